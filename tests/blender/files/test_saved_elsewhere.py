# SPDX-License-Identifier: GPL-3.0-or-later
"""Relative paths of the extension's settings after the .blend was saved into another folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from blender_addon import compat  # noqa: E402

TEXT = "//files/own.exr"


@pytest.fixture
def settings(blender: Any, tmp_path: Path) -> list[tuple[Any, str]]:
    """Paths of a saved file: of nodes, of spectra on data and on nodes, and of a scene."""
    scene, material = bpy.context.scene, bpy.data.materials.new("Paint")
    material.use_fake_user = True
    tree = compat.use_nodes(material)
    color = tree.nodes.new("ShaderNodeRGB")
    texture, lamp = tree.nodes.new("SpectralSceneTexture"), bpy.data.lights.new("Lamp", "POINT")
    lamp.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one" / "scene.blend"))
    found = [(texture, "filepath"), (material.spectral, "filepath"), (lamp.spectral, "filepath"),
             (color.spectral, "filepath"), (scene.spectral.recipe, "filepath"),
             (scene.spectral.texture, "texture_file")]  # fmt: skip
    for group, name in found:
        setattr(group, name, TEXT)
    scene.spectral.dial.filepath = "//dial.transport.exr"
    lamp.spectral.message = texture.message = ""
    return found


@pytest.fixture(autouse=True)
def _folders(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name / "deep").mkdir(parents=True)


def test_a_save_into_another_folder_keeps_the_files(settings: list[tuple[Any, str]], tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two" / "deep" / "scene.blend"))
    assert {getattr(*place) for place in settings} == {"//../../one/files/own.exr"}
    assert bpy.context.scene.spectral.dial.filepath == "//dial.transport.exr", "a recording is copied beside the file"
    assert not settings[0][0].message and not settings[2][0].message, "nothing is read again"
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    path = bpy.path.abspath(bpy.data.lights["Lamp"].spectral.filepath)
    assert Path(path).resolve() == (tmp_path / "one" / "files" / "own.exr").resolve()


def test_a_copy_has_paths_of_its_own_and_leaves_the_open_file(settings: list[tuple[Any, str]], tmp_path: Path) -> None:
    copy = tmp_path / "two" / "copy.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(copy), copy=True)
    assert {getattr(*place) for place in settings} == {TEXT}
    bpy.ops.wm.open_mainfile(filepath=str(copy))
    assert bpy.context.scene.spectral.recipe.filepath == "//../one/files/own.exr"


def test_a_save_that_fails_changes_nothing(settings: list[tuple[Any, str]], tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="annot open"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "absent" / "scene.blend"))
    assert {getattr(*place) for place in settings} == {TEXT}


def test_a_save_in_the_same_folder_changes_nothing(settings: list[tuple[Any, str]], tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one" / "other.blend"))
    assert {getattr(*place) for place in settings} == {TEXT}


def test_folders_that_are_links_keep_the_files(settings: list[tuple[Any, str]], tmp_path: Path) -> None:
    """`..` in a linked folder leads out of the folder that the link points to."""
    (tmp_path / "one" / "files").mkdir()
    (tmp_path / "one" / "files" / "own.exr").touch()
    (tmp_path / "link").symlink_to(tmp_path / "two" / "deep", target_is_directory=True)
    for folder in ("link", "one/deep", "two"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / folder / "scene.blend"))
        assert all(Path(bpy.path.abspath(getattr(*place))).is_file() for place in settings), folder


def test_a_file_opened_through_a_link_keeps_the_files(blender: Any, tmp_path: Path) -> None:
    own = tmp_path / "one" / "own.exr"
    own.touch()
    (tmp_path / "link").symlink_to(tmp_path / "two" / "deep", target_is_directory=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "link" / "scene.blend"))
    bpy.context.scene.spectral.recipe.filepath = "//../../one/own.exr"  # from two/deep
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two" / "scene.blend"))
    assert Path(bpy.path.abspath(bpy.context.scene.spectral.recipe.filepath)).samefile(own)
