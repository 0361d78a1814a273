# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera and output settings to camera and film."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Aperture, Camera, Film
from spectral_core.scene.camera import GREATEST_VIEW_RAD, LEAST_VIEW_RAD, space_from_camera

from ..context import Translation
from ..frames import NO_LENGTH, is_sheared, rigid
from ..ledger import at_default, note_changed
from ..visibility import cycles_settings
from .panorama import MIDDLE_VIEW_RAD, panorama_of

FITS = {"AUTO": "auto", "HORIZONTAL": "width", "VERTICAL": "height"}
MILLIMETRE = 1e-3
SPOT_RAD = np.pi / 4
"""Blender's cone of a lamp that is no spot."""
SPOT_RAD_OF_50_MM = 2 * np.arctan(16 / 50)


def translate_camera(translation: Translation, camera: Any) -> Camera:
    """Camera of an evaluated camera object. Raises InvalidInputError if the scene has none."""
    if camera is None:
        raise InvalidInputError(
            f"the scene {translation.scene.name!r} has no camera; add one, or choose one in the scene properties"
        )
    matrix = np.asarray(camera.matrix_world, dtype=np.float64)
    if is_sheared(matrix):
        message = "its parents shear it; Cycles skews the picture, here it is straight; parent it to an unscaled object"
        translation.note(camera.name, message)
    if not np.all(np.linalg.norm(matrix[:3, :3], axis=0) > NO_LENGTH):
        message = "its scale is 0 along an axis, so its direction there is unknown and is chosen; give it another scale"
        translation.note(camera.name, message)
    if camera.type != "CAMERA":
        # Cycles looks through a lamp with the angle of its spot, through any other object with a lens of 50 mm
        angle = getattr(camera.data, "spot_size", SPOT_RAD) if camera.type == "LIGHT" else SPOT_RAD_OF_50_MM
        view = 2 * np.arctan(18 / 16 * np.tan(angle / 2))
        return Camera(world_from_camera=rigid(matrix), field_of_view_rad=view, near=1e-5, far=1e5)
    lens = camera.data
    for item in (lens, lens.dof):
        note_changed(translation, camera.name, item)
    if lens.type not in ("PERSP", "ORTHO", "PANO"):
        translation.note(camera.name, f"a {lens.type.lower()} camera is shown as a perspective one")
    render = translation.render
    if lens.type in ("PANO", "PERSP") and render.use_multiview and render.views_format == "STEREO_3D":
        note_changed(translation, camera.name, lens.stereo)
    orthographic = lens.type == "ORTHO"
    shown = panorama_of(lens, render) if lens.type == "PANO" else None
    near = max(lens.clip_start, 1e-6)
    radius, focus = lens_of(camera)
    return Camera(
        world_from_camera=axes_of(matrix),
        kind="panoramic" if shown is not None else ("orthographic" if orthographic else "perspective"),
        field_of_view_rad=MIDDLE_VIEW_RAD
        if shown is not None
        else float(np.clip(lens.angle, LEAST_VIEW_RAD, GREATEST_VIEW_RAD)),
        orthographic_scale=_orthographic_scale(camera) if orthographic else 1.0,
        sensor_fit=FITS[lens.sensor_fit],  # type: ignore[arg-type]
        shift=(lens.shift_x, lens.shift_y),
        aperture_radius=radius,
        focus_distance=focus,
        near=near,
        far=max(lens.clip_end, near * (1 + 1e-6)),  # an end before the start shows nothing
        aperture=aperture_of(lens.dof),
        panorama=shown,
    )


def axes_of(matrix: np.ndarray) -> np.ndarray:
    """Axes of length 1 of a camera. A mirrored camera gives a mirrored picture, as in Cycles."""
    placed = rigid(matrix)
    if np.linalg.det(matrix[:3, :3]) < 0:
        placed[:3, 1] *= -1
    return placed


def space_from_world(camera: Any, render: Any) -> np.ndarray:
    """Matrix (4, 4) from the world to the space Camera of nodes, of a camera object; without one of the world itself.

    ``render``: the scene's render settings.
    """
    if camera is None:
        return space_from_camera(None)
    placed = axes_of(np.asarray(camera.matrix_world, dtype=np.float64))
    is_panorama = camera.type == "CAMERA" and camera.data.type == "PANO"
    shown = panorama_of(camera.data, render) if is_panorama else None
    return np.asarray(space_from_camera(shown) @ np.linalg.pinv(placed))


def _orthographic_scale(camera: Any) -> float:
    """Extent of an orthographic camera's view. Raises InvalidInputError if nothing lies in it."""
    scale = float(camera.data.ortho_scale)
    if scale > 0:
        return scale
    raise InvalidInputError(
        f"the Orthographic Scale of the camera {camera.name!r} is {scale:g} (Blender stores numbers below 0 as 0); "
        "expected a number above 0; set it in the camera's properties under Lens"
    )


def lens_of(camera: Any) -> tuple[float, float]:
    """Radius of a camera's lens, 0 for a sharp picture, and the distance at which it is sharp."""
    lens, matrix = camera.data, np.asarray(camera.matrix_world, dtype=np.float64)
    radius = _lens_radius(lens) if lens.dof.use_dof else 0.0
    return radius, max(_focus_distance(lens, matrix), 1e-6)


def aperture_of(dof: Any) -> Aperture:
    """Shape of the aperture if the camera has depth of field."""
    if not dof.use_dof:
        return Aperture()
    return Aperture(int(dof.aperture_blades), float(dof.aperture_rotation), float(dof.aperture_ratio))


def _lens_radius(lens: Any) -> float:
    """Radius in scene units, as in Cycles: a lens in millimeters, an orthographic one of length 1."""
    length = 1.0 if lens.type == "ORTHO" else lens.lens * MILLIMETRE
    return float(length / (2 * max(lens.dof.aperture_fstop, 1e-5)))


def _focus_distance(lens: Any, matrix: np.ndarray) -> float:
    """Distance to the plane in focus: along the view to the object or bone in focus, else as set."""
    target = lens.dof.focus_object
    if target is None:
        return float(lens.dof.focus_distance)
    place = target.matrix_world
    bone = target.pose.bones.get(lens.dof.focus_subtarget) if target.pose is not None else None
    if bone is not None:
        place = place @ bone.matrix
    view = matrix[:3, 2] / max(np.linalg.norm(matrix[:3, 2]), 1e-12)
    return float(abs(view @ (np.asarray(place.translation, dtype=np.float64) - matrix[:3, 3])))


def translate_film(scene: Any, samples: int, seed: int, render: Any = None) -> Film:
    """Film of a scene's output settings: percentage and border count, as Blender computes them.

    ``render``: the settings of the running render, of which size and border count, None for the scene's.
    """
    render = scene.render if render is None else render
    width, height = frame_in_pixels(render)
    return Film(
        width,
        height,
        samples=samples,
        seed=seed,
        crop=border_in_pixels(render, width, height),
        pixel_aspect=render.pixel_aspect_y / render.pixel_aspect_x,
        transparent=scene.render.film_transparent,  # may be animated, which the running render's are not
        transparent_glass=bool(cycles_settings(scene, "film_transparent_glass", False)),
        **pixel_filter_of(scene),
        exposure=float(cycles_settings(scene, "film_exposure", 1.0)),
    )


def frame_in_pixels(render: Any) -> tuple[int, int]:
    """Width and height of the whole frame at its percentage, as Blender computes them."""
    width = max(int(render.resolution_x * render.resolution_percentage / 100), 1)
    return width, max(int(render.resolution_y * render.resolution_percentage / 100), 1)


def pixel_filter_of(scene: Any) -> dict[str, Any]:
    """Type and full width (pixels) of the film's filter: that of Cycles if it is not the default, else the Filter Size.

    Blender's sizes are half of the full width of a Blackman-Harris filter and a third of that of a Gaussian. A box is
    one pixel wide.
    """
    size, kind = scene.render.filter_size, "BLACKMAN_HARRIS"
    cycles = getattr(scene, "cycles", None)
    if cycles is not None and not (at_default(cycles, "pixel_filter_type") and at_default(cycles, "filter_width")):
        size, kind = cycles.filter_width, cycles.pixel_filter_type
    if kind == "BOX":
        return {"filter_kind": "box", "filter_width": 1.0}
    widths = {"BLACKMAN_HARRIS": 2.0, "GAUSSIAN": 3.0}
    return {"filter_kind": kind.lower(), "filter_width": widths[kind] * float(np.clip(size, 0.01, 10.0))}


def border_in_pixels(render: Any, width: int, height: int) -> tuple[int, int, int, int] | None:
    """(left, bottom, width, height) of the render border, None for the whole frame.

    Blender rounds both edges down to integer pixels (in 32-bit arithmetic). Raises InvalidInputError for an empty
    border.
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
