# SPDX-License-Identifier: GPL-3.0-or-later
"""NRRD, NIfTI, NumPy, TIFF and VTK compared bit by bit with files of the usual programs."""

from __future__ import annotations

import nibabel
import nrrd
import numpy as np
import pytest
import tifffile

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import read_volume, write_volume
from tests.volume_files.volume_fixtures import (
    DATA,
    DIRECTIONS,
    EXTENT_START,
    ORIGIN,
    SHAPE,
    SHEARED,
    SPACING,
    check,
    fixture_values,
    world,
)

# Files of other writers


@pytest.mark.parametrize("path", sorted(DATA.glob("*.vti")), ids=lambda path: path.stem)
def test_vtk_image_data(path):
    if "lz4" in path.stem:
        pytest.importorskip("lz4")
    volume = read_volume(path)
    first = np.array(EXTENT_START) + (0.5 if "cells" in path.stem else 0.0)
    origin = np.array(ORIGIN) + DIRECTIONS @ (first * SPACING)
    check(volume, fixture_values(volume.data.dtype.name), world(DIRECTIONS, origin))


@pytest.mark.parametrize("name", ["points_ascii.vtk", "points_binary.vtk"])
def test_vtk_structured_points(name):
    check(read_volume(DATA / name, field="measured"), fixture_values("int16"), world())
    velocity = read_volume(DATA / name, field="velocity", component=2)
    check(velocity, np.full(SHAPE, 2.5, np.float32), world())


@pytest.mark.parametrize("name", ["image.mha", "image.mhd", "itk.nrrd"])
def test_files_of_itk(name):
    check(read_volume(DATA / name), fixture_values("int16"), world(DIRECTIONS))


# NRRD


@pytest.mark.parametrize(
    "dtype", ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"]
)
def test_nrrd_keeps_every_type_and_a_sheared_frame(tmp_path, dtype):
    values = fixture_values(dtype)
    header = {"space directions": SHEARED[:3, :3].T, "space origin": SHEARED[:3, 3], "space": "left-posterior-superior"}
    nrrd.write(str(tmp_path / "a.nrrd"), values, header)
    check(read_volume(tmp_path / "a.nrrd"), values, SHEARED)


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii"])
@pytest.mark.parametrize("detached", [False, True])
def test_nrrd_encodings(tmp_path, encoding, detached):
    values = fixture_values("int16")
    path = tmp_path / ("a.nhdr" if detached else "a.nrrd")
    nrrd.write(str(path), values, {"encoding": encoding, "spacings": SPACING}, detached_header=detached)
    check(read_volume(path), values, np.diag([*SPACING, 1]))


def test_nrrd_big_endian_and_skipped_bytes(tmp_path):
    values = fixture_values("int16")
    (tmp_path / "a.bin").write_bytes(b"junk\nmore" + values.astype(">i2").tobytes(order="F"))
    text = "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 5\nendian: big\nencoding: raw\n{}\ndata file: a.bin\n\n"
    for skip in ("line skip: 1\nbyte skip: 4", "byte skip: -1"):
        (tmp_path / "a.nhdr").write_text(text.format(skip))
        check(read_volume(tmp_path / "a.nhdr"), values, np.eye(4))


def test_nrrd_slices_in_many_files(tmp_path):
    values = fixture_values("uint8")
    for z in range(5):
        (tmp_path / f"s{z + 1:02d}.raw").write_bytes(values[:, :, z].tobytes(order="F"))
    head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 5\nencoding: raw\n"
    (tmp_path / "pattern.nhdr").write_text(head + "data file: s%02d.raw 1 5 1\n")
    (tmp_path / "list.nhdr").write_text(
        head + "data file: LIST\n" + "\n".join(f"s{z + 1:02d}.raw" for z in range(5)) + "\n"
    )
    check(read_volume(tmp_path / "pattern.nhdr"), values, np.eye(4))
    check(read_volume(tmp_path / "list.nhdr"), values, np.eye(4))


def test_nrrd_vectors_need_a_component(tmp_path):
    values = np.stack([fixture_values("int16"), fixture_values("int16") + 1000])
    header = {"kinds": ["vector", "domain", "domain", "domain"], "spacings": [np.nan, *SPACING]}
    nrrd.write(str(tmp_path / "v.nrrd"), values, header)
    check(read_volume(tmp_path / "v.nrrd", component=1), values[1], np.diag([*SPACING, 1]))
    with pytest.raises(InvalidInputError, match="2 components per voxel; say which with component=0 to 1"):
        read_volume(tmp_path / "v.nrrd")
    with pytest.raises(InvalidInputError, match=r"component 2 of v.nrrd was requested"):
        read_volume(tmp_path / "v.nrrd", component=2)


def test_nrrd_axis_minima_follow_the_centering(tmp_path):
    values = fixture_values("uint8")
    for centering, shift in (("node", 0.0), ("cell", 0.5)):
        header = {"spacings": SPACING, "axis mins": ORIGIN, "centerings": [centering] * 3}
        nrrd.write(str(tmp_path / "a.nrrd"), values, header)
        check(read_volume(tmp_path / "a.nrrd"), values, world(origin=np.array(ORIGIN) + shift * np.array(SPACING)))


# NIfTI


@pytest.mark.parametrize("ending", ["nii", "nii.gz", "hdr"])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "float64"])
def test_nifti_keeps_type_and_affine(tmp_path, ending, dtype):
    values = fixture_values(dtype)
    image = nibabel.Nifti1Image(values, SHEARED) if ending != "hdr" else nibabel.Nifti1Pair(values, SHEARED)
    nibabel.save(image, tmp_path / f"a.{ending}")
    volume = read_volume(tmp_path / f"a.{ending}")
    assert volume.name == "a"
    assert np.allclose(volume.world_from_index, SHEARED, rtol=1e-6, atol=1e-6)  # the header holds float32
    check(volume, values, volume.world_from_index)


def test_nifti_2_big_endian_and_time(tmp_path):
    values = np.stack([fixture_values("int16"), fixture_values("int16") + 7], axis=-1)
    header = nibabel.Nifti2Header(endianness=">")
    header.set_data_dtype("int16")
    nibabel.save(nibabel.Nifti2Image(values, np.eye(4), header), tmp_path / "t.nii")
    check(read_volume(tmp_path / "t.nii", component=1), values[..., 1], np.eye(4))
    with pytest.raises(InvalidInputError, match="2 time steps per voxel"):
        read_volume(tmp_path / "t.nii")


def test_nifti_scaling_gives_real_values(tmp_path):
    values = fixture_values("int16")
    image = nibabel.Nifti1Image(values, np.eye(4))
    image.header.set_slope_inter(0.25, -3)
    image.to_filename(tmp_path / "s.nii")
    stored = bytearray((tmp_path / "s.nii").read_bytes())
    volume = read_volume(tmp_path / "s.nii")
    proxy = nibabel.load(tmp_path / "s.nii").dataobj
    assert volume.data.dtype == np.float32
    assert (proxy.slope, proxy.inter) == (0.25, -3)
    raw = np.frombuffer(stored[352:], np.int16).reshape(SHAPE, order="F")
    assert np.array_equal(volume.data, raw * 0.25 - 3)


# NumPy


def test_numpy_axis_0_is_x(tmp_path):
    values = fixture_values("float64")
    np.save(tmp_path / "a.npy", values)
    check(read_volume(tmp_path / "a.npy"), values, np.eye(4))


def test_npz_has_its_geometry(tmp_path):
    values = fixture_values("uint16")
    np.savez_compressed(tmp_path / "a.npz", data=values, spacing=SPACING, origin=ORIGIN)
    np.savez(tmp_path / "b.npz", ct=values, pet=values.astype(np.float32), to_world=SHEARED)
    check(read_volume(tmp_path / "a.npz"), values, world())
    check(read_volume(tmp_path / "b.npz", field="pet"), values.astype(np.float32), SHEARED)
    with pytest.raises(InvalidInputError, match=r"holds ct \(4, 3, 5\), pet .*say which"):
        read_volume(tmp_path / "b.npz")
    with pytest.raises(UnknownNameError, match=r"no array of b.npz is named 'pett'; did you mean 'pet'"):
        read_volume(tmp_path / "b.npz", field="pett")


def test_numpy_of_objects_or_flat_arrays_is_refused(tmp_path):
    np.save(tmp_path / "o.npy", np.array([{}, []], dtype=object), allow_pickle=True)
    np.save(tmp_path / "flat.npy", np.zeros((4, 3)))
    np.save(tmp_path / "c.npy", np.zeros((2, 2, 2), complex))
    with pytest.raises(FileFormatError, match="not a NumPy file of plain numbers"):
        read_volume(tmp_path / "o.npy")
    with pytest.raises(FileFormatError, match=r"has shape \(4, 3\); expected three axes"):
        read_volume(tmp_path / "flat.npy")
    with pytest.raises(FileFormatError, match="holds complex128"):
        read_volume(tmp_path / "c.npy")


# TIFF


@pytest.mark.parametrize("options", [{}, {"compression": "deflate"}, {"bigtiff": True}, {"byteorder": ">"}])
def test_tiff_pages(tmp_path, options):
    values = fixture_values("uint16")
    tifffile.imwrite(tmp_path / "a.tif", values.transpose(2, 1, 0), photometric="minisblack", **options)
    check(read_volume(tmp_path / "a.tif"), values, np.eye(4))


def test_tiff_spacing_of_imagej_and_ome(tmp_path):
    values = fixture_values("float32")
    pages = values.transpose(2, 1, 0)
    metadata = {"spacing": 2.0, "unit": "um", "axes": "ZYX"}
    tifffile.imwrite(tmp_path / "ij.tif", pages, imagej=True, resolution=(1 / 0.5, 1 / 1.25), metadata=metadata)
    sizes = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", SPACING, strict=True)}
    tifffile.imwrite(tmp_path / "o.ome.tif", pages, photometric="minisblack", metadata={"axes": "ZYX", **sizes})
    check(read_volume(tmp_path / "ij.tif"), values, np.diag([*SPACING, 1]))
    check(read_volume(tmp_path / "o.ome.tif"), values, np.diag([*SPACING, 1]))


def test_tiff_folder_is_sorted_by_number(tmp_path):
    values = np.random.default_rng(1).integers(0, 255, (4, 3, 12)).astype(np.uint8)
    folder = tmp_path / "stack"
    folder.mkdir()
    for z in range(12):
        tifffile.imwrite(folder / f"slice{z}.tif", values[:, :, z].T)
    check(read_volume(folder), values, np.eye(4))
    with pytest.raises(InvalidInputError, match="read the 12 files as a stack"):
        read_volume(folder / "slice3.tif")
    tifffile.imwrite(folder / "slice5.tif", values[:3, :, 5].T)
    with pytest.raises(FileFormatError, match=r"slice5.tif .* is \(3, 3\) of uint8, slice0.tif is \(4, 3\)"):
        read_volume(folder)


def test_color_tiffs_need_a_component(tmp_path):
    pages = np.random.default_rng(2).integers(0, 255, (5, 3, 4, 3)).astype(np.uint8)
    tifffile.imwrite(tmp_path / "rgb.tif", pages, photometric="rgb")
    with pytest.raises(InvalidInputError, match="3 color channels per voxel"):
        read_volume(tmp_path / "rgb.tif")
    check(read_volume(tmp_path / "rgb.tif", component=1), pages[..., 1].transpose(2, 1, 0), np.eye(4))


@pytest.mark.parametrize(("dtype", "fitting"), [("float16", "float32"), ("longdouble", "float64")])
def test_nrrd_refuses_floats_that_it_has_no_type_for(tmp_path, dtype, fitting):
    volume = ScalarVolume("wide", np.ones((2, 3, 4), dtype))
    if volume.data.dtype.itemsize == 8:
        pytest.skip("long double is double here")
    with pytest.raises(InvalidInputError, match=f"NRRD has no type for float.*convert volume 'wide' to {fitting}"):
        write_volume(volume, tmp_path / "a.nrrd")
