# SPDX-License-Identifier: GPL-3.0-or-later
"""The copy of the file that a sweep renders may lie in another folder than the file, and what they name does not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from blender_addon import compat  # noqa: E402
from blender_addon.editing.board.paths import full_path, in_copy  # noqa: E402
from blender_addon.editing.sweep.documents import parameters_of, write_documents  # noqa: E402
from blender_addon.editing.sweep.node import blend_node  # noqa: E402
from spectral_core.explore.sweep.document import read_sweep  # noqa: E402
from spectral_core.palette.texture.file import write_texture  # noqa: E402
from spectral_core.palette.texture.reach import TEXTURE_GRID  # noqa: E402
from spectral_core.palette.texture.texture import SpectralTexture  # noqa: E402
from spectral_core.scene import SpectralImage  # noqa: E402
from spectral_core.spectra.catalogue import illuminant  # noqa: E402
from tests.blender_sweep.test_sweep_in_blender import KEY, scene  # noqa: E402, F401 - a fixture


def node_of_run(made: Any) -> Any:
    """The node of the run that the panel starts, which opens the copy."""
    documents = write_documents(made)
    document = read_sweep(documents.document)
    entries = {name: value for name, value in document.compute.items() if name != "kind"}
    return blend_node(entries, document.space, documents.folder.parent)


@pytest.mark.parametrize("folder", ["//sweep.cdb", "//far/away/sweep.cdb"])
def test_a_spectral_texture_with_a_relative_path_is_rendered_from_a_copy(
    scene: Any, tmp_path: Path, folder: str  # noqa: F811
) -> None:  # fmt: skip
    """Blender does not change the path of an extension's node where it copies the file: the pictures lacked it."""
    weights = np.linspace(0, 1, 2 * 4 * 4).reshape(2, 4, 4).astype(np.float16)
    band = np.clip((TEXTURE_GRID.wavelengths_nm - 520) / 60, 0, 1)
    write_texture(tmp_path / "wood.exr", SpectralTexture(weights, np.stack([band, 1 - band]), (illuminant("D65"),)))
    tree = compat.use_nodes(bpy.data.materials["Metal"])
    texture = tree.nodes.new("SpectralSceneTexture")
    tree.links.new(texture.outputs[0], tree.nodes["Glossy"].inputs["Color"])
    texture.filepath = "//wood.exr"
    bpy.ops.wm.save_as_mainfile(filepath=bpy.data.filepath)
    bpy.ops.spectral.sweep_add(target=KEY)
    scene.spectral.sweep.folder = folder
    node = node_of_run(scene)
    assert isinstance(node.scene({"key_energy": 3.0}, 0).materials[0].surface.color, SpectralImage)


def test_a_linked_setting_is_swept_in_a_copy_elsewhere(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    """Blender changes the path of the library in the copy; the setting was not found there."""
    library = tmp_path / "libs" / 'lamps "1".blend'
    library.parent.mkdir()
    bpy.data.libraries.write(str(library), {bpy.data.objects["Key"]})
    with bpy.data.libraries.load(str(library), link=True, relative=True) as (_, given):
        given.objects = ["Key"]
    linked = given.objects[0]
    scene.collection.objects.link(linked)
    bpy.ops.wm.save_as_mainfile(filepath=bpy.data.filepath)
    path = full_path(linked.data, "energy")
    assert bpy.ops.spectral.sweep_add(target=path) == {"FINISHED"}
    assert in_copy(path, tmp_path) == path  # beside the file: earlier sweeps can be continued
    scene.spectral.sweep.folder = "//out/deep/sweep.cdb"
    assert parameters_of(scene.spectral.sweep)[0].path == path.replace("//", "//../../")
    powers = {light.power_w for light in node_of_run(scene).scene({"key_energy": 3.0}, 0).lights}
    assert powers == {3.0, 300.0}
