# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera and output settings to camera and film."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Camera, Film

from .context import Translation
from .frames import rigid
from .ledger import note_changed
from .visibility import cycles_settings

FITS = {"AUTO": "auto", "HORIZONTAL": "width", "VERTICAL": "height"}
MILLIMETRE = 1e-3


def translate_camera(translation: Translation, camera: Any) -> Camera:
    """Camera of an evaluated camera object. Raises InvalidInputError where the scene has none."""
    if camera is None:
        raise InvalidInputError(
            f"the scene {translation.scene.name!r} has no camera; add one, or choose one in the scene properties"
        )
    matrix = np.asarray(camera.matrix_world, dtype=np.float64)
    if camera.type != "CAMERA":
        translation.note(
            camera.name, f"this {camera.type.lower()} is the scene's camera; it looks with a lens of 50 mm"
        )
        return Camera(world_from_camera=rigid(matrix), field_of_view_rad=2 * np.arctan(36 / 100))
    lens = camera.data
    for item in (lens, lens.dof):
        note_changed(translation, camera.name, item)
    if lens.type not in ("PERSP", "ORTHO"):
        kind = {"PANO": "panoramic", "CUSTOM": "custom"}.get(lens.type, lens.type.lower())
        translation.note(camera.name, f"a {kind} camera is shown as a perspective one")
    orthographic = lens.type == "ORTHO"
    placed = rigid(matrix)
    if np.linalg.det(matrix[:3, :3]) < 0:
        placed[:3, 1] *= -1  # a mirrored camera gives a mirrored picture, as in Cycles
    near = max(lens.clip_start, 1e-6)
    return Camera(
        world_from_camera=placed,
        kind="orthographic" if orthographic else "perspective",
        field_of_view_rad=float(np.clip(lens.angle, 1e-3, np.pi - 1e-3)),
        orthographic_scale=lens.ortho_scale,
        sensor_fit=FITS[lens.sensor_fit],  # type: ignore[arg-type]
        shift=(lens.shift_x, lens.shift_y),
        aperture_radius=_aperture(translation, camera, orthographic),
        focus_distance=max(_focus_distance(lens, matrix), near),
        near=near,
        far=max(lens.clip_end, near * 2),
    )


def lens_of(camera: Any) -> tuple[float, float]:
    """Radius of a camera's lens, 0 for a sharp picture, and the distance at which it is sharp."""
    lens, matrix = camera.data, np.asarray(camera.matrix_world, dtype=np.float64)
    radius = _lens_radius(lens) if lens.dof.use_dof else 0.0
    return radius, max(_focus_distance(lens, matrix), 1e-6)


def _aperture(translation: Translation, camera: Any, orthographic: bool) -> float:
    """Radius of the lens in scene units, as Cycles takes it: a lens in millimetres, an orthographic one of length 1."""
    dof = camera.data.dof
    if not dof.use_dof:
        return 0.0
    if dof.aperture_blades or dof.aperture_ratio != 1:
        translation.note(camera.name, "the shape of its aperture is shown as a circle")
    return _lens_radius(camera.data)


def _lens_radius(lens: Any) -> float:
    length = 1.0 if lens.type == "ORTHO" else lens.lens * MILLIMETRE
    return float(length / (2 * max(lens.dof.aperture_fstop, 1e-5)))


def _focus_distance(lens: Any, matrix: np.ndarray) -> float:
    """Distance to the sharp plane: along the view to the object in focus, else as set."""
    target = lens.dof.focus_object
    if target is None:
        return float(lens.dof.focus_distance)
    view = matrix[:3, 2] / max(np.linalg.norm(matrix[:3, 2]), 1e-12)
    return float(abs(view @ (np.asarray(target.matrix_world.translation, dtype=np.float64) - matrix[:3, 3])))


def translate_film(scene: Any, samples: int, seed: int) -> Film:
    """Film of a scene's output settings: percentage and border count, as Blender computes them."""
    render = scene.render
    width = max(int(render.resolution_x * render.resolution_percentage / 100), 1)
    height = max(int(render.resolution_y * render.resolution_percentage / 100), 1)
    return Film(
        width,
        height,
        samples=samples,
        seed=seed,
        crop=border_in_pixels(render, width, height),
        pixel_aspect=render.pixel_aspect_y / render.pixel_aspect_x,
        transparent=render.film_transparent,
        filter_width=float(np.clip(render.filter_size, 0.01, 10.0)),
        exposure=float(cycles_settings(scene, "film_exposure", 1.0)),
    )


def border_in_pixels(render: Any, width: int, height: int) -> tuple[int, int, int, int] | None:
    """(left, bottom, width, height) of the render border, None where the whole frame is meant.

    Blender cuts both edges off to whole pixels (in 32-bit arithmetic). Raises InvalidInputError for an empty border.
    """
    if not render.use_border:
        return None
    edges = np.array([render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y], np.float32)
    size = np.array([width, width, height, height], np.float32)
    left, right, bottom, top = (int(edge) for edge in edges * size)
    if right <= left or top <= bottom:
        raise InvalidInputError(
            f"the render border of {right - left}×{top - bottom} pixels is empty; draw a larger one or clear it"
        )
    return left, bottom, right - left, top - bottom
