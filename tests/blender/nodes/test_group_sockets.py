# SPDX-License-Identifier: GPL-3.0-or-later
"""Values change their type at the sockets of groups and at muted nodes in Blender 4, and not in Blender 5.

The expected numbers are what Cycles of 4.3.2 and 5.0.1 render for a color or vector (0.1, 0.5, 0.9) that varies.
"""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

PARTS, MEAN, LUMINANCE = (0.1, 0.5, 0.9), (0.5,) * 3, (0.4438,) * 3


def source(tree, kind):
    """A color or vector (0.1, 0.5, 0.9) that depends on the object."""
    info = tree.nodes.new("ShaderNodeObjectInfo")
    if kind == "RGBA":
        return info.outputs["Color"]
    moved = tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(info.outputs["Location"], moved.inputs[0])
    moved.inputs[1].default_value = PARTS
    return moved.outputs[0]


def through_group(tree, output, types):
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    for side, kind in zip(("INPUT", "OUTPUT"), types, strict=True):
        inner.interface.new_socket(side, in_out=side, socket_type=f"NodeSocket{kind}")
    inner.links.new(inner.nodes.new("NodeGroupInput").outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    tree.links.new(output, group.inputs[0])
    return group.outputs[0]


def through_muted(tree, output, kind):
    node = tree.nodes.new(kind)
    tree.links.new(output, node.inputs[0])
    node.mute = True
    return node.outputs[0]


@pytest.fixture
def shown(build, translate, monkeypatch):
    """The color that a material emits, by the kind of source, what it passes, and the type of socket at the end."""
    from blender_addon import compat
    from spectral_core.scene import Computed

    def run(kind, types, end, converts):
        monkeypatch.setattr(compat, "converts_in_groups", lambda: converts)
        if converts:  # Blender 4 inlines nothing
            monkeypatch.setattr(compat, "inlined", lambda owner: None)
        material = build.material(shader="ShaderNodeEmission")
        build.plane(material=material)
        tree = material.node_tree
        output = source(tree, kind)
        output = through_muted(tree, output, types) if isinstance(types, str) else through_group(tree, output, types)
        last = tree.nodes.new("ShaderNodeMath" if end == "number" else "ShaderNodeVectorMath")
        last.operation = "MULTIPLY"
        last.inputs[1].default_value = 1.0 if end == "number" else (1.0, 1.0, 1.0)
        tree.links.new(output, last.inputs[0])
        tree.links.new(last.outputs[0], tree.nodes["shader"].inputs["Color"])
        color = next(item for item in translate().materials if item.name == material.name).surface.color
        assert isinstance(color, Computed)
        inputs = {"object_color": PARTS, "object_location": (0.0, 0.0, 0.0)}
        return np.ravel(color.program.evaluate(lambda name, _: tuple(np.full(1, part) for part in inputs[name])))

    return run


CASES = [
    ("RGBA", ("Float", "Vector"), "vector", LUMINANCE, PARTS),
    ("VECTOR", ("Float", "Color"), "vector", MEAN, PARTS),
    ("RGBA", ("Vector", "Float"), "vector", MEAN, PARTS),
    ("RGBA", ("Vector", "Vector"), "number", MEAN, LUMINANCE),
    ("VECTOR", ("Color", "Color"), "number", LUMINANCE, MEAN),
    ("VECTOR", ("Color", "Float"), "vector", LUMINANCE, PARTS),
    ("RGBA", ("Int", "Float"), "number", (0.0,) * 3, LUMINANCE),
    ("RGBA", ("Color", "Color"), "vector", PARTS, PARTS),
    ("RGBA", "ShaderNodeMath", "vector", LUMINANCE, PARTS),
    ("VECTOR", "ShaderNodeGamma", "number", LUMINANCE, MEAN),
]


@pytest.mark.parametrize(("kind", "types", "end", "in_4", "in_5"), CASES)
def test_values_change_at_sockets_of_groups_in_blender_4_alone(shown, kind, types, end, in_4, in_5):
    for converts, expected in ((False, in_5), (True, in_4)):
        found = shown(kind, types, end, converts)
        np.testing.assert_allclose(np.broadcast_to(found, 3), expected, atol=2e-4)


def test_this_blender_converts_as_its_version_does():
    from blender_addon import compat

    assert compat.converts_in_groups() == (bpy.app.version < (5, 0))
