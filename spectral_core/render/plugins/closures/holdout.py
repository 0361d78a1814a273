# SPDX-License-Identifier: GPL-3.0-or-later
"""``holdout``: a closure that shows nothing and, where the camera sees it, cuts a hole into the picture.

Its share of a surface is asked for like what the surface lets through, by a hit whose mark says so.
"""

from __future__ import annotations

from typing import Any

QUESTION = -1.0
"""The mark (``ray_marks``) of a hit that asks for the hole."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDF for the active variant."""

    class Holdout(mi.BSDF):
        """Neither scatters nor lets through."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            flags = int(mi.BSDFFlags.Null | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.m_components, self.m_flags = [flags], flags

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0), mi.Float(0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(dr.select(si.dn_dv.x < 0.0, mi.Float(1.0), 0.0))

        def to_string(self) -> str:
            return "Holdout[]"

    mi.register_bsdf("holdout", lambda properties: Holdout(properties))
