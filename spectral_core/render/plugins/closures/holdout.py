# SPDX-License-Identifier: GPL-3.0-or-later
"""``holdout``: a closure without light; where the camera sees it, the picture is transparent.

Its share of a surface is queried like transmission, by a hit with a mark of its own.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import Closure, register_closure

QUESTION = -1.0
"""The mark (``ray_marks``) of a hit that queries the share of holdouts."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class Holdout(Closure):
        """Neither scatters nor transmits."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.Null | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(dr.select(si.dn_dv.x < 0.0, mi.Float(1.0), 0.0))

    register_closure(mi, "holdout", Holdout)
