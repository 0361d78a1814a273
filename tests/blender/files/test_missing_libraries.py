# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes of the command line on linked libraries: what a picture lacks is named, and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def linking(blender: Any, tmp_path: Path) -> Path:
    """A file that links two objects of library.blend; it is open."""
    for name in ("Kept", "Lost"):
        bpy.ops.mesh.primitive_cube_add()
        bpy.context.object.name = name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.objects = ["Kept", "Lost"]
    for each in bpy.data.objects:
        bpy.context.scene.collection.objects.link(each)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "main.blend"))
    bpy.ops.file.make_paths_relative()
    bpy.ops.wm.save_mainfile()
    return tmp_path


def reopened(folder: Path) -> list[str]:
    from blender_addon.commands._blend import missing_files

    bpy.ops.wm.open_mainfile(filepath=str(folder / "main.blend"))
    return missing_files()


def test_a_packed_library_is_not_missing(linking: Path) -> None:
    """Its contents were called missing in a picture that showed them."""
    bpy.ops.file.pack_libraries()
    bpy.ops.wm.save_mainfile()
    (linking / "library.blend").unlink()
    assert reopened(linking) == []
    assert len(bpy.data.objects["Kept"].data.vertices) == 8


def test_packed_data_are_not_missing(linking: Path) -> None:
    """As Link with Pack makes them, from Blender 5.0 on."""
    if "is_archive" not in bpy.types.Library.bl_rna.properties:
        pytest.skip("this Blender packs whole libraries alone")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(linking / "library.blend"), link=True, pack=True) as (_, into):
        into.objects = ["Kept"]
    bpy.context.scene.collection.objects.link(into.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(linking / "main.blend"))
    (linking / "library.blend").unlink()
    assert reopened(linking) == []


def test_what_a_library_no_longer_has_is_named(linking: Path) -> None:
    """A renamed object of the library was missing in the picture without a word."""
    assert reopened(linking) == []
    bpy.ops.wm.open_mainfile(filepath=str(linking / "library.blend"))
    bpy.data.objects["Lost"].name = "Found"
    bpy.ops.wm.save_mainfile()
    text = "library.blend: the linked library //library.blend does not have object 'Lost'"
    assert reopened(linking) == [text]


def test_a_library_that_is_gone_or_damaged_is_named(linking: Path) -> None:
    (linking / "library.blend").write_bytes(b"no blend")
    named = "library.blend: the linked library //library.blend"
    assert reopened(linking) == [f"{named} cannot be read; its contents are missing"]
    (linking / "library.blend").unlink()
    assert reopened(linking) == [f"{named} was not found; its contents are missing"]
