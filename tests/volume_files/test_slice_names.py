# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of slices whose names are not those of one complete stack: several series became one, gaps were closed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.volume.files import read_volume
from spectral_core.volume.files.slice_names import in_order

SERIES = "expected the slices of one stack, whose names differ in one number: move each series"


def ordered(*names: str) -> list[str]:
    return [file.name for file in in_order(map(Path, names), Path("folder"))]


@pytest.mark.parametrize(
    "names",
    [
        ("z9.tif", "z10.tif", "z11.tif"),
        ("a_0.tif", "a_10.tif", "a_20.tif"),  # every tenth slice
        ("a_0.tif", "a_5.tif"),
        ("s1_1699.tif", "s2_1777.tif", "s3_1778.tif"),  # a counter and the time
        ("1699_s1.tif", "1777_s2.tif", "1778_s3.tif"),
        ("s1.tif", "s2.TIF"),
        ("only.tif",),
    ],
)
def test_names_of_one_stack(names: tuple[str, ...]) -> None:
    assert ordered(*reversed(names)) == list(names)


@pytest.mark.parametrize(
    ("names", "two"),
    [
        (("ch0_000.tif", "ch0_001.tif", "ch1_000.tif", "ch1_001.tif"), "ch0_000.tif and ch1_000.tif"),
        (("a_0.tif", "a_1.tif", "b_0.tif"), "a_0.tif and b_0.tif"),
        (("s1.tif", "s2.tif", "preview.tif"), "preview.tif and s1.tif"),
        (("s1.tif", "s2.tif", "s2.tiff"), "s1.tif and s2.tiff"),
        (("s01.tif", "s1.tif"), "s01.tif and s1.tif"),
    ],
)
def test_several_series(names: tuple[str, ...], two: str) -> None:
    with pytest.raises(FileFormatError, match=rf"folder holds several series, such as {two}; {SERIES}"):
        ordered(*names)


@pytest.mark.parametrize(
    ("names", "two"),
    [
        (("000.tif", "001.tif", "003.tif"), "001.tif and 003.tif"),
        (("s0.tif", "s2.tif", "s3.tif"), "s0.tif and s2.tif"),
        (("s1_1699.tif", "s2_1777.tif", "s4_1778.tif"), "s2_1777.tif and s4_1778.tif"),
    ],
)
def test_missing_slices(names: tuple[str, ...], two: str) -> None:
    with pytest.raises(FileFormatError, match=f"no slice between {two}, .* add the missing files, or renumber"):
        ordered(*names)


def test_a_folder_of_two_channels_is_refused(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    for channel in range(2):
        for z in range(3):
            tifffile.imwrite(tmp_path / f"ch{channel}_{z:03}.tif", np.full((4, 5), z, np.uint8))
    with pytest.raises(FileFormatError, match="ch0_000.tif and ch1_000.tif"):
        read_volume(tmp_path)
