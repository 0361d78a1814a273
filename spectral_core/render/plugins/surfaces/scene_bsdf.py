# SPDX-License-Identifier: GPL-3.0-or-later
"""The single BSDF of all shapes in Mitsuba: Mitsuba's own integrators then render our surfaces."""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.plugins.surfaces.at_hit import SurfaceAt
from spectral_core.render.plugins.surfaces.table import SurfaceTables


@cache
def scene_bsdf_class(variant: str) -> Any:
    """The class under ``variant``, which must be the active one."""
    import drjit as dr
    import mitsuba as mi

    class NoSurface:
        """Answers of a BSDF that is kept for the next scene. No shape of a traced scene has it, but Dr.Jit asks all
        BSDFs that exist, also for scenes that have none of ours.
        """

        def sample(self, *_: Any) -> tuple[Any, Any]:
            return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)

        def eval_pdf(self, *_: Any) -> tuple[Any, Any]:
            return mi.Spectrum(0.0), mi.Float(0.0)

        def eval_null_transmission(self, *_: Any) -> Any:
            return mi.Spectrum(0.0)

    class SceneBSDF(mi.BSDF):
        """Looks up the surface of each hit in ``surfaces``; None between two scenes."""

        def __init__(self, surfaces: SurfaceTables | None) -> None:
            super().__init__(mi.Properties())
            self.surfaces = surfaces

        def seal(self) -> None:
            """Write the surfaces to the device, after all shapes were created."""
            assert self.surfaces is not None
            self.surfaces.seal()
            self.m_flags = self.surfaces.flags
            self.m_components = [self.surfaces.flags]

        def _at(self, si: Any) -> Any:
            return NoSurface() if self.surfaces is None else SurfaceAt(self.surfaces, si)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            return self._at(si).sample(ctx, si, sample1, sample2, active)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self._at(si).eval_pdf(ctx, si, wo, active)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return self._at(si).eval_null_transmission(si, active)

        def to_string(self) -> str:
            return "SceneBSDF"

    return SceneBSDF
