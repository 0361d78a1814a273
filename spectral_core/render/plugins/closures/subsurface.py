# SPDX-License-Identifier: GPL-3.0-or-later
"""``subsurface``: light enters here and leaves elsewhere; the path integrator walks in between.

A sample of this kind is no direction. Its ``wo`` holds the radii of red, green and blue, its ``eta`` the anisotropy,
its ``pdf`` the factor of what lies above, and its weight the color that is to be seen.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.numbers import opaque_number

DIVES = 1 << 30
"""Bit of a sample's type, beside Mitsuba's own."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDF for the active variant."""

    class Subsurface(mi.BSDF):
        """``color``, ``scale`` (textures); ``radius_0`` to ``radius_2`` and ``anisotropy`` (numbers)."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            flags = int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.m_components, self.m_flags = [flags], flags
            self.color, self.scale = properties["color"], properties["scale"]
            self.radii = [opaque_number(mi, dr, properties[f"radius_{k}"]) for k in range(3)]
            self.anisotropy = opaque_number(mi, dr, properties["anisotropy"])

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            scale = dr.maximum(self.scale.eval_1(si, active), 0.0)
            bs.wo = mi.Vector3f(*(radius * scale for radius in self.radii))
            bs.eta, bs.pdf, bs.sampled_type = mi.Float(self.anisotropy), mi.Float(1.0), mi.UInt32(DIVES)
            return bs, dr.select(active, self.color.eval(si, active), 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0), mi.Float(0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def to_string(self) -> str:
            return "Subsurface"

    mi.register_bsdf("subsurface", lambda properties: Subsurface(properties))
