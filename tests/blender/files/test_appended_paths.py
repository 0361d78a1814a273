# SPDX-License-Identifier: GPL-3.0-or-later
"""Relative paths of the extension's settings in data-blocks that were appended from another .blend, or made local."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from blender_addon import compat  # noqa: E402

TEXT = "//files/own.exr"
HERE = "//../library/files/own.exr"


@pytest.fixture
def library(blender: Any, tmp_path: Path) -> str:
    """A file with a material whose texture, spectra and group of nodes name files beside it; another one is open."""
    for name in ("library", "project"):
        (tmp_path / name).mkdir()
    material, group = bpy.data.materials.new("Paint"), bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree = compat.use_nodes(material)
    tree.nodes.new("ShaderNodeGroup").node_tree = group
    for place in (tree.nodes.new("SpectralSceneTexture"), group.nodes.new("SpectralSceneTexture"), material.spectral,
                  tree.nodes.new("ShaderNodeRGB").spectral, bpy.context.scene.spectral.recipe):  # fmt: skip
        place.filepath = TEXT
    bpy.data.meshes.new("Mesh").materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Painted", bpy.data.meshes["Mesh"]))
    bpy.context.scene.name = "From Library"
    blend = str(tmp_path / "library" / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    bpy.ops.wm.read_homefile(use_empty=True, app_template="")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "project" / "scene.blend"))
    return blend


def _paths(material: Any) -> list[str]:
    nodes = [*material.node_tree.nodes, *bpy.data.node_groups["Group"].nodes]
    return [
        material.spectral.filepath,
        *(node.filepath for node in nodes if node.bl_idname == "SpectralSceneTexture"),
        *(node.spectral.filepath for node in nodes if node.bl_idname == "ShaderNodeRGB"),
    ]


def _brought(library: str, folder: str, name: str, **how: Any) -> None:
    bring = bpy.ops.wm.link if how.pop("link", False) else bpy.ops.wm.append
    bring(directory=f"{library}/{folder}/", filename=name, **how)


@pytest.mark.parametrize(("folder", "name"), [("Material", "Paint"), ("Object", "Painted"), ("Scene", "From Library")])
def test_appended_data_keep_the_files(library: str, folder: str, name: str) -> None:
    _brought(library, folder, name)
    assert _paths(bpy.data.materials["Paint"]) == [HERE] * 4
    if folder == "Scene":
        assert bpy.data.scenes["From Library"].spectral.recipe.filepath == HERE


def test_data_that_are_used_again_are_not_moved_again(library: str) -> None:
    for _ in range(2):
        _brought(library, "Object", "Painted", do_reuse_local_id=True)
    assert len(bpy.data.materials) == 1
    assert _paths(bpy.data.materials["Paint"]) == [HERE] * 4


def test_an_unsaved_file_gets_whole_paths(library: str) -> None:
    bpy.ops.wm.read_homefile(use_empty=True, app_template="")
    _brought(library, "Material", "Paint")
    assert set(_paths(bpy.data.materials["Paint"])) == {str(Path(library).parent / TEXT[2:])}


def test_linked_data_keep_their_paths_until_mend_table_makes_them_local(library: str) -> None:
    _brought(library, "Material", "Paint", link=True)
    assert _paths(bpy.data.materials["Paint"]) == [TEXT] * 4
    row = bpy.context.scene.spectral.palette.materials.add()
    row.name, row.material = "Paint", bpy.data.materials["Paint"]
    row.material_name = "Paint"
    assert bpy.ops.spectral.palette_mend() == {"FINISHED"}
    material = row.material
    assert material.library is None
    assert material.spectral.filepath == HERE


def test_the_clipboard_keeps_the_paths(library: str, tmp_path: Path) -> None:
    """Its file is elsewhere, and what is pasted counts from the file that was copied from."""
    copied = tmp_path / "copybuffer.blend"
    Path(library).rename(copied)
    _brought(str(copied), "Material", "Paint")
    assert _paths(bpy.data.materials["Paint"]) == [TEXT] * 4
