# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds and materials that are no plain light: skies with a sun, overrides, node groups, shared worlds."""

from __future__ import annotations

import bpy
import numpy as np
import pytest


def _node(owner, kind):
    return next(node for node in owner.node_tree.nodes if node.type == kind)


def _sky(world):
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    background = _node(world, "BACKGROUND")
    background.inputs["Strength"].default_value = 0.02
    world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])


def _turned(dial, picture):
    """The picture of a mixture in which no light is off, so that a render chooses the same paths."""
    dial.selector, dial.intensity = (0.2, -0.3), 5.0
    bpy.ops.spectral.dial_show()
    return picture().copy()


@pytest.mark.parametrize("storage", ["DIAL", "EXACT"])
def test_a_sky_and_its_sun_are_one_bulb_that_can_be_applied(stage, picture, same_paths, storage):
    _sky(stage.world)
    stage.spectral.render.transport = "SPECTRAL" if storage == "EXACT" else "AUTO"
    stage.cycles.sample_clamp_indirect = 0
    dial = stage.spectral.dial
    dial.storage = storage
    bpy.ops.spectral.dial_record()
    assert [bulb.name for bulb in dial.bulbs] == ["Ball", "Fill", "Key", "World"]
    tolerance = 0.05 if storage == "EXACT" else 1e-5
    before = same_paths()[..., :3]
    assert picture()[..., :3].mean(axis=(0, 1)) == pytest.approx(before.mean(axis=(0, 1)), rel=tolerance)
    mixed = _turned(dial, picture)
    bpy.ops.spectral.dial_apply()
    applied = same_paths()[..., :3]
    assert mixed[..., :3].mean(axis=(0, 1)) == pytest.approx(applied.mean(axis=(0, 1)), rel=tolerance)
    assert np.abs(applied - before).max() > 0.05


def test_a_lamp_for_a_sky_is_not_applied(stage):
    """It replaced the sky by one color and removed its sun, while the picture showed the sky in the lamp's light."""
    _sky(stage.world)
    dial = stage.spectral.dial
    dial.storage = "BANDS31"
    bpy.ops.spectral.dial_record()
    dial.bulbs["World"].lamp = "HP1"
    energy = bpy.data.objects["Key"].data.energy
    dial.selector = (0.3, 0.4)
    refused = "shines in several colors.*'HP1' would replace; empty the lamp of the bulb"
    with pytest.raises(RuntimeError, match=refused):
        bpy.ops.spectral.dial_apply()
    assert stage.world.spectral.source == "NONE" and bpy.data.objects["Key"].data.energy == energy
    dial.bulbs["World"].lamp = ""
    _turned_to(dial, "Key")
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    dial.bulbs["World"].lamp = "HP1"
    _turned_to(dial, "World")
    with pytest.raises(RuntimeError, match=refused):
        bpy.ops.spectral.dial_apply()  # a dark sky has one color, so that the lamp replaced it
    assert stage.world.spectral.source == "NONE"
    assert _node(stage.world, "BACKGROUND").inputs["Strength"].default_value == 0


def _turned_to(dial, name):
    dial.selector = next(bulb.place for bulb in dial.bulbs if bulb.name == name)


@pytest.mark.usefixtures("without_rays")
def test_a_sky_that_apply_made_dark_is_no_change_of_the_scene(stage):
    """Its sun, which a dark sky does not have, was called removed, and changed as soon as the sky shone again."""
    _sky(stage.world)
    dial = stage.spectral.dial
    bpy.ops.spectral.dial_record()
    for place in (dial.bulbs["Key"].place[:], (0.2, -0.3)):
        dial.selector = place
        bpy.ops.spectral.dial_apply()
        assert (_node(stage.world, "BACKGROUND").inputs["Strength"].default_value == 0) is (place != (0.2, -0.3))
        bpy.ops.spectral.dial_check()
        assert dial.changes == ""
    _node(stage.world, "TEX_SKY").sun_elevation += 0.3
    bpy.ops.spectral.dial_check()
    assert dial.changes == "the world was changed, the sun of the sky was changed"


def test_a_world_that_the_view_layer_shows_in_place_of_the_scenes_is_dimmed(stage, picture, same_paths):
    shown = stage.world.copy()
    _node(shown, "BACKGROUND").inputs["Color"].default_value = (1.0, 0.2, 0.1, 1.0)
    stage.view_layers[0].world_override = shown
    bpy.ops.spectral.dial_record()
    mixed = _turned(stage.spectral.dial, picture)
    bpy.ops.spectral.dial_apply()
    np.testing.assert_allclose(mixed[..., :3], same_paths()[..., :3], rtol=1e-4, atol=1e-5)
    assert _node(stage.world, "BACKGROUND").inputs["Strength"].default_value == pytest.approx(0.2)


@pytest.mark.usefixtures("without_rays")
def test_emission_of_a_material_override_is_named_and_nothing_is_written(stage):
    override = bpy.data.materials["Glow"].copy()
    stage.view_layers[0].material_override = override
    bpy.ops.spectral.dial_record()
    dial = stage.spectral.dial
    dial.selector = (0.2, -0.3)
    with pytest.raises(RuntimeError, match="material override"):
        bpy.ops.spectral.dial_apply()
    assert bpy.data.lights["Key"].energy == 200.0
    assert _node(bpy.data.materials["Glow"], "EMISSION").inputs["Strength"].default_value == 3.0


def _grouped(material):
    """Add an emission within a node group to the surface of a material."""
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    emission, end = group.nodes.new("ShaderNodeEmission"), group.nodes.new("NodeGroupOutput")
    group.links.new(emission.outputs[0], end.inputs[0])
    tree = material.node_tree
    node, added = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeAddShader")
    node.node_tree = group
    tree.links.new(_node(material, "EMISSION").outputs[0], added.inputs[0])
    tree.links.new(node.outputs[0], added.inputs[1])
    tree.links.new(added.outputs[0], _node(material, "OUTPUT_MATERIAL").inputs["Surface"])


def _with_coefficients(material):
    """Give a material a volume that emits light of three coefficients."""
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVolumeCoefficients")
    node.inputs["Emission Coefficients"].default_value = (0.3, 0.1, 0.2)
    tree.links.new(node.outputs[0], _node(material, "OUTPUT_MATERIAL").inputs["Volume"])


@pytest.mark.usefixtures("without_rays")
@pytest.mark.parametrize("add", [_grouped, _with_coefficients])
def test_a_material_of_which_only_a_part_can_be_dimmed_is_named(stage, add):
    if add is _with_coefficients and not hasattr(bpy.types, "ShaderNodeVolumeCoefficients"):
        pytest.skip("this Blender has no Volume Coefficients")
    glow = bpy.data.materials["Glow"]
    add(glow)
    bpy.ops.spectral.dial_record()
    dial = stage.spectral.dial
    dial.selector = (0.2, -0.3)
    with pytest.raises(RuntimeError, match="emits light in its node"):
        bpy.ops.spectral.dial_apply()
    assert _node(glow, "EMISSION").inputs["Strength"].default_value == 3.0
    assert bpy.data.lights["Key"].energy == 200.0
    bpy.ops.spectral.dial_reset()
    bpy.ops.spectral.dial_apply()  # as recorded: nothing to dim
    assert _node(glow, "EMISSION").inputs["Strength"].default_value == 3.0


@pytest.mark.usefixtures("without_rays")
def test_a_world_of_two_scenes_is_dimmed_in_one_of_them(stage, dial):
    other = bpy.data.scenes.new("Other")
    other.world = stage.world
    dial.selector = dial.bulbs["World"].place
    bpy.ops.spectral.dial_apply()
    assert _node(stage.world, "BACKGROUND").inputs["Strength"].default_value == pytest.approx(0.8)
    assert _node(other.world, "BACKGROUND").inputs["Strength"].default_value == pytest.approx(0.2)
    bpy.ops.spectral.dial_check()
    assert dial.changes == ""
    bpy.ops.spectral.dial_apply(restore=True)
    assert _node(stage.world, "BACKGROUND").inputs["Strength"].default_value == pytest.approx(0.2)


def test_a_linked_scene_is_not_recorded_since_its_bulbs_would_be_lost(stage, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "source.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "host.blend"))
    with bpy.data.libraries.load(str(tmp_path / "source.blend"), link=True) as (_, given):
        given.scenes = ["Scene"]
    linked = next(each for each in bpy.data.scenes if each.library)
    with (
        bpy.context.temp_override(scene=linked, view_layer=linked.view_layers[0]),
        pytest.raises(RuntimeError, match=r"is linked from .*source\.blend.*make the scene local"),
    ):
        bpy.ops.spectral.dial_record()
    assert not (tmp_path / "host.transport.exr").exists()


def test_a_comparison_draws_no_sky_again(stage, monkeypatch):
    """Each comparison of the scene with its recording took half a second for a sky that had not changed."""
    from blender_addon.editing.dial import changes
    from blender_addon.translate.lighting import patterns

    _sky(stage.world)
    first = changes.parts_of(stage)
    monkeypatch.setattr(patterns, "environment_of", lambda *_: pytest.fail("the sky was drawn again"))
    assert changes.parts_of(stage) == first
    monkeypatch.undo()
    _node(stage.world, "TEX_SKY").sun_elevation += 0.3
    assert {name for name, each in changes.parts_of(stage).items() if first.get(name) != each} >= {"the world"}
