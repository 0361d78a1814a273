# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns and skies of worlds, types of rays, bent normals and attributes equal those of Cycles, without a note."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import Options

pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

SCENES = (
    "world/sky multiple_scattering", "world/gradient spherical", "inputs/light path Ray Length",
    "textures/displacement bump", "inputs/attribute of the object", "combined/steep bump of BsdfPrincipled",
    "combined/attribute stored on instances", "combined/emissive cube not visible to diffuse",
    "lamp trees/image on a spot by UV", "lamp trees/point of soft falloff that touches the floor",
    "lamp trees/mix of emissions by a pattern", "shown/plastic under a world not visible to diffuse",
    "mixed/displacement displacement",
    "combined/tangent of a UV map by name", "combined/transparent by Transparent Depth",
)  # fmt: skip


@pytest.mark.slow
def test_features_agree_with_cycles(blender):
    from benchmarks.render import render_features

    found = render_features.run(Options(quick=True, extra=list(SCENES)))["scenes"]
    assert {name: row["verdict"] for name, row in found.items()} == dict.fromkeys(SCENES, render_features.AGREES), found


def test_the_sun_of_a_sky_is_a_light(build, translate):
    import bpy

    from blender_addon import compat

    build.camera()
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = 0.5, 0.25
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 2.0
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    scene = translate()
    (sun,) = scene.lights
    # north is +y, and a sky's sun turns clockwise from there
    expected = (np.cos(0.5) * np.sin(0.25), np.cos(0.5) * np.cos(0.25), np.sin(0.5))
    np.testing.assert_allclose(sun.world_from_light[:3, 2], expected, atol=1e-6)
    # a little over half of the 1361 W/m² outside the atmosphere arrives as light; Blender's unit is about 10 W/m²
    assert 100 < sun.irradiance < 400 and scene.world.is_image
    sky.sun_disc = False
    assert translate().lights == ()


def test_the_camera_can_see_another_background_than_the_light_source(build, translate):
    """Uses a tree of Math nodes on Is Camera Ray, not only the output itself."""
    import bpy

    from blender_addon import compat

    build.camera()
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    path, math = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    math.operation = "MULTIPLY_ADD"
    math.inputs[1].default_value, math.inputs[2].default_value = 3.0, 0.5
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1)
    tree.links.new(path.outputs["Is Camera Ray"], math.inputs[0])
    tree.links.new(math.outputs[0], background.inputs["Strength"])
    world = translate().world
    np.testing.assert_allclose(world.color.linear_rgb * world.strength, (0.5, 0.25, 0.125))
    view = world.camera_view
    np.testing.assert_allclose(view.color.linear_rgb * view.strength, (3.5, 1.75, 0.875))


@pytest.mark.parametrize(
    ("model", "elevation", "altitude", "cycles"),
    [
        ("single", 0.02, 30_000.0, (152.67, 131.07, 115.15)),
        ("multiple", 0.02, 30_000.0, (85.034, 78.542, 75.210)),
        ("single", -0.1, 100.0, (4.4072, 1.8126, 0.13423)),
    ],
)
def test_a_sun_that_the_horizon_cuts_gives_the_light_of_cycles(model, elevation, altitude, cycles):
    """Light of the region of 45 by 40 degrees around a sun of 0.3 radian, that Cycles 5.0.1 renders."""
    from blender_addon.translate.shading.nodes.skies import drawn
    from spectral_core.scene.skies.atmosphere import Atmosphere

    pixels, left = drawn(Atmosphere(model, elevation, altitude=altitude), 0.3, 1.0)
    assert left == 0, "the disk is in the picture, so that no light stands for it"
    rows, columns = pixels.shape[:2]
    solid_angle = np.cos(((np.arange(rows) + 0.5) / rows - 0.5) * np.pi) * (np.pi / rows) ** 2
    # +Y, where a sun without rotation is, is at a quarter of the picture
    region = (slice(rows * 48 // 128, rows * 80 // 128), slice(columns * 50 // 256, columns * 78 // 256))
    found = (pixels * solid_angle[:, None, None])[region].sum((0, 1))
    np.testing.assert_allclose(found, cycles, rtol=0.015)


def test_a_sun_past_the_zenith_goes_down_on_the_other_side(build, translate, monkeypatch):
    """Cycles keeps the place of the sun, so that the elevation of a whole day can be animated."""
    import bpy

    from blender_addon import compat
    from blender_addon.translate.lighting import patterns
    from blender_addon.translate.shading.nodes import skies as sky_nodes

    monkeypatch.setattr(sky_nodes, "SKY_ROWS", 32)
    monkeypatch.setattr(patterns, "ROWS", 32)
    build.camera()
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    sky = tree.nodes.new("ShaderNodeTexSky")
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    found = []
    for elevation, rotation in ((np.radians(60), 0.3 + np.pi), (np.radians(120), 0.3), (np.radians(480), 0.3)):
        sky.sun_elevation, sky.sun_rotation = elevation, rotation
        scene = translate()
        found.append((scene.world.color.pixels, scene.lights[0].world_from_light))
    for pixels, placed in found[1:]:
        np.testing.assert_allclose(pixels, found[0][0], rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(placed[:, 2], found[0][1][:, 2], atol=1e-5)


def test_a_small_sun_is_drawn_only_where_the_horizon_cuts_it():
    from blender_addon.translate.shading.nodes.skies import drawn
    from spectral_core.scene.skies.atmosphere import Atmosphere

    usual = 0.0095
    assert drawn(Atmosphere(sun_elevation=0.3), usual, 1.0)[1] == usual
    cut, left = drawn(Atmosphere(sun_elevation=0.0, altitude=0.0), usual, 1.0)
    assert left == 0
    rows = len(cut)
    sky = Atmosphere(sun_elevation=0.0, altitude=0.0)
    disk = cut - drawn(sky, 0.0, 1.0)[0]
    light = disk.sum((0, 1)) * (np.pi / rows) ** 2
    half = sky.sun_radiance(usual) * np.pi * (usual / 2) ** 2  # of the whole disk's mean; the upper half is brighter
    assert (light[:2] > half[:2]).all() and (light[:2] < 1.5 * half[:2]).all()


@pytest.mark.parametrize("moved_by", ["UV", "Mapping"])
def test_an_environment_without_a_direction_has_the_color_of_its_corner(build, tmp_path, moved_by):
    import bpy

    from blender_addon import compat
    from tests.blender import cycles

    build.camera()
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    image = bpy.data.images.new("rows", 8, 4)
    pixels = np.full((4, 8, 4), 0.1, np.float32)
    pixels[[0, -1]] = (0.9, 0.7, 0.5, 1.0)  # the corner lies between the last row and the first one
    image.pixels.foreach_set(pixels.ravel())
    environment = tree.nodes.new("ShaderNodeTexEnvironment")
    environment.image = image
    source = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]  # a world has none: a vector of zeros
    if moved_by == "Mapping":
        source = tree.nodes.new("ShaderNodeMapping").outputs["Vector"]
        source.node.inputs["Scale"].default_value = (0.0, 0.0, 0.0)
    tree.links.new(source, environment.inputs["Vector"])
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(environment.outputs["Color"], background.inputs["Color"])
    cycles.settings(samples=4, size=8)
    theirs = cycles.cycles(tmp_path).mean((0, 1))
    assert theirs[0] > 0.5
    pixels, notes = cycles.ours(samples=4)
    np.testing.assert_allclose(pixels.mean((0, 1)), theirs, rtol=0.01)
    assert not notes
