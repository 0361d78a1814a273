# SPDX-License-Identifier: GPL-3.0-or-later
"""The sweep of a .blend: add numbers, run, extend, apply a point, keyframe a path, and the same by command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

KEY = 'bpy.data.lights["Key"].energy'
ROUGH = 'bpy.data.materials["Metal"].node_tree.nodes["Glossy"].inputs[1].default_value'
HEIGHT = 'bpy.data.objects["Camera"].location[2]'


@pytest.fixture
def scene(blender, tmp_path):
    from blender_addon import compat

    made = bpy.context.scene
    made.render.engine = "SPECTRAL"
    made.render.resolution_x, made.render.resolution_y = 32, 24
    bpy.ops.mesh.primitive_plane_add(size=8)
    material = bpy.data.materials.new("Metal")
    tree = compat.use_nodes(material)
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfGlossy")
    node.name = "Glossy"
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    light = bpy.data.lights.new("Key", "POINT")
    light.energy, light.shadow_soft_size = 300.0, 0.5
    lamp = bpy.data.objects.new("Key", light)
    lamp.location = (1, 1, 3)
    made.collection.objects.link(lamp)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -5, 3), (1.1, 0, 0)
    made.collection.objects.link(camera)
    made.camera = camera
    made.spectral.sweep.percentage, made.spectral.sweep.samples, made.spectral.sweep.budget = 100, 4, 3
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return made


def add(path: str, low: float, high: float):
    bpy.ops.spectral.sweep_add(target=path)
    entry = bpy.context.scene.spectral.sweep.parameters[path]
    entry.low, entry.high = low, high
    return entry


@pytest.mark.slow
def test_three_properties_are_swept_applied_and_keyframed(scene, tmp_path):
    from blender_addon.editing.sweep import live as editing

    entry = add(KEY, 100, 1000)
    entry.scale = "log"
    add(ROUGH, 0.1, 0.9)
    add(HEIGHT, 2, 5)
    assert [each.label for each in scene.spectral.sweep.parameters] == [
        "key_energy",
        "metal_roughness",
        "camera_location_z",
    ]
    assert bpy.ops.spectral.sweep_estimate() == {"FINISHED"}
    assert bpy.ops.spectral.sweep_run() == {"FINISHED"}, scene.spectral.sweep.status
    rows = editing.rows(scene)
    assert len(rows) == 3 and (tmp_path / "sweep.cdb" / rows[0].files["FILE"]).is_file()
    assert bpy.ops.spectral.sweep_apply(row=2) == {"FINISHED"}
    assert bpy.data.lights["Key"].energy == pytest.approx(rows[1].parameters["key_energy"], rel=1e-6)
    assert bpy.data.objects["Camera"].location[2] == pytest.approx(rows[1].parameters["camera_location_z"], rel=1e-6)
    # applying a point changes the file, and the sweep still continues
    scene.spectral.sweep.budget = 5
    assert bpy.ops.spectral.sweep_run() == {"FINISHED"}, scene.spectral.sweep.status
    more = editing.rows(scene)
    assert [row.key for row in more[:3]] == [row.key for row in rows] and len(more) == 5
    assert [row.outcome for row in more[:3]] == [row.outcome for row in rows]
    assert bpy.ops.spectral.sweep_keyframe(rows="1, 3", step=10) == {"FINISHED"}
    scene.frame_set(scene.frame_current + 10)
    assert bpy.data.lights["Key"].energy == pytest.approx(more[2].parameters["key_energy"], rel=1e-5)
    # the light makes the picture brighter
    brightness = np.array([row.outcome["lab_lightness"] for row in more])
    energy = np.array([row.parameters["key_energy"] for row in more])
    assert np.corrcoef(np.log(energy), brightness)[0, 1] > 0.3


@pytest.mark.slow
def test_a_swept_light_is_relit_and_equals_a_render(scene, tmp_path):
    from blender_addon.editing.sweep.node import BlendNode
    from spectral_core.explore.sweep.compute.rendering import rendered
    from spectral_core.explore.sweep.parameters import Parameter, Space

    space = Space((Parameter("energy", 10, 1000, path=KEY),))
    node = BlendNode.of(tmp_path / "scene.blend", space, samples=4)
    assert node.relights
    for energy in (50.0, 700.0):
        relit = node({"energy": energy}, 3).pictures[""]
        alone = rendered(node.scene({"energy": energy}, 3)).pictures[""]
        assert np.abs(relit[..., :3] - alone[..., :3]).max() < 1e-4 * max(1.0, float(alone.max()))


@pytest.mark.parametrize(
    "path",
    ['bpy.data.lights["None"].energy', "__import__('os')", 'bpy.data.lights["Key"].nothing',
    'bpy.data.lights["Key"].energy; 1',
     'bpy.data.objects["Camera"].location[7]', 'bpy.data.objects["Camera"].__class__', "../x", ""],
)  # fmt: skip
def test_an_error_names_a_path_that_does_not_exist(scene, path):
    with pytest.raises(RuntimeError):
        bpy.ops.spectral.sweep_add(target=path)
    assert len(scene.spectral.sweep.parameters) == 0


@pytest.mark.slow
def test_the_command_line_sweeps_a_file_and_reports_a_wrong_path(scene, tmp_path, capsys):
    from blender_addon.commands import main

    text = """[compute]
kind = "blend"
blend = "scene.blend"
samples = 2
percentage = 50
[design]
budget = 2
[[parameters]]
name = "height"
path = 'bpy.data.objects["Camera"].location[2]'
low = 2.0
high = 4.0
"""
    (tmp_path / "good.toml").write_text(text)
    (tmp_path / "bad.toml").write_text(text.replace("Camera", "Kamera"))
    command = [sys.executable, "-m", "blender_addon", "sweep", "--json"]
    good = subprocess.run([*command, str(tmp_path / "good.toml"), "--out", str(tmp_path / "good")], capture_output=True,
                          text=True, check=False, cwd=Path(__file__).parents[2])  # fmt: skip
    assert good.returncode == 0, good.stderr
    assert json.loads(good.stdout.splitlines()[-1])["computed"] == 2
    # another process would load Blender once more
    assert main(["sweep", str(tmp_path / "bad.toml"), "--out", str(tmp_path / "bad")]) == 1
    assert "Kamera" in capsys.readouterr().err


def test_columns_have_the_names_of_sockets_and_components(scene):
    color = ROUGH.replace("inputs[1].default_value", "inputs[0].default_value[1]")
    turn = 'bpy.data.objects["Camera"].rotation_euler[0]'
    for path in (ROUGH, color, turn, turn.replace("[0]", "[1]")):
        bpy.ops.spectral.sweep_add(target=path)
    assert [each.label for each in scene.spectral.sweep.parameters] == [
        "metal_roughness", "metal_color_g", "camera_rotation_euler_x", "camera_rotation_euler_y"
    ]  # fmt: skip


def test_a_number_is_removed_and_a_sweep_without_a_run_cannot_be_cancelled_or_opened(scene):
    add(KEY, 1, 2)
    assert bpy.ops.spectral.sweep_remove(index=0) == {"FINISHED"}
    assert len(scene.spectral.sweep.parameters) == 0
    with pytest.raises(RuntimeError, match="there is no parameter 0"):
        bpy.ops.spectral.sweep_remove(index=0)
    with pytest.raises(RuntimeError, match="no sweep is running"):
        bpy.ops.spectral.sweep_cancel()
    with pytest.raises(RuntimeError, match="there is no sweep in"):
        bpy.ops.spectral.sweep_open(browse=False)


def test_a_sweep_without_parameters_is_refused(scene):
    with pytest.raises(RuntimeError, match="nothing is swept"):
        bpy.ops.spectral.sweep_run()
