# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume objects whose shaders are finer than their voxels, whose grids differ, or which Cycles shows differently."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def cloud(build: Any, tmp_path: Any) -> Any:
    """A Volume object of a file with grids: (name, values, size of a voxel, background); returns its tree and node."""
    from blender_addon import compat
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb = find_openvdb()
    if openvdb is None:
        pytest.skip("no OpenVDB module here")

    def make(grids: Any, mirror: float = 1.0) -> Any:
        made = []
        for name, values, size, background in grids:
            is_vector = values.ndim == 4
            grid = openvdb.Vec3SGrid((0, 0, 0)) if is_vector else openvdb.FloatGrid(background)
            grid.copyFromArray(values.astype(np.float32))
            matrix = np.diag([mirror * size, size, size, 1.0])
            grid.name, grid.transform = name, openvdb.createLinearTransform(matrix.tolist())
            made.append(grid)
        openvdb.write(str(tmp_path / "cloud.vdb"), grids=made)
        data = bpy.data.volumes.new("Cloud")
        data.filepath = str(tmp_path / "cloud.vdb")
        material = bpy.data.materials.new("Cloud")
        tree = compat.use_nodes(material)
        tree.nodes.clear()
        data.materials.append(material)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Cloud", data))
        build.camera((0, -5, 0))
        node = tree.nodes.new("ShaderNodeVolumePrincipled")
        node.inputs["Color"].default_value = (1, 1, 1, 1)
        tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
        return tree, node

    return make


def medium_of(scene: Any) -> Any:
    return next(m.medium for m in scene.materials if m.medium is not None and m.medium.grid is not None)


def scattering(medium: Any) -> np.ndarray:
    """Sum of scattering over space: values times the size of a voxel."""
    voxel = abs(np.linalg.det(medium.grid.world_from_index[:3, :3]))
    return medium.density * medium.extinction.linear_rgb.max() * medium.grid.scattering.sum(dtype=float) * voxel


def test_a_plain_density_keeps_its_voxels(cloud: Any, translate: Any) -> None:
    cloud([("density", np.random.default_rng(3).random((5, 4, 3)) + 0.1, 0.3, 0.0)])
    assert medium_of(translate()).grid.shape == (7, 6, 5)


def test_a_power_of_a_density_is_computed_between_the_voxels(cloud: Any, translate: Any) -> None:
    """The cube of a tent over one voxel: its integral along an axis is 1 / 2, of values at voxels 1."""
    tree, node = cloud([("heat", np.ones((1, 1, 1)), 1.0, 0.0)])
    read, power = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeMath")
    read.attribute_name, power.operation = "heat", "POWER"
    power.inputs[1].default_value = 3.0
    tree.links.new(read.outputs["Fac"], power.inputs[0])
    tree.links.new(power.outputs[0], node.inputs["Density"])
    assert scattering(medium_of(translate())) == pytest.approx(0.5**3, rel=0.1)


def test_a_blackbody_of_a_grid_is_linear_between_its_voxels(cloud: Any, translate: Any) -> None:
    """Cycles reads the temperature at one voxel that it draws: on the average, emission fades out over one voxel. Of
    the fourth power of a temperature that fades out, 1/125 of the space would be left in place of 1.
    """
    from blender_addon import compat

    if compat.is_before_5_0():
        pytest.skip("older versions read between the voxels")

    def whole(size: float, count: int) -> Any:
        _, node = cloud([("temperature", np.full((count,) * 3, 2000.0), size, 0.0)])
        node.inputs["Density"].default_value = 0.0
        node.inputs["Blackbody Intensity"].default_value = node.inputs["Temperature"].default_value = 1.0
        medium = medium_of(translate())
        voxel = abs(np.linalg.det(medium.grid.world_from_index[:3, :3]))
        return medium.emission_strength * medium.grid.emission.sum(dtype=float) * voxel

    assert whole(1.0, 1) == pytest.approx(whole(0.1, 10), rel=0.02)


@pytest.mark.parametrize("names", [("density", "heat"), ("heat", "density")])
def test_the_finest_grid_states_the_voxels_and_coarse_ones_fade_out_over_their_own(
    cloud: Any, translate: Any, names: Any
) -> None:
    tree, node = cloud([(names[0], np.ones((2, 2, 2)), 1.0, 0.0), (names[1], np.ones((20, 20, 20)), 0.1, 0.0)])
    read = tree.nodes.new("ShaderNodeAttribute")
    read.attribute_name = "heat"
    tree.links.new(read.outputs["Fac"], node.inputs["Emission Strength"])
    grid = medium_of(translate()).grid
    assert np.allclose(np.diag(grid.world_from_index)[:3], 0.1)
    coarse = grid.scattering if names[0] == "density" else grid.emission
    line = coarse[:, coarse.shape[1] // 2, coarse.shape[2] // 2]
    ramp = line[(line > 0) & (line < 1)]
    assert len(ramp) == 18 and np.allclose(sorted(ramp)[::2], np.arange(1, 10) / 10, atol=1e-3)


def test_a_vector_as_a_density_counts_with_its_mean(cloud: Any, translate: Any) -> None:
    values = np.ones((3, 3, 3, 3)) * np.array([6.0, 0.0, 3.0])
    cloud([("density", values, 1.0, 0.0)])
    medium = medium_of(translate())
    assert medium.density * medium.extinction.linear_rgb.max() == pytest.approx(3.0)


def test_a_pattern_much_finer_than_the_voxels_gets_a_note(cloud: Any, translate: Any) -> None:
    tree, node = cloud([("density", np.ones((3, 3, 3)), 1.0, 0.0)])
    noise = tree.nodes.new("ShaderNodeTexWhiteNoise")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], noise.inputs["Vector"])
    tree.links.new(noise.outputs["Value"], node.inputs["Density"])
    assert any("varies more finely than the grid" in note.message for note in translate().notes)


@pytest.mark.parametrize(
    ("background", "mirror", "words"),
    [(1.5, 1.0, "where the grids have no voxels"), (0.0, -1.0, "is mirrored"), (0.0, 1.0, "")],
)
def test_grids_that_cycles_shows_differently_are_named(
    cloud: Any, translate: Any, background: float, mirror: float, words: str
) -> None:
    cloud([("density", np.full((3, 3, 3), 2.0), 0.5, background)], mirror)
    notes = [note.message for note in translate().notes]
    assert any(words in note for note in notes) if words else not notes


@pytest.mark.parametrize("is_read_by_node", [False, True])
def test_cubic_interpolation_of_a_material_blurs_its_grids(cloud: Any, translate: Any, is_read_by_node: bool) -> None:
    """A voxel of 1 is a cubic B-spline in Cycles, of the same integral; it was a tent."""
    tree, node = cloud([("density" if not is_read_by_node else "heat", np.ones((1, 1, 1)), 1.0, 0.0)])
    if is_read_by_node:
        read = tree.nodes.new("ShaderNodeAttribute")
        read.attribute_name = "heat"
        tree.links.new(read.outputs["Fac"], node.inputs["Density"])
    material = bpy.data.materials["Cloud"]
    peaks = []
    for kind in ("LINEAR", "CUBIC"):
        material.cycles.volume_interpolation = kind
        material.update_tag()
        medium = medium_of(translate())
        peaks.append(medium.density * medium.extinction.linear_rgb.max() * medium.grid.scattering.max())
        assert scattering(medium) == pytest.approx(1.0, rel=0.02)
    assert peaks == pytest.approx([1.0, (2 / 3) ** 3], rel=1e-3)


def test_generated_coordinates_of_a_volume_are_those_of_the_object(cloud: Any, translate: Any) -> None:
    """As textures without a vector read them. They were shares of the box around the voxels."""
    tree, node = cloud([("density", np.ones((6, 5, 4)), 0.5, 0.0)])
    place, split = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(split.outputs["X"], node.inputs["Density"])
    found = []
    for name in ("Object", "Generated"):
        tree.links.new(place.outputs[name], split.inputs[0])
        medium = medium_of(translate())
        found.append(medium.density * medium.extinction.linear_rgb.max() * medium.grid.scattering)
    np.testing.assert_allclose(found[1], found[0], atol=1e-6)
    assert found[0].max() == pytest.approx(2.5, rel=0.01)


def test_the_alpha_of_a_grid_is_1(cloud: Any, translate: Any) -> None:
    """It was 0, and a shader that read nothing else of a grid did not show it."""
    tree, node = cloud([("heat", np.full((3, 4, 5), 0.25), 0.5, 0.0)])
    read = tree.nodes.new("ShaderNodeAttribute")
    read.attribute_name = "heat"
    tree.links.new(read.outputs["Alpha"], node.inputs["Density"])
    medium = medium_of(translate())
    assert medium.density * medium.extinction.linear_rgb.max() == pytest.approx(1.0)
    read.attribute_name = "none"
    scene = translate()
    assert not scene.instances and any("nothing is seen" in note.message for note in scene.notes)


def test_emission_that_is_the_same_everywhere_gets_a_note(cloud: Any, translate: Any) -> None:
    """It ends a voxel beyond the grids; the note looked only at what varies."""
    _, node = cloud([("density", np.full((3, 3, 3), 2.0), 0.5, 0.0)])
    node.inputs["Emission Strength"].default_value = 0.2
    assert any("where the grids have no voxels" in note.message for note in translate().notes)
