# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbered files as frames."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.files import RawLayout, find_sequence, read_volume, sequence_of
from spectral_core.volume.files.formats.openvdb_format import find_openvdb


@pytest.fixture
def flow(tmp_path):
    """flow_0008.npy to flow_0012.npy without 10, and files that are not frames."""
    for number in (8, 9, 11, 12):
        np.save(tmp_path / f"flow_{number:04d}.npy", np.full((2, 2, 2), number, np.int16))
    for other in ("flow_0009.txt", "flow_0009b.npy", "flow_9.npy", "other_0009.npy"):
        (tmp_path / other).write_bytes(b"")
    return tmp_path


@pytest.mark.parametrize("pattern", ["flow_####.npy", "flow_%04d.npy", "flow_{:04d}.npy"])
def test_patterns_name_the_frames(flow, pattern):
    sequence = find_sequence(flow / pattern)
    assert sequence.numbers == (8, 9, 11, 12)
    assert sequence.missing == (10,)
    assert len(sequence) == 4
    assert sequence.read(11).data.max() == 11
    assert [int(volume.data[0, 0, 0]) for volume in sequence] == [8, 9, 11, 12]
    with pytest.raises(InvalidInputError, match="has no frame 10; it has 4 from 8 to 12"):
        sequence.read(10)


def test_numbers_without_zeros_sort_as_numbers(tmp_path):
    for number in (2, 10, 1):
        (tmp_path / f"f{number}.raw").write_bytes(bytes([number] * 8))
    layout = RawLayout((2, 2, 2), "uint8")
    for pattern in ("f%d.raw", "f{}.raw", "f*.raw"):
        sequence = find_sequence(tmp_path / pattern, raw=layout)
        assert sequence.numbers == (1, 2, 10)
        assert sequence.read(10).data.max() == 10


def test_wide_numbers_follow_a_narrow_pattern(tmp_path):
    for number in ("98", "99", "100"):
        np.save(tmp_path / f"f{number}.npy", np.zeros((2, 2, 2)))
    assert find_sequence(tmp_path / "f##.npy").numbers == (98, 99, 100)


def test_a_frame_belongs_to_its_sequence(flow):
    assert sequence_of(flow / "flow_0009.npy").numbers == (8, 9, 11, 12)
    assert sequence_of(flow / "flow_9.npy") is None  # another number of digits is another sequence


def test_a_file_alone_is_no_sequence(tmp_path):
    np.save(tmp_path / "head2.npy", np.zeros((2, 2, 2)))
    np.save(tmp_path / "head.npy", np.zeros((2, 2, 2)))
    assert sequence_of(tmp_path / "head2.npy") is None
    assert sequence_of(tmp_path / "head.npy") is None


def test_a_damaged_frame_is_reported(flow):
    (flow / "flow_0009.npy").write_bytes(b"\x93NUMPY")
    with pytest.raises(FileFormatError, match=r"flow_0009.npy is not a NumPy file"):
        list(find_sequence(flow / "flow_####.npy"))


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ("flow.npy", "has 0 places for a number"),
        ("flow_##_##.npy", "has 2 places for a number"),
        ("wind_####.npy", "no file in .* matches 'wind_####.npy'"),
        ("missing/flow_####.npy", "no file in"),
    ],
)
def test_patterns_without_files_are_refused(flow, pattern, message):
    with pytest.raises(InvalidInputError, match=message):
        find_sequence(flow / pattern)


def test_two_files_with_one_number_are_refused(tmp_path):
    for name in ("f1.npy", "f01.npy"):
        np.save(tmp_path / name, np.zeros((2, 2, 2)))
    with pytest.raises(InvalidInputError, match=r"frame 1 of f\*.npy is both f01.npy and f1.npy"):
        find_sequence(tmp_path / "f*.npy")


@pytest.mark.parametrize("stem", ["run#2_", "50%d_", "a{}", "star*_"])
def test_marks_of_patterns_in_a_name_have_no_meaning_where_a_file_is_given(tmp_path, stem):
    for number in (7, 8):
        np.save(tmp_path / f"{stem}{number:04d}.npy", np.full((2, 2, 2, 2), number, np.int16))
    sequence = sequence_of(tmp_path / f"{stem}0007.npy", component=1)
    assert sequence.numbers == (7, 8)
    assert sequence.read(8).data.max() == 8


def test_frames_of_one_width_belong_to_one_that_has_no_zero(tmp_path):
    for number in (98, 99, 100, 1000):
        np.save(tmp_path / f"wide{number:03d}.npy", np.zeros((2, 2, 2)))
        np.save(tmp_path / f"plain{number}.npy", np.zeros((2, 2, 2)))
    for number in (98, 99, 100, 1000):
        assert sequence_of(tmp_path / f"wide{number:03d}.npy").numbers == (98, 99, 100, 1000)
        assert sequence_of(tmp_path / f"plain{number}.npy").numbers == (98, 99, 100, 1000)


def test_missing_frames_are_in_the_steps_of_the_others_and_few_are_named(tmp_path):
    """A simulation that writes every hundredth state lacked 99 of 100; two dates took all memory of the machine."""
    for number in (0, 100, 200, 400):
        np.save(tmp_path / f"plt{number:05d}.npy", np.zeros((2, 2, 2)))
    sequence = find_sequence(tmp_path / "plt#####.npy")
    assert (sequence.step, sequence.missing) == (100, (300,))
    assert sequence.missing_note == "frames without a file are left out: 300"
    (tmp_path / "plt00400.npy").unlink()
    assert find_sequence(tmp_path / "plt#####.npy").missing_note == ""
    for number in (1, 20260101123000, 20260101124501):
        np.save(tmp_path / f"scan_{number}.npy", np.zeros((2, 2, 2)))
    dates = find_sequence(tmp_path / "scan_*.npy")
    assert dates.missing == tuple(range(2, 1002))
    assert dates.missing_note == "frames without a file are left out: 2, 3, 4, 5, 6, 7, 8, 9 and others"


def test_frames_of_smoke_that_begins_empty(tmp_path):
    """A grid without voxels ended the whole sequence, on the command line and at the import into Blender."""
    openvdb = find_openvdb()
    if openvdb is None:
        pytest.skip("needs OpenVDB's module")
    values = np.arange(1.0, 9.0, dtype=np.float32).reshape(2, 2, 2)
    for number, is_empty in enumerate((True, True, False, True), 1):
        grid = openvdb.FloatGrid(0.0)
        grid.name = "density"
        if not is_empty:
            grid.copyFromArray(values)
        openvdb.write(str(tmp_path / f"smoke_{number}.vdb"), grids=[grid])
    smoke = find_sequence(tmp_path / "smoke_#.vdb")
    assert [frame.data.shape for frame in smoke] == [(1, 1, 1), (1, 1, 1), (2, 2, 2), (1, 1, 1)]
    assert smoke.read(1).value_range == (0.0, 0.0) and smoke.read(1).name == "smoke_1"
    assert np.array_equal(smoke.first().data, values)
    with pytest.raises(FileFormatError, match="no active voxel"):
        read_volume(tmp_path / "smoke_1.vdb")
    (tmp_path / "smoke_3.vdb").unlink()
    with pytest.raises(FileFormatError, match="smoke_4.vdb has no active voxel"):
        find_sequence(tmp_path / "smoke_#.vdb").first()
    (tmp_path / "smoke_2.vdb").write_bytes(b"no grid")
    with pytest.raises(FileFormatError, match="smoke_2.vdb"):
        find_sequence(tmp_path / "smoke_#.vdb").read(2)
