# SPDX-License-Identifier: GPL-3.0-or-later
"""The scalar field's border: what it takes, keeps and refuses."""

from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume


@pytest.mark.parametrize("dtype", ["u1", "i2", "<f4", ">f4", "f8", "u2"])
def test_type_order_and_values_are_kept(dtype):
    data = np.asfortranarray(np.arange(24).reshape(2, 3, 4).astype(dtype))
    volume = ScalarVolume("v", data)
    assert volume.data.dtype == np.dtype(dtype).newbyteorder("=")
    assert volume.data.flags.f_contiguous and not volume.data.flags.writeable
    assert np.array_equal(volume.data, data)
    data[0, 0, 0] = 7
    assert volume.data[0, 0, 0] == 0
    assert volume.shape == (2, 3, 4) and volume.value_range == (0.0, 23.0)


def test_read_only_array_is_not_copied():
    data = np.zeros((4, 4, 4), np.uint8)
    data.setflags(write=False)
    assert np.shares_memory(ScalarVolume("v", data).data, data)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_first_bad_voxel_is_named(bad):
    data = np.zeros((3, 4, 5), np.float32)
    data[1, 2, 3] = bad
    with pytest.raises(InvalidInputError, match=r"volume 'lung'.*\(1, 2, 3\)"):
        ScalarVolume("lung", data)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (np.zeros((3, 3)), "shape"),
        (np.zeros((3, 0, 3)), "each at least 1"),
        (np.zeros((2, 2, 2), complex), "complex128"),
        (np.zeros((2, 2, 2), bool), "bool"),
    ],
)
def test_what_is_no_field_is_refused(data, words):
    with pytest.raises(InvalidInputError, match=words):
        ScalarVolume("v", data)


def test_bad_matrices_are_refused():
    flat = np.diag([1.0, 0.0, 1.0, 1.0])
    with pytest.raises(InvalidInputError, match="not invertible"):
        ScalarVolume("v", np.zeros((2, 2, 2)), flat)
    tilted = np.eye(4)
    tilted[3, 0] = 1.0
    with pytest.raises(InvalidInputError, match="last row"):
        ScalarVolume("v", np.zeros((2, 2, 2)), tilted)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_spacing_origin_and_corners(scale):
    volume = ScalarVolume.from_spacing(
        "v", np.zeros((2, 3, 1)), np.array([1, 2, 3]) * scale, np.array([5, 0, 0]) * scale
    )
    corners = volume.corners_world / scale
    assert np.allclose(corners.min(0), [4.5, -1, -1.5]) and np.allclose(corners.max(0), [6.5, 5, 1.5])
    assert np.allclose(volume.index_from_world @ volume.world_from_index, np.eye(4))
    assert np.allclose(volume.voxel_size, np.array([1, 2, 3]) * scale)


def test_more_voxels_than_dr_jit_can_number_are_refused():
    pytest.importorskip("drjit")
    import drjit.llvm as types

    from spectral_core.volume.march.device import DeviceVolume

    data = np.broadcast_to(np.zeros((1, 1, 1), np.uint8), (2048, 2048, 1024))
    with pytest.raises(InvalidInputError, match=r"'ct' has 2048×2048×1024 = 4,294,967,296 voxels; fewer than 2\^32"):
        DeviceVolume(types, SimpleNamespace(name="ct", data=data, shape=data.shape))
