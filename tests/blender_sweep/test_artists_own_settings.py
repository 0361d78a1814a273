# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps of settings that artists make themselves: custom properties, inputs of geometry nodes, lists; angles."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from tests.blender_sweep.test_sweep_in_blender import scene  # noqa: E402, F401 - a fixture

PLANE = 'bpy.data.objects["Plane"]'
TURN = f"{PLANE}.rotation_euler[2]"
STRENGTH = 'bpy.data.worlds["World"].node_tree.nodes["Background"].inputs[1].default_value'


@pytest.fixture
def plane(scene: Any) -> Any:  # noqa: F811
    """An object with custom properties and a modifier whose inputs are Size (0.5 to 2) and Shape (Whole, Half)."""
    made = bpy.data.objects["Plane"]
    made["height"], made["sides"], made['of "me"'] = 0.5, [1.0, 2.0, 3.0], 1
    made.id_properties_ui('of "me"').update(items=[("few", "Few", "", 2), ("many", "Many", "", 90)])
    tree = bpy.data.node_groups.new("Tree", "GeometryNodeTree")
    for name, kind, way in (
        ("Geometry", "NodeSocketGeometry", "OUTPUT"), ("Geometry", "NodeSocketGeometry", "INPUT"),
        ("Size", "NodeSocketFloat", "INPUT"), ("Shape", "NodeSocketMenu", "INPUT"),
    ):  # fmt: skip
        socket = tree.interface.new_socket(name, in_out=way, socket_type=kind)
        if name == "Size":
            socket.min_value, socket.max_value, socket.default_value = 0.5, 2.0, 1.0
    entry, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    switch = tree.nodes.new("GeometryNodeMenuSwitch")
    switch.data_type = "FLOAT"
    for item, name, value in zip(switch.enum_items, ("Whole", "Half"), (1.0, 0.5), strict=True):
        item.name = name
        switch.inputs[name].default_value = value
    moved = tree.nodes.new("GeometryNodeTransform")
    tree.links.new(entry.outputs["Shape"], switch.inputs[0])
    tree.links.new(entry.outputs["Geometry"], moved.inputs["Geometry"])
    tree.links.new(switch.outputs[0], moved.inputs["Scale"])
    tree.links.new(moved.outputs[0], end.inputs[0])
    made.modifiers.new("Nodes", "NODES").node_group = tree
    return made


def input_path(name: str) -> str:
    """Full data path of an input of the modifier, as this Blender copies it."""
    modifier = bpy.data.objects["Plane"].modifiers["Nodes"]
    sockets = modifier.node_group.interface.items_tree
    identifier = next(each.identifier for each in sockets if each.name == name and each.in_out == "INPUT")
    inputs = f'{PLANE}.modifiers["Nodes"]'
    return f"{inputs}.properties.inputs.{identifier}.value" if hasattr(modifier, "properties") else (
        f'{inputs}["{identifier}"]'
    )  # fmt: skip


def reach(made: Any) -> float:
    """Largest coordinate of the meshes of a translated scene."""
    meshes = made.meshes.values() if hasattr(made.meshes, "values") else made.meshes
    return max(float(mesh.positions.max()) for mesh in meshes)


def added(path: str) -> Any:
    assert bpy.ops.spectral.sweep_add(target=path) == {"FINISHED"}
    return bpy.context.scene.spectral.sweep.parameters[path]


def test_the_context_menu_offers_custom_properties(plane: Any) -> None:
    """Blender 4.3 and 5.2 describe the property under the pointer like this: read-only, and of no known length."""
    from blender_addon.operators import board, sweep

    class Layout:
        targets: list[SimpleNamespace]

        def separator(self) -> None:
            """Nothing to press."""

        def operator(self, _name: str, **_look: Any) -> SimpleNamespace:
            self.targets.append(SimpleNamespace())
            return self.targets[-1]

    def offered(draw: Any, pointer: Any, name: str, kind: str, *, is_array: bool = False) -> list[str]:
        layout = Layout()
        layout.targets = []
        known = SimpleNamespace(identifier=name, type=kind, is_readonly=True, is_array=is_array, array_length=1)
        draw(SimpleNamespace(layout=layout), SimpleNamespace(button_pointer=pointer, button_prop=known))
        return [each.target for each in layout.targets]

    for draw in (sweep.draw_menu, board.draw_menu):
        assert offered(draw, plane, "height", "FLOAT") == [f'{PLANE}["height"]']
        assert offered(draw, plane, "sides", "FLOAT", is_array=True) == [f'{PLANE}["sides"][{k}]' for k in range(3)]
        assert offered(draw, plane, 'of "me"', "INT") == [f'{PLANE}["of \\"me\\""]']
        assert offered(draw, plane, "dimensions", "POINTER") == []
    assert offered(sweep.draw_menu, plane.modifiers["Nodes"], "Socket_2", "FLOAT") == [
        f'{PLANE}.modifiers["Nodes"]["Socket_2"]'
    ]


def test_an_input_of_geometry_nodes_has_the_name_and_range_of_its_slider(plane: Any) -> None:
    entry = added(input_path("Size"))
    assert (entry.label, entry.low, entry.high, entry.choices) == ("plane_size", 0.5, 2.0, "")


def test_a_menu_of_geometry_nodes_is_a_choice_and_changes_the_picture(plane: Any, tmp_path: Path) -> None:
    from blender_addon.editing.sweep.node import BlendNode
    from spectral_core.explore.sweep.parameters import Parameter, Space

    path = input_path("Shape")
    entry = added(path)
    assert (entry.label, entry.choices) == ("plane_shape", "Whole, Half")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    parameter = Parameter("shape", kind="choice", choices=("Whole", "Half"), path=path)
    node = BlendNode.of(tmp_path / "scene.blend", Space((parameter,)), samples=2)
    whole, half = (node.scene({"shape": shape}, 0) for shape in ("Whole", "Half"))
    assert reach(whole) == pytest.approx(2 * reach(half))


def test_a_custom_property_with_a_list_is_a_choice(plane: Any) -> None:
    from blender_addon.editing.sweep.points import set_point

    entry = added(f'{PLANE}["of \\"me\\""]')
    assert entry.choices == "few, many"
    assert set_point(bpy.context.scene, {entry.label: "many"}) == []
    assert plane['of "me"'] == 90
    with pytest.raises(Exception, match="cannot be 'none'; it offers few, many"):
        set_point(bpy.context.scene, {entry.label: "none"})


def test_an_angle_is_entered_in_degrees_and_stored_in_radians(plane: Any) -> None:
    from blender_addon.editing.sweep.documents import parameters_of

    entry = added(TURN)
    assert entry.is_angle and not added(f'{PLANE}["height"]').is_angle
    assert type(entry).bl_rna.properties["high_angle"].subtype == "ANGLE"
    entry.low_angle, entry.high_angle = math.radians(30), math.radians(90)
    parameter = parameters_of(bpy.context.scene.spectral.sweep)[0]
    assert (parameter.low, parameter.high) == pytest.approx((math.pi / 6, math.pi / 2))
    assert parameter.unit == "rad"


def test_a_number_of_a_node_without_limits_gets_a_range_about_its_value(plane: Any) -> None:
    from blender_addon import compat

    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    compat.use_nodes(world).nodes["Background"].inputs[1].default_value = 3.0
    entry = added(STRENGTH)
    assert (entry.low, entry.high) == (0.0, 6.0)


def test_shape_keys_and_inputs_of_groups_have_the_range_of_their_sliders(scene: Any) -> None:  # noqa: F811
    """Shape keys went from -10 to 10, which Blender limits to 0 to 1; an input of a group from 0 to twice its value."""
    plane = bpy.data.objects["Plane"]
    plane.shape_key_add(name="Basis")
    bend = plane.shape_key_add(name="Bend")
    bend.slider_min, bend.slider_max = -0.5, 2.0
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    amount = group.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    amount.min_value, amount.max_value, amount.default_value = 2.0, 7.0, 3.0
    node = bpy.data.node_groups.new("Outer", "ShaderNodeTree").nodes.new("ShaderNodeGroup")
    node.node_tree = group
    paths = (
        f'bpy.data.shape_keys["{plane.data.shape_keys.name}"].key_blocks["Bend"].value',
        f'bpy.data.node_groups["Outer"].nodes["{node.name}"].inputs[0].default_value',
    )
    for path, ends in zip(paths, ((-0.5, 2.0), (2.0, 7.0)), strict=True):
        assert bpy.ops.spectral.sweep_add(target=path) == {"FINISHED"}
        entry = scene.spectral.sweep.parameters[path]
        assert (entry.low, entry.high) == ends
