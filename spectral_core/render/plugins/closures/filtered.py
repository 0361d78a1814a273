# SPDX-License-Identifier: GPL-3.0-or-later
"""Filter Glossy: lobes are as wide as the light that reaches them was scattered before, as in Cycles.

After a bounce that scatters widely, a path finds a mirror or a glass, and behind it a small light, by chance only; the
blurred lobe trades the sharp caustic for a smooth one. The path integrator stores the least alpha in ``duv_dx``, which
nothing else reads.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import Closure, register_closure

LARGEST_ALPHA = 0.5
"""Alpha behind a bounce in every direction."""


def least_alpha(si: Any) -> Any:
    """Alpha that narrower lobes at a hit get; 0 for camera rays and without Filter Glossy."""
    return si.duv_dx.x


def strength_of(limits: Any) -> Any:
    """Strength of Filter Glossy, which kernels read from memory; None if it is off."""
    import drjit as dr
    import mitsuba as mi

    return dr.opaque(mi.Float, float(limits.filter_glossy)) if limits.filter_glossy > 0 else None


def mark(si: Any, strength: Any, least_density: Any) -> None:
    """Store the alpha for a path whose bounces had at least ``least_density``; ``strength``: of Filter Glossy, None if
    it is off.

    Cycles: α = √(1 - p / strength) / 2, with the least density p.
    """
    import drjit as dr
    import mitsuba as mi

    if strength is None:
        return
    alpha = LARGEST_ALPHA * dr.safe_sqrt(1.0 - least_density / strength)
    si.duv_dx = mi.Vector2f(alpha, 0.0)


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class Filtered(Closure):
        """A closure of discrete directions, ``sharp``; where Filter Glossy applies, ``rough``, which has facets."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.sharp, self.rough = inputs["sharp"], inputs["rough"]
            self.m_flags = self.sharp.flags() | self.rough.flags()

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            blurs = least_alpha(si) > 0.0
            sharp, weight = self.sharp.sample(ctx, si, sample1, sample2, active & ~blurs)
            rough, value = self.rough.sample(ctx, si, sample1, sample2, active & blurs)
            return dr.select(blurs, rough, sharp), dr.select(blurs, mi.Spectrum(value), mi.Spectrum(weight))

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            blurs = least_alpha(si) > 0.0
            value, density = self.rough.eval_pdf(ctx, si, wo, active & blurs)
            return dr.select(blurs, mi.Spectrum(value), 0.0), dr.select(blurs, mi.Float(density), 0.0)

    register_closure(mi, "filtered", Filtered)
