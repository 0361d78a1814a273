# SPDX-License-Identifier: GPL-3.0-or-later
"""``subsurface``: light enters here and leaves elsewhere; the path integrator walks in between.

A sample of this type is no direction. Its ``wo`` holds the radii of red, green and blue, its ``eta`` the anisotropy,
its ``pdf`` the factor of the layers above, and its weight the visible color.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import Closure, register_closure

SHORTEST = 1e-4
"""Least radius: the steps of a walk must be longer than the offset of its start."""
DIVES = 1 << 30
"""Bit of a sample's type, beside Mitsuba's own."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class Subsurface(Closure):
        """``color``; ``scale``, ``radius_0`` to ``radius_2`` and ``anisotropy`` (numbers)."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.color, self.scale = inputs["color"], inputs["scale"]
            self.radii = [inputs[f"radius_{k}"] for k in range(3)]
            self.anisotropy = inputs["anisotropy"]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            scale = dr.maximum(self.scale.eval_1(si, active), 0.0)
            bs.wo = dr.maximum(mi.Vector3f(*(radius.eval_1(si, active) * scale for radius in self.radii)), SHORTEST)
            bs.eta, bs.pdf = self.anisotropy.eval_1(si, active), mi.Float(1.0)
            bs.sampled_type = mi.UInt32(DIVES)
            return bs, dr.select(active, self.color.eval(si, active), 0.0)

    register_closure(mi, "subsurface", Subsurface)
