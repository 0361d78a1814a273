# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume shaders: sums and mixes, phase functions, and media of the world."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def filled(build):
    """A cube with a volume shader node; returns the node and its tree."""

    def make(kind, **inputs):
        material = build.material()
        tree = material.node_tree
        tree.nodes.remove(tree.nodes["shader"])
        node = tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
        tree.links.new(node.outputs[0], output.inputs["Volume"])
        build.plane(material=material)
        return node, tree, output

    return make


def only_medium(scene):
    return next(material.medium for material in scene.materials if material.medium is not None)


def coefficients(medium):
    extinction = medium.density * np.asarray(medium.extinction.linear_rgb)
    scattered = extinction * np.asarray(medium.color.linear_rgb)
    return scattered, extinction - scattered


def test_principled_absorbs_by_the_root_of_its_absorption_color(filled, translate):
    filled("ShaderNodeVolumePrincipled", Density=2.0, Color=(0.5, 0.5, 0.5, 1), Absorption_Color=(0.0, 0.25, 1.0, 1))
    scattered, absorbed = coefficients(only_medium(translate()))
    assert np.allclose(scattered, 1.0) and np.allclose(absorbed, [1.0, 0.5, 0.0], atol=1e-6)


def test_sums_and_mixes_of_volumes_add_up(filled, translate):
    first, tree, output = filled("ShaderNodeVolumeScatter", Color=(1, 1, 1, 1), Density=1.0, Anisotropy=0.5)
    second, glow = tree.nodes.new("ShaderNodeVolumeAbsorption"), tree.nodes.new("ShaderNodeEmission")
    second.inputs["Color"].default_value, second.inputs["Density"].default_value = (0.0, 0.5, 1.0, 1), 2.0
    glow.inputs["Strength"].default_value = 0.3
    mix, add = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeAddShader")
    mix.inputs[0].default_value = 0.25
    for source, target in (
        (first, mix.inputs[1]),
        (second, mix.inputs[2]),
        (mix, add.inputs[0]),
        (glow, add.inputs[1]),
    ):
        tree.links.new(source.outputs[0], target)
    tree.links.new(add.outputs[0], output.inputs["Volume"])
    scene = translate()
    medium = only_medium(scene)
    scattered, absorbed = coefficients(medium)
    assert np.allclose(scattered, 0.75) and np.allclose(absorbed, [0.5, 0.25, 0.0], atol=1e-6)
    assert (
        medium.emission_strength == pytest.approx(0.3) and medium.lobes[0][1] == pytest.approx(0.5) and not scene.notes
    )


@pytest.mark.parametrize("phase", ["HENYEY_GREENSTEIN", "FOURNIER_FORAND", "DRAINE", "RAYLEIGH", "MIE"])
def test_phase_functions_integrate_to_1(filled, translate, phase):
    node, _, _ = filled("ShaderNodeVolumeScatter")
    if not hasattr(node, "phase"):
        pytest.skip("this Blender has one phase function")
    node.phase = phase
    scene = translate()
    lobes = only_medium(scene).lobes
    assert sum(weight for weight, _, _ in lobes) == pytest.approx(1.0) and not scene.notes
    assert all(weight >= 0 and -1 < g < 1 and alpha >= 0 for weight, g, alpha in lobes)


@pytest.mark.parametrize("backscatter", [0.01, 0.1, 0.3])
def test_lobes_follow_the_phase_function_of_water(backscatter):
    from blender_addon.translate.shading.media.phases import fournier_forand

    cosine = np.linspace(-1.0, 0.0, 2001)
    turned = sum(
        weight * (1 - g * g) / 2 / (1 + g * g - 2 * g * cosine) ** 1.5
        for weight, g, _ in fournier_forand(1.33, backscatter)
    )
    assert np.mean(turned) == pytest.approx(backscatter, rel=0.15)


def test_a_world_can_have_a_medium(build, translate):
    from blender_addon import compat

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    node = tree.nodes.new("ShaderNodeVolumeScatter")
    node.inputs["Density"].default_value = 0.2
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Volume"])
    scene = translate()
    assert np.allclose(coefficients(scene.world.medium)[0], 0.2 * 0.8) and not scene.notes


def feed(tree, target, scale=2.0):
    """A pattern into a socket, over the coordinates of the object."""
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = scale
    place = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs["Color" if target.type == "RGBA" else 0], target)


def test_a_density_that_varies_is_one_factor_on_a_grid(filled, translate):
    node, tree, _ = filled("ShaderNodeVolumeScatter")
    feed(tree, node.inputs["Density"])
    scene = translate()
    medium = next(m.medium for m in scene.materials if m.medium is not None and m.medium.grid is not None)
    assert not scene.notes and medium.grid.scattering is medium.grid.absorption and medium.grid.scattering.ndim == 3
    assert medium.grid.scattering.max() == 1 and medium.grid.scattering.min() < 0.7


def test_a_color_that_varies_is_a_grid_of_colors(filled, translate):
    node, tree, _ = filled("ShaderNodeVolumePrincipled", Density=2.0, Emission_Strength=0.5)
    feed(tree, node.inputs["Color"])
    feed(tree, node.inputs["Emission Color"])
    scene = translate()
    medium = next(m.medium for m in scene.materials if m.medium is not None and m.medium.grid is not None)
    grid = medium.grid
    assert not scene.notes and [values.ndim for values in grid.given] == [4, 4, 4]
    assert max(values.max() for values in grid.given) == 1
    np.testing.assert_allclose(medium.density * (grid.scattering + grid.absorption), 2.0, rtol=1e-4)


def test_an_object_reads_its_own_random_number(build, translate, filled):
    node, tree, _ = filled("ShaderNodeVolumeScatter")
    tree.links.new(tree.nodes.new("ShaderNodeObjectInfo").outputs["Random"], node.inputs["Density"])
    build.plane(material=next(m for m in bpy.data.materials if m.node_tree is not None and m.node_tree == tree))
    media = [m.medium for m in translate().materials if " in " in m.name]
    sizes = [float(medium.density * medium.extinction.linear_rgb.max()) for medium in media]
    assert len(set(sizes)) == 2 and all(0 < size < 0.81 for size in sizes)


def test_slots_with_one_fog_share_one_grid(filled, translate):
    node, tree, _ = filled("ShaderNodeVolumeScatter")
    feed(tree, node.inputs["Density"])
    plane = next(obj for obj in bpy.data.objects if obj.type == "MESH")
    for _ in range(3):
        plane.data.materials.append(plane.data.materials[0])
    scene = translate()
    (instance,) = [each for each in scene.instances if each.shown_as == plane.name]
    fogs = [m.name for m in scene.materials if m.medium is not None and m.medium.grid is not None]
    assert len(instance.materials) == 4 and set(instance.materials) == set(fogs) and len(fogs) == 1


def test_a_pattern_too_fine_for_the_grid_gets_a_note(filled, translate):
    node, tree, _ = filled("ShaderNodeVolumeScatter")
    noise = tree.nodes.new("ShaderNodeTexWhiteNoise")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], noise.inputs["Vector"])
    tree.links.new(noise.outputs["Value"], node.inputs["Density"])
    assert any("varies more finely than the grid" in note.message for note in translate().notes)


def test_fog_of_the_world_that_varies_gets_a_note(build, translate):
    from blender_addon import compat

    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = compat.use_nodes(world)
    node = tree.nodes.new("ShaderNodeVolumeScatter")
    feed(tree, node.inputs["Density"])
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Volume"])
    scene = translate()
    assert scene.world.medium is not None and scene.world.medium.grid is None
    assert any("fog without end" in note.message for note in scene.notes)


@pytest.fixture
def smoke(tmp_path):
    """A Volume object with two grids of different boxes, and its material's node tree."""
    from blender_addon import compat
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb = find_openvdb()
    if openvdb is None:
        pytest.skip("no OpenVDB module here")
    grids = []
    for name, start in (("density", 0), ("heat", 4)):
        grid = openvdb.FloatGrid()
        grid.copyFromArray(np.full((6, 5, 4), 0.5 + start, np.float32), ijk=(start, 0, 0))
        grid.name, grid.transform = name, openvdb.createLinearTransform(0.25)
        grids.append(grid)
    openvdb.write(str(tmp_path / "smoke.vdb"), grids=grids)
    data = bpy.data.volumes.new("Smoke")
    data.filepath = str(tmp_path / "smoke.vdb")
    material = bpy.data.materials.new("Smoke")
    tree = compat.use_nodes(material)
    tree.nodes.clear()
    data.materials.append(material)
    made = bpy.data.objects.new("Smoke", data)
    bpy.context.scene.collection.objects.link(made)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    return made, tree, output.inputs["Volume"]


def test_grids_of_different_boxes_share_their_voxels(build, smoke, translate):
    build.camera((0, -5, 0))
    _, tree, socket = smoke
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = 4.0
    heat, glow = tree.nodes.new("ShaderNodeAttribute"), node.inputs["Emission Strength"]
    heat.attribute_name = "heat"
    tree.links.new(heat.outputs["Fac"], glow)
    tree.links.new(node.outputs[0], socket)
    scene = translate()
    medium = next(m.medium for m in scene.materials if " #" in m.name or (m.medium and m.medium.grid is not None))
    grid = medium.grid
    assert not scene.notes and grid.shape == (12, 7, 6)  # ten by five by four voxels, and one of nothing around them
    box = next(item for item in scene.instances if item.shown_as == "Smoke")
    corners = np.array([[0, 0, 0, 1], [1, 1, 1, 1]]) @ (np.linalg.inv(grid.world_from_index) @ box.world_from_object).T
    # larger than the voxels: faces that coincide with a floor lost the medium above it
    np.testing.assert_allclose(corners[:, :3], [(-0.6,) * 3, np.array(grid.shape) - 0.4], atol=1e-6)
    assert medium.density * medium.extinction.linear_rgb.max() == pytest.approx(2.0)
    assert medium.emission_strength == pytest.approx(4.5)
    assert np.flatnonzero(grid.scattering[:, 3, 3]).tolist() == [1, 2, 3, 4, 5, 6]
    assert np.flatnonzero(grid.emission[:, 3, 3]).tolist() == [5, 6, 7, 8, 9, 10]
    np.testing.assert_allclose(grid.world_from_index[:3, 3], -0.25)


def test_a_shader_that_reads_no_grid_of_the_file_shows_nothing_with_a_note(build, smoke, translate):
    build.camera((0, -5, 0))
    _, tree, socket = smoke
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], socket)
    scene = translate()
    assert not scene.instances
    assert any("holds 'density', 'heat': nothing is seen" in note.message for note in scene.notes)


def test_densities_count_in_the_units_of_the_object(build, smoke, translate):
    build.camera((0, -5, 0))
    made, tree, socket = smoke
    tree.links.new(tree.nodes.new("ShaderNodeVolumePrincipled").outputs[0], socket)
    made.scale = (2.0, 2.0, 2.0)
    sizes = []
    for space in ("OBJECT", "WORLD"):
        made.data.render.space = space
        medium = next(m.medium for m in translate().materials if m.medium and m.medium.grid is not None)
        sizes.append(medium.density)
    assert sizes[1] == pytest.approx(2 * sizes[0])


def test_clipping_bounds_the_grids_of_a_volume(build, smoke, translate):
    build.camera((0, -5, 0))
    made, tree, socket = smoke
    node, heat = tree.nodes.new("ShaderNodeVolumePrincipled"), tree.nodes.new("ShaderNodeAttribute")
    heat.attribute_name = "heat"
    tree.links.new(heat.outputs["Fac"], node.inputs["Emission Strength"])
    tree.links.new(node.outputs[0], socket)
    shapes = []
    for clipping in (0.001, 0.75):
        made.data.render.clipping = clipping
        shapes += [m.medium.grid.shape for m in translate().materials if m.medium and m.medium.grid is not None]
    assert shapes == [(12, 7, 6), (8, 7, 6)]  # the densities are 0.5, the heat 4.5
