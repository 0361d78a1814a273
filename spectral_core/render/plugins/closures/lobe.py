# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of closures: they have the interface of Mitsuba's BSDFs, but are no objects of Mitsuba.

Dr.Jit traces every registered BSDF at every call of one. Closures are therefore parts of the single BSDF of a scene.
"""

from __future__ import annotations

from typing import Any

OWN = 1 << 29
"""Type of a drawn direction whose value over the density is known by its closure alone."""
ALONE = 1 << 27
"""Type of a drawn direction in which the closure has no value for a light that is sampled."""
TURNED = 1 << 26
"""Type of a drawn direction that no density counts: an even world, which Cycles does not sample, is shown in full."""
RAISED = 1 << 28
"""Bit of a closure's flags: its normal is that of a displaced surface, and replaces the smooth one."""

classes: dict[tuple[str, str], Any] = {}
"""Closures by variant and name."""


def register_closure(mi: Any, name: str, kind: Any) -> None:
    """Register a class of closures for the active variant."""
    classes[mi.variant(), name] = kind


class Closure:
    """Base of closures. ``inputs``: slots, closures and fixed choices of the class, by name.

    ``m_flags``: Mitsuba's flags of its scattering.
    """

    m_flags = 0
    is_bent = False
    """True if its diffuse light fades toward the horizon of a smooth surface that its normal leans away from."""

    turns_normal = False
    """True if a bent normal that leans away is turned until it mirrors the viewer outward, for all of the closure."""

    dives = bends_below = tints_below = False
    """True if light enters the surface in some of it, if it leaves about another normal than that of the shape, and if
    layers above color it where it enters.
    """

    def __init__(self, inputs: Any) -> None:
        del inputs

    def flags(self) -> int:
        """Mitsuba's flags of its scattering."""
        return int(self.m_flags)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        """A drawn direction, and the value over its density."""
        raise NotImplementedError

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Value · cosine and density of a direction; zeros for closures of discrete directions."""
        import mitsuba as mi

        return mi.Spectrum(0.0), mi.Float(0.0)

    def normal_below(self, si: Any, active: Any) -> Any:
        """Normal about which light from below leaves, times its share; 0 if there is no such light."""
        import mitsuba as mi

        return mi.Vector3f(0.0)

    def tint_below(self, si: Any, active: Any) -> Any:
        """Color of the layers above light that enters the surface, over its mean."""
        import mitsuba as mi

        return mi.Spectrum(1.0)

    def exit_of(self, si: Any, active: Any) -> Any:
        """Where a ray through a portal goes on; 0 without one."""
        import mitsuba as mi

        return mi.Vector3f(0.0)

    def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
        """Share of light that passes straight through."""
        import mitsuba as mi

        return mi.Spectrum(0.0)
