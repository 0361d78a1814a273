# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene on its way to a picture: loaded once, traced in passes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import RenderError, SpectralError
from spectral_core.render.accumulate import Accumulator
from spectral_core.render.mitsuba_scene import load_scene
from spectral_core.render.mitsuba_scene.paint import emitted_spectrum
from spectral_core.render.plan import EffectPlan
from spectral_core.render.simulated import simulated_scene
from spectral_core.render.variant import activate, choose_backend
from spectral_core.render.wavelengths import Bands, WavelengthPlan, plan_wavelengths
from spectral_core.scene import Color, Note, Scene
from spectral_core.spectrum import Spectrum

UNLIMITED_ROULETTE = 5
"""Bounces after which Russian roulette may end a path."""


class RenderJob:
    """One scene under one plan. Raises RenderError where Mitsuba cannot load it."""

    def __init__(self, scene: Scene, plan: EffectPlan, bands: Bands | None = None) -> None:
        self.plan = plan
        self.scene = simulated_scene(scene, plan)
        backend = choose_backend("spectral" if plan.is_spectral else "rgb", scene.settings.variant)
        self.variant = backend.variant
        self._mitsuba = activate(backend)
        wavelengths = None
        if plan.is_spectral:
            wavelengths = plan_wavelengths(light_spectra(self.scene), bands, disperses=plan.is_on("dispersion"))
        try:
            loaded = load_scene(self.scene, self._mitsuba, spectral=plan.is_spectral)
            self._scene, self._integrator = loaded.scene, self._mitsuba.load_dict(integrator_description(plan, scene))
            self._sums = self._accumulator(wavelengths)
        except SpectralError:
            raise
        except Exception as error:
            raise RenderError(f"Mitsuba cannot load the scene: {error}") from error
        self.notes = tuple(Note("Renderer", text) for text in backend.notes) + loaded.notes

    def _accumulator(self, wavelengths: WavelengthPlan | None) -> Any:
        return Accumulator(self._mitsuba, self.scene.camera, self.scene.film, wavelengths)

    @property
    def samples(self) -> int:
        """Samples per pixel so far."""
        return int(self._sums.samples)

    def trace(self, samples: int, should_stop: Callable[[], bool] | None = None) -> bool:
        """Add ``samples`` per pixel; False where ``should_stop`` said so before all were traced."""
        try:
            for _ in self._sums.add(self._scene, self._integrator, samples):
                if should_stop is not None and should_stop():
                    return False
        except Exception as error:
            raise RenderError(f"Mitsuba stopped while rendering: {error}") from error
        return True

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 4) linear sRGB and coverage so far, row 0 at the bottom."""
        return self._sums.picture()

    def band_picture(self) -> NDArray[np.float32]:
        """(height, width, n_bands) so far."""
        return self._sums.band_picture()


def integrator_description(plan: EffectPlan, scene: Scene) -> dict[str, Any]:
    """Mitsuba's integrator for a plan: plain path tracing unless light passes through surfaces or media."""
    kind = "volpath" if plan.is_on("media") or plan.is_on("transparency") else "path"
    depth = plan.bounces + 2  # Mitsuba counts path edges: the emitter seen directly is 1
    return {
        "type": kind,
        "max_depth": depth,
        "rr_depth": min(UNLIMITED_ROULETTE, depth),
        "hide_emitters": bool(scene.film.transparent),
    }


def light_spectra(scene: Scene) -> list[Spectrum]:
    """Spectra of everything that emits, where wavelengths are worth tracing."""
    paints: list[Any] = [light.color for light in scene.lights]
    if not scene.world.is_black:
        paints.append(scene.world.color)
    return [emitted_spectrum(paint if isinstance(paint, (Color, Spectrum)) else Color(np.ones(3))) for paint in paints]
