# SPDX-License-Identifier: GPL-3.0-or-later
"""What passes hold of the world, against Cycles: AOVs of the world, mist, and what a transparent film omits."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba")
OpenEXR = pytest.importorskip("OpenEXR")

from tests.blender.cycles import settings as small_picture  # noqa: E402

SIZE = 24


@pytest.fixture
def scene(build):
    """A small square in front of a world, and both engines' settings."""
    made = bpy.context.scene
    small_picture(16, SIZE)
    build.plane(size=1.0, material=build.material()).location = (0.4, 0.3, 0)
    build.camera((0, 0, 4)).rotation_euler = (0.2, 0.1, 0)
    made.world = bpy.data.worlds.new("World")
    made.world.use_nodes = True
    made.world.cycles.sampling_method, made.world.cycles.sample_map_resolution = "MANUAL", 128
    made.spectral.render.samples, made.spectral.render.transport = 16, "RGB"
    return made


def both(tmp_path):
    """Channels of the multilayer file by name, of Cycles and of this renderer."""
    from blender_addon import compat

    scene, found = bpy.context.scene, []
    compat.set_image_format(scene.render.image_settings, "OPEN_EXR_MULTILAYER", color_depth="32")
    for engine in ("CYCLES", "SPECTRAL"):
        scene.render.engine, scene.render.filepath = engine, str(tmp_path / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
            channels = [item for part in file.parts for item in part.channels.items()]
            found.append({name.partition(".")[2]: np.array(each.pixels, np.float64) for name, each in channels})
    return found


def test_the_world_gives_values_to_aovs(scene, tmp_path):
    """They were 0 beside the objects, without a note."""
    layer, tree = bpy.context.view_layer, scene.world.node_tree
    for name, kind in (("way", "COLOR"), ("mark", "VALUE")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
        node = tree.nodes.new("ShaderNodeOutputAOV")
        node.aov_name, node.inputs["Value"].default_value = name, 0.75
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Camera"], node.inputs["Color"])
    theirs, ours = both(tmp_path)
    for name in ("way.R", "way.G", "way.B", "way.A", "mark.X"):
        assert np.abs(ours[name] - theirs[name]).mean() < 0.01, name
        assert np.abs(theirs[name]).max() > 0.1
    scene.render.film_transparent = True
    assert not any(each["mark.X"].any() for each in both(tmp_path))


def test_mist_of_depth_0_and_that_of_a_scene_without_a_world(scene, tmp_path):
    """The first was everywhere, and the second began at 5 m."""
    bpy.context.view_layer.use_pass_mist = True
    scene.world.mist_settings.start, scene.world.mist_settings.depth = 1.0, 0.0
    for world in (scene.world, None):
        scene.world = world
        theirs, ours = both(tmp_path)
        assert np.abs(ours["Mist.Z"] - theirs["Mist.Z"]).mean() < 0.01
        assert (theirs["Mist.Z"].min() == 0) == (world is not None)


def test_what_is_behind_transparent_glass(scene, build, tmp_path):
    """The environment that the picture omits there was in no pass, and albedo held it, and no lamps in reflections.

    Depth held the way to a surface that the camera does not see.
    """
    build.plane("Unseen", 0.9).visible_camera, bpy.data.objects["Unseen"].location.x = False, -0.8
    scene.objects["Plane"].data.materials[0] = build.material("Glass", "ShaderNodeBsdfGlass", Roughness=0.0, IOR=3.0)
    build.light("AREA", energy=20.0, location=(0, 0, 6), size=8.0)
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.2, 0.4, 0.6, 1)
    scene.render.film_transparent = scene.cycles.film_transparent_glass = True
    scene.cycles.samples = scene.spectral.render.samples = 64
    layer = bpy.context.view_layer
    layer.cycles.denoising_store_passes = True
    for shows in (True, False):
        layer.use_pass_environment = shows
        theirs, ours = both(tmp_path)
        held = ("Denoising Albedo.B", "Denoising Albedo.R", "Denoising Depth.Z", "Environment.B")
        for name in held if shows else held[:3]:
            means = [each[name].reshape(SIZE // 8, 8, SIZE // 8, 8).mean(axis=(1, 3)) for each in (theirs, ours)]
            assert np.abs(means[1] - means[0]).mean() < 0.1 * means[0].mean(), (name, means)
