# SPDX-License-Identifier: GPL-3.0-or-later
"""A field or a component that a file does not have is refused in every format, and one that chooses on two axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files import RawLayout, read_volume, write_volume

VALUES = np.arange(-12, 12, dtype=np.int16).reshape(2, 3, 4)
TEXT = " ".join(map(str, VALUES.ravel(order="F")))
VTI = """<VTKFile type="ImageData" version="0.1"><ImageData WholeExtent="0 1 0 2 0 3"><Piece Extent="0 1 0 2 0 3">
<PointData><DataArray type="Int16" Name="s" format="ascii">{}</DataArray></PointData></Piece></ImageData></VTKFile>"""
VTK = """# vtk DataFile Version 3.0
t
ASCII
DATASET STRUCTURED_POINTS
DIMENSIONS 2 3 4
POINT_DATA 24
SCALARS s short 1
LOOKUP_TABLE default
{}
"""
MHD = "ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = MET_SHORT\nElementDataFile = a.raw\n"


def written(folder: Path, ending: str) -> Path:
    """A file of VALUES in the format of this ending."""
    path = folder / f"a.{ending}"
    (folder / "a.raw").write_bytes(VALUES.astype("<i2").tobytes(order="F"))
    if ending in ("nrrd", "vdb"):
        pytest.importorskip("nrrd")
        write_volume(ScalarVolume("a", VALUES), path)
    elif ending == "nii":
        nibabel = pytest.importorskip("nibabel")
        nibabel.save(nibabel.Nifti1Image(VALUES, np.eye(4)), path)
    elif ending == "tif":
        tifffile = pytest.importorskip("tifffile")
        stack = np.ascontiguousarray(VALUES.transpose(2, 1, 0))
        tifffile.imwrite(path, stack, imagej=True, metadata={"axes": "ZYX"})
    elif ending == "npy":
        np.save(path, VALUES)
    elif ending == "npz":
        np.savez(path, a=VALUES)
    elif ending == "dat":
        path.write_text("ObjectFileName: a.raw\nResolution: 2 3 4\nFormat: SHORT\n")
    elif ending != "raw":
        path.write_text({"mhd": MHD, "vtk": VTK.format(TEXT), "vti": VTI.format(TEXT)}[ending])
    return path


@pytest.mark.parametrize("ending", ["nrrd", "vdb", "nii", "tif", "npy", "npz", "dat", "mhd", "vtk", "vti", "raw"])
def test_what_a_file_does_not_have_cannot_be_chosen(tmp_path: Path, ending: str) -> None:
    path = written(tmp_path, ending)
    raw = RawLayout((2, 3, 4), "int16") if ending == "raw" else None
    for component in (None, 0):
        np.testing.assert_array_equal(read_volume(path, component=component, raw=raw).data, VALUES)
    for component in (1, -1):
        with pytest.raises(InvalidInputError, match=f"component {component} of a.{ending} was requested; it has|holds"):
            read_volume(path, component=component, raw=raw)
    with pytest.raises(InvalidInputError, match="leave field out|no array of"):
        read_volume(path, field="nope", raw=raw)


def test_one_component_does_not_choose_on_two_axes(tmp_path: Path) -> None:
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(np.zeros((2, 2, 2, 3, 4), np.int16), np.eye(4)), tmp_path / "a.nii")
    for component in (None, 1):
        with pytest.raises(InvalidInputError, match="holds 3 times 4 numbers per voxel on 2 axes, and component"):
            read_volume(tmp_path / "a.nii", component=component)


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"component": "1"}, "component is '1'; expected a whole number from 0"),
        ({"component": 1.5}, "component is 1.5; expected a whole number"),
        ({"component": True}, "component is True; expected a whole number"),
        ({"field": 3}, "field is 3; expected the name of an array"),
        ({"raw": (3, 4, 5)}, r"raw is \(3, 4, 5\); expected a RawLayout, such as"),
    ],
)
def test_a_choice_of_a_wrong_type_is_not_taken_for_a_damaged_file(
    choice: dict[str, object], said: str, tmp_path: Path
) -> None:
    """The message was "is truncated, damaged or of another type"; True selected no component."""
    np.save(tmp_path / "v.npy", np.zeros((3, 4, 5, 2)))
    with pytest.raises(InvalidInputError, match=said):
        read_volume(tmp_path / "v.npy", **choice)  # type: ignore[arg-type]


def test_an_offset_that_is_no_whole_number_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="offset 1.5; expected a whole number of bytes"):
        RawLayout((2, 3, 4), "uint8", offset=1.5)  # type: ignore[arg-type]
