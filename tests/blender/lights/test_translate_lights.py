# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights, world, camera and film: numbers of Blender, and notes on unusual settings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.scene import AreaLight, Color, ImageTexture, PointLight, SpotLight, SunLight
from spectral_core.spectra.spectrum import Illuminant

bpy = pytest.importorskip("bpy")


def the_light(scene):
    assert len(scene.lights) == 1
    return scene.lights[0]


def test_each_type_of_light_keeps_its_numbers(build, translate):
    build.light("POINT", 5, shadow_soft_size=0.25, use_soft_falloff=False).visible_camera = True
    build.light("SPOT", 6, spot_size=1.0, spot_blend=0.5)
    build.light("SUN", 7, angle=0.1)
    build.light("AREA", 8, shape="ELLIPSE", size=2, size_y=3).scale = (2, 1, 5)
    found = {type(light): light for light in translate().lights}
    assert (found[PointLight].power_w, found[PointLight].radius) == (5, 0.25)
    assert found[PointLight].camera_visible and not found[PointLight].soft_falloff
    assert found[SpotLight].soft_falloff and not found[SpotLight].camera_visible  # Blender's formula
    assert (found[SpotLight].cone_angle_rad, found[SpotLight].blend) == (1.0, 0.5)
    assert found[SunLight].irradiance == 7 and found[SunLight].angle_rad == pytest.approx(0.1)
    area = found[AreaLight]
    assert (area.power_w, area.shape, area.size) == (8, "ellipse", (4, 3))
    np.testing.assert_allclose(area.world_from_light[:3, :3], np.eye(3))


def test_the_frame_of_a_light_is_rigid_for_any_object_transform(build, translate):
    lamp = build.light("AREA", size=1)
    lamp.scale, lamp.rotation_euler = (-2, 3, 0.5), (0.3, 1.2, -0.7)
    frame = the_light(translate()).world_from_light[:3, :3]
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-7)
    assert np.linalg.det(frame) == pytest.approx(1)
    bpy.context.view_layer.update()
    toward = np.array(lamp.matrix_world)[:3, 2]
    np.testing.assert_allclose(frame[:, 2], toward / np.linalg.norm(toward), atol=1e-6)


def test_a_panel_without_area_emits_nothing(build, translate):
    build.light("AREA", size=0.0)
    scene = translate()
    assert not scene.lights and [note.subject for note in scene.notes] == ["Area"]


def test_lights_without_power_are_omitted_and_negative_ones_take_light_away(build, translate):
    build.light("POINT", 0)
    build.light("SUN", 1, color=(0, 0, 0))
    build.light("SPOT", -5)
    scene = translate()
    assert [light.power_w for light in scene.lights] == [-5] and scene.notes == ()


def test_temperature_is_a_blackbody_and_a_tint_keeps_the_color(build, translate):
    lamp = build.light("POINT", 100)
    if not hasattr(lamp.data, "use_temperature"):
        pytest.skip("this Blender's lights have no temperature")
    lamp.data.use_temperature, lamp.data.temperature = True, 3200
    assert the_light(translate()).color.name == "blackbody 3200"
    lamp.data.color = (1, 0.5, 0.5)
    tinted = the_light(translate()).color
    np.testing.assert_allclose(tinted.linear_rgb, np.array(lamp.data.temperature_color) * (1, 0.5, 0.5), rtol=1e-5)


def test_exposure_and_power_over_area(build, translate):
    lamp = build.light("AREA", 10, shape="DISK", size=2)
    if not hasattr(lamp.data, "exposure"):
        pytest.skip("this Blender's lights have no exposure")
    lamp.data.exposure, lamp.data.normalize = 3, False
    assert the_light(translate()).power_w == pytest.approx(10 * 8 * math.pi)


def test_nodes_and_spectrum_of_a_lamp(build, translate):
    from blender_addon import compat
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant

    lamp = build.light("POINT", 10)
    tree = compat.use_nodes(lamp.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    emission.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1)
    emission.inputs["Strength"].default_value = 3
    light = the_light(translate())
    assert light.power_w == 30
    np.testing.assert_allclose(light.color.linear_rgb, (0.5, 0.25, 0.125))
    store_spectrum(lamp.data.spectral, illuminant("HP1"), strength=2.0)
    light = the_light(translate())
    assert isinstance(light.color, Illuminant) and light.color.name == "HP1" and light.power_w == 60
    np.testing.assert_allclose(light.color.values, illuminant("HP1").values, rtol=1e-6)


def test_light_groups(build, translate):
    group = bpy.context.view_layer.lightgroups.add()
    group.name = "Key"
    build.light("POINT").lightgroup = "Key"
    build.plane().lightgroup = "Key"
    bpy.context.scene.world = bpy.data.worlds.new("World")
    bpy.context.scene.world.lightgroup = "Key"
    scene = translate()
    assert {scene.lights[0].group, scene.instances[0].group, scene.world.group} == {"Key"}


def world_with(*, image=None, rotation=None, color=(0.2, 0.4, 0.6, 1)):
    from blender_addon import compat

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    tree.nodes.clear()
    background, output = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "OutputWorld"))
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = color
    background.inputs["Strength"].default_value = 2.5
    if image is not None:
        texture = tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = image
        tree.links.new(texture.outputs["Color"], background.inputs["Color"])
        if rotation is not None:
            mapping, place = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
            mapping.inputs["Rotation"].default_value = rotation
            tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
            tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    return world


def test_world_color_and_image(build, translate, rng):
    world_with()
    world = translate().world
    assert world.strength == 2.5
    np.testing.assert_allclose(world.color.linear_rgb, (0.2, 0.4, 0.6), rtol=1e-6)
    pixels = rng.random((4, 8, 4))
    world_with(image=build.image("Sky", pixels, float_buffer=True), rotation=(0.1, 0.2, 0.3))
    world = translate().world
    assert isinstance(world.color, ImageTexture)
    np.testing.assert_allclose(world.color.pixels, pixels[..., :3], rtol=1e-5)
    from mathutils import Euler

    turned = np.array(Euler((0.1, 0.2, 0.3), "XYZ").to_matrix())
    np.testing.assert_allclose(world.world_from_environment[:3, :3] @ turned, np.eye(3), atol=1e-6)


def test_the_texture_mapping_panel_of_an_environment_turns_it(build, translate, rng):
    """A turn in the panel moves the picture's pixels by a quarter of its width."""
    pixels = np.ones((4, 8, 4))
    pixels[..., :3] = rng.random((4, 8, 3))
    world = world_with(image=build.image("Sky", pixels, float_buffer=True))
    texture = next(node for node in world.node_tree.nodes if node.type == "TEX_ENVIRONMENT")
    texture.interpolation = "Closest"

    def coarse():
        scene = translate()
        drawn = scene.world.strength * scene.world.color.pixels
        rows, columns = drawn.shape[:2]
        assert not scene.notes
        return drawn[rows // 8 :: rows // 4, columns // 16 :: columns // 8]

    plain = coarse()
    texture.texture_mapping.rotation = (0.0, 0.0, math.pi / 2)
    turned = coarse()
    assert plain.shape == turned.shape == (4, 8, 3)
    np.testing.assert_allclose(turned, np.roll(plain, 2, axis=1), rtol=1e-5)


def test_a_coarse_environment_of_bytes_is_filtered_before_it_is_decoded(build, translate):
    """Between black and white lies the linear light of byte 128, 0.22, as in Cycles."""
    pixels = np.ones((2, 4, 4))
    pixels[0, :, :3] = 0.0
    world_with(image=build.image("Sky", pixels))
    column = translate().world.color.pixels[:, 0, 0]
    middle = column[len(column) // 2 - 1 :][:2].mean()
    np.testing.assert_allclose(middle / column.max(), 0.214, atol=0.01)


@pytest.mark.parametrize(
    ("output", "told"), [("Is Camera Ray", False), ("Is Glossy Ray", True), ("Diffuse Depth", True)]
)
def test_a_drawn_world_that_tells_rays_apart_has_a_note(build, translate, output, told, monkeypatch):
    from blender_addon.translate.lighting import patterns

    monkeypatch.setattr(patterns, "ROWS", 64)
    world_with()
    tree = bpy.context.scene.world.node_tree
    path, mixed, sky = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("LightPath", "Mix", "TexNoise"))
    mixed.data_type = "RGBA"
    colors = [socket for socket in mixed.inputs if socket.type == "RGBA"]
    tree.links.new(path.outputs[output], mixed.inputs[0])
    tree.links.new(sky.outputs["Color"], colors[0])
    target = next(node for node in tree.nodes if node.type == "BACKGROUND").inputs["Color"]
    tree.links.new(next(socket for socket in mixed.outputs if socket.type == "RGBA"), target)
    assert any("depends on the type of ray" in note.message for note in translate().notes) is told


@pytest.mark.parametrize(("limit", "told"), [(1024, False), (60, False), (2, True)])
def test_bounces_of_the_world_have_a_note_if_paths_are_longer(build, translate, limit, told):
    world_with()
    bpy.context.scene.world.cycles.max_bounces, bpy.context.scene.cycles.max_bounces = limit, 12
    assert any("number of bounces" in note.message for note in translate().notes) is told


def test_no_world_is_black_and_a_missing_sky_image_is_magenta_with_a_note(build, translate):
    assert translate().world.is_black
    world_with(image=bpy.data.images.new("Gone", 4, 4))
    bpy.data.images["Gone"].source = "FILE"
    bpy.data.images["Gone"].filepath = "//nowhere.exr"
    scene = translate()
    np.testing.assert_allclose(scene.world.color.linear_rgb, (1, 0, 1))
    assert [note.subject for note in scene.notes] == ["Gone"] and "nowhere.exr" in scene.notes[0].message


def test_camera_numbers(build, translate):
    target = build.object("Target", None, (3, 4, -10))
    camera = build.camera((0, 0, 5), lens=35, sensor_fit="VERTICAL", shift_x=0.1, shift_y=-0.2, clip_end=77)
    camera.data.dof.use_dof, camera.data.dof.focus_object, camera.data.dof.aperture_fstop = True, target, 1.4
    camera.scale = (2, 2, 2)
    view = translate().camera
    assert view.sensor_fit == "height" and view.far == 77 and view.shift == pytest.approx((0.1, -0.2))
    assert view.field_of_view_rad == pytest.approx(2 * math.atan(24 / 70), rel=1e-6)
    assert view.focus_distance == pytest.approx(15) and view.aperture_radius == pytest.approx(0.035 / 2.8)
    np.testing.assert_allclose(view.world_from_camera[:3, :3], np.eye(3), atol=1e-7)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 3
    assert translate().camera.kind == "orthographic" and translate().camera.orthographic_scale == 3


def test_no_camera_gives_one_clear_message(blender):
    from blender_addon.translate.scene import translate_scene

    with pytest.raises(InvalidInputError, match="'Scene' has no camera; add one"):
        translate_scene(bpy.context.evaluated_depsgraph_get())


def test_film_has_percentage_border_and_background(build, translate):
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 201, 100, 50
    render.use_border, render.border_min_x, render.border_max_x = True, 0.25, 0.5
    render.border_min_y, render.border_max_y = 0.1, 0.9
    render.film_transparent = True
    bpy.context.scene.spectral.render.samples = 7
    film = translate().film
    assert (film.width, film.height, film.samples, film.transparent) == (100, 50, 7, True)
    assert film.crop == (25, 5, 25, 40)
    render.border_max_x = 0.2501
    with pytest.raises(InvalidInputError, match=r"border of 0×40 pixels is empty"):
        translate()


def test_colors_come_from_the_working_space(build, monkeypatch):
    """In a file with another working space, the same reflectance has other numbers."""
    from blender_addon import compat
    from blender_addon.translate.context import Translation

    monkeypatch.setattr(compat, "working_space", lambda data: "ACEScg")
    translation = Translation.of(None, bpy.data)
    np.testing.assert_allclose(translation.linear_rgb([1, 1, 1]), 1, atol=2e-4)  # white stays white
    red = translation.linear_rgb([0.61309741, 0.07019384, 0.02061593])  # Rec.709 red in ACEScg, from OpenColorIO
    np.testing.assert_allclose(red, [1, 0, 0], atol=1e-3)


def test_the_color_of_a_light_is_a_color_object(build, translate):
    build.light("POINT", color=(1, 0.5, 0.25))
    assert isinstance(the_light(translate()).color, Color)


@pytest.mark.parametrize("normalize", [True, False])
def test_a_small_area_light_keeps_its_size(build, translate, normalize):
    """One below 0.1 mm was as large as that, so that one without Normalize was a hundred times too bright."""
    lamp = build.light("AREA", 8, shape="DISK", size=2e-5)
    if not hasattr(lamp.data, "normalize"):
        pytest.skip("lamps are normalized before Blender 4.5")
    lamp.data.normalize = normalize
    (found,) = translate().lights
    assert found.size == pytest.approx((2e-5, 2e-5))
    assert found.power_w == pytest.approx(8 if normalize else 8 * np.pi * 1e-10)


@pytest.mark.parametrize(("kind", "factor"), [("POINT", 4.0), ("SPOT", 4.0), ("SUN", 1.0)])
def test_a_lamp_of_size_0_without_normalize_shines(build, translate, kind, factor):
    """Cycles multiplies by the surface of a lamp of any other size, so that 4 takes the place of 4 π r²."""
    lamp = build.light(kind, energy=10.0)
    setattr(lamp.data, "angle" if kind == "SUN" else "shadow_soft_size", 0.0)
    lamp.data.normalize = False
    (light,) = translate().lights
    assert (light.irradiance if kind == "SUN" else light.power_w) == pytest.approx(10.0 * factor)
