# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB files by the OpenVDB module and by this project's code, compared with each other."""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import read_volume, write_volume
from tests.volume_files.volume_fixtures import (
    SHEARED,
    check,
    fixture_values,
)

# OpenVDB


@pytest.fixture
def openvdb():
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    module = find_openvdb()
    if module is None:
        pytest.skip("no OpenVDB module here")
    return module


@pytest.fixture(params=["module", "own code"])
def vdb_code(request, monkeypatch):
    """The OpenVDB module, and the code that replaces it if it is missing."""
    from spectral_core.volume.files.formats import openvdb_format

    if request.param == "own code":
        monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    elif openvdb_format.find_openvdb() is None:
        pytest.skip("no OpenVDB module here")


@pytest.mark.parametrize("dtype", ["int8", "uint8", "int16", "uint16", "int32", "float16", "float32", "float64"])
def test_written_volumes_are_read_back(tmp_path, dtype, vdb_code):
    values = fixture_values(dtype)
    values[:2] = 0  # a slab of background values must not reduce the box
    volume = ScalarVolume("engine block", values, SHEARED)
    for ending in ("vdb", "nrrd"):
        if (ending, dtype) == ("nrrd", "float16"):
            continue
        back = read_volume(write_volume(volume, tmp_path / f"a.{ending}"))
        check(back, values, SHEARED)
        assert back.name == "engine block"
    assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith(".")) == []


@pytest.mark.parametrize("shape", [(4, 3, 5), (17, 9, 33), (140, 20, 9), (4200, 3, 3)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_openvdb_reads_written_files(tmp_path, openvdb, shape, dtype):
    """OpenVDB as the oracle of writer and reader, across leaves, nodes and roots."""
    from spectral_core.volume.files.vdb.read import read_grid
    from spectral_core.volume.files.vdb.write import write_grid

    values = np.random.default_rng(3).random(shape).astype(dtype)
    values[: shape[0] // 2] = 0
    values[-1, 0, 0] = 5
    write_grid(tmp_path / "a.vdb", values, SHEARED, "density", {"note": "größer"})
    grid = openvdb.read(str(tmp_path / "a.vdb"), "density")
    back = np.zeros(shape, dtype)
    grid.copyToArray(back)
    assert np.array_equal(back, values)
    assert grid.metadata["note"] == "größer"
    corner = np.array(grid.transform.indexToWorld((0, 0, 0)))
    columns = [np.array(grid.transform.indexToWorld(step)) - corner for step in np.eye(3, dtype=int).tolist()]
    assert np.allclose(np.array(columns).T, SHEARED[:3, :3])
    own = read_grid(tmp_path / "a.vdb", "density")
    filled = np.empty(shape, dtype)
    own.fill(filled, (0, 0, 0))
    assert np.array_equal(filled, values)
    assert own.active_box() == grid.evalActiveVoxelBoundingBox()
    assert own.active.sum() == grid.activeVoxelCount()


@pytest.mark.parametrize("mark", [0, 1, 2, 3, 4, 5])
def test_masked_values_and_tiles_equal_those_of_openvdb(tmp_path, openvdb, monkeypatch, mark):
    """Every encoding of inactive values, and tiles: files that a modified writer creates."""
    import struct
    import zlib

    from spectral_core.volume.files.vdb import write as vdb_write
    from spectral_core.volume.files.vdb.read import read_grid

    def packed(values):
        if len(values) != 512:  # a node: entry 5 becomes an inactive tile of value 7
            values = values.copy()
            values[5] = 7.0
            return struct.pack("<b", 6) + zipped(values)
        others = {2: [0.25], 4: [0.25], 5: [0.25, 0.5]}.get(mark, [])
        chosen = np.packbits(np.arange(512) % 3 == 0, bitorder="little").tobytes() if mark in (3, 4, 5) else b""
        return struct.pack("<b", mark) + np.array(others, "<f4").tobytes() + chosen + zipped(values[values != 0])

    def zipped(values):
        data = zlib.compress(values.astype("<f4").tobytes())
        return struct.pack("<q", len(data)) + data

    monkeypatch.setattr(vdb_write, "_packed", packed)
    monkeypatch.setattr(vdb_write, "ZIP", 3)  # compressed, without inactive values
    values = np.random.default_rng(4).random((20, 9, 8)).astype(np.float32)
    values[values < 0.4] = 0
    vdb_write.write_grid(tmp_path / "m.vdb", values, np.eye(4), "density", {})
    grid = openvdb.read(str(tmp_path / "m.vdb"), "density")
    expected, filled = np.zeros((2, 24, 16, 700), np.float32)
    grid.copyToArray(expected, ijk=(0, 0, 0))
    own = read_grid(tmp_path / "m.vdb", "density")
    own.fill(filled, (0, 0, 0))
    assert np.array_equal(filled, expected)
    assert (expected == 7.0).any()
    assert own.active.sum() == grid.activeVoxelCount()


def test_blosc_without_openvdb_names_the_remedy(tmp_path, openvdb, monkeypatch):
    from spectral_core.volume.files.formats import openvdb_format

    path = write_volume(ScalarVolume("v", fixture_values("float32")), tmp_path / "a.vdb")
    monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    with pytest.raises(MissingDependencyError, match="packed with Blosc.*open it in a Blender from blender.org"):
        read_volume(path)


def test_grids_of_other_programs_are_read_in_the_box_of_their_voxels(tmp_path, openvdb):
    values = fixture_values("float32") + 100
    grid = openvdb.FloatGrid(0.0)
    grid.copyFromArray(values, ijk=(-3, 7, 100))
    grid.name = "temperature"
    grid.transform = openvdb.createLinearTransform(SHEARED.T.tolist())
    whole = openvdb.Int64Grid(0)
    whole.copyFromArray(fixture_values("int64"))
    whole.name = "count"
    wind = openvdb.Vec3SGrid((0.0, 0.0, 0.0))
    wind.copyFromArray(np.stack([values, values + 1, values + 2], axis=-1))
    wind.name = "wind"
    openvdb.write(str(tmp_path / "f.vdb"), grids=[grid, whole, wind])
    expected = SHEARED.copy()
    expected[:3, 3] += SHEARED[:3, :3] @ (-3, 7, 100)
    check(read_volume(tmp_path / "f.vdb", field="temperature"), values, expected)
    check(read_volume(tmp_path / "f.vdb", field="wind", component=2), values + 2, np.eye(4))
    assert read_volume(tmp_path / "f.vdb", field="count").data.dtype == np.int64
    with pytest.raises(InvalidInputError, match=r"f.vdb holds .*temperature.*; say which is the volume with field"):
        read_volume(tmp_path / "f.vdb")


def test_empty_frustum_and_huge_grids_are_refused(tmp_path, openvdb):
    empty = openvdb.FloatGrid(0.0)
    empty.name = "density"
    openvdb.write(str(tmp_path / "e.vdb"), grids=[empty])
    with pytest.raises(FileFormatError, match="no active voxel"):
        read_volume(tmp_path / "e.vdb")
    empty.fill((0, 0, 0), (0, 0, 0), 1.0)
    empty.fill((9999, 9999, 9999), (9999, 9999, 9999), 1.0)
    openvdb.write(str(tmp_path / "h.vdb"), grids=[empty])
    with pytest.raises(FileFormatError, match="spans 10000×10000×10000 voxels"):
        read_volume(tmp_path / "h.vdb")
    frustum = openvdb.FloatGrid(0.0)
    frustum.fill((0, 0, 0), (2, 2, 2), 1.0)
    frustum.transform = openvdb.createFrustumTransform((0, 0, 0), (10, 10, 10), 0.5, 10.0)
    frustum.name = "density"
    openvdb.write(str(tmp_path / "p.vdb"), grids=[frustum])
    with pytest.raises(FileFormatError, match="NonlinearFrustumMap|frustum"):
        read_volume(tmp_path / "p.vdb")


def test_integers_beyond_double_are_refused_by_vdb(tmp_path, openvdb):
    values = np.full((2, 2, 2), (1 << 53) + 1, np.int64)
    with pytest.raises(InvalidInputError, match="no float grid of OpenVDB holds exactly"):
        write_volume(ScalarVolume("big", values), tmp_path / "a.vdb")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("tree", ["Leaf_float_5_4_3", "Tree_float_4_4_3", "Tree_string_5_4_3", "Tree_float_5_4", ""])
def test_an_error_names_the_type_of_an_unsupported_tree(tree):
    from spectral_core.volume.files.vdb.read import GridReader

    with pytest.raises(FileFormatError, match=f"is a {tree}; expected numbers in a tree 5-4-3"):
        GridReader(BytesIO(b""), Path("strange.vdb"), tree)


@pytest.mark.parametrize("size", [20, 120])  # the list of leaves is plain, and packed
def test_a_list_of_leaves_that_is_too_long_is_refused_before_openvdb_reads_it(tmp_path, openvdb, size):
    """OpenVDB reads a file of 10 KB for minutes if it states eight million leaves."""
    path = tmp_path / "v.vdb"
    values = np.random.default_rng(size).random((size, size, size), np.float32)
    grid = openvdb.FloatGrid(0.0)
    grid.copyFromArray(values)
    openvdb.write(str(path), grids=[grid])
    np.testing.assert_array_equal(read_volume(path).data, values)
    held = bytearray(path.read_bytes())
    begin = held.index(b"__delayedload") + len("__delayedload") + 4
    leaves, packed = struct.unpack_from("<II", held, begin)
    assert leaves == (-(-size // 8)) ** 3
    for place, damaged in ((begin, 0x7F0000 + leaves), (begin + 4, 0x7F0000 + packed)):
        broken = held.copy()
        struct.pack_into("<I", broken, place, damaged)
        path.write_bytes(broken)
        with pytest.raises(FileFormatError, match="truncated or invalid"):
            read_volume(path)


@pytest.mark.parametrize("far", [2**29, -(2**29), 2**30, 2**31 - 4096, -(2**31)])
def test_voxels_at_the_ends_of_32_bits_are_refused(tmp_path, openvdb, far):
    """OpenVDB ended the process when it copied them."""
    path = tmp_path / "v.vdb"
    values = fixture_values("float32") + 100
    grid = openvdb.FloatGrid(0.0)
    grid.copyFromArray(values, ijk=(0, far, 0))
    openvdb.write(str(path), grids=[grid])
    if abs(far) == 2**29:
        np.testing.assert_array_equal(read_volume(path).data, values)
    else:
        with pytest.raises(FileFormatError, match=r"expected multiples of 4096 within 536,870,912 of 0"):
            read_volume(path)


@pytest.mark.parametrize("background", [0.0, -2.0])
@pytest.mark.parametrize("kind", ["FloatGrid", "DoubleGrid", "Vec3SGrid", "Int64Grid"])
def test_grids_of_half_floats_are_read(tmp_path, openvdb, kind, background):
    """Fluid caches and exports of other programs hold them; they were refused as invalid.

    A node without tiles has no number of bytes in them, and grids of integers have the mark but are stored whole.
    """
    values = np.random.default_rng(3).integers(-50, 50, (9, 20, 6))
    vector = kind.startswith("Vec")
    grid = getattr(openvdb, kind)((background,) * 3 if vector else int(background) if "Int" in kind else background)
    stored = np.stack([values, values + 1, values + 2], axis=-1) if vector else values
    grid.copyFromArray(
        stored.astype("i8" if "Int" in kind else "f8" if kind == "DoubleGrid" else "f4"), ijk=(-3, 0, 130)
    )
    grid.name, grid.saveFloatAsHalf = "density", True
    openvdb.write(str(tmp_path / "h.vdb"), grids=[grid])
    volume = read_volume(tmp_path / "h.vdb", component=1 if vector else None)
    low, high = grid.evalActiveVoxelBoundingBox()
    box = tuple(slice(a - o, b - o + 1) for a, b, o in zip(low, high, (-3, 0, 130), strict=True))
    assert np.array_equal(volume.data, (values + vector)[box])


def test_half_floats_without_openvdb(tmp_path, monkeypatch):
    """As above, by Spectral's own reader."""
    import struct
    import zlib

    from spectral_core.volume.files.vdb import write as vdb_write
    from spectral_core.volume.files.vdb.read import read_grid

    def packed(values):
        data = zlib.compress(values[values != 0].astype("<f2").tobytes()) if len(values) == 512 else b""
        return b"\0" + (struct.pack("<q", len(data)) + data if data else b"")

    monkeypatch.setattr(vdb_write, "_packed", packed)
    monkeypatch.setattr(vdb_write, "ZIP", 3)  # compressed, without inactive values
    values = np.random.default_rng(4).integers(0, 9, (20, 9, 8)).astype(np.float32)
    path = tmp_path / "m.vdb"
    vdb_write.write_grid(path, values, np.eye(4), "density", {})
    name, half = b"Tree_float_5_4_3", b"Tree_float_5_4_3_HalfFloat"
    data = path.read_bytes()
    at = data.index(name)
    places = at + len(name) + 4  # an empty text, then the places of the grid, which move
    moved = [each + len(half) - len(name) for each in struct.unpack_from("<3q", data, places)]
    path.write_bytes(
        data[: at - 4] + struct.pack("<I", len(half)) + half + data[places - 4 : places]
        + struct.pack("<3q", *moved) + data[places + 24 :]
    )  # fmt: skip
    filled = np.full(values.shape, np.nan, np.float32)
    read_grid(path, "density").fill(filled, (0, 0, 0))
    assert np.array_equal(filled, values)
