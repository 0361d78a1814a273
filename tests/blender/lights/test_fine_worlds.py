# SPDX-License-Identifier: GPL-3.0-or-later
"""A pattern of a world that is finer than the environment drawn from it is seen as it is, also through a long lens."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

pytest.importorskip("bpy")

COARSE = "finer than the environment"


def _world():
    """The tree of a new world, and its background."""
    import bpy

    from blender_addon import compat

    world = bpy.context.scene.world = bpy.data.worlds.new("Chess")
    tree = compat.use_nodes(world)
    return tree, next(node for node in tree.nodes if node.type == "BACKGROUND")


def _checker(scale: float, coordinates: str = "Generated"):
    tree, background = _world()
    checker, place = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeTexCoord")
    checker.inputs["Scale"].default_value = scale
    checker.inputs["Color1"].default_value = (0.9, 0.5, 0.2, 1)
    tree.links.new(place.outputs[coordinates], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], background.inputs["Color"])
    return tree, checker, background


def _stars():
    """Stars of two hundredths of a radian on a dim sky, whose strength is a pattern."""
    tree, background = _world()
    place, cells = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexVoronoi")
    near, strength = (tree.nodes.new("ShaderNodeMath") for _ in range(2))
    cells.inputs["Scale"].default_value = 60.0
    near.operation, strength.operation = "LESS_THAN", "MULTIPLY_ADD"
    near.inputs[1].default_value = 0.15
    strength.inputs[1].default_value, strength.inputs[2].default_value = 3.0, 0.02
    tree.links.new(place.outputs["Generated"], cells.inputs["Vector"])
    for first, second, name in ((cells, near, 0), (near, strength, 0), (strength, background, "Strength")):
        tree.links.new(first.outputs[0], second.inputs[name])


def _camera(build, lens: float):
    """A camera that looks along +Y, where two edges of the checker cross in the middle of the picture."""
    import bpy

    camera = build.camera()
    camera.data.lens = lens
    camera.location, camera.rotation_euler = (0, 0, 0), (np.pi / 2, 0, 0)
    bpy.context.view_layer.update()


def _is_named(scene) -> bool:
    return any(COARSE in note.message for note in scene.notes)


def _far(tmp_path) -> float:
    """Error of the picture against Cycles (root mean square) over its mean."""
    wanted, (found, notes) = cycles(tmp_path), ours()
    assert not any(COARSE in note for note in notes)
    return _apart(found, wanted)


def _apart(found, wanted) -> float:
    return float(np.sqrt(np.mean((found - wanted) ** 2)) / wanted.mean())


CASES = {
    "edges through a long lens": (lambda: _checker(3.0), 1200.0, 0.02),  # 0.25 by the environment alone
    "fine checker": (lambda: _checker(150.0), 35.0, 0.15),  # 0.27
    "checker in the space of the camera": (lambda: _checker(200.0, "Camera"), 35.0, 0.15),
    "checker in the frame": (lambda: _checker(40.0, "Window"), 35.0, 0.08),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_fine_patterns_of_worlds_equal_those_of_cycles(build, tmp_path, name: str):
    pytest.importorskip("mitsuba")
    make, lens, most = CASES[name]
    make()
    _camera(build, lens)
    settings(samples=64, size=48)
    assert _far(tmp_path) < most


def test_a_mirror_and_a_floor_under_stars_equal_those_of_cycles(build, tmp_path):
    """The mirror and the sky show the stars; the floor has no more noise than under a smooth sky."""
    pytest.importorskip("mitsuba")
    _stars()
    _camera(build, 35.0)
    build.plane(size=1.2, material=build.material(shader="ShaderNodeBsdfGlossy", Roughness=0.0)).location = (
        0,
        1.2,
        -0.4,
    )
    build.plane("Floor", size=40.0, material=build.material("Paper")).location = (0, 0, -0.5)
    settings(samples=400, size=48)
    wanted, (found, _) = cycles(tmp_path), ours(samples=400)
    floor, mirror, sky = slice(15, 20), (slice(4, 12), slice(18, 30)), slice(26, 48)
    np.testing.assert_allclose(found[floor].mean(), wanted[floor].mean(), rtol=0.05)
    assert found[floor].std() < wanted[floor].std()
    assert _apart(found[sky], wanted[sky]) < 1.0  # 2.9 by the environment alone
    assert np.corrcoef(found[mirror].ravel(), wanted[mirror].ravel())[0, 1] > 0.7


def test_a_pattern_that_only_the_camera_sees(build, translate):
    """With Is Camera Ray as the factor, the light comes from another, plain background."""
    from spectral_core.scene import Color, DrawnPattern

    tree, _, background = _checker(150.0)
    mix, path, plain = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "LightPath", "Background"))
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(plain.outputs[0], mix.inputs[1])
    tree.links.new(background.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    world = translate().world
    assert isinstance(world.color, Color)
    assert world.camera_view is not None and isinstance(world.camera_view.color, DrawnPattern)


def test_a_smooth_world_needs_no_pattern(build, translate):
    from spectral_core.scene import DrawnPattern

    tree, background = _world()
    gradient = tree.nodes.new("ShaderNodeTexGradient")
    tree.links.new(gradient.outputs[0], background.inputs["Color"])
    world = translate().world
    assert world.is_image and not isinstance(world.color, DrawnPattern)


def test_a_fine_pattern_that_needs_a_surface_is_named(build, translate):
    tree, checker, background = _checker(150.0)
    occlusion = tree.nodes.new("ShaderNodeAmbientOcclusion")
    tree.links.new(checker.outputs["Color"], occlusion.inputs["Color"])
    tree.links.new(occlusion.outputs["Color"], background.inputs["Color"])
    assert _is_named(translate())


def test_a_fine_image_at_its_own_pixels_has_no_note(build, translate):
    import bpy

    _camera(build, 35.0)
    image = bpy.data.images.new("Wide", 128, 64, float_buffer=True)
    rng = np.random.default_rng(4)
    image.pixels.foreach_set(rng.random(128 * 64 * 4).astype(np.float32))
    tree, background = _world()
    node, gamma = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeGamma")
    node.image = image
    gamma.inputs["Gamma"].default_value = 1.5
    tree.links.new(node.outputs[0], gamma.inputs["Color"])
    tree.links.new(gamma.outputs[0], background.inputs["Color"])
    assert not _is_named(translate())
