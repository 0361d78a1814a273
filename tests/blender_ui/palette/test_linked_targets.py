# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons on data that are linked from another file or overridden: Blender would lose what they write."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def linked(blender, tmp_path):
    """Link objects by name from a library; with ``overridden`` they are library overrides."""
    from blender_addon import compat

    blender.ops.wm.read_factory_settings(use_empty=True)
    material = bpy.data.materials.new("Skin")
    compat.use_nodes(material)
    material.spectral.source, material.spectral.catalogue_name = "CATALOGUE", "dark skin"
    bare = bpy.data.objects.new("Bare", bpy.data.meshes.new("Bare"))
    made = [bpy.data.objects.new(name, bpy.data.meshes.new(name)) for name in ("Painted",)]
    made[0].data.materials.append(material)
    made += [bare, bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke"))]
    made += [bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))]
    made[-2].data.spectral.materials.add()
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), set(made))
    blender.ops.wm.read_factory_settings(use_empty=True)

    def load(name, *, overridden=False):
        with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
            wanted.objects = [name]
        found = wanted.objects[0]
        bpy.context.scene.collection.objects.link(found)
        found = found.override_create(remap_local_usages=True) if overridden else found
        bpy.context.view_layer.objects.active = found
        return found

    return load


@pytest.fixture
def texture(tmp_path):
    """A file in the place of a designed texture, which is named in a warning."""
    path = tmp_path / "texture.exr"
    path.write_bytes(b"no texture")
    bpy.context.scene.spectral.texture.texture_file = str(path)


def test_the_spectrum_of_a_linked_material_is_not_read_again(linked) -> None:
    material = linked("Painted").active_material
    material.spectral.samples.clear()
    with pytest.raises(RuntimeError, match="material 'Skin' is linked from library.blend"):
        bpy.ops.spectral.spectrum_reload(carrier="MATERIAL")
    assert not len(material.spectral.samples)
    material.node_tree.nodes.active = material.node_tree.nodes["Principled BSDF"]
    with pytest.raises(RuntimeError, match="is linked from library.blend"):
        bpy.ops.spectral.spectrum_reload(carrier="NODE")


def test_a_linked_transfer_function_is_not_changed(linked) -> None:
    volume = linked("Smoke").data
    for press in (bpy.ops.spectral.volume_material_remove, bpy.ops.spectral.volume_curve_add):
        with pytest.raises(RuntimeError, match="volume 'Smoke' is linked from library.blend"):
            press()
    assert len(volume.spectral.materials) == 1


@pytest.mark.parametrize(("name", "overridden"), [("Painted", False), ("Bare", False), ("Bare", True)])
def test_a_linked_object_gets_no_texture(linked, texture, name, overridden) -> None:
    linked(name, overridden=overridden)
    before = len(bpy.data.materials)
    with pytest.raises(RuntimeError, match=f"'{name}' is linked from library.blend and cannot get the material"):
        bpy.ops.spectral.texture_material()
    assert len(bpy.data.materials) == before


def test_an_overridden_object_gets_the_texture_in_its_own_slot(linked, texture, tmp_path) -> None:
    linked("Painted", overridden=True)
    assert bpy.ops.spectral.texture_material() == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    shown = next(each for each in bpy.data.objects if each.name == "Painted" and each.library is None)
    assert shown.material_slots[0].material.name == "Spectral Texture"


def test_lights_of_a_texture_are_given_to_both_lamps_or_to_none(linked, texture, tmp_path) -> None:
    (tmp_path / "lights.csv").write_text("wavelength,first,second\n400,1,0.2\n550,1,1\n700,1,0.5\n", "utf-8")
    design = bpy.context.scene.spectral.texture
    design.lamp_1, design.lamp_2 = bpy.data.lights.new("Own", "POINT"), linked("Lamp").data
    with pytest.raises(RuntimeError, match="'Lamp' is linked from library.blend"):
        bpy.ops.spectral.texture_lights()
    assert design.lamp_1.spectral.source == "NONE"


def test_the_dial_does_not_dim_what_an_override_loses(linked) -> None:
    from blender_addon.editing.dial.dimming import apply_weights
    from blender_addon.editing.dial.members import Member, store_members
    from spectral_core.errors import InvalidInputError

    lamp = linked("Lamp", overridden=True)
    lamp.data.override_create(remap_local_usages=True)
    bulbs = bpy.context.scene.spectral.dial.bulbs
    bulbs.add().name = "Lamp"
    store_members(bulbs, [Member("Lamp", lamp.session_uid, -1, "", 100.0)])
    with pytest.raises(InvalidInputError, match="'Lamp' is a library override, which does not keep its strength"):
        apply_weights(bulbs, [0.5])
    lamp.data = lamp.data.copy()
    lamp.data.make_local(clear_liboverride=True)
    assert apply_weights(bulbs, [0.5]) == 1
    assert lamp.data.energy == 50.0
