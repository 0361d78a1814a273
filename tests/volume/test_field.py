# SPDX-License-Identifier: GPL-3.0-or-later
"""The scalar field: accepted, kept and refused data."""

from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.volume import renderer
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.device.voxels import _stored_units
from spectral_core.volume.samples import marschner_lobb
from spectral_core.volume.view import View


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


def test_a_read_only_array_is_not_copied():
    data = np.zeros((4, 4, 4), np.uint8)
    data.setflags(write=False)
    assert np.shares_memory(ScalarVolume("v", data).data, data)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_the_first_invalid_voxel_is_reported(bad):
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
def test_arrays_that_are_no_field_are_refused(data, words):
    with pytest.raises(InvalidInputError, match=words):
        ScalarVolume("v", data)


def test_invalid_matrices_are_refused():
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


def test_more_voxels_than_dr_jit_can_index_are_refused():
    pytest.importorskip("drjit")
    import drjit.llvm as types

    from spectral_core.volume.march.device.voxels import DeviceVolume

    data = np.broadcast_to(np.zeros((1, 1, 1), np.uint8), (2048, 2048, 1024))
    with pytest.raises(InvalidInputError, match=r"'ct' has 2048×2048×1024 = 4,294,967,296 voxels; fewer than 2\^32"):
        DeviceVolume(types, SimpleNamespace(name="ct", data=data, shape=data.shape))


@pytest.mark.parametrize(("low", "high"), [(0.0, 3.0), (-7.0, 5.0), (1000.0, 1000.5), (-3e-4, 1e-5), (0.0, 0.0)])
def test_stored_units_are_powers_of_two_with_data_up_to_1(low, high):
    """A division by a power of two is exact in float32; the largest stored value lies between ½ and 1."""
    base, unit = _stored_units(low, high)
    assert np.frexp(unit)[0] == 0.5  # a power of two
    greatest = max(abs(low - base), abs(high - base)) / unit
    assert greatest == 0 or 0.5 < greatest <= 1.0


def test_the_marschner_lobb_signal_equals_that_of_the_paper():
    """Marschner and Lobb 1994, Eq. 5, at samples on and off the axes."""
    size = 9
    field = marschner_lobb(size)
    axis = np.linspace(-1, 1, size)
    for i, j, k in ((4, 4, 4), (0, 4, 8), (2, 7, 1), (6, 3, 5)):
        radius = np.hypot(axis[i], axis[j])
        ring = np.cos(2 * np.pi * 6 * np.cos(np.pi * radius / 2))
        exact = (1 - np.sin(np.pi * axis[k] / 2) + 0.25 * (1 + ring)) / (2 * (1 + 0.25))
        assert field[i, j, k] == pytest.approx(exact, abs=1e-4)


@pytest.mark.parametrize(("backend", "remedy"), [("llvm", "LLVM"), ("cuda", "use llvm")])
def test_a_missing_backend_names_its_remedy(monkeypatch, backend, remedy):
    dr = pytest.importorskip("drjit")
    monkeypatch.setattr(renderer, "find_llvm", lambda: None)
    monkeypatch.setattr(dr, "has_backend", lambda kind: False)
    with pytest.raises(MissingDependencyError, match=remedy):
        renderer.array_types(backend)


def test_a_view_around_a_field_has_its_documented_defaults():
    volume = ScalarVolume("v", np.zeros((3, 4, 5), np.uint8))
    assert View.around(volume).key == View.around(volume, 35.0, 25.0, zoom=1.0, fov_deg=30.0).key


@pytest.mark.parametrize("fov", [0.0, 180.0, float("nan")])
def test_an_impossible_angle_of_view_is_refused(fov):
    with pytest.raises(InvalidInputError, match="fov_deg"):
        View.around(ScalarVolume("v", np.zeros((3, 4, 5), np.uint8)), fov_deg=fov)
    with pytest.raises(InvalidInputError, match="fov_deg"):
        View(np.eye(4), fov_deg=fov)


def test_voxels_are_unit_cubes_from_the_origin_unless_stated() -> None:
    data = np.zeros((2, 3, 4), np.uint8)
    np.testing.assert_array_equal(ScalarVolume.from_spacing("plain", data).world_from_index, np.eye(4))
    placed = ScalarVolume.from_spacing("placed", data, (1, 2, 3), (5, 6, 7))
    np.testing.assert_array_equal(placed.world_from_index @ [1, 1, 1, 1], [6, 8, 10, 1])
