# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids of one OpenVDB file at common voxels, compared with OpenVDB's own accessors."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.volume.files import read_volume
from spectral_core.volume.files.formats.openvdb_format import find_openvdb
from spectral_core.volume.files.vdb import together
from spectral_core.volume.files.vdb.read import grid_background
from spectral_core.volume.files.vdb.together import grids_together

openvdb = find_openvdb()
if openvdb is None:
    pytest.skip("needs OpenVDB's module", allow_module_level=True)

ROTATED = np.array([[0.28, 0.96, 0, 0], [-0.96, 0.28, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def grid(name, shape, *, size=1.0, at=(0, 0, 0), background=0.0, turn=None, seed=1):
    """An OpenVDB grid of random values in a box whose first voxel has index ``at``."""
    values = np.random.default_rng(seed).uniform(1, 2, shape).astype(np.float32)
    made = openvdb.Vec3SGrid(background) if values.ndim == 4 else openvdb.FloatGrid(background)
    made.copyFromArray(values, ijk=at)
    matrix = np.diag([size, size, size, 1.0]) if turn is None else turn
    made.name, made.transform = name, openvdb.createLinearTransform(matrix.tolist())
    return made


def interpolated(made, place):
    """Trilinear value of a grid at a place in space, by its accessor, which knows the background."""
    there = np.array(made.transform.worldToIndex(tuple(place)))
    there = np.where(np.abs(there - np.round(there)) < 1e-6, np.round(there), there)
    first, read = np.floor(there).astype(int), made.getConstAccessor()
    total = 0.0
    for corner in itertools.product((0, 1), repeat=3):
        weight = float(np.prod(np.where(corner, there - first, 1 - (there - first))))
        if weight:
            total = total + weight * np.asarray(read.getValue(tuple(int(n) for n in first + corner)), float)
    return total


def check(path, grids, names):
    """Every voxel of the common region, and that the region holds all grids with one voxel around each."""
    openvdb.write(str(path), grids=grids)
    voxels = grids_together(path, names)
    index = np.array(list(np.ndindex(voxels.shape)), float)
    places = index @ voxels.world_from_index[:3, :3].T + voxels.world_from_index[:3, 3]
    for made in grids:
        found = voxels.grids[made.name]
        expected = np.array([interpolated(made, place) for place in places])
        np.testing.assert_allclose(found, expected, atol=2e-5)
        low, high = (np.array(end) for end in made.evalActiveVoxelBoundingBox())
        for corner in itertools.product((0, 1), repeat=3):
            place = np.array(made.transform.indexToWorld(tuple(map(float, np.where(corner, high + 1, low - 1)))))
            own = np.linalg.solve(voxels.world_from_index, np.append(place, 1.0))[:3]
            assert (own > -1e-6).all() and (own < np.array(voxels.shape) - 1 + 1e-6).all()
    return voxels


def test_a_grid_has_its_background_where_it_has_no_voxels(tmp_path):
    small = grid("temperature", (2, 3, 2), at=(3, 2, 1), background=300.0, seed=2)
    tint = grid("tint", (2, 2, 2, 3), at=(-2, 0, 0), background=(0.9, 0.2, 0.4), seed=3)
    voxels = check(tmp_path / "fire.vdb", [grid("density", (5, 6, 4)), small, tint], ["density", "temperature", "tint"])
    assert voxels.shape == (9, 8, 6) and voxels.resampled == ()
    assert grid_background(tmp_path / "fire.vdb", "temperature") == 300.0


@pytest.mark.parametrize("first", ["coarse", "fine"])
def test_the_finest_voxels_are_used(tmp_path, first):
    """Voxels of the first grid would lose most of the other one."""
    grids = [grid("coarse", (3, 3, 3), size=4.0), grid("fine", (6, 5, 7), at=(2, 1, 0), seed=4, background=-1.0)]
    names = sorted(["coarse", "fine"], key=lambda name: name != first)
    voxels = check(tmp_path / "two.vdb", grids, names)
    assert np.linalg.det(voxels.world_from_index[:3, :3]) == pytest.approx(1.0)
    assert voxels.interpolated == ("coarse",)


def test_grids_that_are_turned_against_each_other(tmp_path):
    check(
        tmp_path / "turned.vdb",
        [grid("a", (4, 5, 3)), grid("b", (3, 3, 3), turn=np.diag([1.5, 1.5, 1.5, 1.0]) @ ROTATED, seed=5)],
        ["a", "b"],
    )


def test_a_coarser_grid_serves_where_the_finest_voxels_are_too_many(tmp_path, monkeypatch):
    path = tmp_path / "two.vdb"
    openvdb.write(str(path), grids=[grid("coarse", (6, 6, 6), size=4.0), grid("fine", (2, 2, 2))])
    monkeypatch.setattr(together, "MOST_RESAMPLED", 1000)
    assert grids_together(path, ["coarse", "fine"]).resampled == ("fine",)
    monkeypatch.setattr(together, "MOST_VOXELS", 100)
    with pytest.raises(InvalidInputError, match="at most 100 are rendered"):
        grids_together(path, ["coarse", "fine"])


def test_grids_of_one_name_are_named_as_openvdb_names_them(tmp_path):
    """The first of several grids named ``density`` was read, and nothing said so."""
    path = tmp_path / "two.vdb"
    made = [grid("density", (3, 3, 3), seed=1), grid("density", (3, 3, 3), seed=2), grid("heat", (3, 3, 3), seed=3)]
    openvdb.write(str(path), grids=made)
    for field in (None, "density"):
        with pytest.raises((InvalidInputError, UnknownNameError), match=r"density\[0\], density\[1\], heat"):
            read_volume(path, field=field)
    for number, each in enumerate(made[:2]):
        expected = np.zeros((3, 3, 3), np.float32)
        each.copyToArray(expected)
        assert np.array_equal(read_volume(path, field=f"density[{number}]").data, expected)
    voxels = grids_together(path, ["density", "heat"])  # of a shader: the first one, as Blender shows it
    assert voxels.repeated == ("density",) and set(voxels.grids) == {"density", "heat"}
    openvdb.write(str(path), grids=[made[1], made[2]])
    assert grids_together(path, ["density"]).repeated == () and read_volume(path).shape == (3, 3, 3)


def test_a_grid_without_voxels_has_its_background_beside_others(tmp_path):
    """A fire without flames as yet was left out, smoke and all."""
    path = tmp_path / "fire.vdb"
    flames, tint = openvdb.FloatGrid(0.25), openvdb.Vec3SGrid((0.5, 0.25, 1.0))
    flames.name, tint.name = "flames", "tint"
    smoke = grid("density", (3, 4, 5))
    openvdb.write(str(path), grids=[smoke, flames, tint])
    voxels = check(tmp_path / "smoke.vdb", [smoke], ["density"])
    both = grids_together(path, ["flames", "density", "tint"])
    assert both.shape == voxels.shape and both.interpolated == both.resampled == ()
    assert np.array_equal(both.grids["density"], voxels.grids["density"])
    assert np.all(both.grids["flames"] == 0.25) and np.all(both.grids["tint"] == (0.5, 0.25, 1.0))
    with pytest.raises(FileFormatError, match="'flames' of fire.vdb has no active voxel"):
        grids_together(path, ["flames"])


@pytest.mark.parametrize(("ends", "counts"), [
    (0.0008, False), (0.001, False), (0.0011, True), (-0.0008, False), (-0.004, True),
    ((0.0008, 0.0008, -0.0008), False), ((0.0, 0.0, 0.004), True), ((-0.004, 0.0, 0.0), True),
])  # fmt: skip
def test_small_voxels_at_the_ends_are_clipped_as_by_cycles(tmp_path, ends, counts):
    """Which ends count was measured in Cycles 5.0.1; voxels within the box keep their values."""
    values = np.full((16, 4, 5, *np.shape(ends)), ends, np.float32)
    values[4:7], values[9:12, 1:3] = 0.004, 0.004
    made = grid("density", values.shape, background=0.0 if values.ndim == 3 else (0.0, 0.0, 0.0))
    made.copyFromArray(values)
    path = tmp_path / "ends.vdb"
    openvdb.write(str(path), grids=[made])
    least = float(np.float32(0.001))
    whole, clipped = grids_together(path, ["density"]), grids_together(path, ["density"], least)
    assert whole.shape == (18, 6, 7) and not whole.is_clipped and clipped.is_clipped is not counts
    assert clipped.shape == ((18, 6, 7) if counts else (10, 6, 7))
    first = 0 if counts else 4
    np.testing.assert_allclose(clipped.world_from_index[:3, 3], (first - 1, -1, -1), atol=1e-6)
    same = whole.grids["density"].reshape(*whole.shape, -1)[first : first + clipped.shape[0]]
    assert np.array_equal(clipped.grids["density"].reshape(*clipped.shape, -1), same)


def test_clipped_grids_share_the_box_of_all(tmp_path):
    path = tmp_path / "two.vdb"
    smoke, heat = grid("density", (12, 3, 3)), grid("heat", (2, 3, 3), at=(8, 0, 0), seed=2)
    values = np.full((12, 3, 3), 0.0005, np.float32)
    values[2:4] = 1.0
    smoke.copyFromArray(values)
    openvdb.write(str(path), grids=[smoke, heat])
    both, alone = (grids_together(path, names, 0.001) for names in (["density", "heat"], ["density"]))
    assert both.shape == (10, 5, 5) and alone.shape == (4, 5, 5)
    inner = both.grids["density"].reshape(both.shape)[1:-1, 1:-1, 1:-1]
    assert np.array_equal(inner, values[2:10])
    assert np.array_equal(both.grids["density"].reshape(both.shape)[[0, -1], 2, 2], values[[1, 10], 1, 1])
    values[:] = 0.0005
    smoke.copyFromArray(values)
    openvdb.write(str(path), grids=[smoke, heat])
    assert grids_together(path, ["density", "heat"], 0.001).shape == (4, 5, 5)
    with pytest.raises(FileFormatError, match=r"'density' of two.vdb has no voxel above 0.001; .* lower Clipping"):
        grids_together(path, ["density"], 0.001)


def plateau(name, shape, value, *, at=(0, 0, 0)):
    """A grid of one value, which OpenVDB stores as tiles where whole cubes of 8³ voxels have it."""
    made = openvdb.FloatGrid()
    made.copyFromArray(np.full(shape, value, np.float32), ijk=at)
    made.name = name
    return made


@pytest.mark.parametrize(
    ("shape", "at", "begins"),
    [
        ((16, 8, 24), (0, 0, 0), (1, 1, 1)),
        ((16, 8, 24), (-8, 8, 800), (1, 1, 1)),
        ((4096, 8, 8), (4096, 0, 0), (1, 1, 1)),
        ((16, 8, 20), (0, 0, 0), (-0.5, -0.5, 1)),  # its last voxels are in leaves, beside its first ones but for z
        ((16, 8, 24), (1, 0, 0), (-0.5, -0.5, -0.5)),
        ((4, 5, 6), (0, 0, 0), (-0.5, -0.5, -0.5)),
    ],
)
def test_tiles_begin_without_fading_in(tmp_path, shape, at, begins):
    """Cycles widens the box of voxels by one, but that of tiles not."""
    made, path = plateau("density", shape, 2.0, at=at), tmp_path / "tiles.vdb"
    openvdb.write(str(path), grids=[made])
    voxels = grids_together(path, ["density"], 0.001)
    assert tuple(voxels.begins) == begins
    assert voxels.shape == tuple(n + 2 for n in shape)
    single = [each.min for each in made.citerOnValues() if each.count == 1]
    lowest = np.min(single, axis=0) if single else np.full(3, np.inf)
    assert ((lowest > at) == (np.array(begins) == 1)).all()
    assert tuple(voxels.surrounded().begins) == tuple(2 if each == 1 else -0.5 for each in begins)


def test_tiles_beside_other_grids_begin_with_the_first(tmp_path):
    path, tiles = tmp_path / "two.vdb", plateau("density", (8, 8, 8), 2.0)
    openvdb.write(str(path), grids=[tiles, grid("heat", (2, 3, 3), at=(-3, 2, 2))])
    assert tuple(grids_together(path, ["density", "heat"]).begins) == (-0.5, 1, 1)
    assert tuple(grids_together(path, ["density"]).begins) == (1, 1, 1)
    assert tuple(grids_together(path, ["heat"]).begins) == (-0.5, -0.5, -0.5)
