# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders and values that are read more than once, in towers and lattices of mixes and sums, and long rows of nodes.

The work is counted in links that are followed; weights are compared with products of matrices.
"""

from __future__ import annotations

import pickle
import sys
import threading

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.translate.lighting import patterns  # noqa: E402

KINDS = {"material": "ShaderNodeBsdfDiffuse", "world": "ShaderNodeBackground", "lamp": "ShaderNodeEmission"}
DEEP = 40
"""Levels that no method whose cost doubles with each of them would end."""


class Tree:
    """A new node tree of an owner, with the shaders of its kind."""

    def __init__(self, build, kind):
        from blender_addon import compat

        self.kind = kind
        if kind == "material":
            owner = build.material()
            build.plane(material=owner)
        elif kind == "world":
            owner = bpy.context.scene.world = bpy.data.worlds.new("World")
        else:
            owner = build.light("POINT").data
        self.nodes = compat.use_nodes(owner).nodes
        self.links = owner.node_tree.links
        self.nodes.clear()
        self.output = self.nodes.new(f"ShaderNodeOutput{ {'lamp': 'Light'}.get(kind, kind.title()) }")

    def leaf(self, color=(0.5, 0.5, 0.5)):
        node = self.nodes.new(KINDS[self.kind])
        node.inputs[0].default_value = (*color, 1)
        return node.outputs[0]

    def both(self, kind, first, second, factor=0.5):
        """A mix or sum of two shaders; ``factor``: a number or an output."""
        node = self.nodes.new(f"ShaderNode{kind}Shader")
        for socket, output in zip([s for s in node.inputs if s.type == "SHADER"], (first, second), strict=True):
            self.links.new(output, socket)
        if kind == "Mix" and isinstance(factor, float):
            node.inputs[0].default_value = factor
        elif kind == "Mix":
            self.links.new(factor, node.inputs[0])
        return node.outputs[0]

    def show(self, output, name="Surface"):
        self.links.new(output, self.output.inputs[name])


@pytest.fixture
def followed(monkeypatch):
    """Counts the links that a translation follows."""
    from blender_addon.translate.shading import tree

    counts, path = [0], tree.Input.path

    def counted(self):
        counts[0] += 1
        return path(self)

    monkeypatch.setattr(tree.Input, "path", counted)
    return counts


def tower(tree, kind, depth, factor=0.5):
    last = tree.leaf()
    for _ in range(depth):
        last = tree.both(kind, last, last, factor)
    return last


@pytest.mark.parametrize("owner", KINDS)
@pytest.mark.parametrize("shape", ["mixes", "sums", "lattice", "varying lattice"])
def test_the_work_grows_with_the_nodes(build, translate, followed, owner, shape, monkeypatch):
    monkeypatch.setattr(patterns, "ROWS", 16)
    work = []
    for depth in (DEEP // 2, DEEP):
        tree = Tree(build, owner)
        if shape in ("mixes", "sums"):
            tree.show(tower(tree, {"mixes": "Mix", "sums": "Add"}[shape], depth))
        else:
            factors = [0.3, 0.6]
            if shape == "varying lattice":
                factors = [tree.nodes.new("ShaderNodeTexNoise").outputs[0] for _ in range(2)]
            ends = tree.leaf((0.2, 0.4, 0.6)), tree.leaf((0.9, 0.1, 0.3))
            for _ in range(depth):
                ends = tuple(tree.both("Mix", *ends, factor) for factor in factors)
            tree.show(ends[0])
        followed[0] = 0
        translate()
        work.append(followed[0])
    assert work[1] <= 3.5 * work[0]  # the scene of the second may contain the first, too
    assert work[1] < 100 * DEEP


@pytest.mark.parametrize("owner", KINDS)
def test_values_that_are_read_twice_are_followed_once(build, translate, followed, owner, monkeypatch):
    monkeypatch.setattr(patterns, "ROWS", 16)
    tree = Tree(build, owner)
    shader = tree.leaf()
    last = tree.nodes.new("ShaderNodeTexNoise").outputs[0]
    for _ in range(DEEP):
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = "MULTIPLY"
        for socket in node.inputs[:2]:
            tree.links.new(last, socket)
        last = node.outputs[0]
    place = shader.node.inputs["Color" if owner == "material" else "Strength"]
    tree.links.new(last, place)
    tree.show(shader)
    translate()
    assert followed[0] < 100 * DEEP


def weights_of(surface, at=None):
    """Weight of each closure by the red of its color, with its varying factors for a value of the noise."""
    from spectral_core.scene import weighted_leaves

    found = {}
    for weight, leaf in weighted_leaves(surface):
        amount = weight.constant
        for value, complement in weight.varying:
            share = float(np.ravel(value.program.evaluate(lambda *_: np.array([at])))[0])
            assert 0 <= share <= 1
            amount *= 1 - share if complement else share
        red = round(float(leaf.color.linear_rgb[0]), 3)
        assert red not in found  # one closure for each shader node
        found[red] = amount
    return found


@pytest.mark.parametrize("varies", [False, True])
def test_the_weights_of_a_lattice_are_a_product_of_matrices(build, translate, varies):
    tree = Tree(build, "material")
    noise = 0.37
    if varies:
        wave = tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"]
        flipped = tree.nodes.new("ShaderNodeMath")
        flipped.operation = "SUBTRACT"
        flipped.inputs[0].default_value = 1.0
        tree.links.new(wave, flipped.inputs[1])
        factors, shares = (wave, flipped.outputs[0]), (noise, 1 - noise)
    else:
        factors = shares = (0.3, 0.6)
    ends, total = (tree.leaf((0.2, 0, 0)), tree.leaf((0.7, 0, 0))), np.eye(2)
    step = np.array([[1 - share, share] for share in shares])
    for _ in range(7):
        ends, total = tuple(tree.both("Mix", *ends, factor) for factor in factors), step @ total
    tree.show(tree.both("Add", *ends))
    (surface,) = [m.surface for m in translate().materials if m.name == "Material"]
    found = weights_of(surface, noise)
    np.testing.assert_allclose([found[0.2], found[0.7]], total.sum(axis=0), rtol=1e-6)


def test_a_shader_that_is_added_to_itself_counts_twice_each_time(build, translate):
    tree = Tree(build, "material")
    tree.show(tower(tree, "Add", 10))
    (surface,) = [m.surface for m in translate().materials if m.name == "Material"]
    assert weights_of(surface) == {0.5: 1024.0}


@pytest.mark.parametrize("owner", ["lamp", "world"])
def test_lights_and_worlds_add_up_as_surfaces_do(build, translate, owner):
    tree = Tree(build, owner)
    tree.show(tower(tree, "Add", 10))
    scene = translate()
    if owner == "world":
        assert scene.world.strength * scene.world.color.linear_rgb[0] == pytest.approx(512.0)
    else:
        assert scene.lights[0].color.linear_rgb[0] == pytest.approx(512.0)


@pytest.mark.parametrize("owner", KINDS)
def test_long_rows_need_no_deep_recursion(build, translate, owner, monkeypatch):
    """Python's limit counts for all threads of the program: nothing may change it."""
    monkeypatch.setattr(sys, "setrecursionlimit", lambda limit: pytest.fail("the limit of the program was changed"))
    monkeypatch.setattr(patterns, "ROWS", 16)
    tree = Tree(build, owner)
    shader = tree.leaf()
    last = tree.nodes.new("ShaderNodeTexNoise").outputs["Color" if owner == "world" else 0]
    for _ in range(300):
        node = tree.nodes.new("ShaderNodeGamma")
        tree.links.new(last, node.inputs[0])
        last = node.outputs[0]
    tree.links.new(last, shader.node.inputs["Color"])
    total = shader
    for _ in range(300):
        total = tree.both("Mix", total, tree.leaf((0.1, 0.2, 0.3)), 0.01)
    tree.show(total)
    scene = translate()
    assert not scene.notes
    assert len(pickle.dumps(scene)) > 0  # as it is sent to the renderer


def test_results_in_a_circle_and_results_of_long_chains():
    from blender_addon.translate.shading.walks.deep import Results

    results, made = Results(), []

    def chain(k):
        made.append(k)
        return 0 if k == 0 else 1 + results.of(k - 1, lambda: chain(k - 1), lambda: -1)

    assert results.of(5000, lambda: chain(5000), lambda: -1) == 5000
    assert len(made) < 2.5 * 5000  # some are made again

    def circle(k):
        return 1 + results.of(("c", (k + 1) % 300), lambda: circle((k + 1) % 300), lambda: 1000)

    assert results.of(("c", 0), lambda: circle(0), lambda: 1000) == 1300

    def broken():
        raise ValueError("in a node")

    with pytest.raises(ValueError, match="in a node"):
        results.of("b", broken, lambda: 0)
    assert results.of("b", lambda: 7, lambda: 0) == 7


def test_a_surface_that_is_deep_is_read_in_a_small_thread(build, translate):
    """Icons are read on threads whose stack is small."""
    tree = Tree(build, "material")
    total = tree.leaf()
    for _ in range(300):
        total = tree.both("Add", total, tree.leaf((0.1, 0.2, 0.3)))
    tree.show(total)
    surface = translate().materials[0].surface
    found = []
    before = threading.stack_size(256 * 1024)
    try:
        thread = threading.Thread(target=lambda: found.append(len(weights_of_all(surface))))
        thread.start()
        thread.join()
    finally:
        threading.stack_size(before)
    assert found == [301]


def weights_of_all(surface):
    from spectral_core.scene import map_leaves, weighted_leaves

    return list(weighted_leaves(map_leaves(surface, lambda leaf: leaf)))


def test_phase_functions_of_sums_in_each_other_keep_their_shares(build, translate):
    tree = Tree(build, "material")
    parts = []
    for g, density in ((0.2, 1.0), (0.5, 1.0), (-0.4, 2.0)):
        node = tree.nodes.new("ShaderNodeVolumeScatter")
        node.inputs["Color"].default_value = (1, 1, 1, 1)
        node.inputs["Anisotropy"].default_value = g
        node.inputs["Density"].default_value = density
        parts.append(node.outputs[0])
    tree.show(tree.both("Add", tree.both("Add", *parts[:2]), parts[2]), "Volume")
    (medium,) = [m.medium for m in translate().materials if m.medium is not None]
    total = sum(weight for weight, _, _ in medium.lobes)
    shares = {round(g, 3): weight / total for weight, g, _ in medium.lobes}
    assert shares == pytest.approx({0.2: 0.25, 0.5: 0.25, -0.4: 0.5})


def test_an_edit_of_a_factor_changes_numbers_alone(build, translate):
    """So that a live view needs no new kernel."""
    from spectral_core.scene import weighted_leaves

    tree = Tree(build, "material")
    wave = tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"]
    ends = tree.leaf((0.2, 0, 0)), tree.leaf((0.7, 0, 0))
    for _ in range(4):
        ends = tree.both("Mix", *ends, 0.3), tree.both("Add", ends[0], tree.both("Mix", *ends, wave))
    tree.show(tree.both("Mix", *ends))
    seen = []
    for factor in (0.3, 0.5, 0.8):
        for node in tree.nodes:
            if node.type == "MIX_SHADER" and not node.inputs[0].is_linked:
                node.inputs[0].default_value = factor
        (surface,) = [m.surface for m in translate().materials if m.name == "Material"]
        found = list(weighted_leaves(surface))
        assert len(found) == 2
        shapes = [[(value.program.shape, rest) for value, rest in weight.varying] for weight, _ in found]
        seen.append((shapes, weights_of(surface, 0.4)))
    assert seen[0][0] == seen[1][0] == seen[2][0]
    assert len({round(weights[0.2], 6) for _, weights in seen}) == 3
