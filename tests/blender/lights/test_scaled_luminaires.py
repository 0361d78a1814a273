# SPDX-License-Identifier: GPL-3.0-or-later
"""The distribution of a measured luminaire is stretched and mirrored with its lamp, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

TABLE = """IESNA:LM-63-2002
TILT=NONE
1 1000 1 3 4 1 2 0 0 0
1 1 50
0 90 180
0 90 180 270
100 400 10
100 50 10
100 200 10
100 20 10
"""


def _luminaire(build, translate, scale):
    from blender_addon import compat

    build.camera()
    data = bpy.data.lights.new("Downlight", "POINT")
    data.energy = 100.0
    lamp = bpy.data.objects.new("Downlight", data)
    lamp.scale = scale
    bpy.context.scene.collection.objects.link(lamp)
    tree = compat.use_nodes(data)
    text = bpy.data.texts.new("table.ies")
    text.write(TABLE)
    node = tree.nodes.new("ShaderNodeTexIES")
    node.mode, node.ies = "INTERNAL", text
    emission = next(each for each in tree.nodes if each.type == "EMISSION")
    tree.links.new(node.outputs[0], emission.inputs["Strength"])
    bpy.context.view_layer.update()
    (light,) = translate().lights
    return light


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.5, 2.5, 2.5)])
def test_a_lamp_that_keeps_angles_has_its_table(build, translate, scale):
    light = _luminaire(build, translate, scale)
    assert light.photometry is not None and light.pattern is None


def _strength(program, direction: np.ndarray) -> float:
    def read(name: str, shift: int):
        return tuple(np.array([part]) for part in direction) if name in ("incoming", "normal") else np.zeros(1)

    return float(np.ravel(program.evaluate(read, transform=lambda vector, *_: vector))[0])


@pytest.mark.parametrize(("scale", "mirrored"), [((1.0, -1.0, 1.0), (1, -1, 1)), ((-1.0, 1.0, 1.0), (-1, 1, 1))])
def test_a_mirrored_lamp_has_a_mirrored_distribution(build, translate, scale, mirrored):
    plain = _luminaire(build, translate, (1.0, 1.0, 1.001))  # hardly stretched: the program without a mirror
    bpy.data.objects.remove(bpy.data.objects["Downlight"])
    light = _luminaire(build, translate, scale)
    assert light.photometry is None and light.pattern is not None and plain.pattern is not None
    rng = np.random.default_rng(3)
    found, expected = [], []
    for direction in rng.normal(size=(20, 3)):
        direction /= np.linalg.norm(direction)
        found.append(_strength(light.pattern.program, direction))
        expected.append(_strength(plain.pattern.program, direction * mirrored))
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=0.02 * max(expected))
    assert np.ptp(expected) > 0.5 * max(expected)
