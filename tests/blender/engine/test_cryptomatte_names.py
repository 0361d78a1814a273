# SPDX-License-Identifier: GPL-3.0-or-later
"""Names and ids in the headers of cryptomattes, beside those that Cycles wrote for the same names."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from spectral_core.scene.passes import Passes

bpy = pytest.importorskip("bpy")

OF_CYCLES = {"default_surface": "78d05529", "m é": "053f2cdc", "Plätte 中": "4c227b01"}
"""Of Blender 5.0; an object without a material has the first one in the cryptomatte of materials."""


@pytest.fixture
def manifests(build, translate):
    """Texts of the manifests of a picture with one object without and one with a material."""
    from blender_addon.translate.passes import cryptomatte_header

    build.plane("Plätte 中")
    build.plane("Other", material=build.material("m é", "ShaderNodeEmission"))
    scene = translate()
    wanted = replace(scene.settings, passes=Passes(("CryptoObject", "CryptoMaterial")))
    entries = cryptomatte_header(replace(scene, settings=wanted), bpy.context.evaluated_depsgraph_get())
    return {entries[key.replace("manifest", "name")]: text for key, text in entries.items() if "manifest" in key}


def test_an_object_without_a_material_has_the_id_that_cycles_gives_it(manifests):
    """Its id was that of the name "No material", by which no node of Blender finds it."""
    names = json.loads(manifests["ViewLayer.CryptoMaterial"])
    assert names == {name: OF_CYCLES[name] for name in ("default_surface", "m é")}


def test_names_beyond_ascii_are_written_as_they_are(manifests):
    """Blender's own reader knows no code such as "u00e4" after a backslash: it showed another name."""
    text = manifests["ViewLayer.CryptoObject"]
    assert '"Plätte 中"' in text and json.loads(text)["Plätte 中"] == OF_CYCLES["Plätte 中"]


def test_a_linked_material_has_its_plain_name(build, translate, tmp_path):
    """The library was a part of the hashed name."""
    path = str(tmp_path / "lib.blend")
    bpy.data.libraries.write(path, {build.material("Paint", "ShaderNodeEmission")}, fake_user=True)
    bpy.data.materials.remove(bpy.data.materials["Paint"])
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.materials = ["Paint"]
    build.plane(material=bpy.data.materials["Paint"])
    (material,) = translate().materials
    assert material.name != "Paint" and material.shown_as == "Paint"


def test_hair_and_points_have_the_names_of_their_objects(build, translate):
    """Those of Cycles; hair had the name of its particle system too, and further instances a number."""
    owner, group = build.plane("Owner"), bpy.data.collections.new("Group")
    owner.parent = build.plane("Parent")
    owner.modifiers.new("Hair", "PARTICLE_SYSTEM")
    owner.particle_systems[0].settings.type, owner.particle_systems[0].settings.count = "HAIR", 5
    curves = bpy.data.hair_curves.new("Curves")
    curves.add_curves([2])
    curves.attributes["position"].data.foreach_set("vector", [0, 0, 0, 0, 0, 1])
    group.objects.link(bpy.data.objects.new("Curves", curves))
    for k in range(2):
        empty = bpy.data.objects.new(f"Empty {k}", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    scene = translate()
    strands = {mesh.name for mesh in scene.meshes if mesh.is_strands}
    found = sorted((item.shown_as, item.asset) for item in scene.instances if item.mesh in strands)
    assert found == [("Curves", "Curves"), ("Curves", "Curves"), ("Owner", "Parent")]


def test_lamps_the_world_and_overridden_materials_are_listed(build, translate):
    """Cycles lists them, so that a name can be chosen before it is in the picture."""
    from blender_addon import compat
    from blender_addon.translate.passes import cryptomatte_header

    plain, lamp = build.plane(material=build.material("Paint", "ShaderNodeEmission")), build.light("SUN")
    lamp.name, lamp.data.name, lamp.parent = "Key", "Key data", plain
    compat.use_nodes(lamp.data)
    build.light("POINT").hide_render = True
    bpy.context.scene.world = bpy.data.worlds.new("Day")
    bpy.context.view_layer.material_override = build.material("Clay", "ShaderNodeEmission")
    scene, kinds = translate(), ("CryptoObject", "CryptoMaterial", "CryptoAsset")
    scene = replace(scene, settings=replace(scene.settings, passes=Passes(kinds)))
    entries = cryptomatte_header(scene, bpy.context.evaluated_depsgraph_get())
    found = {
        entries[key.replace("manifest", "name")]: set(json.loads(text))
        for key, text in entries.items()
        if "manif" in key
    }
    assert found == {
        "ViewLayer.CryptoObject": {"Plane", "Key"},
        "ViewLayer.CryptoMaterial": {"Clay", "Paint", "Key data"},
        "ViewLayer.CryptoAsset": {"Plane", "Day"},
    }
