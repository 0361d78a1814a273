# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lamps to lights of the scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import AreaLight, Color, ImageTexture, Light, Paint, PointLight, SpotLight, SunLight
from spectral_core.spectra.catalogue import blackbody

from .. import compat
from . import spectra
from .context import Translation
from .fields import mean_color
from .frames import rigid
from .nodes import Input, linked, surface_output
from .reader import Reader

SMALLEST_SIZE = 1e-4
"""Edge of an area light that has none: what it sends is kept, from as good as a point (or a line)."""


def translate_light(translation: Translation, name: str, thing: Any, world_from_light: Any) -> Light | None:
    """Light of an evaluated object that stands at ``world_from_light`` (4, 4); None where it is dark."""
    lamp, matrix = thing.data, np.asarray(world_from_light, dtype=np.float64)
    color, factor = _color(translation, lamp)
    power = lamp.energy * compat.light_exposure_factor(lamp) * factor
    if power == 0 or (isinstance(color, Color) and not np.any(color.linear_rgb)):
        return None
    if power < 0:
        translation.note(name, "a light of negative power takes no light away here; it was left out")
        return None
    if not lamp.use_shadow:
        translation.note(name, "its light throws shadows here, although that is switched off")
    shared: dict[str, Any] = {
        "name": name,
        "world_from_light": rigid(matrix),
        "color": color,
        "group": thing.original.lightgroup,  # Blender does not tell the evaluated copy of a change
        "camera_visible": thing.visible_camera,
    }
    if lamp.type == "SUN":
        return SunLight(**shared, irradiance=power * _sun_area(lamp), angle_rad=lamp.angle)
    if lamp.type == "AREA":
        return _area(translation, lamp, power, matrix, shared)
    radius = lamp.shadow_soft_size
    shared |= {"radius": radius, "soft_falloff": lamp.use_soft_falloff}
    if not compat.light_is_normalized(lamp):
        power *= 4 * np.pi * radius**2  # then its strength is its radiant exitance
    if lamp.type == "SPOT":
        if lamp.use_square:
            translation.note(name, "a square spot light is shown as a round one")
        return SpotLight(**shared, power_w=power, cone_angle_rad=lamp.spot_size, blend=lamp.spot_blend)
    return PointLight(**shared, power_w=power)


def _sun_area(lamp: Any) -> float:
    """Solid angle's projected area of a sun whose strength is its radiance; 1 where it is its irradiance."""
    if compat.light_is_normalized(lamp):
        return 1.0
    return float(np.pi * np.sin(lamp.angle / 2) ** 2)


def _area(
    translation: Translation, lamp: Any, power: float, matrix: NDArray[np.float64], shared: dict[str, Any]
) -> AreaLight:
    """Area light: an object's scale stretches its extent, as in Cycles, and not its power."""
    stretch = np.linalg.norm(matrix[:3, :2], axis=0)
    width, height = lamp.size, (lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size)
    size = (float(width * stretch[0]), float(height * stretch[1]))
    if min(size) < SMALLEST_SIZE:
        translation.note(shared["name"], f"an area light without area is rendered {SMALLEST_SIZE:g} wide")
        size = (max(size[0], SMALLEST_SIZE), max(size[1], SMALLEST_SIZE))
    ellipse = lamp.shape in ("DISK", "ELLIPSE")
    if not compat.light_is_normalized(lamp):
        power *= size[0] * size[1] * (np.pi / 4 if ellipse else 1.0)
    return AreaLight(
        **shared, power_w=power, shape="ellipse" if ellipse else "rectangle", size=size, spread_rad=lamp.spread
    )


def _color(translation: Translation, lamp: Any) -> tuple[Paint, float]:
    """Color of the lamp, and the factor on its power that its nodes, spectrum and gray color bring."""
    tint = translation.linear_rgb(lamp.color)
    node_color, factor = _node_emission(translation, lamp)
    spectrum = spectra.spectrum_of(translation, lamp)
    if spectrum is not None:
        return spectrum, factor * spectra.strength_of(lamp)
    kelvin = compat.light_temperature_k(lamp)
    if kelvin is not None:
        tint = tint * translation.linear_rgb(lamp.temperature_color)
        if np.ptp(lamp.color[:]) < 1e-6 and isinstance(node_color, Color) and np.all(node_color.linear_rgb == 1):
            # Blender's temperature keeps the luminance of white, as a normalized illuminant does
            return blackbody(min(max(kelvin, 800.0), 20000.0)), factor * float(lamp.color[0])
    if isinstance(node_color, Color):
        return Color(tint * node_color.linear_rgb), factor
    if not np.allclose(tint, tint[0]):
        translation.note(lamp.name, "a lamp color times a spectrum in its nodes: the spectrum alone was used")
    return node_color, factor * float(tint.mean())


def _node_emission(translation: Translation, lamp: Any) -> tuple[Paint, float]:
    """Color and strength of the Emission node of a lamp, white and 1 where it has none."""
    white = Color(np.ones(3))
    tree = compat.node_tree(lamp)
    output = surface_output(tree, "OUTPUT_LIGHT") if tree is not None else None
    if output is None:
        return white, 1.0
    source = linked(Input(output.inputs["Surface"]))
    if source is None or source.node.type != "EMISSION":
        what = "nothing" if source is None else repr(source.label)
        translation.note(lamp.name, f"its nodes end in {what}, not in an Emission node; its own color is used")
        return white, 1.0
    reader = Reader(translation, lamp.name)
    spectrum = spectra.spectrum_of(translation, source.node)
    paint = spectrum if spectrum is not None else reader.paint(source.input("Color"), white)
    strength = reader.number(source.input("Strength"), 1.0) * spectra.strength_of(source.node)
    if isinstance(paint, ImageTexture):
        translation.note(lamp.name, "an image on a lamp is shown as its mean color")
        paint = Color(mean_color(paint))
    return paint, strength
