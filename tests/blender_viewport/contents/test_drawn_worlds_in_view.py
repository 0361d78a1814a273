# SPDX-License-Identifier: GPL-3.0-or-later
"""Skies and patterns of the world in a view: drawn again only if the world has changed, and then always."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import updated, whole  # noqa: E402


@pytest.fixture
def drawn(coarse, monkeypatch):
    """A sky that is mixed with a gradient, in a view, and the number of the environments that were drawn."""
    from blender_addon.translate.lighting import patterns

    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:  # before Blender 5
        world.use_nodes = True
    tree = world.node_tree
    sky, place, gradient, ramp, mix = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexSky", "TexCoord", "TexGradient", "ValToRGB", "Mix")
    )
    mix.data_type = "RGBA"
    colors = [socket for socket in mix.inputs if socket.type == "RGBA"]
    tree.links.new(place.outputs["Generated"], gradient.inputs[0])
    tree.links.new(gradient.outputs[0], ramp.inputs[0])
    tree.links.new(sky.outputs[0], colors[0])
    tree.links.new(ramp.outputs[0], colors[1])
    tree.links.new(next(out for out in mix.outputs if out.type == "RGBA"), tree.nodes["Background"].inputs[0])
    counted, usual = [], patterns.environment_of
    monkeypatch.setattr(patterns, "environment_of", lambda *given: counted.append(1) or usual(*given))
    updated(coarse)
    coarse.drawn = counted
    return coarse


def undo_of_a_move():
    bpy.ops.ed.undo_push(message="before")
    bpy.data.objects["Ball"].location.x += 1
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()


def sky():
    return next(node for node in bpy.context.scene.world.node_tree.nodes if node.type == "TEX_SKY")


def background():
    return bpy.context.scene.world.node_tree.nodes["Background"]


EDITS = {
    "elevation": lambda: setattr(sky(), "sun_elevation", 0.9),
    "size of the sun": lambda: setattr(sky(), "sun_size", 0.2),
    "intensity of the sun": lambda: setattr(sky(), "sun_intensity", 0.5),
    "disk": lambda: setattr(sky(), "sun_disc", False),
    "ramp": lambda: setattr(
        next(n for n in sky().id_data.nodes if n.type == "VALTORGB").color_ramp.elements[1], "color", (1, 0, 0, 1)
    ),
    "strength": lambda: setattr(background().inputs[1], "default_value", 0.4),
    "name": lambda: setattr(bpy.context.scene.world, "name", "Other"),
    "light group": lambda: (
        bpy.context.view_layer.lightgroups.add(name="Key"), setattr(bpy.context.scene.world, "lightgroup", "Key"),
        bpy.context.scene.world.update_tag(),
    ),
    "rays": lambda: setattr(bpy.context.scene.world.cycles_visibility, "glossy", False),
    "shader": lambda: added(),
}  # fmt: skip


def added():
    """The same background twice, as a sum: the same programs in another shader."""
    tree = bpy.context.scene.world.node_tree
    total = tree.nodes.new("ShaderNodeAddShader")
    for place in total.inputs:
        tree.links.new(background().outputs[0], place)
    tree.links.new(total.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Surface"])


def known(stage):
    return next(iter(stage.link.scenes.values()))


def same_as_drawn_anew(stage):
    from blender_addon.translate.lighting import patterns
    from spectral_core.render.same import equal

    patterns._latest.clear()
    true, sent = whole(stage), known(stage)
    np.testing.assert_array_equal(sent.world.color.pixels, true.world.color.pixels)
    assert equal(sent.world, true.world) and equal(sent.lights, true.lights)
    assert {n.message for n in sent.notes if n.subject == sent.world.color.name} == {
        n.message for n in true.notes if n.subject == sent.world.color.name
    }


def test_frames_undos_and_other_edits_draw_no_sky_again(drawn):
    """A sky took 170 to 410 ms of Blender's main thread in each of them."""
    drawn.drawn.clear()
    for edit in (
        lambda: bpy.context.scene.frame_set(7), undo_of_a_move,
        lambda: bpy.context.scene.collection.children.link(bpy.data.collections.new("More")),
    ):  # fmt: skip
        updated(drawn, lambda _stage, edit=edit: edit())
        assert drawn.drawn == []
    same_as_drawn_anew(drawn)


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_sky_is_that_of_a_new_view(drawn, name):
    before = known(drawn)
    updated(drawn, lambda _stage: EDITS[name]())
    assert known(drawn) is not before or name == "rays"  # which Blender does not report
    if name == "rays":
        updated(drawn, lambda _stage: bpy.context.scene.world.update_tag())
    same_as_drawn_anew(drawn)


def test_a_color_for_another_type_of_ray_is_that_of_a_new_view(drawn):
    """What the camera and diffuse rays meet stays the same; the view kept the world of before the edit."""
    tree = bpy.context.scene.world.node_tree
    path = tree.nodes.new("ShaderNodeLightPath")
    red, mixed = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeMixShader")
    red.inputs[0].default_value = (1.0, 0.0, 0.0, 1.0)
    for output, place in (
        (background().outputs[0], mixed.inputs[1]), (red.outputs[0], mixed.inputs[2]),
        (mixed.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Surface"]),
    ):  # fmt: skip
        tree.links.new(output, place)
    for rays in ("Is Glossy Ray", "Is Transmission Ray"):
        tree.links.new(path.outputs[rays], mixed.inputs[0])
        updated(drawn)
    same_as_drawn_anew(drawn)
