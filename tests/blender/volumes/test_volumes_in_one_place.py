# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on volumes of objects that are in one place, where Cycles and this renderer differ."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

COMMON, OTHER_WAYS = "faces of its volume coincide", "scatters other colors into other directions"
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


@pytest.fixture
def fog(build: Any) -> Any:
    """A box from ``low`` to ``high`` with Volume Scatter."""

    def make(low: Any, high: Any, **inputs: Any) -> Any:
        material = build.material()
        tree = material.node_tree
        tree.nodes.remove(tree.nodes["shader"])
        node = tree.nodes.new("ShaderNodeVolumeScatter")
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs[0], output.inputs["Volume"])
        unit = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
        points = np.array(low) + unit * (np.array(high) - np.array(low))
        mesh = bpy.data.meshes.new("Fog")
        mesh.from_pydata(points.tolist(), [], SIDES)
        mesh.materials.append(material)
        obj = bpy.data.objects.new("Fog", mesh)
        bpy.context.scene.collection.objects.link(obj)
        return obj

    return make


def notes_with(scene: Any, words: str) -> int:
    return sum(words in note.message for note in scene.notes)


@pytest.mark.parametrize(
    ("low", "high", "count"),
    [
        ((0, 0, 0), (1, 1, 1), 1),  # the same box
        ((0.2, 0.2, 0), (0.8, 0.8, 0.5), 1),  # inside, on the same bottom
        ((1, 0, 0), (2, 1, 1), 0),  # beside, face to face
        ((0.2, 0.2, 0.2), (0.8, 0.8, 0.8), 0),  # inside
        ((-0.01, -0.01, -0.01), (1.01, 1.01, 1.01), 0),  # around
    ],
)
def test_volumes_with_common_faces_are_named(fog: Any, translate: Any, low: Any, high: Any, count: int) -> None:
    fog((0, 0, 0), (1, 1, 1))
    fog(low, high)
    scene = translate()
    assert notes_with(scene, COMMON) == count and notes_with(scene, OTHER_WAYS) == 0


@pytest.mark.parametrize(
    ("inputs", "apart", "count"),
    [
        ({"Anisotropy": 0.7, "Color": (0.9, 0.5, 0.2, 1)}, 0.5, 1),
        ({"Anisotropy": 0.7, "Color": (0.4, 0.4, 0.4, 1)}, 0.5, 0),  # the same color, darker
        ({"Color": (0.9, 0.5, 0.2, 1)}, 0.5, 0),  # the same directions
        ({"Anisotropy": 0.7, "Color": (0, 0, 0, 1)}, 0.5, 0),  # it does not scatter
        ({"Anisotropy": 0.7, "Color": (0.9, 0.5, 0.2, 1)}, 1.5, 0),
    ],
)
def test_overlapping_volumes_of_other_directions_and_colors_are_named(
    fog: Any, translate: Any, inputs: Any, apart: float, count: int
) -> None:
    fog((0, 0, 0), (1, 1, 1))
    fog((apart,) * 3, (apart + 1,) * 3, **inputs)
    scene = translate()
    assert notes_with(scene, OTHER_WAYS) == count and notes_with(scene, COMMON) == 0
