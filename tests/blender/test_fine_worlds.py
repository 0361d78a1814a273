# SPDX-License-Identifier: GPL-3.0-or-later
"""A pattern of a world that is finer than the environment drawn from it is named, also through a long lens."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

COARSE = "finer than the environment"


def _checker(scale: float):
    import bpy

    from blender_addon import compat

    world = bpy.context.scene.world = bpy.data.worlds.new("Chess")
    tree = compat.use_nodes(world)
    checker, place = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeTexCoord")
    checker.inputs["Scale"].default_value = scale
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(place.outputs["Generated"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], background.inputs["Color"])
    return tree


def _camera(build, lens: float):
    camera = build.camera()
    camera.data.lens = lens
    return camera


def _look_at_an_edge(camera):
    """Look along +Y, where two edges of the pattern cross in the middle of the picture."""
    import bpy

    camera.rotation_euler = (np.pi / 2, 0, 0)
    bpy.context.view_layer.update()


def _is_named(scene) -> bool:
    return any(COARSE in note.message for note in scene.notes)


@pytest.mark.parametrize(("scale", "lens", "is_named"), [(3.0, 35.0, False), (150.0, 35.0, True), (3.0, 1200.0, True)])
def test_fine_patterns_of_worlds_are_named(build, translate, scale: float, lens: float, is_named: bool):
    camera = _camera(build, lens)
    _look_at_an_edge(camera)
    _checker(scale)
    assert _is_named(translate()) == is_named


def test_a_fine_pattern_that_the_camera_does_not_see_through_its_long_lens_has_no_note(build, translate):
    import bpy

    camera = _camera(build, 1200.0)
    _look_at_an_edge(camera)
    _checker(3.0)
    bpy.context.scene.render.film_transparent = True
    assert not _is_named(translate())


def test_a_fine_image_at_its_own_pixels_has_no_note(build, translate):
    import bpy

    from blender_addon import compat

    _camera(build, 35.0)
    image = bpy.data.images.new("Wide", 128, 64, float_buffer=True)
    rng = np.random.default_rng(4)
    image.pixels.foreach_set(rng.random(128 * 64 * 4).astype(np.float32))
    world = bpy.context.scene.world = bpy.data.worlds.new("Grains")
    tree = compat.use_nodes(world)
    node, gamma = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeGamma")
    node.image = image
    gamma.inputs["Gamma"].default_value = 1.5
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(node.outputs[0], gamma.inputs["Color"])
    tree.links.new(gamma.outputs[0], background.inputs["Color"])
    assert not _is_named(translate())
