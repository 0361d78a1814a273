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
