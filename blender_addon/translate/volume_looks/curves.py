# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of a Volume's transfer function and their curves, stored in Float Curve nodes."""

import bpy
import numpy as np
from bpy.types import Node, PropertyGroup, Volume
from numpy.typing import ArrayLike

from spectral_core.errors import InvalidInputError

from ...properties.volume import own_curves

CURVES = ("density", "emission", "gradient")
JUMP = 2e-6
"""Curve widgets cannot hold two points at one position; a smaller distance is a jump."""


def add_material(volume: Volume, name: str) -> PropertyGroup:
    """A new material with a density ramp; returns it."""
    settings = volume.spectral
    made = settings.materials.add()
    made.name = _unused(name, [each.name for each in settings.materials][:-1])
    made.uid = settings.next_uid
    settings.next_uid += 1
    set_curve(volume, made, "density", [0.0, 1.0], [0.0, 1.0])
    settings.active = len(settings.materials) - 1
    volume.update_tag()
    return made


def remove_material(volume: Volume, index: int) -> None:
    """Remove a material and its curves."""
    settings = volume.spectral
    own_curves(volume)
    for which in CURVES:
        node = curve_node(volume, settings.materials[index], which)
        if node is not None:
            settings.curves.nodes.remove(node)
    settings.materials.remove(index)
    settings.active = min(settings.active, max(len(settings.materials) - 1, 0))
    volume.update_tag()


def clear(volume: Volume) -> None:
    """Remove all materials."""
    while len(volume.spectral.materials):
        remove_material(volume, 0)


def curve_node(volume: Volume, material: PropertyGroup, which: str) -> Node | None:
    """The Float Curve node of a material's curve; None without one."""
    tree = volume.spectral.curves
    return None if tree is None else tree.nodes.get(f"{material.uid} {which}")


def set_curve(volume: Volume, material: PropertyGroup, which: str, positions: ArrayLike, heights: ArrayLike) -> None:
    """Straight lines through the points; two equal positions are a jump."""
    settings = volume.spectral
    own_curves(volume)
    if settings.curves is None:
        settings.curves = bpy.data.node_groups.new(f".{volume.name} curves", "ShaderNodeTree")
    node = curve_node(volume, material, which)
    if node is not None:
        settings.curves.nodes.remove(node)
    node = settings.curves.nodes.new("ShaderNodeFloatCurve")
    node.name = f"{material.uid} {which}"
    x, y = _separated(np.asarray(positions, float)), np.asarray(heights, float)
    if len(x) == 1:
        x, y = np.array([x[0], x[0] + 1.0]), np.repeat(y, 2)
    mapping, curve = node.mapping, node.mapping.curves[0]
    mapping.use_clip = False
    for _ in range(len(x) - len(curve.points)):
        curve.points.new(0.5, 0.5)
    for point, place, height in zip(curve.points, x, y, strict=True):
        point.location, point.handle_type = (place, height), "VECTOR"
    mapping.clip_min_x, mapping.clip_max_x = min(0.0, float(x[0])), max(1.0, float(x[-1]))
    mapping.clip_min_y, mapping.clip_max_y = 0.0, max(1.0, float(y.max()))
    mapping.update()
    mapping.reset_view()
    settings.curves.update_tag()
    volume.update_tag()


def require_held(name: str, positions: ArrayLike, heights: ArrayLike) -> None:
    """Raise InvalidInputError for a peak of the material ``name`` that a curve widget cannot hold."""
    x, y = np.asarray(positions, float), np.asarray(heights, float)
    near = np.diff(x) < JUMP * np.maximum(1.0, np.abs(x[:-1]))
    start = 0
    for end in range(1, len(x) + 1):
        if end < len(x) and near[end - 1]:
            continue
        rises = np.diff(y[start:end])
        # A jump keeps the values on both sides: what rises and falls between them is lost.
        if x[end - 1] > x[start] and rises.min() < 0.0 < rises.max():
            raise InvalidInputError(
                f"material {name!r} has a peak between {x[start]:.9g} and {x[end - 1]:.9g} of the curve's range. It is "
                f"narrower than {JUMP:g}, the least that a curve of Blender holds: widen it, or replace values of the "
                "data that are far beyond the others, which make the range so wide"
            )
        start = end


def curve_points(volume: Volume, material: PropertyGroup, which: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) and heights (n,) of a curve as straight lines; curved parts are sampled finely.

    Emission and edges have a ramp until their curve is drawn. Raises InvalidInputError for a lost curve of the density,
    and for a point that is not finite.
    """
    node = curve_node(volume, material, which)
    if node is None and which == "density":
        raise InvalidInputError(
            f"the density curve of material {material.name!r} of volume {volume.name!r} is lost; press Draw its Curve, "
            "or choose a preset"
        )
    if node is None:
        return np.array([0.0, 1.0]), np.array([0.0, 1.0])
    mapping = node.mapping
    curve = mapping.curves[0]
    x = np.array([point.location[0] for point in curve.points], dtype=np.float64)
    y = np.array([point.location[1] for point in curve.points], dtype=np.float64)
    for place, height in zip(x, y, strict=True):
        if not np.isfinite((place, height)).all():
            raise InvalidInputError(
                f"the {which} curve of material {material.name!r} of volume {volume.name!r} has a point at "
                f"{place:g}, {height:g}; expected numbers. Move or delete the point"
            )
    if any(point.handle_type != "VECTOR" for point in curve.points):
        mapping.initialize()
        x = np.unique(np.concatenate([x, np.linspace(x[0], x[-1], 129)]))
        y = np.array([mapping.evaluate(curve, float(place)) for place in x])
    return _joined(x), np.maximum(y, 0.0)


def _separated(x: np.ndarray) -> np.ndarray:
    """Equal positions separated by half of JUMP, so that the widget keeps their order."""
    apart = x.copy()
    for index in range(1, len(apart)):
        if apart[index] <= apart[index - 1]:
            apart[index] = apart[index - 1] + JUMP / 2 * max(1.0, abs(apart[index - 1]))
    return apart


def _joined(x: np.ndarray) -> np.ndarray:
    """Inverse of _separated."""
    joined = x.copy()
    for index in range(1, len(joined)):
        if joined[index] - x[index - 1] < JUMP * max(1.0, abs(x[index - 1])):
            joined[index] = joined[index - 1]
    return joined


def _unused(name: str, taken: list[str]) -> str:
    number, unused = 1, name
    while unused in taken:
        unused, number = f"{name}.{number:03d}", number + 1
    return unused
