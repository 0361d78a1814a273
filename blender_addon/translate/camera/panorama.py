# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's panoramic cameras."""

from __future__ import annotations

from typing import Any

from spectral_core.scene import Panorama

MIDDLE_VIEW_RAD = 1.57
"""Angle of a panorama's center for which a picture's sharpness is judged: a quarter turn."""


def panorama_of(lens: Any, render: Any) -> Panorama:
    """The projection of a camera of type Panoramic."""
    kind = lens.panorama_type
    if kind == "EQUIRECTANGULAR":
        edges = (lens.longitude_min, lens.longitude_max, lens.latitude_min, lens.latitude_max)
        return Panorama("equirectangular", edges)
    if kind == "FISHEYE_EQUIDISTANT":
        return Panorama("fisheye_equidistant", (lens.fisheye_fov,))
    if kind == "FISHEYE_LENS_POLYNOMIAL":
        coefficients = tuple(getattr(lens, f"fisheye_polynomial_k{k}") for k in range(5))
        return Panorama("fisheye_polynomial", (*coefficients, lens.fisheye_fov, *_sensor(lens, render)))
    if kind == "MIRRORBALL":
        return Panorama("mirror_ball")
    if kind == "EQUIANGULAR_CUBEMAP_FACE":
        return Panorama("cube_face")
    if kind == "CENTRAL_CYLINDRICAL":
        radius = max(lens.central_cylindrical_radius, 1e-5)
        heights = (lens.central_cylindrical_range_v_min / radius, lens.central_cylindrical_range_v_max / radius)
        longitudes = (lens.central_cylindrical_range_u_min, lens.central_cylindrical_range_u_max)
        return Panorama("cylinder", (*longitudes, *heights))
    return Panorama("fisheye_equisolid", (lens.fisheye_lens, lens.fisheye_fov, *_sensor(lens, render)))


def _sensor(lens: Any, render: Any) -> tuple[float, float]:
    """Width and height in millimeters: one side as set, the other by the picture's proportions."""
    width = render.resolution_x * render.pixel_aspect_x
    height = render.resolution_y * render.pixel_aspect_y
    fits_width = lens.sensor_fit == "HORIZONTAL" or (lens.sensor_fit == "AUTO" and width > height)
    size = lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width
    return (size, size * height / width) if fits_width else (size * width / height, size)
