# SPDX-License-Identifier: GPL-3.0-or-later
"""From the dial back to lamps that have colors, strengths, keyframes and names of their own."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

LUMINANCE = (0.2126, 0.7152, 0.0722)


def brightness(scene, picture):
    """Mean luminance of the dial's present mix."""
    return float(picture()[..., :3].mean(axis=(0, 1)) @ LUMINANCE)


def alone(dial, name):
    """Turn the dial to one bulb, with the powers as recorded."""
    dial.selector = next(bulb for bulb in dial.bulbs if bulb.name == name).place
    dial.intensity = 1.0


def without_others(scene):
    """Only lamps give light."""
    bpy.data.objects["Ball"].hide_render = True
    scene.world = None


def mixed_and_baked(scene, picture, name):
    """Brightness of one bulb of a recording, and of a recording of the lamp that is baked from it."""
    alone(scene.spectral.dial, name)
    mixed = brightness(scene, picture)
    assert bpy.ops.spectral.dial_bake(hide=True) == {"FINISHED"}
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    return mixed, brightness(scene, picture)


def red(lamp):
    lamp.color = (1.0, 0.04, 0.02)


def brightened(lamp):
    lamp.spectral.source, lamp.spectral.catalogue_name = "CATALOGUE", "A"
    lamp.spectral.strength = 2.5


@pytest.mark.parametrize("change", [red, brightened])
def test_a_baked_lamp_is_as_bright_as_the_mix(stage, picture, change):
    without_others(stage)
    change(bpy.data.lights["Key"])
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    mixed, baked = mixed_and_baked(stage, picture, "Key")
    assert [bulb.name for bulb in stage.spectral.dial.bulbs] == ["Dial Light"]
    # the red lamp was rendered in RGB, the baked one with its spectrum, of which the floor reflects another share
    assert baked == pytest.approx(mixed, rel=0.06)


def test_a_baked_lamp_stands_for_all_lamps_of_a_light_group(stage, picture):
    without_others(stage)
    stage.view_layers[0].lightgroups.add(name="Row")
    first = bpy.data.objects["Key"]
    second = first.copy()
    second.data = first.data.copy()
    second.data.energy = 3 * first.data.energy
    stage.collection.objects.link(second)
    first.lightgroup = second.lightgroup = "Row"
    stage.spectral.dial.one_per_light = False
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    mixed, baked = mixed_and_baked(stage, picture, "Row")
    assert baked == pytest.approx(mixed, rel=0.02)


def brighter_by_stops(first, second):
    second.data.exposure = 2.0


def unequal_panels(first, second):
    """Area lights whose strength counts per area: the smaller one has more strength, and less power."""
    for each, size, strength in ((first, 2.0, 20.0), (second, 0.5, 40.0)):
        each.data = bpy.data.lights.new("Panel", "AREA")
        each.data.normalize, each.data.size, each.data.energy = False, size, strength


@pytest.mark.skipif("normalize" not in bpy.types.Light.bl_rna.properties, reason="lamps have no exposure before 4.5")
@pytest.mark.parametrize("unlike", [brighter_by_stops, unequal_panels])
def test_a_baked_lamp_counts_exposures_and_areas(stage, picture, unlike):
    """Two lamps at one place, so that one lamp can be as bright."""
    without_others(stage)
    bpy.data.objects["Fill"].hide_render = True
    stage.view_layers[0].lightgroups.add(name="Row")
    first = bpy.data.objects["Key"]
    second = first.copy()
    second.data = first.data.copy()
    stage.collection.objects.link(second)
    unlike(first, second)
    first.data.color = second.data.color = (1.0, 1.0, 1.0)
    first.lightgroup = second.lightgroup = "Row"
    stage.spectral.dial.one_per_light = False
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    mixed, baked = mixed_and_baked(stage, picture, "Row")
    assert baked == pytest.approx(mixed, rel=0.03)


@pytest.mark.parametrize("center", [550.0, 550.4])
def test_a_baked_lamp_keeps_lines_that_are_narrower_than_its_grid(center):
    """Whether such a line is on a knot of the grid or between two, its share of the luminance stays."""
    from types import SimpleNamespace

    import numpy as np

    from blender_addon.operators.dial_apply import _mixed_spectrum
    from spectral_core.spectra.catalogue import illuminant
    from spectral_core.spectra.observer import normalized, xyz_of
    from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

    laser = Illuminant("laser", SpectralGrid(center + np.array([-0.05, 0.0, 0.05])), np.array([0.0, 1.0, 0.0]))
    lights, shares = [laser, illuminant("A")], np.array([1.0, 1.0])
    bulbs = [SimpleNamespace(name=light.name, lamp="") for light in lights]
    mixed = _mixed_spectrum(SimpleNamespace(bulbs=bulbs), SimpleNamespace(lights=lights), shares)
    wanted = sum(xyz_of(normalized(light)) for light in lights)
    found = xyz_of(mixed)
    assert found / found[1] == pytest.approx(wanted / wanted[1], rel=0.005)
    tungsten = illuminant("A")
    assert mixed.at(330.0) / mixed.at(700.0) == pytest.approx(tungsten.at(330.0) / tungsten.at(700.0), rel=0.01)


def test_an_applied_lamp_is_as_bright_as_in_the_picture(stage, picture):
    without_others(stage)
    brightened(bpy.data.lights["Key"])
    dial = stage.spectral.dial
    dial.storage = "BANDS31"
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    alone(dial, "Key")
    next(bulb for bulb in dial.bulbs if bulb.name == "Key").lamp = "D65"
    mixed = brightness(stage, picture)
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    spectral = bpy.data.lights["Key"].spectral
    assert (spectral.catalogue_name, spectral.strength) == ("D65", 2.5)
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    dial.bulbs[0].lamp = ""
    dial.intensity = 1.0
    assert brightness(stage, picture) == pytest.approx(mixed, rel=0.03)


def test_an_unknown_lamp_is_refused_before_anything_is_written(stage):
    lamp = bpy.data.lights["Key"]
    lamp.spectral.source, lamp.spectral.catalogue_name = "CATALOGUE", "A"
    dial = stage.spectral.dial
    dial.storage = "BANDS31"
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    next(bulb for bulb in dial.bulbs if bulb.name == "Key").lamp = "sodium lamp of the corner"
    with pytest.raises(RuntimeError, match="no illuminant is named 'sodium lamp of the corner'"):
        bpy.ops.spectral.dial_apply()
    assert (lamp.spectral.catalogue_name, lamp.energy) == ("A", 200.0)
    assert len(lamp.spectral.samples)


def world_strength():
    tree = bpy.context.scene.world.node_tree
    node = next(each for each in tree.nodes if each.type == "BACKGROUND")
    node.inputs["Strength"].keyframe_insert("default_value", frame=3)
    return "World"


def driven_emission():
    node = next(each for each in bpy.data.materials["Glow"].node_tree.nodes if each.type == "EMISSION")
    node.inputs["Strength"].driver_add("default_value").driver.expression = "2 + 1"
    return "Glow"


def action_strip():
    lamp = bpy.data.lights["Key"]
    lamp.keyframe_insert("energy", frame=4)
    animation = lamp.animation_data
    animation.nla_tracks.new().strips.new("Strip", 4, animation.action)
    animation.action = None
    return "Key"


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize("animate", [world_strength, driven_emission, action_strip])
def test_animated_strengths_are_named(stage, dial, animate):
    from blender_addon.operators.dial_apply import _animated

    assert _animated(dial) == ""
    name = animate()
    assert _animated(stage.spectral.dial) == name
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}


@pytest.mark.usefixtures("without_rays")
def test_a_saved_animation_returns_to_the_moment_between_two_frames(stage, dial, tmp_path):
    stage.frame_start, stage.frame_end = 1, 2
    stage.frame_set(2, subframe=0.5)
    assert bpy.ops.spectral.dial_save(filepath=str(tmp_path / "walk_.png"), animation=True) == {"FINISHED"}
    assert (stage.frame_current, stage.frame_subframe) == (2, 0.5)


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize(("name", "files"), [
    ("walk_##_é.png", ["walk_01_é.png", "walk_02_é.png"]), ("####.exr", ["0001.exr", "0002.exr"]),
    ("a b.png", ["a b0001.png", "a b0002.png"]),
])  # fmt: skip
def test_marks_in_the_name_are_the_number_of_the_frame(stage, dial, tmp_path, capfd, name, files):
    """They stayed in the names, unlike in every other path of Blender."""
    stage.frame_start, stage.frame_end = 1, 2
    (tmp_path / "new").mkdir()
    assert bpy.ops.spectral.dial_save(filepath=str(tmp_path / "new" / name), animation=True) == {"FINISHED"}
    assert sorted(each.name for each in (tmp_path / "new").iterdir()) == files
    assert f"{files[0]} and 1 more" in capfd.readouterr().out, "the message names a file that exists"


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize("moves", [False, True])
def test_a_saved_animation_of_a_scene_that_moves_says_that_it_does_not(stage, dial, tmp_path, capfd, moves):
    """All frames show the recorded one; a video of a still scene was the first sign."""
    stage.frame_start, stage.frame_end = 1, 3
    key = bpy.data.objects["Key"]
    for frame, x in ((1, -2.0), (3, 2.0 if moves else -2.0)):
        key.location.x = x
        key.keyframe_insert("location", frame=frame)
    stage.frame_set(1)
    bpy.ops.spectral.dial_record()
    capfd.readouterr()
    assert bpy.ops.spectral.dial_save(filepath=str(tmp_path / "walk_.png"), animation=True) == {"FINISHED"}
    told = "all frames show the scene as it was recorded, but at frame 2 light 'Key' was changed"
    assert (told in "".join(capfd.readouterr())) is moves
    assert dial.changes == "" and stage.frame_current == 1


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize("dark", [False, True])
def test_lights_that_apply_made_dark_are_named_by_the_next_recording(stage, dial, capfd, dark):
    dial.selector = dial.bulbs["Key"].place if dark else (0.3, 0.1)
    bpy.ops.spectral.dial_apply()
    capfd.readouterr()
    bpy.ops.spectral.dial_record()
    told = "lights that Apply made dark have no bulb now (Ball, Fill, World)"
    assert (told in "".join(capfd.readouterr())) is dark
    assert len(stage.spectral.dial.bulbs) == (1 if dark else 4)


@pytest.mark.usefixtures("without_rays")
def test_lamps_that_apply_made_dark_stay_dark_if_the_next_one_fails(stage, dial):
    dial.selector = dial.bulbs["Key"].place
    bpy.ops.spectral.dial_apply()
    stage.camera = None
    before = {lamp.name: lamp.energy for lamp in bpy.data.lights}
    assert before["Fill"] == 0.0
    with pytest.raises(RuntimeError, match="has no camera"):
        bpy.ops.spectral.dial_apply(restore=True)
    assert {lamp.name: lamp.energy for lamp in bpy.data.lights} == before
