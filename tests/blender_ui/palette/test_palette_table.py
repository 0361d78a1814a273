# SPDX-License-Identifier: GPL-3.0-or-later
"""The table: rows, columns, cells and their references, through Blender's operators and properties."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon import compat
from blender_addon.translate.palette import from_scene, table
from blender_addon.translate.palette.problem import palette_problem
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import linear_from_display_rgb


@pytest.fixture
def palette(blender):
    """A table of two materials and two lights, D65 and HP1, without requests and without live solving."""
    palette = blender.context.scene.spectral.palette
    palette.live = False
    for side, name in (("LIGHT", "day"), ("LIGHT", "lamp"), ("MATERIAL", "mark"), ("MATERIAL", "ground")):
        blender.ops.spectral.palette_add(side=side, name=name)
    palette.lights[1].spectral.catalogue_name = "HP1"
    return palette


def modes(palette) -> list[list[str]]:
    return [[cell.mode for cell in material.cells] for material in palette.materials]


def test_added_rows_and_columns_form_a_complete_table(blender, palette):
    assert [light.name for light in palette.lights] == ["day", "lamp"]
    assert [material.name for material in palette.materials] == ["mark", "ground"]
    assert modes(palette) == [["IGNORE"] * 2] * 2
    blender.ops.spectral.palette_add(side="LIGHT", name="day")
    assert palette.lights[2].name == "day 2"
    assert [len(material.cells) for material in palette.materials] == [3, 3]
    assert palette.active_column == 2


def test_the_active_object_supplies_light_and_material(blender, palette):
    blender.ops.object.light_add(type="SUN")
    blender.ops.spectral.palette_add(side="LIGHT")
    assert palette.lights[-1].light == blender.context.object.data
    blender.ops.mesh.primitive_cube_add()
    paint = blender.data.materials.new("paint")
    blender.context.object.data.materials.append(paint)
    blender.ops.spectral.palette_add(side="MATERIAL")
    assert palette.materials[-1].material == paint
    assert palette.materials[-1].name == "paint"


def painted(blender, name: str, *, shown_by: str):
    """A material whose output shows a shader with a linked RGB color; an unlinked red shader comes first."""
    paint = blender.data.materials.new(name)
    tree = compat.use_nodes(paint)
    tree.nodes.clear()
    if shown_by == "group":
        group = tree.nodes.new("ShaderNodeGroup")
        tree = group.node_tree = blender.data.node_groups.new("Inner", "ShaderNodeTree")
    red = tree.nodes.new("ShaderNodeBsdfDiffuse")
    red.inputs["Color"].default_value = (1, 0, 0, 1)
    shader, color = tree.nodes.new("ShaderNodeBsdfPrincipled"), tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.1, 0.2, 0.6, 1)
    tree.links.new(color.outputs[0], shader.inputs["Base Color"])
    output, shown = tree.nodes.new("ShaderNodeOutputMaterial"), shader
    if shown_by == "sum":
        shown = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(shader.outputs[0], shown.inputs[1])
    elif shown_by == "mix":
        shown = tree.nodes.new("ShaderNodeMixShader")
        shown.inputs[0].default_value = 1.0
        tree.links.new(red.outputs[0], shown.inputs[1])
        tree.links.new(shader.outputs[0], shown.inputs[2])
    tree.links.new(shown.outputs[0], output.inputs["Surface"])
    return paint


@pytest.mark.parametrize("shown_by", ["shader", "sum", "mix", "group"])
def test_a_row_keeps_the_color_that_its_material_shows(blender, palette, shown_by):
    if shown_by == "group" and not compat.computes_constants():
        pytest.skip("output nodes of groups count from Blender 5.0 on")
    row = from_scene.add_material(palette, painted(blender, "blue", shown_by=shown_by))
    shown = linear_from_display_rgb(np.array(row.cells[0].target))
    np.testing.assert_allclose(shown, (0.1, 0.2, 0.6), atol=1e-5)


def test_a_row_keeps_its_color_in_another_working_space(blender, palette, monkeypatch):
    monkeypatch.setattr(compat, "working_space", lambda _data: "ACEScg")
    paint = painted(blender, "blue", shown_by="shader")
    row = from_scene.add_material(palette, paint)
    expected = compat.rec709_from_working("ACEScg") @ (0.1, 0.2, 0.6)
    np.testing.assert_allclose(linear_from_display_rgb(np.array(row.cells[0].target)), expected, atol=1e-5)


def test_cells_that_lose_their_reference_are_named(blender, palette):
    palette.materials[1].cells[0].mode = "SAME"
    palette.active_row = 0
    assert table.references(palette, palette.materials[1].cells[0]) == [(0, 0)]
    assert table.remove_material(palette, 0) == ["ground under day"]
    assert modes(palette) == [["IGNORE", "IGNORE"]]
    palette.materials[0].cells[0].mode = "CONSTANT"
    assert table.remove_light(palette, 1) == ["ground under day"]


def test_a_dye_is_removed_from_a_measured_material(blender, palette):
    palette.active_row = 1
    blender.ops.spectral.palette_dye()
    palette.materials[1].design = "MEASURED"
    with pytest.raises(RuntimeError, match="no dye can be designed into it"):
        blender.ops.spectral.palette_dye()
    blender.ops.spectral.palette_dye(index=0)
    assert not len(palette.materials[1].dyes)


def test_what_the_active_object_supplies_keeps_its_spectrum_and_color(blender):
    palette = blender.context.scene.spectral.palette
    palette.live = False
    blender.ops.mesh.primitive_cube_add()
    paint = blender.data.materials.new("paint")
    paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.2, 0.3, 0.1, 1.0)
    blender.context.object.data.materials.append(paint)
    blender.ops.spectral.palette_add(side="MATERIAL", name="my paint")
    assert palette.materials[0].name == "my paint"
    blender.ops.object.light_add(type="SUN")
    blender.context.object.data.spectral.source = "CATALOGUE"
    blender.context.object.data.spectral.catalogue_name = "HP1"
    blender.ops.spectral.palette_add(side="LIGHT")
    assert palette.lights[0].spectral.spectrum_name == "HP1"
    # the first light arrives after the material, whose color it shows
    assert tuple(palette.materials[0].cells[0].target) == pytest.approx((0.4845, 0.5838, 0.3492), abs=1e-3)
    blender.ops.object.light_add(type="SUN")
    blender.ops.spectral.palette_add(side="LIGHT")
    assert modes(palette) == [["FIXED", "IGNORE"]]


def test_removing_a_row_or_column_removes_cells_and_references(blender, palette):
    palette.materials[1].cells[0].mode = "SAME"
    assert table.references(palette, palette.materials[1].cells[0]) == [(0, 0)]
    blender.ops.spectral.palette_remove(side="MATERIAL", index=0)
    assert modes(palette) == [["IGNORE", "IGNORE"]]
    blender.ops.spectral.palette_remove(side="LIGHT", index=1)
    assert modes(palette) == [["IGNORE"]]
    with pytest.raises(RuntimeError, match="there is no light 5; there are 1"):
        blender.ops.spectral.palette_remove(side="LIGHT", index=5)


def test_moving_keeps_each_cell_with_its_material_and_light(blender, palette):
    palette.materials[0].cells[0].mode = "BLACK"
    palette.materials[1].cells[0].mode = "SAME"
    blender.ops.spectral.palette_select(row=0, column=0)
    blender.ops.spectral.palette_move(side="LIGHT", direction="FORTH")
    blender.ops.spectral.palette_move(side="MATERIAL", direction="FORTH")
    assert [light.name for light in palette.lights] == ["lamp", "day"]
    assert [material.name for material in palette.materials] == ["ground", "mark"]
    assert modes(palette) == [["IGNORE", "SAME"], ["IGNORE", "BLACK"]]
    assert table.references(palette, palette.materials[0].cells[1]) == [(1, 1)]
    assert (palette.active_row, palette.active_column) == (1, 1)
    assert blender.ops.spectral.palette_move(side="LIGHT", direction="FORTH") == {"CANCELLED"}


@pytest.mark.parametrize(
    ("mode", "place", "expected"),
    [("SAME", (1, 0), [(0, 0)]), ("CONSTANT", (0, 1), [(0, 0)]), ("DISTINCT", (0, 0), [(1, 0)])],
)
def test_a_new_reference_points_to_the_most_common_cell(palette, mode, place, expected):
    cell = palette.materials[place[0]].cells[place[1]]
    cell.mode = mode
    assert table.references(palette, cell) == expected


def test_references_are_toggled_and_refused(blender, palette):
    blender.ops.spectral.palette_select(row=0, column=0)
    cell = palette.materials[0].cells[0]
    with pytest.raises(RuntimeError, match="select a cell whose target is"):
        blender.ops.spectral.palette_refer(row=1, column=1)
    cell.mode = "DISTINCT"
    blender.ops.spectral.palette_refer(row=1, column=1)
    assert set(table.references(palette, cell)) == {(1, 0), (1, 1)}
    blender.ops.spectral.palette_refer(row=1, column=0)
    assert table.references(palette, cell) == [(1, 1)]
    cell.mode = "SAME"
    blender.ops.spectral.palette_refer(row=0, column=1)
    assert table.references(palette, cell) == [(0, 1)]
    cell.mode = "CONSTANT"
    with pytest.raises(RuntimeError, match="a constant cell refers to its own row"):
        blender.ops.spectral.palette_refer(row=1, column=0)


def test_a_cell_is_copied_to_its_column_and_row(blender, palette):
    cell = palette.materials[0].cells[1]
    blender.ops.spectral.palette_select(row=0, column=1)
    cell.mode, cell.target, cell.weight, cell.exact = "FIXED", (0.2, 0.4, 0.6), 3.0, True
    blender.ops.spectral.palette_spread(side="LIGHT")
    assert modes(palette) == [["IGNORE", "FIXED"], ["IGNORE", "FIXED"]]
    below = palette.materials[1].cells[1]
    assert list(below.target) == list(cell.target)
    assert (below.weight, below.exact) == (3.0, True)
    blender.ops.spectral.palette_spread(side="MATERIAL")
    assert modes(palette) == [["FIXED", "FIXED"], ["IGNORE", "FIXED"]]


def test_lamps_are_added_to_lists_and_removed(blender, palette):
    blender.ops.spectral.palette_select(column=1)
    light = palette.lights[1]
    for to, lamps in (("PRIMARIES", light.primaries), ("VARIANTS", light.variants)):
        blender.ops.spectral.palette_lamp_add(to=to, lamp="FL11")
        blender.ops.spectral.palette_lamp_add(to=to, lamp="A")
        assert [lamp.spectral.spectrum_name for lamp in lamps] == ["FL11", "A"]
        blender.ops.spectral.palette_lamp_remove(to=to, index=0)
        assert [lamp.spectral.spectrum_name for lamp in lamps] == ["A"]


def test_selecting_outside_the_table_reports_its_size(blender, palette):
    with pytest.raises(RuntimeError, match="there is no material 7; there are 2"):
        blender.ops.spectral.palette_select(row=7, column=0)
    assert (palette.active_row, palette.active_column) == (1, 1)


def test_clear(blender, palette):
    blender.ops.spectral.palette_clear()
    assert not len(palette.lights)
    assert not len(palette.materials)
    assert table.active_cell(palette) is None


def test_the_scene_supplies_lights_and_materials_with_their_colors(blender):
    palette = blender.context.scene.spectral.palette
    with pytest.raises(RuntimeError, match="this scene has 0 lights and 0 materials"):
        blender.ops.spectral.palette_from_scene()
    for name, color in (("red", (0.5, 0.1, 0.05, 1.0)), ("blue", (0.05, 0.1, 0.4, 1.0))):
        blender.ops.mesh.primitive_cube_add()
        material = blender.data.materials.new(name)
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
        blender.context.object.data.materials.append(material)
    for lamp in ("A", None):
        blender.ops.object.light_add(type="POINT")
        if lamp:
            blender.context.object.data.spectral.source = "CATALOGUE"
            blender.context.object.data.spectral.catalogue_name = lamp
    blender.ops.spectral.palette_from_scene()
    assert {light.spectral.spectrum_name for light in palette.lights} == {"A", "D65"}
    assert {material.name for material in palette.materials} == {"red", "blue"}
    assert {material.material.name for material in palette.materials} == {"red", "blue"}
    assert [cell.mode for cell in palette.materials[0].cells] == ["FIXED", "IGNORE"]
    assert palette.status in ("solved", "compromise")
    red = next(material for material in palette.materials if material.name == "red")
    assert tuple(red.cells[0].wanted_linear) == pytest.approx((0.5, 0.1, 0.05), abs=1e-5)

    # Measured rows and columns are not replaced.
    blender.data.materials["blue"].spectral.source = "CATALOGUE"
    blender.data.materials["blue"].spectral.catalogue_name = "blue"
    blender.ops.spectral.palette_from_scene()
    assert {material.name: material.design for material in palette.materials} == {"red": "DESIGNED", "blue": "MEASURED"}


def test_what_cannot_be_read_leaves_the_table_as_it_was(blender):
    """Half a column stayed, and From This Scene had removed the table before."""
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    lamp = blender.data.lights.new("Broken", "POINT")
    lamp.spectral.source, lamp.spectral.filepath = "FILE", "/nowhere.csv"
    paint = blender.data.materials.new("Unknown")
    paint.spectral.source, paint.spectral.catalogue_name = "CATALOGUE", "no such surface"
    shown = blender.data.objects.new("Shown", blender.data.meshes.new("Shown"))
    shown.data.materials.append(paint)
    holders = {"Broken": blender.data.objects.new("Broken", lamp), "Unknown": shown}
    before = [*palette.lights.keys(), *palette.materials.keys(), palette.status, palette.is_stale]
    for name, side in (("Broken", "LIGHT"), ("Unknown", "MATERIAL")):
        blender.context.scene.collection.objects.link(holders[name])
        blender.context.view_layer.objects.active = holders[name]
        with pytest.raises(RuntimeError, match=f"the spectrum of '{name}' is empty"):
            blender.ops.spectral.palette_add(side=side)
    with pytest.raises(RuntimeError, match="the spectrum of 'Broken' is empty"):
        blender.ops.spectral.palette_from_scene()
    assert [*palette.lights.keys(), *palette.materials.keys(), palette.status, palette.is_stale] == before
    assert {len(row.cells) for row in palette.materials} == {2}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("brightness", "Light Level of the table is nan"),
        ("intensity", "Brightness of light 'day' is nan"),
        ("grid_start", "of the table is nan"),
        ("smoothness", "of the table is nan"),
    ],
)
def test_a_number_that_is_none_is_named_by_its_label(palette, name, words):
    """Only a script can store it."""
    setattr(palette.lights[0] if name == "intensity" else palette, name, np.nan)
    with pytest.raises(InvalidInputError, match=words):
        palette_problem(palette)
