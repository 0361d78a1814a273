# SPDX-License-Identifier: GPL-3.0-or-later
"""What closures have in common: called as Mitsuba's BSDFs are, but no objects of Mitsuba's.

Dr.Jit traces every registered BSDF wherever any is called. Closures are parts of the one BSDF that a scene has.
"""

from __future__ import annotations

from typing import Any

classes: dict[tuple[str, str], Any] = {}
"""Closures by variant and name."""


def register_closure(mi: Any, name: str, kind: Any) -> None:
    """Enter a class of closures for the active variant."""
    classes[mi.variant(), name] = kind


class Closure:
    """Base of closures. ``inputs``: what the class reads, by name: slots, closures, fixed choices.

    ``m_flags``: Mitsuba's flags of what it does with light.
    """

    m_flags = 0

    def __init__(self, inputs: Any) -> None:
        del inputs

    def flags(self) -> int:
        """Mitsuba's flags of what it does with light."""
        return int(self.m_flags)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        """A direction drawn, and what comes back from it over its density."""
        raise NotImplementedError

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Value · cosine and density of a direction; zeros for closures of sharp directions."""
        import mitsuba as mi

        return mi.Spectrum(0.0), mi.Float(0.0)

    def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
        """Share of light that passes straight."""
        import mitsuba as mi

        return mi.Spectrum(0.0)
