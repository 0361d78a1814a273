# SPDX-License-Identifier: GPL-3.0-or-later
"""``volume.spectral``: the transfer function of a Volume data-block, and how finely it is sampled.

Curves are Float Curve nodes in a node group of the volume's own, because that is where Blender keeps curves that an
artist can draw; x is the fraction of the data's range, y the fraction of the material's density.
"""

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .spectrum import SpectralSpectrum

RULES = [
    ("auto", "Automatic", "Whatever needs fewest samples and least time for the wanted error", 0),
    ("uniform", "Uniform", "The same step everywhere", 1),
    ("thesis", "Sampling Theorem", "Steps from the local band limit, as the thesis derives it (Eq. 4.14)", 2),
    ("error", "Even Error", "Steps that spread the error evenly over the ray", 3),
]
LIGHTING = [
    ("even", "Even", "White light from everywhere: each material shows its color, and data are read most easily", 0),
    ("scene", "Scene", "The scene's lights, with shading by the gradient of the data", 1),
    ("shadows", "Scene, Shadows", "The scene's lights with shadows, to and from surfaces; slower", 2),
]
RANGE_KEY = "spectral_range"
"""Least and greatest data value, kept as double precision on the data-block itself."""
CURVES = ("density", "emission", "gradient")
JUMP = 2e-6
"""Curve widgets cannot hold two points at one place; closer than this they are a jump."""


def _changed(properties, _context=None) -> None:
    """A change of ours is a change of the data-block: whoever keeps an evaluated copy of it must copy again."""
    properties.id_data.update_tag()


class SpectralVolumeMaterial(bpy.types.PropertyGroup):
    """One material of a transfer function; ``name`` is its name, its curves are nodes named after ``uid``."""

    uid: IntProperty()
    color: FloatVectorProperty(
        name="Color", update=_changed, subtype="COLOR", size=3, min=0.0, max=1.0, default=(0.8, 0.8, 0.8),
        description="Color of the material where it carries no spectrum",
    )  # fmt: skip
    spectral: PointerProperty(type=SpectralSpectrum)
    density: FloatProperty(
        name="Density", update=_changed, default=0.1, min=0.0, soft_max=2.0, precision=3,
        description="Light that is taken per voxel where the density curve is at its top",
    )  # fmt: skip
    emission: FloatProperty(
        name="Emission", update=_changed, default=0.0, min=0.0, soft_max=1.0, precision=3,
        description="Light that is added per voxel where the emission curve is at its top. Without density: an X-ray",
    )  # fmt: skip
    lit: BoolProperty(
        name="Lit by the Scene", update=_changed, default=True,
        description="The color is what it reflects of the scene's light; without, it shines by itself",
    )  # fmt: skip
    use_gradient: BoolProperty(
        name="Only Edges", update=_changed, default=False,
        description="Weigh the material by how quickly the data change: boundaries show and insides do not",
    )  # fmt: skip
    gradient: FloatProperty(
        name="Steepness", update=_changed, default=0.1, min=1e-6, soft_max=1.0, precision=3,
        description="Right end of the edge curve: change per voxel, as a fraction of the data's range",
    )  # fmt: skip


class SpectralVolume(bpy.types.PropertyGroup):
    """What this extension keeps on a Volume."""

    enabled: BoolProperty(
        name="Transfer Function", update=_changed, default=False,
        description="Show the data through this transfer function; without, the volume's shader is meant",
    )  # fmt: skip
    materials: CollectionProperty(type=SpectralVolumeMaterial)
    active: IntProperty(name="Material", min=0)
    next_uid: IntProperty(default=1)
    curves: PointerProperty(type=bpy.types.NodeTree, description="Holds the curves of the materials")
    rule: EnumProperty(
        name="Steps", update=_changed, items=RULES, default="auto", description="How the steps along a ray are chosen"
    )
    lighting: EnumProperty(
        name="Lighting", items=LIGHTING, default="scene", update=_changed,
        description="How materials that are lit get their light. Of several volumes the most thorough counts for all",
    )  # fmt: skip
    quality_db: FloatProperty(
        name="Quality", update=_changed, default=50.0, min=20.0, max=90.0, subtype="NONE", precision=0,
        description="Signal-to-noise ratio of the picture in dB: 40 for a preview, 50 good, 60 past what screens show",
    )  # fmt: skip
    grid: StringProperty(
        name="Grid", update=_changed, default="density", description="Which grid of the OpenVDB file is shown"
    )
    source: StringProperty(name="Source", subtype="FILE_PATH", description="File that this volume was imported from")
    facts: StringProperty(description="Size and type of the data, for the panel")


CLASSES = (SpectralVolumeMaterial, SpectralVolume)


def add_material(volume, name: str):
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


def remove_material(volume, index: int) -> None:
    """Take a material and its curves away."""
    settings = volume.spectral
    tree = settings.curves
    for which in CURVES:
        node = curve_node(volume, settings.materials[index], which)
        if node is not None:
            tree.nodes.remove(node)
    settings.materials.remove(index)
    settings.active = min(settings.active, max(len(settings.materials) - 1, 0))
    volume.update_tag()


def clear(volume) -> None:
    """Take all materials away."""
    while len(volume.spectral.materials):
        remove_material(volume, 0)


def curve_node(volume, material, which: str):
    """The Float Curve node of a material's curve, None where it has none yet."""
    tree = volume.spectral.curves
    return None if tree is None else tree.nodes.get(f"{material.uid} {which}")


def set_curve(volume, material, which: str, positions, heights) -> None:
    """Straight lines through the points; two equal positions are a jump."""
    settings = volume.spectral
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


def curve_points(volume, material, which: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) and heights (n,) of a curve as straight lines; what an artist made round is sampled finely."""
    node = curve_node(volume, material, which)
    if node is None:
        return np.array([0.0, 1.0]), np.array([0.0, 1.0])
    mapping = node.mapping
    curve = mapping.curves[0]
    x = np.array([point.location[0] for point in curve.points], dtype=np.float64)
    y = np.array([point.location[1] for point in curve.points], dtype=np.float64)
    if any(point.handle_type != "VECTOR" for point in curve.points):
        mapping.initialize()
        x = np.unique(np.concatenate([x, np.linspace(x[0], x[-1], 129)]))
        y = np.array([mapping.evaluate(curve, float(place)) for place in x])
    return _joined(x), np.maximum(y, 0.0)


def _separated(x: np.ndarray) -> np.ndarray:
    """Equal positions apart by half of JUMP, so that the widget keeps their order."""
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


def register() -> None:
    """Add ``spectral`` to Volume data-blocks."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Volume.spectral = PointerProperty(type=SpectralVolume, name="Spectral")


def unregister() -> None:
    """Take it away; what is stored stays in the file."""
    del bpy.types.Volume.spectral
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
