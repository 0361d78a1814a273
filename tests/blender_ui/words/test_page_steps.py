# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of docs/palette_in_blender.md: two materials that are equal under one light and different under another."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


def test_the_steps_of_the_page_make_two_materials_equal_and_different(blender) -> None:
    scene = blender.context.scene
    palette = scene.spectral.palette
    lamps = [blender.data.lights.new(name, "POINT") for name in ("day", "street")]
    meshes = [blender.data.meshes.new(name) for name in ("first", "second")]
    for mesh in meshes:
        mesh.materials.append(blender.data.materials.new(mesh.name))
    for side, each in (("LIGHT", lamps), ("MATERIAL", meshes)):
        for data in each:
            shown = blender.data.objects.new(data.name, data)
            scene.collection.objects.link(shown)
            blender.context.view_layer.objects.active = shown
            blender.ops.spectral.palette_add(side=side)
    assert [light.spectral.catalogue_name for light in palette.lights] == ["D65", "D65"]
    palette.lights[1].spectral.catalogue_name = "HP1"
    blender.ops.spectral.palette_select(row=1, column=0)
    match = palette.materials[1].cells[0]
    match.mode = "SAME"
    blender.ops.spectral.palette_refer(row=0, column=0)
    match.exact = True
    for material, color in zip(palette.materials, ((0.8, 0.5, 0.2), (0.6, 0.4, 0.2)), strict=True):
        material.cells[1].mode = "FIXED"
        material.cells[1].target = color
    assert match.delta_e < 0.01
    (first, second) = (tuple(material.cells[1].actual_linear) for material in palette.materials)
    assert max(abs(a - b) for a, b in zip(first, second, strict=True)) > 0.05
    assert blender.ops.spectral.palette_apply() == {"FINISHED"}
    assert {lamp.spectral.source for lamp in lamps} == {"DESIGNED"}
    assert {mesh.materials[0].spectral.source for mesh in meshes} == {"DESIGNED"}


def test_a_column_has_the_name_of_the_lamp_in_the_outliner(blender) -> None:
    """Artists rename objects; the light of a renamed lamp keeps its name, such as Area.001."""
    scene = blender.context.scene
    blender.ops.object.light_add(type="AREA")
    lamp = blender.context.object
    lamp.name = "Street Lamp"
    assert lamp.data.name != lamp.name
    blender.ops.spectral.palette_add(side="LIGHT")
    column = scene.spectral.palette.lights[-1]
    assert (column.name, column.light) == ("Street Lamp", lamp.data)
    blender.ops.mesh.primitive_cube_add()
    blender.context.object.data.materials.append(blender.data.materials.new("Paint"))
    blender.ops.spectral.palette_from_scene()
    assert "Street Lamp" in [each.name for each in scene.spectral.palette.lights]


def test_an_unsolved_table_says_what_it_needs(blender) -> None:
    from blender_addon.panels.palette import _next_step

    palette = blender.context.scene.spectral.palette
    palette.live = False
    blender.ops.spectral.palette_add(side="LIGHT", name="day")
    assert "+ Material" in _next_step(palette)
    blender.ops.spectral.palette_add(side="MATERIAL", name="paint")
    assert "press Solve" in _next_step(palette)
    blender.ops.spectral.palette_remove(side="LIGHT")
    assert "+ Light" in _next_step(palette)
