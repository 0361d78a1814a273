# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of a picture by Mitsuba's camera, film and block renderer, as a reference for this project's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.camera_rays import CameraFrame, camera_frame
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.wavelengths import WavelengthPlan
from spectral_core.scene import Camera, Film
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.spectrum import FIRST_NM, LAST_NM


class FilmSums:
    """Running sums of a picture, with the interface of ``Accumulator``."""

    def __init__(self, mitsuba: Any, camera: Camera, film: Film, wavelengths: WavelengthPlan | None) -> None:
        self._mi, self.film, self.samples = mitsuba, film, 0
        self.lost = 0
        """Samples so far in pixels that a pass gave as NaN or Inf: they count as black."""
        self._plan = wavelengths
        self._sensor = mitsuba.load_dict(_sensor(mitsuba, camera_frame(camera, film), film, wavelengths))
        width, height = film.size
        self._sums = np.zeros((height, width, 3 if wavelengths is None else len(wavelengths.responses)))

    def add(self, first_hit: FirstHit, integrator: Any, samples: int) -> Iterator[float]:
        """Trace ``samples`` more per pixel; one step, as Mitsuba renders a pass in one call."""
        seed = (self.film.seed * 2654435761 + self.samples * 97 + 1) & 0xFFFFFFFF
        mean = self._mi.render(first_hit.scene, sensor=self._sensor, integrator=integrator, spp=samples, seed=seed)
        mean = np.array(mean, dtype=np.float64)[::-1, :, : self._sums.shape[2]]
        self.lost += samples * int((~np.isfinite(mean)).any(axis=2).sum())
        self._sums += np.where(np.isfinite(mean), mean, 0.0) * samples
        self.samples += samples
        yield 1.0

    def picture(self) -> NDArray[np.float32]:
        """Mean so far: (height, width, 4) linear sRGB and coverage 1, row 0 at the bottom."""
        color = self._sums[..., :3] / max(1, self.samples)
        if self._plan is not None:
            color = color @ RGB_FROM_XYZ.T
        color = color * self.film.exposure
        return np.concatenate([color, np.ones_like(color[..., :1])], axis=2).astype(np.float32)

    def band_picture(self) -> NDArray[np.float32]:
        """Mean so far of the spectral channels: (height, width, n_bands), row 0 at the bottom, without exposure."""
        return (self._sums[..., 3:] / max(1, self.samples)).astype(np.float32)


NOTHING = 1e-30
"""Response of a channel that sees nothing, such as blue beyond 700 nm: Mitsuba refuses one that is zero everywhere."""


def _sensor(mitsuba: Any, frame: CameraFrame, film: Film, plan: WavelengthPlan | None) -> dict[str, Any]:
    """Mitsuba's camera. A shifted picture is the part of a larger one that has its center where the camera looks."""
    half, center = (frame.high - frame.low) / 2, (frame.high + frame.low) / 2
    whole = [round(size * (h + abs(c)) / h) for size, h, c in zip((film.width, film.height), half, center, strict=True)]
    width, height = film.size
    left, bottom = film.crop[:2] if film.crop else (0, 0)
    offset_x = left + (whole[0] - film.width if center[0] > 0 else 0)
    offset_y = (film.height - bottom - height) + (0 if center[1] > 0 else whole[1] - film.height)
    description: dict[str, Any] = {
        "type": "specfilm" if plan is not None else "hdrfilm",
        "width": whole[0],
        "height": whole[1],
        "crop_offset_x": offset_x,
        "crop_offset_y": offset_y,
        "crop_width": width,
        "crop_height": height,
        "component_format": "float32",
        "rfilter": {"type": "box"} if film.filter_kind == "box" else {"type": "gaussian", "stddev": 0.25},
    }
    if plan is None:
        description["pixel_format"] = "rgb"
    else:
        for number, response in enumerate(plan.responses):  # channels come in the order of their names
            description[f"band_{number:06d}"] = {
                "type": "regular",
                "wavelength_min": float(FIRST_NM),
                "wavelength_max": float(LAST_NM),
                "values": ",".join(f"{value:.9g}" for value in np.maximum(response, 0 if response.any() else NOTHING)),
            }
    extent = float(half[0] + abs(center[0]))
    camera = frame.camera
    axes = np.eye(4)
    axes[:3, 0], axes[:3, 1], axes[:3, 2], axes[:3, 3] = -frame.right, frame.up, -frame.back, frame.origin
    sensor: dict[str, Any] = {"film": description, "near_clip": float(camera.near), "far_clip": float(camera.far)}
    if camera.kind == "orthographic":
        axes = axes @ np.diag([extent, extent, 1.0, 1.0])
        sensor["type"] = "orthographic"
    else:
        sensor |= {"fov": float(np.degrees(2 * np.arctan(extent))), "fov_axis": "x", "type": "perspective"}
        if camera.aperture_radius > 0:
            sensor |= {"type": "thinlens", "aperture_radius": float(camera.aperture_radius)}
            sensor["focus_distance"] = float(camera.focus_distance)
    sensor["to_world"] = mitsuba.ScalarTransform4f(axes)
    return sensor
