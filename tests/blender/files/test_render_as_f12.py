# SPDX-License-Identifier: GPL-3.0-or-later
"""``spectral-scene render`` shows the moment, the frame and the passes that F12 shows."""

from __future__ import annotations

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


@pytest.fixture
def scene(build):
    """A luminous square that fills the right half of an orthographic picture of 16 × 8 pixels."""
    made = bpy.context.scene
    made.render.resolution_x, made.render.resolution_y = 16, 8
    made.spectral.render.samples = 4
    build.camera(type="ORTHO", ortho_scale=4.0)
    glow = build.material("Glow", "ShaderNodeEmission", Color=(0.5, 0.5, 0.5, 1))
    build.plane("Square", size=4, material=glow).location.x = 2
    return made


@pytest.fixture
def render(tmp_path, capfd):
    """Save the open file, render it by the command, and give its report."""
    from blender_addon.commands import main

    def run(*options, out="out.exr"):
        path = tmp_path / "scene.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        assert main(["render", str(path), "--out", str(tmp_path / out), "--json", *map(str, options)]) == 0
        return json.loads(capfd.readouterr().out.splitlines()[-1])

    return run


def channels(path):
    """Header and channels of the first part of an EXR, the first row on top."""
    part = pytest.importorskip("OpenEXR").File(str(path), separate_channels=True).parts[0]
    return part.header, {name: channel.pixels for name, channel in part.channels.items()}


def test_the_moment_between_frames_is_that_of_the_file(scene, render):
    """It was rendered at the frame before, where the square is out of sight."""
    square = scene.objects["Square"]
    for frame, x in ((1, 20.0), (2, -16.0)):  # the middle of both is 2
        square.location.x = x
        square.keyframe_insert("location", frame=frame)
    scene.frame_set(1, subframe=0.5)
    lit = channels(render()["files"][0])[1]["R"]
    assert lit[:, 9:].min() > 0.4 and lit[:, :7].max() == 0
    at_a_frame = channels(render("--frame", 1)["files"][0])[1]["R"]
    assert at_a_frame.max() == 0


@pytest.mark.parametrize("crops", [False, True])
def test_bands_have_the_frame_and_the_pixels_of_f12(scene, render, crops):
    """They held the region of the border alone, and square pixels."""
    scene.render.pixel_aspect_x = 2.0
    scene.render.use_border, scene.render.use_crop_to_border = True, crops
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 0.75
    plain, picture = channels(render(out="plain.exr")["files"][0])
    header, bands = channels(render("--bands", 3)["files"][0])
    assert picture["R"].shape == ((2, 8) if crops else (8, 16))
    assert header["pixelAspectRatio"] == plain["pixelAspectRatio"] == 2.0
    for name in ("A", "S0.550,000000nm"):
        np.testing.assert_array_equal(bands[name] > 0, picture["A" if name == "A" else "R"] > 0)


def test_bands_leave_other_scenes_of_the_compositor_out(scene, render):
    """Their view layers have the same names: the command failed after both scenes were rendered."""
    scene.render.engine = "SPECTRAL"
    other = scene.copy()
    if hasattr(scene, "compositing_node_group"):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Both", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        end = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree, end = scene.node_tree, next(node for node in scene.node_tree.nodes if node.type == "COMPOSITE")
    layers = tree.nodes.new("CompositorNodeRLayers")
    layers.scene = other
    tree.links.new(layers.outputs[0], end.inputs[0])
    report = render("--bands", 3)
    assert len(report["files"]) == 1 and channels(report["files"][0])[1]["S0.550,000000nm"].max() > 0


def test_the_report_names_the_passes_of_every_view_layer(scene, render):
    """It named those of the last one."""
    scene.view_layers[0].use_pass_position = True
    scene.view_layers.new("Last").use_pass_object_index = True
    assert render("--multilayer")["frames"][0]["passes"] == ["Position", "Object Index"]


def test_the_report_names_passes_that_are_in_the_file_alone(scene, render):
    """It named those that the view layer has ticked, beside a picture that holds none."""
    scene.view_layers[0].use_pass_position = True
    assert render()["frames"][0]["passes"] == []
