# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of a mesh's connected parts and edges where Blender splits it for Cycles, along sharp edges."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

from blender_addon import compat  # noqa: E402
from tests.blender import cycles  # noqa: E402

NODES = {
    "islands": ("ShaderNodeNewGeometry", "Random Per Island"),
    "pointiness": ("ShaderNodeNewGeometry", "Pointiness"),
    "edges": ("ShaderNodeAttribute", "Color"),
}


def head(build, name):
    """A head that is smooth by angle and shows a number of its mesh."""
    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    thing = bpy.context.object
    stored = thing.data.attributes.new("tones", "FLOAT", "EDGE")
    stored.data.foreach_set("value", np.random.default_rng(5).random(len(stored.data)).astype(np.float32))
    material = build.material(shader="ShaderNodeEmission")
    thing.data.materials.append(material)
    tree = compat.use_nodes(material)
    kind, output = NODES[name]
    node = tree.nodes.new(kind)
    if name == "edges":
        node.attribute_name = "tones"
    emission = next(each for each in tree.nodes if each.type == "EMISSION")
    tree.links.new(node.outputs[output], emission.inputs["Color"])
    bpy.ops.object.shade_smooth_by_angle(angle=0.4)
    return thing


def compared(tmp_path):
    """Mean difference of blocks of 4 by 4 pixels, relative to the mean, and our notes."""
    cycles.settings(samples=64, size=32)
    theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(samples=64)
    apart = (ours - theirs).reshape(8, 4, 8, 4, 3).mean(axis=(1, 3))
    return np.abs(apart).mean() / theirs.mean(), notes


@pytest.mark.parametrize("name", NODES)
def test_numbers_of_a_mesh_with_sharp_edges_are_those_of_its_parts(build, tmp_path, name):
    """Islands were those of the whole mesh: 70 % of a head's light was off, without a note."""
    head(build, name)
    build.camera((0.0, 0.0, 6.0))
    error, notes = compared(tmp_path)
    assert error < 0.02
    assert not notes


def test_instances_of_a_mesh_with_sharp_edges_have_its_parts_too(build, tmp_path):
    thing = head(build, "islands")
    group = bpy.data.collections.new("Heads")
    bpy.context.scene.collection.objects.unlink(thing)
    group.objects.link(thing)
    for x in (-1.1, 1.1):
        empty = bpy.data.objects.new("Empty", None)
        empty.location.x, empty.instance_type, empty.instance_collection = x, "COLLECTION", group
        bpy.context.scene.collection.objects.link(empty)
    build.camera((0.0, 0.0, 8.0))
    assert compared(tmp_path)[0] < 0.02
    assert not [mesh for mesh in bpy.data.meshes if mesh.name.startswith("Suzanne.")]  # no copy stays


def test_flat_instances_have_a_note(build, translate):
    """Cycles does not show them; flat objects that are the only ones of their mesh it shows."""
    plane = build.plane(name="Flat")
    plane.scale.z = 0.0
    assert not any("Cycles does not show" in note.message for note in translate().notes)
    other = build.object("Other", plane.data)
    other.location.x, other.scale = 3.0, (1.0, 1.0, 0.001)
    told = [note.subject for note in translate().notes if "Cycles does not show" in note.message]
    assert told == ["Flat"]
