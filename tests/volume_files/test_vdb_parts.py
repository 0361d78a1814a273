# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of OpenVDB files, written here byte by byte: transforms of every linear kind, tiles and leaves in a box."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.volume.files.formats import openvdb_format
from spectral_core.volume.files.read import read_volume
from spectral_core.volume.files.vdb.grid import PlainGrid, Tiles
from spectral_core.volume.files.vdb.header import transform_of
from spectral_core.volume.files.vdb.read import descriptors, read_grid
from spectral_core.volume.files.vdb.walk import sound_metadata
from spectral_core.volume.files.vdb.write import write_grid

MATRIX = np.arange(16.0).reshape(4, 4)
SCALE, SHIFT = [2.0, 3.0, 4.0], [5.0, 6.0, 7.0]
REST = [0.5, 0.25, 0.125] * 4
"""Four vectors that follow from the scale."""


@pytest.mark.parametrize(
    ("kind", "numbers", "expected"),
    [("AffineMap", MATRIX.ravel().tolist(), MATRIX.T), ("UnitaryMap", MATRIX.ravel().tolist(), MATRIX.T),
     ("TranslationMap", SHIFT, [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]),
     ("ScaleMap", [*SCALE, *REST], np.diag([2.0, 3, 4, 1])),
     ("UniformScaleMap", [*SCALE, *REST], np.diag([2.0, 3, 4, 1])),
     ("ScaleTranslateMap", [*SHIFT, *SCALE, *REST], [[2, 0, 0, 5], [0, 3, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]]),
     ("UniformScaleTranslateMap", [*SHIFT, *SCALE, *REST], [[2, 0, 0, 5], [0, 3, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]])],
)  # fmt: skip
def test_every_linear_transform_is_read(tmp_path: Path, kind: str, numbers: list[float], expected: object) -> None:
    path = tmp_path / "t.bin"
    path.write_bytes(
        struct.pack("<I", len(kind)) + kind.encode() + struct.pack(f"<{len(numbers)}d", *numbers) + b"next"
    )
    with path.open("rb") as stream:
        np.testing.assert_array_equal(transform_of(stream, path), expected)
        assert stream.read() == b"next"


def test_a_frustum_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.bin"
    path.write_bytes(struct.pack("<I", 19) + b"NonlinearFrustumMap" + b"\0" * 200)
    with path.open("rb") as stream, pytest.raises(FileFormatError, match="only linear transforms"):
        transform_of(stream, path)


def grid(vector: bool) -> PlainGrid:
    """A leaf at 0, one at (8, 0, 8), an active tile of width 8 at (16, 0, 0) and an inactive one at (0, 8, 0)."""
    tail = (3,) if vector else ()
    rng = np.random.default_rng(1)
    leaves = rng.normal(size=(2, 8, 8, 8, *tail)).astype(np.float32)
    masks = rng.random((2, 8, 8, 8)) < 0.5
    masks[:, 2, 3, 4] = True
    tiles = Tiles(
        np.array([[16, 0, 0], [0, 8, 0]]), np.array([8, 8]),
        np.array([np.full(tail, 2.5), np.full(tail, -1.0)], np.float32), np.array([True, False]),
    )  # fmt: skip
    background = np.full(tail, 0.5, np.float32) if vector else np.float32(0.5)
    return PlainGrid("g", {}, np.eye(4), background, leaves, np.array([[0, 0, 0], [8, 0, 8]]), masks, tiles)


@pytest.mark.parametrize("vector", [False, True])
@pytest.mark.parametrize(
    ("low", "shape"), [((0, 0, 0), (24, 16, 16)), ((3, -2, 5), (9, 12, 7)), ((30, 0, 0), (4, 4, 4))]
)
def test_a_box_is_filled_by_its_leaves_tiles_and_background(vector: bool, low: tuple, shape: tuple) -> None:
    plain = grid(vector)
    tail = (3,) if vector else ()
    array = np.full((*shape, *tail), np.nan, np.float32)
    plain.fill(array, low)
    for at in np.ndindex(*shape):
        x, y, z = np.array(at) + low
        expected = np.full(tail, 0.5)
        if 16 <= x < 24 and 0 <= y < 8 and 0 <= z < 8:
            expected = np.full(tail, 2.5)
        elif 0 <= x < 8 and 8 <= y < 16 and 0 <= z < 8:
            expected = np.full(tail, -1.0)
        elif 0 <= x < 8 and 0 <= y < 8 and 0 <= z < 8:
            expected = plain.leaves[0, x, y, z]
        elif 8 <= x < 16 and 0 <= y < 8 and 8 <= z < 16:
            expected = plain.leaves[1, x - 8, y, z - 8]
        np.testing.assert_allclose(array[at], expected)


def test_the_box_of_active_voxels() -> None:
    plain = grid(vector=False)
    places = [tuple(np.array(at) + origin) for origin, mask in zip(plain.origins, plain.active, strict=True)
              for at in np.argwhere(mask)]  # fmt: skip
    places += [(16, 0, 0), (23, 7, 7)]
    low, high = np.min(places, axis=0), np.max(places, axis=0)
    assert plain.active_box() == (tuple(low.tolist()), tuple(high.tolist()))
    empty = PlainGrid(
        "e", {}, np.eye(4), plain.background, plain.leaves, plain.origins, np.zeros_like(plain.active),
        Tiles(plain.tiles.corners, plain.tiles.widths, plain.tiles.values, np.zeros(2, bool)),
    )  # fmt: skip
    assert empty.active_box() is None


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_root_tiles_are_passed_over_by_the_check_and_read_as_values(tmp_path: Path, dtype: str) -> None:
    """A file of ours with a tile of 4096³ voxels put into its root: 12 bytes of origin, its value and its state."""
    path = tmp_path / "t.vdb"
    values = np.zeros((8, 8, 8), dtype)
    values[1, 2, 3] = 7
    write_grid(path, values, np.eye(4), "density", {})
    sound_metadata(path, "density")
    data = path.read_bytes()
    with path.open("rb") as stream:
        ((_, _, start, end),) = descriptors(stream, path)
    width = np.dtype(dtype).itemsize
    tiles = data.index(b"AffineMap") + 9 + 128 + 4 + width
    assert data[tiles : tiles + 8] == struct.pack("<II", 0, 1)
    for count in (1, 3):
        added = b"".join(struct.pack("<3i", 4096 * (k + 1), 0, 0) + bytes(width) + b"\0" for k in range(count))
        changed = data[:tiles] + struct.pack("<II", count, 1) + added + data[tiles + 8 :]
        ends = struct.pack("<qqq", start, 0, end + len(added))
        path.write_bytes(changed[: start - 24] + ends + changed[start:])
        assert sound_metadata(path, "density")["name"] == "density"
        read = read_grid(path, "density")
        assert len(read.tiles.corners) == count and read.leaves.max() == 7


@pytest.mark.parametrize("kind", ["node", "tile"])
@pytest.mark.parametrize("corner", [(0, -1, 2**31 - 1), (0, 8, 0), (-(2**31), 0, 1)])
def test_entries_of_the_root_begin_at_multiples_of_their_size(tmp_path: Path, kind: str, corner: tuple) -> None:
    """OpenVDB's own reader ended the process: voxels of such a node have indices beyond 32 bits."""
    path = tmp_path / "t.vdb"
    write_grid(path, np.ones((8, 8, 8), np.float32), np.eye(4), "density", {})
    data = path.read_bytes()
    with path.open("rb") as stream:
        ((_, _, start, end),) = descriptors(stream, path)
    counts = data.index(b"AffineMap") + 9 + 128 + 4 + 4
    stored, ends = struct.pack("<3i", *corner), data[start - 24 : start]
    if kind == "node":
        data = data[: counts + 8] + stored + data[counts + 20 :]
    else:
        data = data[:counts] + struct.pack("<II", 1, 1) + stored + bytes(5) + data[counts + 8 :]
        ends = struct.pack("<qqq", start, 0, end + 17)
    path.write_bytes(data[: start - 24] + ends + data[start:])
    for read in (sound_metadata, read_grid, lambda file, _: read_volume(file)):
        with pytest.raises(FileFormatError, match="multiples of 4096"):
            read(path, "density")


def test_a_box_of_voxels_keeps_its_position_in_the_world(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The first voxel that is read has the index 0 from then on."""
    leaves = np.random.default_rng(2).normal(size=(1, 8, 8, 8)).astype(np.float32)
    masks = np.zeros(leaves.shape, bool)
    masks[0, 2:5, 3:6, 4:] = True
    world = np.array([[2.0, 0, 0, 10], [0, 3, 0, 20], [0.5, 0, 4, 30], [0, 0, 0, 1]])
    tiles = Tiles(np.empty((0, 3), np.int64), np.empty(0, np.int64), np.empty(0, np.float32), np.empty(0, bool))
    held = PlainGrid("g", {}, world, np.float32(0), leaves, np.array([[8, 16, 24]]), masks, tiles)
    monkeypatch.setattr(openvdb_format, "read_grid", lambda path, name: held)
    array, _, matrix = openvdb_format._read_plainly(tmp_path, "g")
    first = np.array([10, 19, 28])  # the active box begins here, wherever the leaf does
    np.testing.assert_array_equal(array[0, 0, 0], leaves[0, 2, 3, 4])
    np.testing.assert_allclose(matrix @ [0, 0, 0, 1], world @ [*first, 1])
    np.testing.assert_allclose(matrix @ [1, 2, 1, 1], world @ [*np.add(first, [1, 2, 1]), 1])
