# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lamps to lights of the scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import AreaLight, Color, Light, PointLight, Rays, SpotLight, SunLight

from ... import compat
from ..context import Translation
from ..frames import NO_LENGTH, rigid
from ..ledger import note_changed, note_nodes
from ..shading.attributes import object_info
from ..shading.tree import searched_once
from ..visibility import cycles_settings, hidden_from, seen_as
from .lamp_reader import LampReader
from .light_nodes import shine_of

LIGHT_RAYS = Rays.DIFFUSE | Rays.GLOSSY | Rays.TRANSMISSION | Rays.VOLUME
"""Types of rays that a lamp may be hidden from, in addition to the camera's; it occludes none."""

SHEARED = 0.01
"""Largest cosine between the axes of an area light that is no parallelogram."""


def translate_light(translation: Translation, name: str, obj: Any, instance: Any) -> Light | None:
    """Light of an evaluated object, placed as ``instance`` of the depsgraph; None if it emits nothing."""
    lamp, matrix = obj.data, np.array(instance.matrix_world, dtype=np.float64)
    if lamp.type == "AREA" and cycles_settings(lamp, "is_portal", False):
        return None  # a portal only guides Cycles' sampling of the environment
    for item in (lamp, getattr(lamp, "cycles", None)):
        note_changed(translation, name, item)
    note_nodes(translation, name, compat.node_tree(lamp))
    with searched_once():
        shine = shine_of(_reader(translation, obj, instance, matrix))
    color, power = shine.color, lamp.energy * compat.light_exposure_factor(lamp) * shine.factor
    if power == 0 or (isinstance(color, Color) and not np.any(color.linear_rgb)):
        return None
    seen = lamp_seen_as(translation, instance)
    # without it, Cycles has no lamp for rays to meet
    is_met = cycles_settings(lamp, "use_multiple_importance_sampling", True)
    shared: dict[str, Any] = {
        "name": name,
        "world_from_light": rigid(matrix),
        "color": color,
        "group": obj.original.lightgroup,  # Blender does not notify the evaluated copy of a change
        "camera_visible": is_met and not seen["hidden_from"] & Rays.CAMERA,
        "hidden_from": seen["hidden_from"] & LIGHT_RAYS,
        "is_in_footage": seen["is_shadow_catcher"],
        "max_bounces": cycles_settings(lamp, "max_bounces", 1024),
        "casts_shadow": lamp.use_shadow,
        "is_met": is_met,
        "is_planckian": shine.is_planckian,
        "falloff": shine.falloff,
        "pattern": shine.pattern,
    }
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if lamp.type in ("SUN", "AREA", "SPOT") and (lengths if lamp.type == "SPOT" else lengths[2:]).max() <= NO_LENGTH:
        axis = "" if lamp.type == "SPOT" else " along its Z axis"
        translation.note(name, f"a scale of 0{axis} leaves it without a direction, so it emits no light")
        return None
    if lamp.type == "SUN":
        return SunLight(**shared, irradiance=power * emitting_area(lamp, matrix), angle_rad=lamp.angle)
    if lamp.type == "AREA":
        return _area(translation, lamp, power, matrix, shared)
    radius = lamp.shadow_soft_size
    shared |= {"radius": radius, "soft_falloff": lamp.use_soft_falloff, "photometry": shine.photometry}
    power *= emitting_area(lamp, matrix)
    if lamp.type == "SPOT":
        scale = np.maximum(lengths, 1e-6)  # a scaled spot is an ellipse in Cycles
        if _is_sheared(matrix):
            shared["world_from_light"] = _leaning(matrix, scale)
            if _is_cut(matrix, lamp.spot_size / 2):
                message = "its parents shear it; Cycles cuts off a part of its cone, here the cone is whole"
                translation.note(name, message)
        return SpotLight(
            **shared,
            power_w=power,
            cone_angle_rad=lamp.spot_size,
            blend=lamp.spot_blend,
            cone_scale=(float(scale[0]), float(scale[1]), float(scale[2])),
        )
    return PointLight(**shared, power_w=power)


def lamp_seen_as(translation: Translation, instance: Any) -> dict[str, Any]:
    """Visibility of a lamp: before Blender 4.5 the object that shows it, and its collections, have no effect."""
    if compat.lamps_follow_instancers():
        return seen_as(instance, translation.depsgraph)
    obj = instance.object
    return {"hidden_from": hidden_from(obj), "is_shadow_catcher": bool(obj.is_shadow_catcher)}


def _reader(translation: Translation, obj: Any, instance: Any, matrix: NDArray[np.float64]) -> LampReader:
    """Reader of the nodes of a lamp."""
    far, info = obj.data.type == "SUN", object_info(obj, instance)
    return LampReader(translation, obj.data.name, on_surface=True, is_far=far, lamp=obj.data, matrix=matrix, info=info)


def emitting_area(lamp: Any, matrix: NDArray[np.float64]) -> float:
    """Factor from the strength of a lamp, placed by ``matrix`` (4, 4), to its power (a sun's irradiance): 1 if the
    strength is normalized, else the area of the lamp, or the projected solid angle of a sun.
    """
    if compat.light_is_normalized(lamp) or (lamp.type == "SUN" and lamp.angle <= 0):
        return 1.0
    if lamp.type == "SUN":
        return float(np.pi * np.sin(lamp.angle / 2) ** 2)
    if lamp.type == "AREA":
        width, height = _extent(lamp, matrix)
        return width * height * (np.pi / 4 if _is_ellipse(lamp) else 1.0)
    radius = lamp.shadow_soft_size
    return 4 * np.pi * radius**2 if radius > 0 else 4.0  # a strength is a radiant exitance; of a point as in Cycles


def _extent(lamp: Any, matrix: NDArray[np.float64]) -> tuple[float, float]:
    """Edges or axes of an area light in the world."""
    stretch = np.linalg.norm(matrix[:3, :2], axis=0)
    width, height = lamp.size, (lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size)
    return float(width * stretch[0]), float(height * stretch[1])


def _is_ellipse(lamp: Any) -> bool:
    return lamp.shape in ("DISK", "ELLIPSE")


def _leaning(matrix: NDArray[np.float64], lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """The position and axes of a transform (4, 4), each axis of length 1, at the angles that they have."""
    result = matrix.copy()
    result[:3, :3] /= lengths
    return result


def _is_cut(matrix: NDArray[np.float64], half_angle: float) -> bool:
    """True if Cycles' choice of lamps leaves out a part of a sheared cone.

    Cycles (scene/light_tree.cpp) takes the cone to end at the tangent of its half angle times the longer of the first
    two axes over the third, all around the third.
    """
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    tangent = np.tan(min(half_angle, np.radians(89.9)))
    edge = np.stack([tangent * np.cos(turn), tangent * np.sin(turn), np.ones(64)]).T @ matrix[:3, :3].T
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    cosines = edge @ matrix[:3, 2] / (np.linalg.norm(edge, axis=1) * max(lengths[2], NO_LENGTH))
    limit = np.arctan(tangent * lengths[:2].max() / max(lengths[2], NO_LENGTH))
    return bool(np.arccos(np.clip(cosines, -1, 1)).max() > limit + np.radians(2.0))


def _is_sheared(matrix: NDArray[np.float64]) -> bool:
    """True if the axes of a transform (4, 4) are not at right angles."""
    cosines = [abs(float(matrix[:3, j] @ matrix[:3, k])) for j, k in ((0, 1), (0, 2), (1, 2))]
    return max(cosines) > SHEARED * float(np.linalg.norm(matrix[:3, :3], axis=0).max()) ** 2


def _area(
    translation: Translation, lamp: Any, power: float, matrix: NDArray[np.float64], shared: dict[str, Any]
) -> AreaLight | None:
    """Area light: an object's scale changes its extent, as in Cycles, and not its power; None without area."""
    if _is_sheared(matrix):
        translation.note(shared["name"], "its parents shear it; it is rendered as a rectangle, with another brightness")
    size = _extent(lamp, matrix)
    if min(size) <= 0:
        translation.note(shared["name"], "an area light without area emits no light; give it a size and a scale")
        return None
    power *= emitting_area(lamp, matrix)
    shape: Any = "ellipse" if _is_ellipse(lamp) else "rectangle"
    return AreaLight(**shared, power_w=power, shape=shape, size=size, spread_rad=lamp.spread)
