# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances that geometry nodes make: nested, of collections with lamps, of text and points, with their attributes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from benchmarks.render.features import feature
from benchmarks.render.features.stage import Stage


class Tree:
    """A tree of geometry nodes on a new object, made step by step."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
        for way in ("OUTPUT", "INPUT"):
            self.tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")

    def add(self, kind: str, _settings: dict[str, Any] | None = None, **inputs: Any) -> Any:
        """A node; inputs are values or output sockets, by name with ``_`` for a space."""
        node = self.tree.nodes.new(kind)
        for name, value in (_settings or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            socket = next(s for s in node.inputs if s.name == name.replace("_", " ") and s.enabled)
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return next(s for s in node.outputs if s.enabled)

    def show(self, output: Any, location: Any = (0, -1.2, 0.5)) -> Any:
        """An object that shows an output."""
        self.tree.links.new(output, self.tree.nodes.new("NodeGroupOutput").inputs[0])
        made = self.stage.object("Instances", bpy.data.meshes.new("Empty"), location)
        made.modifiers.new("Instances", "NODES").node_group = self.tree
        return made


def cones(tree: Tree) -> Any:
    cone = tree.add("GeometryNodeMeshCone", Radius_Bottom=0.2, Depth=0.5)
    return tree.add("GeometryNodeSetMaterial", Geometry=cone, Material=tree.stage.material_of_ball)


def _grid(tree: Tree, size: float = 2.6, count: int = 4) -> Any:
    return tree.add("GeometryNodeMeshGrid", Size_X=size, Size_Y=size / 2, Vertices_X=count, Vertices_Y=2)


def _turned(stage: Stage) -> None:
    """Cones with random turns and scales."""
    tree = Tree(stage)
    vector = {"data_type": "FLOAT_VECTOR"}
    turn = tree.add("FunctionNodeRandomValue", vector, Max=(1.5, 1.5, 3.0))
    scale = tree.add("FunctionNodeRandomValue", vector, Min=(0.5, 0.5, 0.5), Max=(1.2, 1.2, 1.6))
    tree.show(tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree), Instance=cones(tree), Rotation=turn,
                       Scale=scale))  # fmt: skip


def _nested(stage: Stage) -> None:
    """Rows of rows, mirrored."""
    tree = Tree(stage)
    row = tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree, 0.8, 2), Instance=cones(tree))
    rows = tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree), Instance=row, Scale=(-0.5, 0.7, 0.5))
    tree.show(rows)


def _colored(stage: Stage, *, realized: bool) -> None:
    """A color for each instance, read as an attribute of the instancer, or of the geometry where it was realized."""
    tree = Tree(stage)
    shown = tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree), Instance=cones(tree))
    color = tree.add("FunctionNodeRandomValue", {"data_type": "FLOAT_VECTOR"})
    shown = tree.add("GeometryNodeStoreNamedAttribute", {"data_type": "FLOAT_COLOR", "domain": "INSTANCE"},
                     Geometry=shown, Name="tone", Value=color)  # fmt: skip
    tree.show(tree.add("GeometryNodeRealizeInstances", Geometry=shown) if realized else shown)
    kind = "GEOMETRY" if realized else "INSTANCER"
    stage.into_color(stage.node("ShaderNodeAttribute", attribute_name="tone", attribute_type=kind).outputs["Color"])


def _random(stage: Stage) -> None:
    tree = Tree(stage)
    tree.show(tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree), Instance=cones(tree)))
    stage.into_color(stage.node("ShaderNodeObjectInfo").outputs["Random"])


def _of_collection(stage: Stage) -> None:
    """A collection of a cube and a lamp at each point."""
    group = bpy.data.collections.new("Lit")
    cube = stage.cube(stage.material("Cube", Color=(0.2, 0.5, 0.3, 1)), (0, 0, 0), 0.3)
    for item in (cube, stage.light("POINT", 15.0, (0, 0, 0.5), shadow_soft_size=0.05)):
        stage.scene.collection.objects.unlink(item)
        group.objects.link(item)
    tree = Tree(stage)
    content = tree.add("GeometryNodeCollectionInfo", Collection=group)
    tree.show(tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree), Instance=content))


def _letters(stage: Stage) -> None:
    tree = Tree(stage)
    curves = tree.add("GeometryNodeStringToCurves", String="Ag5", Size=0.9)
    filled = tree.add("GeometryNodeFillCurve", Curve=curves)
    tree.show(tree.add("GeometryNodeSetMaterial", Geometry=filled, Material=stage.material_of_ball), (-1.2, -1, 0.05))


def _picked(stage: Stage) -> None:
    """Children of a collection picked by number."""
    group = bpy.data.collections.new("Parts")
    for k, color in enumerate(((0.7, 0.2, 0.1, 1), (0.1, 0.3, 0.7, 1))):
        cube = stage.cube(stage.material(f"Part {k}", Color=color), (0, 0, 0), 0.25 + 0.15 * k)
        stage.scene.collection.objects.unlink(cube)
        group.objects.link(cube)
    tree = Tree(stage)
    parts = tree.add("GeometryNodeCollectionInfo", Collection=group, Separate_Children=True, Reset_Children=True)
    tree.show(tree.add("GeometryNodeInstanceOnPoints", Points=_grid(tree), Instance=parts, Pick_Instance=True))


def _of_points(stage: Stage) -> None:
    """Points of a radius, spread over the ball's faces."""
    tree = Tree(stage)
    ball = tree.add("GeometryNodeObjectInfo", {"transform_space": "RELATIVE"}, Object=stage.ball)
    node = next(n for n in tree.tree.nodes if n.bl_idname == "GeometryNodeObjectInfo")
    ball = next(s for s in node.outputs if s.name == "Geometry")
    points = tree.add("GeometryNodeDistributePointsOnFaces", Mesh=ball, Density=4.0)
    tree.show(tree.add("GeometryNodeInstanceOnPoints", Points=points, Instance=cones(tree)), (0, 0, 0))


_SCENES: dict[str, Callable[[Stage], None]] = {
    "turned at random": _turned, "in instances, mirrored": _nested,
    "with their own colors": lambda s: _colored(s, realized=False),
    "realized with their colors": lambda s: _colored(s, realized=True),
    "by their random number": _random, "of a collection with a lamp": _of_collection, "of letters": _letters,
    "picked from a collection": _picked, "spread over faces": _of_points,
}  # fmt: skip
for _name, _build in _SCENES.items():
    feature(f"unusual/instances {_name}", _build)
