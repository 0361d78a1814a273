# SPDX-License-Identifier: GPL-3.0-or-later
"""Every format against its own community's writer: values, type, spacing, orientation and origin to the last bit."""

from __future__ import annotations

import os
from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
import tifffile

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError, UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import RawLayout, detect_format, known_formats, read_volume, write_volume
from tests.volume_files.volume_fixtures import DATA, DIRECTIONS, EXTENT_START, ORIGIN, SHAPE, SPACING, fixture_values

SHEARED = np.array([[0.5, 0.1, 0.0, 10.0], [0.0, -1.25, 0.2, -20.0], [0.3, 0.0, 2.0, 3.5], [0.0, 0.0, 0.0, 1.0]])


IDENTITY = np.eye(3)


def world(directions=IDENTITY, origin=ORIGIN, spacing=SPACING):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = directions * spacing, origin
    return matrix


def check(volume, values, to_world):
    assert volume.data.dtype == values.dtype
    assert volume.data.dtype.isnative
    assert np.array_equal(volume.data, values)
    assert np.allclose(volume.to_world, to_world, rtol=1e-7, atol=1e-12)


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
    with pytest.raises(InvalidInputError, match=r"component 2 of v.nrrd was asked for"):
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
    assert np.allclose(volume.to_world, SHEARED, rtol=1e-6, atol=1e-6)  # the header holds float32
    check(volume, values, volume.to_world)


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


def test_npz_brings_its_geometry(tmp_path):
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


def test_tiff_colours_need_a_component(tmp_path):
    pages = np.random.default_rng(2).integers(0, 255, (5, 3, 4, 3)).astype(np.uint8)
    tifffile.imwrite(tmp_path / "rgb.tif", pages, photometric="rgb")
    with pytest.raises(InvalidInputError, match="3 colour channels per voxel"):
        read_volume(tmp_path / "rgb.tif")
    check(read_volume(tmp_path / "rgb.tif", component=1), pages[..., 1].transpose(2, 1, 0), np.eye(4))


# Raw and its headers


def test_raw_layouts(tmp_path):
    values = fixture_values("uint16")
    (tmp_path / "foot_4x3x5_uint16.raw").write_bytes(values.tobytes(order="F"))
    (tmp_path / "foot_4x3x5_uint16_be.raw").write_bytes(values.astype(">u2").tobytes(order="F"))
    (tmp_path / "plain.bytes").write_bytes(b"header!" + values.tobytes(order="F"))
    check(read_volume(tmp_path / "foot_4x3x5_uint16.raw"), values, np.eye(4))
    check(read_volume(tmp_path / "foot_4x3x5_uint16_be.raw"), values, np.eye(4))
    for offset in (7, -1):
        layout = RawLayout(SHAPE, "uint16", offset=offset, spacing=SPACING, origin=ORIGIN)
        check(read_volume(tmp_path / "plain.bytes", raw=layout), values, world())


def test_raw_of_another_length_is_refused(tmp_path):
    (tmp_path / "a.raw").write_bytes(bytes(100))
    with pytest.raises(
        FileFormatError, match=r"a.raw has 100 bytes; 4×3×5 numbers of type uint16 after 0 bytes .* 120 bytes"
    ):
        read_volume(tmp_path / "a.raw", raw=RawLayout(SHAPE, "uint16"))
    with pytest.raises(InvalidInputError, match=r"does not spell a layout.*give raw=RawLayout"):
        read_volume(tmp_path / "a.raw")
    (tmp_path / "a.mhd").write_text("NDims = 3")
    with pytest.raises(InvalidInputError, match=r"a.mhd lies beside it: open that"):
        read_volume(tmp_path / "a.raw")


def test_raw_data_are_held_once(tmp_path):
    import tracemalloc

    (tmp_path / "a_200x100x100_uint8.raw").write_bytes(bytes(2_000_000))
    tracemalloc.start()
    volume = read_volume(tmp_path / "a_200x100x100_uint8.raw")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert volume.data.flags.f_contiguous
    assert peak < 2_300_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((4, 3), "uint8"), "expected three counts"),
        (((4, 3, 0), "uint8"), "each at least 1"),
        (((4, 3, 5), "uint9"), "expected a NumPy type"),
        (((4, 3, 5), "complex64"), "expected an integer or float type"),
        (((4, 3, 5), "uint8", "middle"), "expected 'little' or 'big'"),
        (((4, 3, 5), "uint8", "little", -2), "or -1 for the file's end"),
        (((4, 3, 5), "uint8", "little", 0, (1, np.nan, 1)), "spacing of the raw layout holds 1 value"),
    ],
)
def test_odd_raw_layouts(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        RawLayout(*arguments)


def test_dat_headers(tmp_path):
    values = fixture_values("uint16")
    (tmp_path / "e.raw").write_bytes(b"1234" + values.astype(">u2").tobytes(order="F"))
    volvis = (
        "ObjectFileName: e.raw\nTaggedFileName: ---\nResolution: 4 3 5\nSliceThickness: 0.5 1.25 2\nFormat: USHORT_12\n"
    )
    inviwo = "RawFile: e.raw\nResolution: 4 3 5\nSpacing: 0.5 1.25 2\nFormat: UINT16\n"
    for text in (volvis, inviwo):
        (tmp_path / "e.dat").write_text(text + "ByteOffset: 4\nEndianness: BigEndian\nOrigin: 10 -20 3.5\n")
        check(read_volume(tmp_path / "e.dat"), values, world())
    (tmp_path / "e.dat").write_text(volvis.replace("e.raw", "f.raw"))
    with pytest.raises(FileFormatError, match=r"names the data file 'f.raw', which is not in"):
        read_volume(tmp_path / "e.dat")


def test_metaimage_variants(tmp_path):
    values = fixture_values("int16")
    head = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 5\nElementType = MET_SHORT\n"
    head += "ElementSize = 0.5 1.25 2\nPosition = 10 -20 3.5\n"
    big = values.astype(">i2").tobytes(order="F")
    (tmp_path / "a.raw").write_bytes(b"skipped" + big)
    (tmp_path / "a.mhd").write_text(head + "ElementByteOrderMSB = True\nHeaderSize = -1\nElementDataFile = a.raw\n")
    check(read_volume(tmp_path / "a.mhd"), values, world())
    numbers = " ".join(str(n) for n in values.ravel(order="F"))
    (tmp_path / "b.mha").write_text(head + "BinaryData = False\nElementDataFile = LOCAL\n" + numbers)
    check(read_volume(tmp_path / "b.mha"), values, world())
    for z in range(5):
        (tmp_path / f"s{z}.raw").write_bytes(values[:, :, z].tobytes(order="F"))
    (tmp_path / "p.mhd").write_text(head + "ElementDataFile = s%d.raw 0 4 1\n")
    (tmp_path / "l.mhd").write_text(head + "ElementDataFile = LIST\n" + "\n".join(f"s{z}.raw" for z in range(5)))
    check(read_volume(tmp_path / "p.mhd"), values, world())
    check(read_volume(tmp_path / "l.mhd"), values, world())


# OpenVDB


@pytest.fixture
def openvdb():
    from spectral_core.volume.files.openvdb_format import find_openvdb

    module = find_openvdb()
    if module is None:
        pytest.skip("no OpenVDB module here")
    return module


@pytest.fixture(params=["module", "own code"])
def vdb_code(request, monkeypatch):
    """OpenVDB's module, and what stands in where it is missing."""
    from spectral_core.volume.files import openvdb_format

    if request.param == "own code":
        monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    elif openvdb_format.find_openvdb() is None:
        pytest.skip("no OpenVDB module here")


@pytest.mark.parametrize("dtype", ["int8", "uint8", "int16", "uint16", "int32", "float16", "float32", "float64"])
def test_written_volumes_come_back_whole(tmp_path, dtype, vdb_code):
    values = fixture_values(dtype)
    values[:2] = 0  # a slab of background must not shrink the box
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
def test_own_files_are_read_by_openvdb(tmp_path, openvdb, shape, dtype):
    """OpenVDB itself as the oracle of the writer, across leaves, nodes and roots, and of the reader."""
    from spectral_core.volume.files.vdb_read import read_grid
    from spectral_core.volume.files.vdb_write import write_grid

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
def test_masked_values_and_tiles_are_read_as_openvdb_reads_them(tmp_path, openvdb, monkeypatch, mark):
    """Every way of leaving out inactive values, and regions of one value: files bent in the writer."""
    import struct
    import zlib

    from spectral_core.volume.files import vdb_write
    from spectral_core.volume.files.vdb_read import read_grid

    def packed(values):
        if len(values) != 512:  # a node: place 5 becomes a tile of value 7, inactive
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
    monkeypatch.setattr(vdb_write, "ZIP", 3)  # zipped, with inactive values left out
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


def test_blosc_without_openvdb_says_what_to_do(tmp_path, openvdb, monkeypatch):
    from spectral_core.volume.files import openvdb_format

    path = write_volume(ScalarVolume("v", fixture_values("float32")), tmp_path / "a.vdb")
    monkeypatch.setattr(openvdb_format, "find_openvdb", lambda: None)
    with pytest.raises(MissingDependencyError, match="packed with Blosc.*open it in a Blender from blender.org"):
        read_volume(path)


def test_foreign_grids_are_read_in_the_box_of_their_voxels(tmp_path, openvdb):
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
    with pytest.raises(FileFormatError, match="frustum transform"):
        read_volume(tmp_path / "p.vdb")


def test_integers_beyond_double_are_refused_by_vdb(tmp_path, openvdb):
    values = np.full((2, 2, 2), (1 << 53) + 1, np.int64)
    with pytest.raises(InvalidInputError, match="no float grid of OpenVDB holds exactly"):
        write_volume(ScalarVolume("big", values), tmp_path / "a.vdb")
    assert list(tmp_path.iterdir()) == []


# Choosing the reader, and writing


def test_bytes_decide_before_the_name(tmp_path):
    (tmp_path / "renamed.raw").write_bytes((DATA / "itk.nrrd").read_bytes())
    (tmp_path / "noending").write_bytes((DATA / "points_binary.vtk").read_bytes())
    assert detect_format(tmp_path / "renamed.raw").name == "nrrd"
    assert detect_format(tmp_path / "noending").name == "vtk"
    check(read_volume(tmp_path / "renamed.raw"), fixture_values("int16"), world(DIRECTIONS))


def test_unknown_and_misnamed_files(tmp_path):
    (tmp_path / "a.nrrd").write_bytes(b"\x89PNG\r\n")
    (tmp_path / "b.xyz").write_bytes(b"hello")
    (tmp_path / "c.vdb").write_bytes(b"")
    with pytest.raises(FileFormatError, match=r"is named as NRRD but does not begin as one does, but with b'\\x89PNG"):
        read_volume(tmp_path / "a.nrrd")
    with pytest.raises(FileFormatError, match=r"no volume format known here; expected one of .*\.nrrd"):
        read_volume(tmp_path / "b.xyz")
    with pytest.raises(FileFormatError, match="is named as OpenVDB but is empty"):
        read_volume(tmp_path / "c.vdb")
    with pytest.raises(InvalidInputError, match="cannot be opened: No such file"):
        read_volume(tmp_path / "missing.nrrd")
    with pytest.raises(FileFormatError, match=r"holds no \.tif"):
        read_volume(tmp_path)


def test_other_vtk_datasets_are_refused(tmp_path):
    text = (DATA / "points_ascii.vtk").read_text()
    (tmp_path / "a.vtk").write_text(text.replace("STRUCTURED_POINTS", "POLYDATA"))
    with pytest.raises(FileFormatError, match="holds a POLYDATA dataset; expected STRUCTURED_POINTS"):
        read_volume(tmp_path / "a.vtk")
    text = (DATA / "image_ascii.vti").read_text()
    (tmp_path / "a.vti").write_text(text.replace('type="ImageData"', 'type="PolyData"'))
    with pytest.raises(FileFormatError, match="holds PolyData; expected ImageData"):
        read_volume(tmp_path / "a.vti")


def test_bad_voxels_are_named_with_the_file(tmp_path):
    values = fixture_values("float32")
    values[1, 2, 3] = np.inf
    np.save(tmp_path / "inf.npy", values)
    with pytest.raises(FileFormatError, match=r"inf.npy: volume 'inf' holds 1 value\(s\).*inf at index \(1, 2, 3\)"):
        read_volume(tmp_path / "inf.npy")


def test_write_refuses_other_endings_and_missing_folders(tmp_path):
    volume = ScalarVolume("v", np.ones((2, 2, 2)))
    with pytest.raises(InvalidInputError, match=r"expected an ending \.nrrd or \.vdb"):
        write_volume(volume, tmp_path / "a.tif")
    with pytest.raises(InvalidInputError, match="does not exist; create it"):
        write_volume(volume, tmp_path / "no" / "a.nrrd")


@pytest.mark.parametrize(("module", "path"), [("nrrd", "itk.nrrd"), ("lz4", "image_appended_raw_lz4.vti")])
def test_absent_libraries_say_how_to_get_them(monkeypatch, module, path):
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MissingDependencyError, match="pip install"):
        read_volume(DATA / path)


def test_every_format_has_a_reader():
    import importlib

    for entry in known_formats():
        assert callable(importlib.import_module(f"spectral_core.volume.files.{entry.name}_format").read)
        assert (
            hasattr(importlib.import_module(f"spectral_core.volume.files.{entry.name}_format"), "write") == entry.writes
        )


def shared_volumes() -> Path:
    return Path(os.environ.get("SPECTRAL_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data")) / "volumes"


@pytest.mark.skipif(not shared_volumes().is_dir(), reason="the real volumes are not here")
def test_real_volumes():
    head = read_volume(shared_volumes() / "headsq.nrrd")
    assert (head.shape, head.data.dtype) == ((64, 64, 93), np.uint16)
    assert head.voxel_size == pytest.approx([3.2, 3.2, 1.5])
    assert read_volume(shared_volumes() / "hipip.nrrd").shape == (68, 68, 68)
