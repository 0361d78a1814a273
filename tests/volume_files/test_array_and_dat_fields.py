# SPDX-License-Identifier: GPL-3.0-or-later
"""Every field of .dat headers, NumPy archives and TIFF and NIfTI axes: what it means, and which values are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import tifffile

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.files import read_volume
from tests.volume_files.volume_fixtures import SHEARED, SPACING, check, fixture_values, world

VALUES = fixture_values("int16")
DAT = {"ObjectFileName": "e.raw", "Resolution": "4 3 5", "Format": "SHORT"}
DAT_TYPES = {
    "UCHAR": "u1", "CHAR": "i1", "USHORT": "u2", "SHORT": "i2", "UINT": "u4", "INT": "i4", "FLOAT": "f4",
    "DOUBLE": "f8", "UINT8": "u1", "UINT16": "u2", "UINT32": "u4", "UINT64": "u8", "INT8": "i1", "INT16": "i2",
    "INT32": "i4", "INT64": "i8", "BYTE": "u1", "FLOAT32": "f4", "FLOAT64": "f8", "USHORT_12": "u2", "uchar": "u1",
}  # fmt: skip


def dat_of(folder: Path, data: bytes, **fields: str) -> Path:
    (folder / "e.raw").write_bytes(data)
    given = {key: value for key, value in {**DAT, **fields}.items() if value is not None}
    (folder / "e.dat").write_text("".join(f"{key}: {value}\n" for key, value in given.items()))
    return folder / "e.dat"


@pytest.mark.parametrize(("kind", "dtype"), DAT_TYPES.items())
def test_dat_types(tmp_path: Path, kind: str, dtype: str) -> None:
    values = fixture_values("uint8" if dtype[0] == "u" else "int8").astype(dtype)
    volume = read_volume(dat_of(tmp_path, values.astype("<" + dtype).tobytes(order="F"), Format=kind))
    assert volume.data.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.data, values)


@pytest.mark.parametrize(
    ("word", "order"), [("BigEndian", ">"), ("big", ">"), ("LITTLE", "<"), ("LittleEndian", "<"), (None, "<")]
)
@pytest.mark.parametrize("key", ["Endianness", "ByteOrder"])
def test_dat_byte_order(tmp_path: Path, key: str, word: str | None, order: str) -> None:
    path = dat_of(tmp_path, VALUES.astype(order + "i2").tobytes(order="F"), **{key: word})
    check(read_volume(path), VALUES, np.eye(4))


def test_dat_geometry_and_offset(tmp_path: Path) -> None:
    data = b"abc" + VALUES.tobytes(order="F")
    words = {"Slice Thickness": "0.5, 1.25, 2", "Origin": "10 -20 3.5", "Byte Offset": "3", "# Origin": "0 0 0"}
    check(read_volume(dat_of(tmp_path, data, **words)), VALUES, world())


def test_dat_of_inviwo_is_placed_by_its_box(tmp_path: Path) -> None:
    """Its offset, its basis vectors and its matrix to the world were not read: voxels were cubes of 1 at the origin."""
    data = VALUES.tobytes(order="F")
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    box, corner = turn @ np.diag([8.0, 4.5, 10.0]), np.array([10.0, -20.0, 3.5])
    rows = {f"BasisVector{k + 1}": " ".join(map(repr, row.tolist())) for k, row in enumerate(box)}
    moved = {f"WorldVector{k + 1}": text for k, text in enumerate(("2 0 0 7", "0 2 0 0", "0 0 2 0", "0 0 0 1"))}

    def at(index: list[float], **fields: str) -> np.ndarray:
        given = {
            "RawFile": "e.raw",
            "ObjectFileName": None,
            "Dimensions": "4 3 5 # voxels",
            "Resolution": None,
            **fields,
        }
        return (read_volume(dat_of(tmp_path, data, **given)).world_from_index @ [*index, 1.0])[:3]

    for index in ([-0.5, -0.5, -0.5], [3.5, 2.5, 4.5], [1.0, 0.0, 2.0]):
        share = (np.array(index) + 0.5) / (4, 3, 5)
        np.testing.assert_allclose(at(index, **rows, Offset="10 -20 3.5"), corner + box @ share, atol=1e-12)
        np.testing.assert_allclose(at(index, **rows), box @ (share - 0.5), atol=1e-12)
        np.testing.assert_allclose(
            at(index, **rows, **moved, Offset="10 -20 3.5"), 2 * (corner + box @ share) + (7, 0, 0), atol=1e-12
        )
        straight = corner + np.array([2.0, 1.5, 2.0]) * (np.array(index) + 0.5)
        np.testing.assert_allclose(at(index, Offset="10 -20 3.5", Spacing="2 1.5 2"), straight, atol=1e-12)


@pytest.mark.parametrize(
    ("fields", "message"),
    [({"Offset": "1 2 3", "Origin": "0 0 0"}, "keep one of them"), ({"BasisVector2": "1 0 0"}, "lacks BasisVector1"),
     ({"WorldVector1": "1 0 0 0"}, "expected WorldVector1 to 4"), ({"Resolution": "4 3"}, "expected 3 numbers"),
     ({"Resolution": "4 3 inf"}, "expected 3 numbers"),
     ({"Resolution": "4 3.5 5"}, "whole numbers"), ({"Resolution": "a b c"}, "expected 3 numbers"),
     ({"Format": "COMPLEX"}, "format 'COMPLEX'"), ({"Format": None}, "lacks format"),
     ({"ObjectFileName": None}, "lacks"), ({"ByteOffset": "1 2"}, "expected 1 number"),
     ({"ByteOffset": "0.5"}, "whole numbers"),
     ({"ObjectFileName": "f.raw"}, "not in"), ({"Resolution": "4 3 6"}, "120 bytes")],
)  # fmt: skip
def test_dat_refuses(tmp_path: Path, fields: dict[str, str], message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        read_volume(dat_of(tmp_path, VALUES.tobytes(order="F"), **fields))


def test_dat_of_huge_numbers(tmp_path: Path) -> None:
    path = dat_of(tmp_path, VALUES.tobytes(order="F"), Spacing="1e308 1 1")
    with pytest.raises(InvalidInputError, match="world_from_index of volume 'e' holds"):
        read_volume(path)


# NumPy


def test_arrays_of_four_axes_need_a_component(tmp_path: Path) -> None:
    both = np.stack([VALUES, VALUES + 100], axis=3)
    np.save(tmp_path / "a.npy", both)
    check(read_volume(tmp_path / "a.npy", component=1), both[..., 1], np.eye(4))
    with pytest.raises(InvalidInputError, match="2 components"):
        read_volume(tmp_path / "a.npy")
    np.save(tmp_path / "one.npy", both[..., :1])
    check(read_volume(tmp_path / "one.npy"), VALUES, np.eye(4))
    with pytest.raises(InvalidInputError, match="one array without a name"):
        read_volume(tmp_path / "a.npy", field="a")
    np.save(tmp_path / "five.npy", both[..., None])
    with pytest.raises(FileFormatError, match="expected three axes"):
        read_volume(tmp_path / "five.npy")


def test_archives_hold_one_volume_and_its_geometry(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", lone=VALUES)
    volume = read_volume(tmp_path / "a.npz")
    assert volume.name == "a"
    np.savez(tmp_path / "b.npz", ct=VALUES, table=np.zeros((4, 3)), spacing=np.array(SPACING))
    volume = read_volume(tmp_path / "b.npz", field="ct")
    assert volume.name == "ct"
    check(volume, VALUES, np.diag([*SPACING, 1]))
    check(read_volume(tmp_path / "b.npz"), VALUES, np.diag([*SPACING, 1]))
    np.savez(tmp_path / "c.npz", ct=VALUES, to_world=SHEARED, spacing=np.ones(3))
    check(read_volume(tmp_path / "c.npz"), VALUES, SHEARED)
    with pytest.raises(InvalidInputError, match="say which is the volume"):
        np.savez(tmp_path / "d.npz", flat=np.zeros((4, 3)), spacing=np.ones(3))
        read_volume(tmp_path / "d.npz")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("to_world", np.eye(3)),
        ("spacing", np.ones(4)),
        ("origin", np.ones((1, 3))),
        ("spacing", np.array(["a", "b", "c"])),
    ],
)
def test_archives_of_wrong_geometry_are_refused(tmp_path: Path, name: str, value: np.ndarray) -> None:
    np.savez(tmp_path / "a.npz", data=VALUES, **{name: value})
    with pytest.raises(FileFormatError, match=f"{name} of a.npz has shape"):
        read_volume(tmp_path / "a.npz")


# NIfTI


def test_nifti_axes(tmp_path: Path) -> None:
    frames = np.stack([VALUES, VALUES + 100], axis=3)[..., None]  # a fifth axis of length 1
    nibabel.save(nibabel.Nifti1Image(frames, np.eye(4)), tmp_path / "a.nii")
    check(read_volume(tmp_path / "a.nii", component=1), frames[..., 1, 0], np.eye(4))
    nibabel.save(nibabel.Nifti1Image(frames[..., :1, 0], np.eye(4)), tmp_path / "b.nii")
    check(read_volume(tmp_path / "b.nii"), VALUES, np.eye(4))
    nibabel.save(nibabel.Nifti1Image(VALUES[..., 0], np.eye(4)), tmp_path / "flat.nii")
    with pytest.raises(FileFormatError, match="expected a volume with three axes"):
        read_volume(tmp_path / "flat.nii")
    nibabel.save(nibabel.Nifti1Image(VALUES.astype(np.complex64), np.eye(4)), tmp_path / "c.nii")
    with pytest.raises(InvalidInputError, match="colors or complex numbers"):
        read_volume(tmp_path / "c.nii")


@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image, nibabel.Nifti1Pair])
def test_nifti_without_an_orientation_is_not_mirrored(tmp_path: Path, kind: Any) -> None:
    """Both of its codes are 0: its coordinates are the indices times the sizes of its voxels."""
    image = kind(VALUES, None)
    image.header.set_zooms((1.0, 2.0, 20.0))
    image.to_filename(tmp_path / "a.hdr" if kind is nibabel.Nifti1Pair else tmp_path / "a.nii")
    (found,) = tmp_path.glob("a.[hn]*")
    check(read_volume(found), VALUES, np.diag([1.0, 2.0, 20.0, 1.0]))
    image.set_qform(np.diag([-1.0, 2.0, 20.0, 1.0]), 1)
    image.to_filename(found)
    check(read_volume(found), VALUES, np.diag([-1.0, 2.0, 20.0, 1.0]))


@pytest.mark.parametrize(
    ("stored", "read"), [("int16", "float32"), ("uint8", "float32"), ("int32", "float64"), ("float32", "float32"),
                         ("float64", "float64")],
)  # fmt: skip
def test_scaled_nifti_is_as_wide_as_its_numbers(tmp_path: Path, stored: str, read: str) -> None:
    image = nibabel.Nifti1Image(fixture_values("uint8").astype(stored), np.eye(4))
    image.header.set_slope_inter(0.5, 2)
    image.to_filename(tmp_path / "a.nii")
    (tmp_path / "a.nii").write_bytes(_with_scale((tmp_path / "a.nii").read_bytes(), 0.5, 2.0))
    volume = read_volume(tmp_path / "a.nii")
    assert volume.data.dtype == np.dtype(read)
    unscaled = nibabel.load(tmp_path / "a.nii").dataobj.get_unscaled()
    np.testing.assert_array_equal(volume.data, 0.5 * unscaled + 2)
    for slope, inter in ((1.0, 3.0), (2.0, 0.0)):  # one of the two alone scales as well
        (tmp_path / "a.nii").write_bytes(_with_scale((tmp_path / "a.nii").read_bytes(), slope, inter))
        np.testing.assert_array_equal(read_volume(tmp_path / "a.nii").data, slope * unscaled + inter)


def _with_scale(data: bytes, slope: float, inter: float) -> bytes:
    """Bytes 112 to 119 of a NIfTI-1 header are its slope and intercept."""
    return data[:112] + np.array([slope, inter], "<f4").tobytes() + data[120:]


# TIFF


@pytest.mark.parametrize(("axes", "what"), [("TZYX", "time steps"), ("CZYX", "channels")])
def test_tiff_axes_besides_depth_need_a_component(tmp_path: Path, axes: str, what: str) -> None:
    both = np.stack([VALUES, VALUES + 100]).transpose(0, 3, 2, 1)
    tifffile.imwrite(tmp_path / "a.ome.tif", both, photometric="minisblack", metadata={"axes": axes})
    check(read_volume(tmp_path / "a.ome.tif", component=1), VALUES + 100, np.eye(4))
    with pytest.raises(InvalidInputError, match=f"2 {what} per voxel"):
        read_volume(tmp_path / "a.ome.tif")
    tifffile.imwrite(tmp_path / "b.ome.tif", both[:1], photometric="minisblack", metadata={"axes": axes})
    check(read_volume(tmp_path / "b.ome.tif"), VALUES, np.eye(4))


def test_one_tiff_page_is_a_volume_of_one_slice(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", VALUES[:, :, 0].T)
    check(read_volume(tmp_path / "a.tif"), VALUES[:, :, :1], np.eye(4))


def test_tiff_of_different_pages_is_refused(tmp_path: Path) -> None:
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        file.write(VALUES[:, :, 0].T)
        file.write(VALUES[:3, :, 0].T)
    with pytest.raises(FileFormatError, match="images of different shapes"):
        read_volume(tmp_path / "a.tif")


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
def test_a_cyclic_list_of_tiff_pages_is_refused(tmp_path: Path, big: bool, order: str) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, VALUES.transpose(2, 1, 0), bigtiff=big, byteorder=order, photometric="minisblack")
    data = bytearray(path.read_bytes())
    kind, count, entry, at = (order + "u8", order + "u8", 20, 8) if big else (order + "u4", order + "u2", 12, 4)
    first = int(np.frombuffer(data, kind, 1, at)[0])
    entries = int(np.frombuffer(data, count, 1, first)[0])
    link = first + np.dtype(count).itemsize + entry * entries
    data[link : link + np.dtype(kind).itemsize] = np.array([first], kind).tobytes()
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match="does not end"):
        read_volume(path)


def test_ome_units_of_each_axis(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    sizes = {"PhysicalSizeX": 0.5, "PhysicalSizeY": 500.0, "PhysicalSizeYUnit": "nm", "PhysicalSizeZ": 0.002}
    metadata = {"axes": "ZYX", **sizes, "PhysicalSizeZUnit": "mm"}
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, VALUES.transpose(2, 1, 0), photometric="minisblack", metadata=metadata)
    assert np.allclose(np.diag(read_volume(path).world_from_index), [0.5, 0.5, 2.0, 1.0])
    tifffile.imwrite(
        path, VALUES.transpose(2, 1, 0), photometric="minisblack", metadata=metadata | {"PhysicalSizeZUnit": "pixel"}
    )
    with pytest.raises(FileFormatError, match="units µm, nm, pixel; expected one unit"):
        read_volume(path)


@pytest.mark.parametrize(
    ("stored", "slope", "intercept", "dtype"),
    [
        ("int16", 1e-3, 1e6, "float64"),  # in float32 the steps of 1e-3 are lost at 1e6
        ("uint8", 1.0, 1e8, "float64"),
        ("float32", 2.0, 1e12, "float64"),
        ("int16", 2e38, 0.0, "float64"),  # beyond float32
        ("int16", 0.25, -1024.0, "float32"),
        ("float32", 0.25, -100.0, "float32"),
    ],
)
def test_scaled_nifti_voxels_keep_what_is_stored(tmp_path, stored, slope, intercept, dtype):
    values = (np.arange(60).reshape(4, 3, 5) * 3 + 7).astype(stored)
    header = nibabel.Nifti1Header()
    header.set_data_dtype(stored)
    header.set_data_shape(values.shape)
    header["scl_slope"], header["scl_inter"], header["vox_offset"], header["magic"] = slope, intercept, 352, b"n+1"
    (tmp_path / "a.nii").write_bytes(header.binaryblock + bytes(4) + values.tobytes(order="F"))
    volume = read_volume(tmp_path / "a.nii")
    assert volume.data.dtype == dtype
    expected = values.astype(float) * float(np.float32(slope)) + float(np.float32(intercept))
    assert np.abs(volume.data.astype(float) - expected).max() <= 0.1 * np.diff(np.unique(expected)).min()
