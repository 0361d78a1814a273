# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender writes, on a disk that is full: the system ends each file at a limit."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import pytest

from spectral_core.errors import FileWriteError

bpy = pytest.importorskip("bpy")
resource = pytest.importorskip("resource", reason="needs a limit on the size of files")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Blender may not ignore the signal of the limit")


@contextmanager
def files_of_at_most(size):
    """No file of this process and of those that it starts grows beyond so many bytes.

    Compiled modules are not kept: Python 3.11 would keep them truncated, and could never import them again.
    """
    before, kept = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONDONTWRITEBYTECODE", "1")
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
            sys.dont_write_bytecode = kept


@pytest.mark.parametrize("size", [0, 100])
@pytest.mark.parametrize("ending", [".png", ".exr"])
def test_a_relit_picture_on_a_full_disk_keeps_the_earlier_file(dial, tmp_path, ending, size):
    """An empty file replaced it, and the message was "saved"."""
    path = tmp_path / f"night{ending}"
    path.write_bytes(b"the picture of yesterday")
    with files_of_at_most(size), pytest.raises(RuntimeError, match=f"night{ending} could not be written"):
        bpy.ops.spectral.dial_save(filepath=str(path))
    assert path.read_bytes() == b"the picture of yesterday"
    assert sorted(each.name for each in tmp_path.glob("*night*")) == [path.name]
    assert bpy.ops.spectral.dial_save(filepath=str(path)) == {"FINISHED"}
    assert path.stat().st_size > 100


def test_a_table_of_the_view_is_not_made_from_a_part_of_its_picture(stage):
    from blender_addon.translate.display.transform import shown_pixels

    linear = np.random.default_rng(2).random((90, 90, 3))
    with files_of_at_most(9000), pytest.raises(FileWriteError, match="could not write a temporary picture"):
        shown_pixels(stage, linear)
    assert shown_pixels(stage, linear).mean() > 0.5


def test_colors_of_an_image_are_not_converted_by_a_part_of_their_file(stage):
    from blender_addon.translate.shading.image_files.color_spaces import scene_linear

    colors = np.random.default_rng(2).random((60, 60, 3))
    with files_of_at_most(9000), pytest.raises(FileWriteError, match="could not write a temporary picture"):
        scene_linear(colors, "ACEScg")
    assert np.isfinite(scene_linear(colors, "ACEScg")).all()


def test_grids_of_nodes_are_not_rendered_from_a_part_of_their_file(stage):
    from blender_addon.translate.volumes import SavedGrids

    tree = bpy.data.node_groups.new("Grids", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube, noise = tree.nodes.new("GeometryNodeVolumeCube"), tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], cube.inputs["Density"])
    tree.links.new(cube.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    made = bpy.data.objects.new("Cloud", bpy.data.volumes.new("Cloud"))
    stage.collection.objects.link(made)
    made.modifiers.new("grids", "NODES").node_group = tree
    data = made.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    with files_of_at_most(50_000), pytest.raises(FileWriteError, match="could not write the grids of volume"):
        SavedGrids(data)
    assert SavedGrids(data).path.stat().st_size > 50_000


COMMAND = """
import resource, sys
from blender_addon.commands import main
resource.setrlimit(resource.RLIMIT_FSIZE, (300, resource.RLIM_INFINITY))
for out in sys.argv[2:]:
    print(main(["render", sys.argv[1], "--out", out]), file=sys.stderr)
"""


def test_a_command_does_not_deliver_a_part_of_a_picture(stage, tmp_path):
    """It ended with status 0, and named the file as written."""
    outs = [tmp_path / f"picture{ending}" for ending in (".png", ".exr", ".jpg", ".tif")]
    words = [sys.executable, "-c", COMMAND, bpy.data.filepath, *map(str, outs)]
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}  # no truncated modules, as above
    ended = subprocess.run(words, capture_output=True, text=True, check=False, env=environment)
    told = ended.stderr.splitlines()
    assert [line for line in told if line in ("0", "1", "None")] == ["1"] * len(outs), ended.stderr
    assert sum("frame" in line for line, status in pairwise(told) if status == "1") == len(outs)
    assert not any(out.exists() for out in outs) and "Traceback" not in ended.stderr
