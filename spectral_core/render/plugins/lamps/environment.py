# SPDX-License-Identifier: GPL-3.0-or-later
"""``tinted_environment``: an environment image whose colors tint a white other than D65."""

from __future__ import annotations

from typing import Any


def register(mi: Any, dr: Any) -> None:
    """Define and register the emitter for the active variant."""

    class TintedEnvironment(mi.Emitter):
        """``environment``: an ``envmap``, whose colors tint D65; ``white`` takes the place of ``daylight``, that D65.

        Both whites are spectra with the same knots, so their quotient is exact at every wavelength.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.SpatiallyVarying
            self.m_needs_sample_3 = False
            self.environment = properties["environment"]
            self.white, self.daylight = properties["white"], properties["daylight"]

        def set_scene(self, scene: Any) -> None:
            self.environment.set_scene(scene)

        def tint(self, wavelengths: Any, active: Any) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths = wavelengths
            day = self.daylight.eval(si, active)
            return dr.select(day > 0.0, self.white.eval(si, active) / day, 0.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.environment.eval(si, active) * self.tint(si.wavelengths, active)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds, weight = self.environment.sample_direction(it, sample, active)
            ds.emitter = mi.EmitterPtr(self)
            return ds, weight * self.tint(it.wavelengths, active)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.environment.pdf_direction(it, ds, active)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.environment.eval_direction(it, ds, active) * self.tint(it.wavelengths, active)

        def bbox(self) -> Any:
            return self.environment.bbox()

        def traverse(self, callback: Any) -> None:
            callback.put("environment", self.environment, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "TintedEnvironment"

    mi.register_emitter("tinted_environment", lambda properties: TintedEnvironment(properties))
