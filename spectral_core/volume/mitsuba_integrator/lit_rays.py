# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot rays under the lights of a scene: they see how the light changes within a step, as the picture does."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.device.voxels import opaque_doubles
from spectral_core.volume.march.loop import march
from spectral_core.volume.march.march_input import Limits, MarchInput
from spectral_core.volume.march.path import FieldPath, Path, Placed, WorldRay
from spectral_core.volume.mitsuba_integrator.scene_colors import SceneColors
from spectral_core.volume.mitsuba_integrator.unit_light import UnitLit, flat_spectra, pilot_wavelengths
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

_ACROSS, _DOWN = 0.7548776662466927, 0.5698402909980532  # multiples of which are distributed evenly over a square


class LitRays:
    """The rays of a renderer, lit by the emitters of a Mitsuba scene.

    A ray sees the same places of the same emitters in every step and every march: which ones, its pixel decides. So a
    march differs from its reference by its steps alone.

    Parameters
    ----------
    renderer
        That of the field, in Mitsuba's variant.
    light
        The light of the scene's emitters.
    colors
        Those of the field's materials.
    placed
        Places the input of a march in the world.
    """

    def __init__(
        self, renderer: VolumeRenderer, light: UnitLit, colors: SceneColors, placed: Callable[[MarchInput], Placed]
    ) -> None:
        self._renderer, self._light, self._colors, self._placed = renderer, light, colors, placed
        self.volume: ScalarVolume = renderer.volume
        self.types = renderer.types
        matrix = self.volume.world_from_index
        self._rows = [opaque_doubles(self.types, row) for row in matrix[:3, :3]]
        self._offset = opaque_doubles(self.types, matrix[:3, 3])

    def rounding_at(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """As the renderer's."""
        return self._renderer.rounding_at(values)

    def shown_corners(self, transfer: TransferFunction) -> NDArray[np.float64]:
        """As the renderer's."""
        return self._renderer.shown_corners(transfer)

    def steepest(self, transfer: TransferFunction) -> float:
        """As the renderer's."""
        return self._renderer.steepest(transfer)

    @property
    def sight(self) -> VolumeRenderer:
        """Rays of even light: what a step misses is missed under any light, and they take less time."""
        return self._renderer

    @property
    def parts(self) -> int:
        """A picture for each channel of each group of emitters, and of materials that emit light.

        A lamp may have any color, so that a channel alone has the wanted quality.
        """
        import mitsuba as mi

        return self._light.count * len(mi.Spectrum(0.0))

    def palette(self, transfer: TransferFunction) -> NDArray[np.float64]:
        """Amounts are the channels of the light itself."""
        return np.eye(self.parts)

    def trace(
        self,
        view: View,
        transfer: TransferFunction,
        stepping: Stepping,
        pixels: tuple[Any, Any],
        limits: Limits,
    ) -> list[NDArray[Any]]:
        """The channels of each part of the light along the rays through ``pixels``, the transmittance, samples and
        iterations.
        """
        import drjit as dr
        import mitsuba as mi

        data = self._renderer.prepare(transfer).march_input(stepping, limits)
        rays = self._renderer.rays(view, pixels, data.grid)
        path = Path((FieldPath(data, rays),), rays.length, rays.world, rays.length * 0.0)
        numbers = self._numbers(pixels)
        seen = SimpleNamespace(time=mi.Float(0.0), wavelengths=pilot_wavelengths())
        colors = self._colors.at(seen.wavelengths)
        shade = self._light.shade(self._in_world(rays), seen, self._placed(data), colors, numbers)
        none = [mi.Spectrum(rays.length * 0.0) for _ in range(self._light.count)]
        with flat_spectra(self._light.scene):
            out = march(path, counts=True, shade=shade, light=none)
        channels = [*(each for part in out.light for each in part), out.transmittance, out.samples, out.steps]
        dr.eval(channels)
        return [channel.numpy() for channel in channels]

    def _in_world(self, rays: Any) -> WorldRay:
        """The rays from where they begin in the field."""
        import drjit as dr

        doubles, singles = self.types.Array3f64, self.types.Array3f
        begin, along = (
            [dr.dot(row, doubles(vector)) for row in self._rows] for vector in (rays.origin, rays.direction)
        )
        return WorldRay(
            singles(doubles(*begin) + self._offset), singles(dr.normalize(doubles(*along))), rays.length * rays.world
        )

    def _numbers(self, pixels: tuple[Any, Any]) -> tuple[Any, Any]:
        """Two random numbers in [0, 1) of each ray, those of its pixel."""
        import drjit as dr

        x, y = (dr.floor(self.types.Float64(each)) for each in pixels)
        first, second = _ACROSS * x + _DOWN * y, _DOWN * x + _ACROSS * y + 0.5
        return tuple(self.types.Float(each - dr.floor(each)) for each in (first, second))
