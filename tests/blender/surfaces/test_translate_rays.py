# SPDX-License-Identifier: GPL-3.0-or-later
"""The translated scene has Blender's lamp nodes, light linking, visibility, light paths and branches of the world."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.scene import Color, ImageTexture, Rays
from spectral_core.spectra.luminaire import WATTS_PER_CANDELA, read_ies

bpy = pytest.importorskip("bpy")

IES = "IESNA:LM-63-1995\nTILT=NONE\n1 -1 2.0 3 1 1 2 0 0 0\n1 0.5 100\n0 45 90\n0\n100 80 20\n"


def linked(lamp, collection, thing, state="INCLUDE"):
    chosen = bpy.data.collections.new("Linked")
    setattr(lamp.light_linking, collection, chosen)
    chosen.objects.link(thing)
    chosen.collection_objects[0].light_linking.link_state = state


def emission_of(lamp):
    from blender_addon import compat

    return next(node for node in compat.use_nodes(lamp.data).nodes if node.type == "EMISSION")


def test_a_portal_emits_no_light(build, translate):
    build.light("AREA").data.cycles.is_portal = True
    assert translate().lights == () and translate().notes == ()


@pytest.mark.parametrize("state", ["INCLUDE", "EXCLUDE"])
def test_light_and_shadow_linking(build, translate, state):
    lamp, inside, outside = build.light("POINT"), build.plane("Inside"), build.plane("Outside")
    linked(lamp, "receiver_collection", inside, state)
    linked(lamp, "blocker_collection", outside, state)
    found = {item.name: item for item in translate().instances}
    lit, unlit = ("Inside", "Outside") if state == "INCLUDE" else ("Outside", "Inside")
    assert found[unlit].unlit_by == ("Point",) and found[lit].unlit_by == ()
    blocker, clear = ("Outside", "Inside") if state == "INCLUDE" else ("Inside", "Outside")
    assert found[clear].clear_for == ("Point",) and found[blocker].clear_for == ()


@pytest.mark.parametrize("states", [("INCLUDE", "EXCLUDE"), ("EXCLUDE", "INCLUDE")])
def test_the_last_entry_of_an_object_counts_in_light_linking(build, translate, states):
    """Objects come after collections, whichever was added first."""
    lamp, twice, once = build.light("POINT"), build.plane("Twice"), build.plane("Once")
    chosen, group = bpy.data.collections.new("Linked"), bpy.data.collections.new("Group")
    lamp.light_linking.receiver_collection = chosen
    chosen.objects.link(twice)
    chosen.children.link(group)
    for thing in (twice, once):
        group.objects.link(thing)
    chosen.collection_children[0].light_linking.link_state = states[0]
    chosen.collection_objects[0].light_linking.link_state = states[1]
    unlit = {item.name for item in translate().instances if item.unlit_by}
    assert unlit == {"Twice" if states[1] == "EXCLUDE" else "Once"}


def test_ray_visibility_of_lamp_object_and_world(build, translate):
    lamp, thing = build.light("POINT"), build.plane()
    lamp.visible_glossy = thing.visible_shadow = thing.visible_camera = False
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    world.cycles_visibility.diffuse = False
    scene = translate()
    assert scene.lights[0].hidden_from == Rays.GLOSSY
    assert scene.instances[0].hidden_from == Rays.SHADOW | Rays.CAMERA
    assert scene.world.hidden_from == Rays.DIFFUSE and not scene.notes


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_simplify_culls_by_view_and_distance(build, translate, kind):
    """An object that is subject to both rules is left out by both together, as in Cycles."""
    scene, camera = bpy.context.scene, build.camera((0, 0, 5))
    camera.data.type, camera.data.clip_end = kind, 100.0
    things = {name: build.plane(name, 1.0) for name in ("Seen", "Beside", "Behind", "Far", "Far beside", "Free")}
    places = {
        "Beside": (20, 0, 0),
        "Behind": (0, 0, 9),
        "Far": (0, 0, -30),
        "Far beside": (90, 0, 0),
        "Free": (90, 0, 0),
    }
    for name, place in places.items():
        things[name].location = place
    for name in ("Seen", "Beside", "Behind"):
        things[name].cycles.use_camera_cull = True
    for name in ("Seen", "Far"):
        things[name].cycles.use_distance_cull = True
    things["Far beside"].cycles.use_camera_cull = things["Far beside"].cycles.use_distance_cull = True
    scene.cycles.use_camera_cull = scene.cycles.use_distance_cull = True
    scene.cycles.distance_cull_margin, scene.cycles.camera_cull_margin = 25.0, 0.01
    assert {item.name for item in translate().instances} == set(things)
    scene.render.use_simplify = True
    found = translate()
    assert {item.name for item in found.instances} == {"Seen", "Free"} and not found.notes
    things["Beside"].cycles.use_distance_cull = True
    things["Beside"].update_tag()
    assert "Beside" in {item.name for item in translate().instances}


@pytest.mark.parametrize(
    ("output", "noted"), [("Is Diffuse Ray", True), ("Is Camera Ray", False), ("Ray Depth", False)]
)
@pytest.mark.parametrize("place", ["Strength", "Factor"])
def test_emission_by_rays_that_meet_it_by_chance_has_a_note(build, translate, output, noted, place):
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    rays, mix = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMixShader")
    shader = tree.nodes["shader"]
    end = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(rays.outputs[output], mix.inputs[0] if place == "Factor" else shader.inputs[place])
    tree.links.new(shader.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], end.inputs["Surface"])
    build.plane(material=material)
    assert [note.subject for note in translate().notes if output in note.message] == [material.name] * noted


@pytest.mark.parametrize("flag", ["holdout", "indirect_only"])
def test_collections_of_the_view_layer(build, translate, flag):
    thing = build.plane()
    own = bpy.data.collections.new("Own")
    bpy.context.scene.collection.children.link(own)
    bpy.context.scene.collection.objects.unlink(thing)
    own.objects.link(thing)
    setattr(bpy.context.view_layer.layer_collection.children["Own"], flag, True)
    bpy.context.scene.render.film_transparent = True
    instance = translate().instances[0]
    assert instance.is_holdout == (flag == "holdout")
    assert instance.hidden_from == (Rays.CAMERA if flag == "indirect_only" else Rays.NONE)


def test_environment_off_and_exposure_and_limits(build, translate):
    bpy.context.scene.world = bpy.data.worlds.new("World")
    bpy.context.view_layer.use_sky = False
    cycles = bpy.context.scene.cycles
    cycles.film_exposure, cycles.diffuse_bounces, cycles.max_bounces = 2.0, 3, 7
    cycles.caustics_refractive = False
    scene = translate()
    assert scene.world.is_black and scene.film.exposure == 2
    assert scene.settings.light_paths.diffuse == 3 and scene.settings.scene_bounces == 7
    assert not scene.settings.light_paths.refractive_caustics


@pytest.mark.parametrize(("output", "power"), [("Quadratic", 0), ("Linear", 1), ("Constant", 2)])
def test_light_falloff(build, translate, output, power):
    lamp = build.light("POINT", 10)
    emission = emission_of(lamp)
    node = emission.id_data.nodes.new("ShaderNodeLightFalloff")
    node.inputs["Strength"].default_value, node.inputs["Smooth"].default_value = 3.0, 0.5
    emission.id_data.links.new(node.outputs[output], emission.inputs["Strength"])
    light = translate().lights[0]
    assert (light.falloff.power, light.falloff.smooth, light.power_w) == (power, 0.5, pytest.approx(30))


def test_a_measured_luminaire(build, translate):
    lamp = build.light("POINT", 10)
    emission = emission_of(lamp)
    node = emission.id_data.nodes.new("ShaderNodeTexIES")
    node.mode, node.ies = "INTERNAL", bpy.data.texts.new("lamp.ies")
    node.ies.write(IES)
    emission.id_data.links.new(node.outputs[0], emission.inputs["Strength"])
    photometry = translate().lights[0].photometry
    np.testing.assert_allclose(photometry.strength, [np.array([100, 80, 20]) * 2.0 * 0.5 * 1 * WATTS_PER_CANDELA])
    node.ies.clear()
    node.ies.write(IES.replace("80", "-80"))
    assert any("1 negative candela of 3" in note.message for note in translate().notes)
    node.ies.clear()
    node.ies.write("no table")
    scene = translate()
    assert scene.lights[0].photometry is None and any("TILT=" in note.message for note in scene.notes)


BAD_TABLES = {
    "empty": "",
    "no number": "TILT=NONE\n1 2 x",
    "too short": "TILT=NONE\n1 2 3",
    "huge": IES.replace(" 3 1 1 2", " 99999 99999 1 2"),
    "no type": IES.replace(" 3 1 1 2", " 3 1 7 2"),
    "cut off": IES.replace("100 80 20", "100 80"),
}


@pytest.mark.parametrize("text", BAD_TABLES.values(), ids=BAD_TABLES)
def test_bad_luminaires_are_refused(text):
    with pytest.raises(FileFormatError):
        read_ies(text)


def test_mixed_emissions_are_added_with_their_shares(build, translate):
    lamp = build.light("POINT", 10)
    first = emission_of(lamp)
    tree = first.id_data
    second, mix = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeMixShader")
    first.inputs["Color"].default_value = (1, 0, 0, 1)
    second.inputs["Color"].default_value, second.inputs["Strength"].default_value = (0, 1, 0, 1), 2.0
    mix.inputs[0].default_value = 0.25
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_LIGHT")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    light = translate().lights[0]
    np.testing.assert_allclose(light.power_w * light.color.linear_rgb, (7.5, 5, 0), atol=1e-5)


def world_of_two(build, kind, factor):
    """A world that mixes or adds a color and an image; the mix uses a number or Is Camera Ray."""
    from blender_addon import compat

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    first = next(node for node in tree.nodes if node.type == "BACKGROUND")
    first.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    second, texture = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = build.image("Sky", np.full((4, 8, 4), 0.8, np.float32), float_buffer=True, color_space="Non-Color")
    tree.links.new(texture.outputs["Color"], second.inputs["Color"])
    node = tree.nodes.new(kind)
    shaders = [socket for socket in node.inputs if socket.type == "SHADER"]
    tree.links.new(first.outputs[0], shaders[0])
    tree.links.new(second.outputs[0], shaders[1])
    if isinstance(factor, str):
        tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs[factor], node.inputs[0])
    elif factor is not None:
        node.inputs[0].default_value = factor
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(node.outputs[0], output.inputs["Surface"])


def test_backgrounds_are_mixed_and_added_exactly(build, translate):
    world_of_two(build, "ShaderNodeMixShader", 0.25)
    world = translate().world
    assert isinstance(world.color, ImageTexture)
    np.testing.assert_allclose(world.strength * world.color.pixels, 0.75 * 0.5 + 0.25 * 0.8, rtol=1e-5)


def test_a_background_for_the_camera_alone_does_not_light_the_scene(build, translate):
    world_of_two(build, "ShaderNodeMixShader", "Is Camera Ray")
    scene = translate()
    assert isinstance(scene.world.color, Color) and np.allclose(scene.world.color.linear_rgb, 0.5)
    assert isinstance(scene.world.camera_view.color, ImageTexture) and not scene.notes


@pytest.mark.parametrize("is_bumped", [True, False])
def test_emission_by_a_bumped_normal_has_a_note(build, translate, is_bumped):
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    checker, bump = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeBump")
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(checker.outputs[1], bump.inputs["Height"])
    shown = bump.outputs[0] if is_bumped else geometry.outputs["Normal"]
    tree.links.new(shown, tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    noted = [note.subject for note in translate().notes if "bumped normal" in note.message]
    assert noted == [material.name] * is_bumped
