# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB grids of Booleans, such as masks, are read as 0 and 1, with and without OpenVDB's own module."""

from __future__ import annotations

import struct
import uuid

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.volume.files.formats import openvdb_format
from spectral_core.volume.files.read import read_volume


@pytest.fixture
def openvdb():
    found = openvdb_format.find_openvdb()
    if found is None:
        pytest.skip("needs OpenVDB's module, as in bpy")
    return found


@pytest.mark.parametrize("background", [False, True])
@pytest.mark.parametrize(
    ("shape", "low"), [((5, 9, 33), (0, 0, 0)), ((40, 24, 16), (-8, 3, 120)), ((200, 17, 9), (0, 0, 0))]
)
def test_a_grid_of_booleans_is_read(tmp_path, openvdb, background, shape, low):
    values = np.random.default_rng(5).random(shape) < 0.4
    values[:16, :16] = True  # whole leaves, which become tiles
    values[0, 0, 0] = values[-1, -1, -1] = not background
    grid = openvdb.BoolGrid(background)
    grid.copyFromArray(values, ijk=low)
    grid.prune(False)
    openvdb.write(str(tmp_path / "m.vdb"), grids=[grid])
    volume = read_volume(tmp_path / "m.vdb")
    first, last = grid.evalActiveVoxelBoundingBox()
    box = tuple(slice(a - o, b - o + 1) for a, b, o in zip(first, last, low, strict=True))
    assert volume.data.dtype == np.uint8
    np.testing.assert_array_equal(volume.data, values[box])
    np.testing.assert_allclose(volume.world_from_index[:3, 3], first)


def _bits(*places: int, count: int) -> bytes:
    return np.packbits(np.isin(np.arange(count), places), bitorder="little").tobytes()


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()


def _file(leaf: np.ndarray) -> bytes:
    """A file of one leaf (8, 8, 8) at the origin and an active tile of True at (16, 0, 0), nothing packed."""
    outer, inner = 32**3, 16**3
    values = np.zeros(inner, bool)
    values[2 * 16 * 16] = True
    mask = np.packbits(leaf.ravel(), bitorder="little").tobytes()
    node = _bits(0, count=outer) + bytes(outer // 8) + b"\6" + bytes(outer)
    node += _bits(0, count=inner) + _bits(2 * 16 * 16, count=inner) + b"\6" + values.tobytes() + mask
    grid = struct.pack("<II", 0, 0) + _text("TranslationMap") + struct.pack("<3d", 7, 8, 9)
    grid += struct.pack("<I", 1) + b"\0" + struct.pack("<II", 0, 1) + bytes(12) + node
    buffers = mask + bytes(12) + mask
    head = (
        struct.pack("<qIII", 0x56444220, 224, 10, 0) + b"\1" + str(uuid.UUID(int=5)).encode() + struct.pack("<II", 0, 1)
    )
    head += _text("mask") + _text("Tree_bool_5_4_3") + _text("")
    start = len(head) + 24
    return head + struct.pack("<3q", start, start + len(grid), start + len(grid) + len(buffers)) + grid + buffers


@pytest.mark.parametrize("has_module", [True, False])
def test_a_file_of_booleans_that_is_written_byte_by_byte(tmp_path, monkeypatch, has_module):
    if has_module and openvdb_format.find_openvdb() is None:
        pytest.skip("needs OpenVDB's module, as in bpy")
    if not has_module:
        monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    leaf = np.random.default_rng(6).random((8, 8, 8)) < 0.5
    leaf[0, 0, 0] = leaf[7, 7, 7] = True
    path = tmp_path / "m.vdb"
    path.write_bytes(_file(leaf))
    volume = read_volume(path)
    assert volume.shape == (24, 8, 8)
    np.testing.assert_array_equal(volume.data[:8], leaf)
    assert not volume.data[8:16].any() and volume.data[16:].all()
    np.testing.assert_allclose(volume.world_from_index[:3, 3], (7, 8, 9))
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(FileFormatError):
        read_volume(path)
