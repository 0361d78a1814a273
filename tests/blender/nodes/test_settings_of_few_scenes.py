# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that few scenes use: read as by Cycles, or named in a note."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def messages(scene):
    return " | ".join(note.message for note in scene.notes)


def test_particles_have_the_properties_of_their_settings(build, translate):
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "INSTANCER", "shade"
    tree.links.new(node.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    shown, emitter = build.plane("Shown", material=material), build.plane("Emitter")
    settings = emitter.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 2, 0, 0, 100
    settings.physics_type, settings.render_type, settings.instance_object = "NO", "OBJECT", shown
    emitter["shade"], settings["shade"] = 0.25, 0.75
    bpy.context.scene.frame_set(2)
    found = [dict(item.attributes)["object_attribute:INSTANCER:shade"] for item in translate().instances[-2:]]
    np.testing.assert_allclose(found, [(0.75, 0.75, 0.75, 1.0)] * 2)


def test_portal_depth_is_named(build, translate):
    material = build.material()
    tree = material.node_tree
    rays = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(rays.outputs["Portal Depth"], tree.nodes["shader"].inputs["Roughness"])
    build.plane(material=material)
    assert "'Portal Depth' of 'Light Path' is 0 here" in messages(translate())


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="a setting of the object before")
def test_adaptive_subdivision_of_the_modifier_is_named(build, translate):
    modifier = build.plane().modifiers.new("Fine", "SUBSURF")
    assert "adaptive" not in messages(translate())
    modifier.use_adaptive_subdivision = True
    assert "adaptive subdivision is not simulated" in messages(translate())


def test_a_metal_whose_index_varies_is_named_by_its_input(build, translate):
    material = build.material(shader="ShaderNodeBsdfMetallic")
    tree = material.node_tree
    tree.nodes["shader"].fresnel_type = "PHYSICAL_CONDUCTOR"
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], tree.nodes["shader"].inputs["Extinction"])
    build.plane(material=material)
    assert "shader: Extinction supports one vector only; its mean was used" in messages(translate())


@pytest.mark.parametrize("kind", ["PANO", "PERSP", "ORTHO"])
def test_spherical_stereo_is_named(build, translate, kind):
    build.plane()
    lens = build.camera().data
    lens.type, lens.stereo.use_spherical_stereo = kind, True
    assert "spherical stereo" not in messages(translate())
    bpy.context.scene.render.use_multiview = True
    assert ("spherical stereo" in messages(translate())) == (kind != "ORTHO")
    bpy.context.scene.render.views_format = "MULTIVIEW"
    assert "spherical stereo" not in messages(translate())


@pytest.mark.parametrize("output", ["Ray Depth", "Diffuse Depth", "Is Diffuse Ray", "Glossy Depth"])
def test_a_world_reads_a_ray_alike_with_and_without_nodes_between(build, translate, output):
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    from blender_addon import compat
    from spectral_core.render.still import render_scene

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    rays, between = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    between.operation = "MULTIPLY"
    between.inputs[1].default_value = 1.0
    build.plane()
    build.camera()
    film = bpy.context.scene.render
    film.resolution_x, film.resolution_y = 8, 6
    bpy.context.scene.spectral.render.samples = 16

    def shown():
        return render_scene(translate()).pixels[..., :3]

    tree.links.new(rays.outputs[output], background.inputs["Strength"])
    plain = shown()
    tree.links.new(rays.outputs[output], between.inputs[0])
    tree.links.new(between.outputs[0], background.inputs["Strength"])
    np.testing.assert_allclose(plain, shown(), rtol=1e-4, atol=1e-5)
    assert bool(plain.max() > 0.02) == (output != "Glossy Depth")  # the world is 0.05, a reflection of it less


@pytest.mark.parametrize("setting", ["visible_camera", "visible_glossy", "is_shadow_catcher", "visible_shadow"])
@pytest.mark.parametrize("kind", ["fog", "surface"])
def test_only_a_catcher_with_a_volume_is_named(build, translate, kind, setting):
    material = build.material(shader="ShaderNodeVolumeScatter" if kind == "fog" else "ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    if kind == "fog":
        tree.links.clear()
        tree.links.new(tree.nodes["shader"].outputs[0], tree.nodes["Material Output"].inputs["Volume"])
    thing = build.plane(material=material)
    assert "volume" not in messages(translate())
    setattr(thing, setting, setting.startswith("is_"))
    assert ("its volume" in messages(translate())) == (kind == "fog" and setting == "is_shadow_catcher")


@pytest.mark.parametrize("has_surface", [False, True])
def test_only_a_surface_is_a_holdout(build, translate, has_surface):
    """A volume-only object lets the picture through, as in Cycles."""
    material = build.material(shader="ShaderNodeVolumeScatter")
    tree = material.node_tree
    output = tree.nodes["Material Output"]
    tree.links.clear()
    tree.links.new(tree.nodes["shader"].outputs[0], output.inputs["Volume"])
    if has_surface:
        tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], output.inputs["Surface"])
    build.plane(material=material).is_holdout = True
    assert translate().instances[0].is_holdout == has_surface


def test_limits_of_simplify_are_named_if_it_is_on(build, translate):
    build.plane()
    scene = bpy.context.scene
    scene.render.simplify_volumes, scene.cycles.texture_limit_render = 0.5, "512"
    assert "Simplify" not in messages(translate())
    scene.render.use_simplify = True
    found = messages(translate())
    assert "volumes are shown at full resolution" in found and "textures are read at full size" in found


def test_the_base_of_a_normal_map_is_named():
    """Blender 5.2 has it."""
    from blender_addon.translate.ledger import entries

    assert "displaced" in entries()["ShaderNodeNormalMap"].noted["base"]
