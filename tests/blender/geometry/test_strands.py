# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair curves, particle hair and point clouds become meshes of the right size and position."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def volume_of(mesh):
    """Volume of a closed mesh with outward faces."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(float) for k in range(3))
    return float(np.einsum("ti,ti->t", np.cross(a, b), c).sum() / 6)


def test_a_ball_of_triangles_is_a_ball():
    from blender_addon.translate.strands import ball

    for finer in range(4):
        vertices, faces = ball(finer)
        assert len(faces) == 20 * 4**finer and len(vertices) == 10 * 4**finer + 2
        assert np.allclose(np.linalg.norm(vertices, axis=1), 1)
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        assert np.einsum("ti,ti->t", np.cross(b - a, c - a), a).min() > 0
    volume = np.einsum("ti,ti->t", np.cross(a, b), c).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi, rel=0.02)


def test_tubes_keep_mean_width_and_length():
    """Seen from all sides a polygon is as wide on average as a circle of its circumference."""
    from blender_addon.translate.strands import SIDES, tubes

    points = np.array([[0, 0, z] for z in (0, 1, 2.0)] + [[5, 0, 0], [6, 0, 0]])
    mesh = tubes("hair", points, np.full(5, 0.1), np.array([3, 2]))
    first = mesh.positions[np.abs(mesh.positions[:, 0]) < 1]
    ring = first[:SIDES, :2]
    edges = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    assert edges.sum() == pytest.approx(2 * np.pi * 0.1, rel=1e-5) and np.ptp(first[:, 2]) == pytest.approx(2)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    facing = np.einsum("ti,ti->t", np.cross(b - a, c - a), mesh.normals[mesh.triangles[:, 0]])
    assert facing.min() > 0 and len(mesh.triangles) % (2 * SIDES) == 0


def test_parallel_strands_are_as_wide_from_every_side():
    """Tubes that all begin at one angle are too wide, or too narrow, together; light passes between too few or many."""
    from blender_addon.translate.strands import SIDES, tubes

    points = np.array([[3.0 * number, 0, z] for number in range(100) for z in (0, 1.0)])
    mesh = tubes("hair", points, np.full(200, 0.1), np.full(100, 2))
    rings = mesh.positions.astype(float).reshape(100, 2, SIDES, 3)[:, 0, :, :2]
    angles = np.linspace(0, np.pi, 180)
    widths = np.ptp(rings @ np.stack([np.cos(angles), np.sin(angles)]), axis=1)
    assert widths.mean(axis=0) == pytest.approx(0.2, rel=1e-3)
    assert widths == pytest.approx(0.2, rel=0.018)


def test_strands_get_the_points_that_their_bends_need():
    """Straight ones get none; arcs stay near their circle, and thick ones need fewer points than thin ones."""
    from blender_addon.translate.strands import BETWEEN, SIDES, tubes

    turn = np.linspace(0, 1.2, 7)
    arc = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    line = np.stack([turn, 0 * turn, 0 * turn + 3], axis=1)
    up, found = np.array([0.0, 0.0, 3.0]), []
    points = np.concatenate([line, arc, arc + 2 * up, arc + 3 * up])
    mesh = tubes("hair", points, np.repeat([0.001, 0.03, 0.006, 1e-7], 7), np.full(4, 7))
    for height, radius in ((0.0, 0.03), (6.0, 0.006), (9.0, 1e-7)):
        there = np.abs(mesh.positions[:, 2] - height) < 0.1
        rings = mesh.positions[there].astype(float).reshape(-1, SIDES, 3).mean(axis=1)
        found.append(len(rings))
        middles = ((rings[1:] + rings[:-1]) / 2)[BETWEEN + 1 : -BETWEEN - 1]  # the curve is straighter at its ends
        away = np.abs(np.hypot(middles[:, 0], middles[:, 1]) - 1).max()
        assert away < 0.2 * radius or len(rings) == 6 * (BETWEEN + 1) + 1
    assert found == sorted(found) and found[0] < found[1] < found[2]
    assert int((mesh.positions[:, 2] > 2).sum() - sum(found[1:]) * SIDES) == 7 * SIDES


def test_hair_without_length_and_invalid_points_are_omitted():
    from blender_addon.translate.strands import tubes

    assert tubes("none", np.zeros((1, 3)), np.ones(1), np.array([1])) is None
    points = np.array([[0, 0, 0], [0, 0, 1], [np.nan, 0, 0], [0, 0, 2.0]])
    mesh = tubes("hair", points, np.full(4, 0.1), np.array([2, 2]))
    assert np.isfinite(mesh.positions).all() and len(mesh.triangles) > 0
    still = tubes("still", np.zeros((3, 3)), np.full(3, 0.1), np.array([3]))
    assert np.isfinite(still.positions).all()


def test_hair_curves_are_translated(build, translate):
    curves = bpy.data.hair_curves.new("Curves")
    curves.add_curves([4, 2])
    points = np.array([[0, 0, z] for z in range(4)] + [[1, 0, 0], [1, 0, 3]], np.float32)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    curves.materials.append(build.material())
    build.object("Curves", curves, (0, 0, 5))
    scene = translate()
    assert [item.name for item in scene.instances] == ["Curves"] and not scene.notes
    assert scene.instances[0].world_from_object[2, 3] == 5 and np.ptp(scene.meshes[0].positions[:, 2]) == pytest.approx(
        3
    )


def test_a_point_cloud_has_its_balls_and_attributes(build, translate):
    thing = build.plane()
    tree = bpy.data.node_groups.new("Geometry", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, points, end = (
        tree.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeMeshToPoints", "NodeGroupOutput")
    )
    points.inputs["Radius"].default_value = 0.25
    tree.links.new(start.outputs[0], points.inputs[0])
    tree.links.new(points.outputs[0], end.inputs[0])
    thing.modifiers.new("G", "NODES").node_group = tree
    mesh = translate().meshes[0]
    assert volume_of(mesh) == pytest.approx(4 * 4 / 3 * np.pi * 0.25**3, rel=0.02)
    assert mesh.attributes == ()

    material = build.material(shader="ShaderNodeEmission")
    told, chosen = material.node_tree.nodes.new("ShaderNodePointInfo"), tree.nodes.new("GeometryNodeSetMaterial")
    for output, name in (("Position", "Color"), ("Radius", "Strength")):
        material.node_tree.links.new(told.outputs[output], material.node_tree.nodes["shader"].inputs[name])
    chosen.inputs["Material"].default_value = material
    tree.links.new(points.outputs[0], chosen.inputs[0])
    tree.links.new(chosen.outputs[0], end.inputs[0])
    scene = translate()
    found = {attribute.name: attribute.values for attribute in scene.meshes[0].attributes}
    assert not scene.notes and set(found) == {"attribute_point_place", "attribute_point_size"}
    assert len(np.unique(found["attribute_point_place"], axis=0)) == 4
    away = scene.meshes[0].positions - found["attribute_point_place"]
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), found["attribute_point_size"][:, 0], atol=1e-6)
    assert len(np.unique(found["attribute_point_size"][:, 1])) == 4 and np.all(found["attribute_point_size"][:, 2] == 1)


def test_strands_have_the_attributes_that_materials_read():
    from blender_addon.translate.shading.attributes import hashed_pair
    from blender_addon.translate.strands import SIDES, tubes
    from spectral_core.scene import STRAND_PLACE, STRAND_RANDOM, STRAND_TANGENT

    points = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2.0], [5, 0, 0], [7, 0, 0]])
    reads = frozenset((STRAND_PLACE, STRAND_RANDOM, STRAND_TANGENT))
    mesh = tubes("hair", points, np.full(5, 0.1), np.array([3, 2]), reads)
    found = {attribute.name: attribute.values for attribute in mesh.attributes}
    second = slice(0, 2 * SIDES)  # strands of fewer points come first
    assert mesh.is_strands and np.allclose(found[STRAND_TANGENT][second], (1, 0, 0))
    assert np.allclose(found[STRAND_TANGENT][2 * SIDES :], (0, 0, 1), atol=1e-6)
    assert np.allclose(found[STRAND_PLACE][second], np.repeat([(0, 2, 0.2), (1, 2, 0.2)], SIDES, axis=0))
    assert np.allclose(found[STRAND_RANDOM][second], hashed_pair(1, 0) / 0xFFFFFFFF)
    assert tubes("hair", points, np.full(5, 0.1), np.array([3, 2])).attributes == ()


@pytest.mark.parametrize("melanin", [0.2, 0.9])
def test_melanin_is_absorption_by_two_pigments(build, translate, melanin):
    material = build.material(shader="ShaderNodeBsdfHairPrincipled")
    node = material.node_tree.nodes["shader"]
    node.parametrization = "MELANIN"
    node.inputs["Melanin"].default_value, node.inputs["Melanin Redness"].default_value = melanin, 0.25
    node.inputs["Tint"].default_value = (0.5, 1, 1, 1)
    build.plane(material=material)
    scene = translate()
    hair = scene.materials[0].surface
    amount = -np.log(1 - melanin)
    fit = np.polyval((0.245, 5.574, -10.73, 2.532, -0.215, 5.969), 0.3)
    pigments = 0.75 * np.array((0.506, 0.841, 1.653)) + 0.25 * np.array((0.343, 0.733, 1.924))
    expected = amount * pigments + np.array([(np.log(0.5) / fit) ** 2, 0, 0])
    assert not hair.is_fur and np.allclose(-np.log(hair.color.linear_rgb) * hair.depth, expected, rtol=1e-4)
    assert scene.notes == ()


def test_random_color_varies_from_strand_to_strand(build, translate):
    from spectral_core.scene import STRAND_RANDOM, Computed

    material = build.material(shader="ShaderNodeBsdfHairPrincipled")
    node = material.node_tree.nodes["shader"]
    node.parametrization = "MELANIN"
    node.inputs["Random Color"].default_value = 0.8
    build.plane(material=material)
    hair = translate().materials[0].surface
    assert isinstance(hair.color, Computed) and hair.color.program.inputs == {STRAND_RANDOM}
    melanin, redness = node.inputs["Melanin"].default_value, node.inputs["Melanin Redness"].default_value
    for random in (0.1, 0.9):
        amount = -np.log(1 - min(melanin * (1 + 2 * (random - 0.5) * 0.8), 1 - 1e-4))
        pigments = (1 - redness) * np.array((0.506, 0.841, 1.653)) + redness * np.array((0.343, 0.733, 1.924))
        found = hair.color.program.evaluate(lambda *_, random=random: (np.full(1, random),) * 3)
        assert np.allclose(-np.log(found[0]) * hair.depth, amount * pigments, rtol=1e-3)


def test_huangs_model_reads_its_sockets(build, translate):
    from spectral_core.scene import STRAND_AXIS, EllipseHair

    material = build.material(shader="ShaderNodeBsdfHairPrincipled")
    node = material.node_tree.nodes["shader"]
    node.model = "HUANG"
    given = {"R lobe": 0.5, "TT lobe": 0.25, "TRT lobe": 0.75, "Aspect Ratio": 0.625, "Roughness": 0.375}
    for socket in node.inputs:
        if socket.identifier in given:
            socket.default_value = given[socket.identifier]
    build.plane(material=material)
    scene = translate()
    hair = scene.materials[0].surface
    found = (hair.reflection, hair.transmission, hair.secondary_reflection, hair.aspect_ratio, hair.roughness)
    assert isinstance(hair, EllipseHair) and found == tuple(given.values())
    assert STRAND_AXIS in hair.major_axis.program.inputs
    assert ["averaged over the width" in note.message for note in scene.notes] == [True]


def test_the_axes_of_cross_sections_are_normals_of_least_twist():
    """Blender: level at the start, x for an upright strand, and carried along a bend without twist."""
    from blender_addon.translate.strands import SIDES, tubes
    from spectral_core.scene import STRAND_AXIS

    bend = np.linspace(0, np.pi / 2, 40)
    points = np.concatenate([
        np.stack([np.sin(bend), 0 * bend, 1 - np.cos(bend)], -1),  # from x to z: its level normal stays
        np.stack([np.sin(bend), 1 - np.cos(bend), 0 * bend], -1),  # from x to y: it turns with the strand
        np.stack([0 * bend, 0 * bend, bend], -1),
    ])  # fmt: skip
    mesh = tubes("hair", points, np.full(120, 0.01), np.full(3, 40), frozenset((STRAND_AXIS,)))
    axes = mesh.attributes[0].values.reshape(3, -1, SIDES, 3)[:, :, 0]
    assert np.allclose(axes[0], (0, -1, 0), atol=1e-6) and np.allclose(axes[2], (1, 0, 0), atol=1e-6)
    assert np.allclose(axes[1, -1], (1, 0, 0), atol=0.05) and np.allclose(axes[1, 0], (0, -1, 0), atol=0.05)


def test_an_index_of_refraction_below_1_of_hair_has_a_note(build, translate):
    material = build.material(shader="ShaderNodeBsdfHairPrincipled")
    build.plane(material=material)
    shader = material.node_tree.nodes["shader"]
    told = lambda: any("index of refraction of its hair" in note.message for note in translate().notes)  # noqa: E731
    assert not told()
    shader.inputs["IOR"].default_value = 0.8
    assert told()


def _shown(material, node, output, **values):
    tree = material.node_tree
    made = tree.nodes.new(node)
    for name, value in values.items():
        setattr(made, name, value)
    tree.links.new(made.outputs[output], tree.nodes["shader"].inputs[0])


def test_particle_hair_has_the_uv_and_colors_of_its_roots(build, translate):
    """On a square whose UV is its position, a strand's UV and its place in the texture space are those of its root."""
    material = build.material()
    _shown(material, "ShaderNodeTexCoord", "UV")
    thing = build.plane(size=2.0, material=material)
    layer = thing.data.uv_layers[0].uv
    for corner, loop in zip(layer, thing.data.loops, strict=True):
        corner.vector = (np.array(thing.data.vertices[loop.vertex_index].co[:2]) + 1) / 2
    thing.location = (10, 0, 0)
    thing.data.color_attributes.new("Col", "BYTE_COLOR", "CORNER").data.foreach_set("color", [0.2, 0.5, 0.8, 1.0] * 4)
    thing.modifiers.new("P", "PARTICLE_SYSTEM")
    settings = thing.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 20, 1.0

    def hair():
        scene = translate()
        assert not scene.notes
        return next(mesh for mesh in scene.meshes if mesh.name.startswith("Plane P"))

    mesh = hair()
    low = mesh.positions[:, 2] < 0.05
    np.testing.assert_allclose(mesh.uvs[low], (mesh.positions[low, :2] + 1) / 2, atol=0.02)
    assert len(np.unique(mesh.uvs.round(4), axis=0)) == 20
    _shown(material, "ShaderNodeTexCoord", "Generated")
    (generated,) = (each.values for each in hair().attributes if each.name == "generated")
    np.testing.assert_allclose(generated[low, :2], mesh.uvs[low], atol=2e-3)
    _shown(material, "ShaderNodeVertexColor", "Color", layer_name="Col")
    (color,) = (each.values for each in hair().attributes if each.name == "attribute:Col")
    np.testing.assert_allclose(color, np.broadcast_to([0.2, 0.5, 0.8], color.shape), atol=0.01)


@pytest.mark.parametrize(("domain", "expected"), [("POINT", [0, 1, 2, 3, 4]), ("CURVE", [0, 0, 0, 1, 1])])
def test_hair_curves_have_their_attributes(build, translate, domain, expected):
    material = build.material()
    _shown(material, "ShaderNodeAttribute", "Fac", attribute_name="Mine")
    curves = bpy.data.hair_curves.new("Curves")
    curves.add_curves([3, 2])
    points = np.array([[0, 0, z] for z in range(3)] + [[5, 0, 0], [5, 0, 3]], np.float32)
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    made = curves.attributes.new("Mine", "FLOAT", domain)
    made.data.foreach_set("value", np.arange(len(made.data), dtype=np.float32))
    curves.materials.append(material)
    build.object("Curves", curves)
    scene = translate()
    (mesh,) = scene.meshes
    (found,) = (each.values[:, 0] for each in mesh.attributes if each.name == "attribute_factor:Mine")
    at_points = [float(found[np.abs(mesh.positions - point).max(axis=1) < 0.1].mean()) for point in points]
    assert at_points == pytest.approx(expected) and not scene.notes
