# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables whose scene is linked, or whose lamps and materials belong to linked objects: nothing is written in vain."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

LOCAL_COPY = "a local copy would not change them"
CHANGES = [
    ("palette_add", {}), ("palette_remove", {}), ("palette_move", {}), ("palette_spread", {}), ("palette_solve", {}),
    ("palette_refer", {}), ("palette_dye", {}), ("palette_lamp_add", {}), ("palette_lamp_remove", {}),
    ("palette_preset", {"preset": "HIDDEN_MARK"}), ("palette_clear", {}), ("palette_apply", {}), ("palette_mend", {}),
    ("palette_relieve", {}), ("palette_from_scene", {}), ("palette_alternatives", {}), ("palette_possible", {}),
    ("palette_alternative_take", {}), ("palette_take_nearest", {}),
]  # fmt: skip


@pytest.fixture
def set_file(blender, tmp_path):
    """A library with a collection of a lamp and a painted object, and a world."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    painted = bpy.data.objects.new("Face", bpy.data.meshes.new("Face"))
    painted.data.materials.append(bpy.data.materials.new("Skin"))
    stage = bpy.data.collections.new("Set")
    for each in (lamp, painted):
        stage.objects.link(each)
    path = str(tmp_path / "set.blend")
    bpy.data.libraries.write(path, {stage, bpy.data.worlds.new("Sky")})
    blender.ops.wm.read_factory_settings(use_empty=True)
    return path


@pytest.fixture
def table(set_file):
    """A table of a file that links the collection and the world."""
    with bpy.data.libraries.load(set_file, link=True) as (_, wanted):
        wanted.collections, wanted.worlds = ["Set"], ["Sky"]
    scene = bpy.context.scene
    scene.collection.children.link(wanted.collections[0])
    scene.world = wanted.worlds[0]
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = scene.spectral.palette
    palette.lights[0].light, palette.materials[0].material = bpy.data.lights["Lamp"], bpy.data.materials["Skin"]
    palette.lights[1].world = scene.world
    return palette


def shown() -> list:
    """The lamp and the material that the scene's objects have."""
    objects = bpy.context.scene.objects
    return [objects["Lamp"].data, objects["Face"].material_slots[0].material]


def test_what_only_linked_objects_use_stays_linked(table) -> None:
    with pytest.raises(RuntimeError, match=LOCAL_COPY):
        bpy.ops.spectral.palette_apply(make_local=True)
    assert table.lights[1].world.library is not None  # nothing was changed
    bpy.ops.spectral.palette_mend()
    assert table.lights[1].world.library is None
    assert [table.lights[0].light, table.materials[0].material] == shown()
    assert not [each for each in (*bpy.data.lights, *bpy.data.materials) if each.name == "Skin" and not each.library]


def test_the_stated_remedy_lets_apply_reach_the_objects(table) -> None:
    for each in bpy.context.view_layer.objects:
        each.select_set(True)
    bpy.ops.object.make_local(type="ALL")
    assert bpy.ops.spectral.palette_apply(make_local=True) == {"FINISHED"}
    for block, entry in zip(shown(), (table.lights[0], table.materials[0]), strict=True):
        values = [[sample.value for sample in each.samples] for each in (block.spectral, entry.result)]
        np.testing.assert_array_equal(*values)


def test_a_local_object_gets_the_local_material_and_the_linked_one_is_told(table, capfd) -> None:
    own = bpy.data.objects.new("Own", bpy.data.meshes.new("Own"))
    own.data.materials.append(bpy.data.materials["Skin"])
    bpy.context.scene.collection.objects.link(own)
    bpy.ops.spectral.palette_mend()
    assert own.data.materials[0] == table.materials[0].material and own.data.materials[0].library is None
    assert "Skin is local now; objects that are linked from set.blend keep the linked one" in capfd.readouterr().out


def test_a_light_that_only_tables_of_copied_scenes_name_is_unused(blender) -> None:
    from blender_addon.editing.palette import bindings

    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    scene = bpy.context.scene
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    scene.spectral.palette.lights[0].light = lamp.data
    blender.ops.scene.new(type="LINK_COPY")
    copy = bpy.context.scene
    assert copy.spectral.palette.lights[0].light == lamp.data
    assert bindings.faults(copy.spectral.palette) == []
    bpy.data.objects.remove(lamp)
    for each in (scene, copy):
        assert [fault.kind for fault in bindings.faults(each.spectral.palette)] == ["unused"]


@pytest.fixture
def linked_scene(blender, tmp_path):
    """A scene with a table, linked from another file and shown in the window."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    bpy.context.scene.name = "Master"
    bpy.data.libraries.write(str(tmp_path / "master.blend"), {bpy.context.scene})
    blender.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "master.blend"), link=True) as (_, wanted):
        wanted.scenes = ["Master"]
    bpy.context.window.scene = wanted.scenes[0]
    return wanted.scenes[0]


def written(scene) -> str:
    """All that the table of a scene has."""
    table = scene.spectral.palette
    cells = [(cell.mode, *cell.actual_linear) for row in table.materials for cell in row.cells]
    spectra = [[sample.value for sample in each.result.samples] for each in (*table.lights, *table.materials)]
    return repr((cells, spectra, table.status, table.is_stale, table.message))


@pytest.mark.parametrize(("name", "options"), CHANGES, ids=[name for name, _ in CHANGES])
def test_the_table_of_a_linked_scene_is_not_changed(linked_scene, name, options) -> None:
    before = written(linked_scene)
    with pytest.raises(RuntimeError, match=r"scene 'Master' is linked from master\.blend"):
        getattr(bpy.ops.spectral, name)(**options)
    assert written(linked_scene) == before


@pytest.mark.parametrize(("name", "options"), [("look_split", {}), ("look_under", {"kind": "LAMP", "name": "HP1"})])
def test_the_look_of_a_linked_scene_is_not_changed(linked_scene, name, options) -> None:
    with pytest.raises(RuntimeError, match=r"scene 'Master' is linked from master\.blend.*changes of its look"):
        getattr(bpy.ops.spectral, name)(**options)
    settings = linked_scene.spectral.viewport
    assert not settings.is_split and settings.look.kind == settings.other.kind == "SCENE"


def test_the_table_of_a_linked_scene_is_read_and_copied(linked_scene, tmp_path) -> None:
    assert bpy.ops.spectral.palette_export(filepath=str(tmp_path / "master.toml")) == {"FINISHED"}
    assert bpy.ops.spectral.spectra_export(filepath=str(tmp_path / "master")) == {"FINISHED"}
    bpy.ops.scene.new(type="FULL_COPY")
    assert bpy.context.scene.library is None
    assert bpy.ops.spectral.palette_solve() == {"FINISHED"}
    assert bpy.context.scene.spectral.palette.status == "solved"
