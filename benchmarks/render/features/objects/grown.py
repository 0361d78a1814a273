# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and scattered instances that a suite of artists' combinations, drawn at random, found wrong at first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.objects.unusual_instances import Tree, cones
from benchmarks.render.features.stage import Stage

Build = Callable[[Stage], object]


def _hairy(stage: Stage, **values: Any) -> Any:
    """A small ball with hair of another material; its settings."""
    stage.ball.data.materials.append(stage.material("Hair", Color=(0.6, 0.5, 0.2, 1)))
    settings = stage.ball.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count, settings.hair_length, settings.material = "HAIR", 350, 0.4, 2
    settings.radius_scale, settings.tip_radius = 0.05, 0.6
    for name, value in values.items():
        setattr(settings, name, value)
    return settings


def _scaled(stage: Stage) -> None:
    """An object that is not as large along each axis; its hair is as thick as its scale makes it."""
    stage.ball.scale = (0.5, 0.6, 0.4)
    _hairy(stage)


def _shortened(stage: Stage) -> None:
    """Children that end before the last step of their parents, far from the origin."""
    stage.ball.scale = (0.6, 0.6, 0.6)
    _hairy(stage, child_type="INTERPOLATED", rendered_child_count=3, child_length=0.6)


def _parents_too(stage: Stage) -> None:
    stage.ball.scale = (0.6, 0.6, 0.6)
    _hairy(stage, child_type="SIMPLE", rendered_child_count=3, use_parent_particles=True)


def _spirals(stage: Stage) -> None:
    stage.ball.scale = (0.6, 0.6, 0.6)
    _hairy(stage, child_type="SIMPLE", rendered_child_count=3, kink="SPIRAL")


def _in_instances(stage: Stage) -> None:
    """Two instances of a collection with a hairy ball that does not show itself."""
    _hairy(stage)
    stage.ball.location = (0, 0, 0)
    stage.ball.show_instancer_for_render = False
    group = bpy.data.collections.new("Hairy")
    for item in list(stage.ball.users_collection):
        item.objects.unlink(stage.ball)
    group.objects.link(stage.ball)
    for x, scale in ((-0.7, (0.5, 0.3, 0.5)), (0.8, (-0.4, 0.4, 0.6))):
        empty = stage.object(f"Empty {x}", None, (x, 0, 1), (0.3, 0.2, x))
        empty.scale = scale
        empty.instance_type, empty.instance_collection = "COLLECTION", group


def _overridden(stage: Stage) -> None:
    _hairy(stage)
    stage.layer.material_override = stage.material("All", Color=(0.7, 0.2, 0.1, 1))


def _scattered(stage: Stage, *, nested: bool) -> None:
    """Cones on random points of a grid, which have an ID, colored by an attribute of the instances."""
    tree = Tree(stage)
    vector = {"data_type": "FLOAT_VECTOR"}
    grid = tree.add("GeometryNodeMeshGrid", Size_X=2.6, Size_Y=1.4)
    shown = cones(tree)
    for level in range(2 if nested else 1):
        points = tree.add("GeometryNodeDistributePointsOnFaces", Mesh=grid, Density=6.0 - 3.0 * level, Seed=level)
        size = (0.4, 0.4, 0.4) if level else (0.8, 0.8, 0.8)
        shown = tree.add("GeometryNodeInstanceOnPoints", Points=points, Instance=shown, Scale=size)
        color = tree.add("FunctionNodeRandomValue", vector, Seed=5 + level)
        kinds = {"data_type": "FLOAT_VECTOR", "domain": "INSTANCE"}
        name = "tone" if level == 0 else "other"
        shown = tree.add("GeometryNodeStoreNamedAttribute", kinds, Geometry=shown, Name=name, Value=color)
    tree.show(shown, (0, -0.5, 0.4))
    node = stage.node("ShaderNodeAttribute", attribute_name="tone", attribute_type="INSTANCER")
    stage.into_color(node.outputs["Color"])


def _carried_along(stage: Stage) -> None:
    """Generated coordinates of a ball with a shape key under Subdivision and Decimate."""
    stage.ball.shape_key_add(name="Basis")
    for point in stage.ball.shape_key_add(name="Flat").data:
        point.co.z *= 0.5
    stage.ball.data.shape_keys.key_blocks["Flat"].value = 1.0
    stage.ball.modifiers.new("Fine", "SUBSURF").render_levels = 1
    stage.ball.modifiers.new("Coarse", "DECIMATE").ratio = 0.6
    noise = stage.node("ShaderNodeTexNoise", Scale=3.0)
    stage.link(stage.node("ShaderNodeTexCoord").outputs["Generated"], noise.inputs["Vector"])
    stage.into_color(noise.outputs["Color"])


_SCENES: dict[str, Build] = {
    "hair of a scaled object": _scaled, "hair of shortened children": _shortened,
    "hair of children, their parents enabled": _parents_too, "hair of children with spirals": _spirals,
    "hair in instances": _in_instances,
    "hair of a view layer's material": _overridden,
    "instances with their colors on random points": lambda stage: _scattered(stage, nested=False),
    "instances in each other with their colors": lambda stage: _scattered(stage, nested=True),
    "generated coordinates through modifiers": _carried_along,
}  # fmt: skip
for _name, _build in _SCENES.items():
    feature(f"grown/{_name}", _build, 2)
