# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells, points, pieces and components of VTK files, written here as text, at their places in the world."""

from __future__ import annotations

import base64
import struct
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, UnknownNameError
from spectral_core.volume.files import read_volume


@pytest.mark.parametrize("of_cells", [False, True])
@pytest.mark.parametrize("points", [(4, 3, 5), (4, 3, 1), (1, 3, 2)])
def test_cells_lie_between_points_in_legacy_files(tmp_path: Path, of_cells: bool, points: tuple) -> None:
    """A flat axis has one layer of cells in the plane of its points."""
    shape = tuple(max(n - 1, 1) for n in points) if of_cells else points
    values = np.arange(np.prod(shape), dtype=np.float64)
    lines = ["# vtk DataFile Version 3.0", "test", "ASCII", "DATASET STRUCTURED_POINTS",
             f"DIMENSIONS {points[0]} {points[1]} {points[2]}", "ORIGIN 10 20 30", "SPACING 2 3 4",
             f"{'CELL' if of_cells else 'POINT'}_DATA {values.size}", "SCALARS v double 1", "LOOKUP_TABLE default",
             " ".join(map(str, values))]  # fmt: skip
    path = tmp_path / "v.vtk"
    path.write_text("\n".join(lines) + "\n")
    volume = read_volume(path)
    assert volume.shape == shape
    np.testing.assert_array_equal(volume.data.ravel("F"), values)
    first = [10 + 1.0 * (of_cells and points[0] > 1), 20 + 1.5 * (of_cells and points[1] > 1),
             30 + 2.0 * (of_cells and points[2] > 1)]  # fmt: skip
    np.testing.assert_allclose(
        volume.world_from_index, [[2, 0, 0, first[0]], [0, 3, 0, first[1]], [0, 0, 4, first[2]], [0, 0, 0, 1]]
    )


def inline(values: np.ndarray) -> str:
    data = values.astype("<f4").tobytes()
    return base64.b64encode(struct.pack("<I", len(data)) + data).decode()


def vti(
    path: Path, whole: list[int], pieces: list[tuple[list[int], np.ndarray]], *, components: int, of_cells: bool
) -> Path:
    """An image whose pieces have values (components, nx, ny, nz)."""
    section = "CellData" if of_cells else "PointData"
    text = ['<?xml version="1.0"?>',
            '<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian">',
            f'<ImageData WholeExtent="{" ".join(map(str, whole))}" Origin="1 2 3" Spacing="0.5 1 2">']  # fmt: skip
    for extent, values in pieces:
        flat = values.transpose(3, 2, 1, 0).ravel()
        text += [f'<Piece Extent="{" ".join(map(str, extent))}"><{section}>',
                 f'<DataArray type="Float32" Name="v" NumberOfComponents="{components}" format="binary">{inline(flat)}',
                 f"</DataArray></{section}></Piece>"]  # fmt: skip
    path.write_text("\n".join([*text, "</ImageData></VTKFile>"]))
    return path


@pytest.mark.parametrize("stated", ['encoding="base64"', "encoding='base64'", "encoding = 'base64'"])
def test_appended_data_state_their_encoding_in_either_quotes(tmp_path: Path, stated: str) -> None:
    values = np.arange(8, dtype=np.float32)
    text = (
        "<VTKFile type='ImageData' byte_order='LittleEndian'><ImageData WholeExtent='0 1 0 1 0 1'><Piece "
        "Extent='0 1 0 1 0 1'><PointData><DataArray type='Float32' Name='v' format='appended' offset='0'/></PointData>"
        f"</Piece></ImageData><AppendedData {stated}>_{inline(values)}</AppendedData></VTKFile>"
    )
    (tmp_path / "v.vti").write_text(text)
    np.testing.assert_array_equal(read_volume(tmp_path / "v.vti").data.ravel("F"), values)


@pytest.mark.parametrize("of_cells", [False, True])
@pytest.mark.parametrize("components", [1, 3])
def test_pieces_of_several_components_are_joined(tmp_path: Path, of_cells: bool, components: int) -> None:
    whole = [2, 6, -1, 2, 3, 5]
    counts = [n - (1 if of_cells else 0) for n in (5, 4, 3)]
    values = np.random.default_rng(1).normal(size=(components, *counts)).astype(np.float32)
    split = 2
    end = split + (0 if of_cells else 1)
    pieces = [([2, 4, -1, 2, 3, 5], values[:, :end]), ([4, 6, -1, 2, 3, 5], values[:, split:])]
    for name, parts in (("two", pieces), ("one", [(whole, values)])):
        path = vti(tmp_path / f"{name}.vti", whole, parts, components=components, of_cells=of_cells)
        for component in range(components):
            volume = read_volume(path, component=component)
            np.testing.assert_array_equal(volume.data, values[component])
            shift = 0.5 if of_cells else 0.0
            first = [1 + 0.5 * (2 + shift), 2 + 1 * (-1 + shift), 3 + 2 * (3 + shift)]
            np.testing.assert_allclose(volume.world_from_index[:3, 3], first)
            np.testing.assert_allclose(np.diag(volume.world_from_index), [0.5, 1, 2, 1])
    short = vti(tmp_path / "short.vti", whole, pieces[:1], components=components, of_cells=of_cells)
    with pytest.raises(FileFormatError, match="do not fill its extent"):
        read_volume(short, component=0)
    outside = vti(tmp_path / "out.vti", [2, 5, -1, 2, 3, 5], pieces, components=components, of_cells=of_cells)
    with pytest.raises(FileFormatError, match="outside"):
        read_volume(outside, component=0)


def test_an_archive_holds_up_to_a_thousand_arrays(tmp_path: Path) -> None:
    for count in (1000, 1001):
        path = tmp_path / f"{count}.npz"
        np.savez(path, **{f"a{k}": np.zeros((1, 1, 1), np.uint8) for k in range(count)})
        if count == 1000:
            assert read_volume(path, field="a999").shape == (1, 1, 1)
        else:
            with pytest.raises(FileFormatError, match="holds 1001 arrays"):
                read_volume(path, field="a0")


@pytest.mark.parametrize("binary", [False, True])
def test_every_section_of_a_legacy_file_is_read_or_passed_over(tmp_path: Path, binary: bool) -> None:
    """Field data of the dataset, arrays of every kind, a color table and metadata, one after the other."""
    kinds = {"float": ">f4", "int": ">i4", "double": ">f8", "unsigned_char": "u1"}

    def numbers(values: np.ndarray, kind: str) -> bytes:
        if binary:
            return values.astype(kinds[kind]).tobytes() + b"\n"
        return " ".join(map(str, values.ravel().tolist())).encode() + b"\n"

    rng = np.random.default_rng(3)
    colored = "unsigned_char" if binary else "float"
    plain, speed, uv = (rng.integers(0, 99, (12, count)) for count in (1, 3, 2))
    rgb, table, one, two = (rng.integers(0, 99, shape) for shape in ((12, 3), (2, 4), (12, 1), (12, 2)))
    parts = [
        b"# vtk DataFile Version 3.0\ntest\n" + (b"BINARY\n" if binary else b"ASCII\n"),
        b"DATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 2\nORIGIN 0 0 0\nSPACING 1 1 1\n",
        b"FIELD FieldData 1\nTIME 1 1 double\n", numbers(np.array([0.5]), "double"),
        b"POINT_DATA 12\nSCALARS plain float\n", numbers(plain, "float"),
        b"LOOKUP_TABLE colors 2\n", numbers(table, colored),
        b"VECTORS speed float\n", numbers(speed, "float"),
        b"TEXTURE_COORDINATES uv 2 float\n", numbers(uv, "float"),
        b"COLOR_SCALARS rgb 3\n", numbers(rgb, colored),
        b"METADATA\nINFORMATION 0\n\n",
        b"FIELD FieldData 2\none 1 12 int\n", numbers(one, "int"), b"two 2 12 float\n", numbers(two, "float"),
    ]  # fmt: skip
    path = tmp_path / "a.vtk"
    path.write_bytes(b"".join(parts))
    for name, values in (("plain", plain), ("one", one)):
        np.testing.assert_array_equal(read_volume(path, field=name).data.ravel("F"), values[:, 0])
    for name, values in (("speed", speed), ("uv", uv), ("rgb", rgb), ("two", two)):
        for component in range(values.shape[1]):
            found = read_volume(path, field=name, component=component)
            np.testing.assert_array_equal(found.data.ravel("F"), values[:, component])
    with pytest.raises(UnknownNameError, match="TIME"):
        read_volume(path, field="TIME")
