# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes ``data/``: one small volume by the writers of VTK and ITK, as a reference for this project's readers.

Run where ``pip install vtk SimpleITK`` is possible: ``python tests/volume_files/volume_fixtures.py``. Values and
geometry are those of ``fixture_values`` and the constants below, which the tests import.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

DATA = Path(__file__).parent / "data"
SHAPE = (4, 3, 5)
SPACING = (0.5, 1.25, 2.0)
ORIGIN = (10.0, -20.0, 3.5)
EXTENT_START = (2, 0, -1)
"""First index of the VTK extent of the .vti files: VTK's origin is at index 0, which need not be in the file."""
DIRECTIONS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Column a is the direction of voxel axis a."""


def fixture_values(dtype: str) -> np.ndarray:
    """(4, 3, 5) distinct values that reveal wrong byte orders, signs and axes."""
    x, y, z = np.meshgrid(*[np.arange(n) for n in SHAPE], indexing="ij")
    values = 100 * x + 10 * y + z
    if np.dtype(dtype).kind == "f":
        return (values * 1.5 - 40.25).astype(dtype)
    return values.astype(dtype) if np.dtype(dtype).itemsize > 1 else (values % 251).astype(dtype)


SHEARED = np.array([[0.5, 0.1, 0.0, 10.0], [0.0, -1.25, 0.2, -20.0], [0.3, 0.0, 2.0, 3.5], [0.0, 0.0, 0.0, 1.0]])


IDENTITY = np.eye(3)


def world(directions=IDENTITY, origin=ORIGIN, spacing=SPACING):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = directions * spacing, origin
    return matrix


def check(volume, values, world_from_index):
    assert volume.data.dtype == values.dtype
    assert volume.data.dtype.isnative
    assert np.array_equal(volume.data, values)
    assert np.allclose(volume.world_from_index, world_from_index, rtol=1e-7, atol=1e-12)


def _vtk_image(values: np.ndarray, *, directed: bool, cells: bool = False):  # type: ignore[no-untyped-def]
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    image = vtk.vtkImageData()
    start = EXTENT_START if directed else (0, 0, 0)
    counts = [n + 1 if cells else n for n in values.shape]
    image.SetExtent(*[bound for s, n in zip(start, counts, strict=True) for bound in (s, s + n - 1)])
    image.SetSpacing(*SPACING)
    image.SetOrigin(*ORIGIN)
    if directed:
        image.SetDirectionMatrix(*DIRECTIONS.ravel())
    array = numpy_to_vtk(values.ravel(order="F"), deep=True)
    array.SetName("measured")
    attributes = image.GetCellData() if cells else image.GetPointData()
    attributes.SetScalars(array)
    return image


def _write_vtk() -> None:
    import vtk

    for name, binary in (("ascii", False), ("binary", True)):
        writer = vtk.vtkStructuredPointsWriter()
        writer.SetFileName(str(DATA / f"points_{name}.vtk"))
        points = vtk.vtkStructuredPoints()
        points.DeepCopy(_vtk_image(fixture_values("int16"), directed=False))
        extra = vtk.vtkFloatArray()
        extra.SetName("velocity")
        extra.SetNumberOfComponents(3)
        extra.SetNumberOfTuples(60)
        for component in range(3):
            extra.FillComponent(component, component + 0.5)
        points.GetPointData().SetVectors(extra)
        writer.SetInputData(points)
        writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
        writer.Write()


def _write_vti() -> None:
    import vtk

    variants = {
        "ascii": ("Ascii", None, "UInt32", "float32"),
        "inline": ("Binary", None, "UInt64", "uint16"),
        "inline_zlib": ("Binary", vtk.vtkZLibDataCompressor, "UInt32", "float64"),
        "appended_raw": ("Appended", None, "UInt64", "int16"),
        "appended_raw_zlib": ("Appended", vtk.vtkZLibDataCompressor, "UInt64", "uint8"),
        "appended_base64_lzma": ("Appended", vtk.vtkLZMADataCompressor, "UInt32", "int32"),
        "appended_raw_lz4": ("Appended", vtk.vtkLZ4DataCompressor, "UInt32", "int32"),
        "cells": ("Appended", None, "UInt32", "float32"),
        "big_endian": ("Appended", None, "UInt32", "int16"),
    }
    for name, (mode, compressor, header, dtype) in variants.items():
        writer = vtk.vtkXMLImageDataWriter()
        writer.SetFileName(str(DATA / f"image_{name}.vti"))
        writer.SetInputData(_vtk_image(fixture_values(dtype), directed=True, cells=name == "cells"))
        getattr(writer, f"SetDataModeTo{mode}")()
        writer.SetCompressor(compressor() if compressor else None)
        writer.SetBlockSize(32)  # several blocks even for this small volume
        writer.SetEncodeAppendedData("base64" in name)
        getattr(writer, f"SetHeaderTypeTo{header}")()
        if name == "big_endian":
            writer.SetByteOrderToBigEndian()
        writer.Write()


def _write_meta() -> None:
    import SimpleITK

    for name, packed in (("image.mha", True), ("image.mhd", False)):
        image = SimpleITK.GetImageFromArray(fixture_values("int16").transpose(2, 1, 0))
        image.SetSpacing(SPACING)
        image.SetOrigin(ORIGIN)
        image.SetDirection(DIRECTIONS.ravel().tolist())
        SimpleITK.WriteImage(image, str(DATA / name), useCompression=packed)
    SimpleITK.WriteImage(image, str(DATA / "itk.nrrd"), useCompression=True)


if __name__ == "__main__":
    DATA.mkdir(exist_ok=True)
    _write_vtk()
    _write_vti()
    _write_meta()
