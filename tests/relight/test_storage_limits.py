# SPDX-License-Identifier: GPL-3.0-or-later
"""Storages of a recording against integrals computed here, at 0.02 nm and from the observer's table alone."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import trapezoid

from spectral_core.errors import InvalidInputError
from spectral_core.render.relight import memory
from spectral_core.render.relight.band_storage import BAND_ERRORS, BandStorage
from spectral_core.render.relight.exact_storage import EXACT_GRID, ExactStorage
from spectral_core.render.relight.storage import MixtureStorage, flat_light, relative_to_flat
from spectral_core.render.relight.storages import STORAGES, storage_of_document
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

FINE = np.linspace(360.0, 830.0, 47001)
"""Steps of 0.01 nm, on which the rule of trapezoids is exact to 1e-8 for products of piecewise linear functions."""


def integral(values: np.ndarray) -> np.ndarray:
    return trapezoid(values, FINE, axis=-1)


def sensitivity() -> np.ndarray:
    """(3, fine) the observer's table between its knots."""
    viewer = observer(STANDARD)
    return np.array([np.interp(FINE, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])


def hats(knots: np.ndarray, *, reaching: bool) -> np.ndarray:
    """(n, fine) hat functions; those at the ends stay at 1 to the ends of the spectrum, or end with the grid."""
    outside = {} if reaching else {"left": 0.0, "right": 0.0}
    return np.array([np.interp(FINE, knots, row, **outside) for row in np.eye(len(knots))])


def lamp() -> Illuminant:
    """A broad lamp with a hump, on its own irregular grid."""
    return Illuminant(
        "lamp", SpectralGrid([360, 395.5, 452.25, 500, 613, 700.5, 830]), [0.2, 1.5, 0.3, 2.0, 1.0, 3, 0.5]
    )


@pytest.mark.parametrize("count", [31, 61, 121])
def test_bands_measure_means_under_hats(count: int) -> None:
    """Beyond the outermost centers the mean follows the observer: flat out to 830 nm it was that of invisible light."""
    bands = BandStorage(count).measured()
    step = 300 / (count - 1)
    fractions = np.interp(np.arange(360.0, 831.0), np.linspace(400, 700, count), np.arange(count))
    at_nm = np.maximum(0.0, 1 - np.abs(fractions - np.arange(count)[:, None]))
    viewer = observer(STANDARD)
    seen = np.array([np.interp(np.arange(360.0, 831.0), viewer.wavelengths_nm, row) for row in viewer.cmfs]).sum(axis=0)
    at_nm[0, :40] *= seen[:40] / seen[40]
    at_nm[-1, 341:] *= seen[341:] / seen[340]
    # linear between whole nm: a hat whose ends lie between two has the width of that polygon
    widths = at_nm.sum(axis=1) - (at_nm[:, 0] + at_nm[:, -1]) / 2
    if count < 121:
        np.testing.assert_allclose(widths[1:-1], step, rtol=1e-12)
    np.testing.assert_allclose(bands.responses, at_nm / widths[:, None], atol=1e-12)
    assert bands.pieces is None
    assert bands.names[:2] == ("400.000000", f"{400 + step:.6f}") and len(bands.names) == count
    names = BandStorage(count).channel_names()
    assert names[0] == "S0.400,000000nm" and names[-1] == "S0.700,000000nm" and len(set(names)) == count


@pytest.mark.parametrize("count", [31, 61, 121])
@pytest.mark.parametrize("lamp_name", ["A", "D65"])
def test_a_surface_that_is_bright_beyond_the_visible_has_the_stated_error(count: int, lamp_name: str) -> None:
    """Black cloth and leaves reflect most light above 700 nm, which made their outermost band too bright by ΔE 1.2."""
    light = illuminant(lamp_name)
    spd = np.interp(FINE, light.grid.wavelengths_nm, light.values, left=0, right=0)
    cmfs = sensitivity()
    white = integral(spd * cmfs[1])
    knots, values = [360.0, 660.0, 690.0, 720.0, 750.0, 830.0], [0.03, 0.03, 0.06, 0.3, 0.6, 0.7]
    true = RGB_FROM_XYZ @ np.array([integral(spd * np.interp(FINE, knots, values) * row) for row in cmfs]) / white
    storage = BandStorage(count)
    channels = storage.measured().responses @ np.interp(np.arange(360.0, 831.0), knots, values)
    relit = storage.rgb_from_channels(light.scaled(1 / white)) @ channels
    assert delta_e_2000(lab_from_linear_rgb(relit), lab_from_linear_rgb(true)) < BAND_ERRORS[121][0]


@pytest.mark.parametrize("count", [31, 121])
def test_the_color_of_a_band_is_the_integral_under_its_hat(count: int) -> None:
    light = lamp()
    weighted = hats(np.linspace(400, 700, count), reaching=True) * np.interp(
        FINE, light.grid.wavelengths_nm, light.values
    )
    expected = RGB_FROM_XYZ @ np.array([integral(weighted * row) for row in sensitivity()])
    np.testing.assert_allclose(BandStorage(count).rgb_from_channels(light), expected, atol=1e-5)


def test_bands_state_their_measured_errors() -> None:
    assert BAND_ERRORS == {31: (1.7, 7.0, 45.0), 61: (0.5, 2.3, 38.0), 121: (0.13, 0.7, 34.0)}
    text = BandStorage(61).stated_error()
    assert re.findall(r"[\d.]+\b", text.split("up to")[1]) == ["0.5", "2.3", "38"]
    assert [name for name in STORAGES if name.startswith("bands")] == ["bands31", "bands61", "bands121"]


def test_bands_of_almost_the_same_centers_are_others() -> None:
    for off, is_same in ((5e-7, True), (3e-6, False)):
        grid = SpectralGrid(np.linspace(400.0, 700.0, 31) + off)
        assert (BandStorage.of_grid(grid) is not None) == is_same


def test_an_exact_recording_measures_hats_times_the_observer() -> None:
    """Responses at whole nm, and the three numbers of each cell of 1 nm, where hats are linear."""
    knots = np.array([360.0, 371.0, 372.0, 500.0, 829.0, 830.0])
    storage = ExactStorage(SpectralGrid(knots))
    bands = storage.measured()
    nm = np.arange(360.0, 831.0)
    viewer = observer(STANDARD)
    cmfs = np.array([np.interp(nm, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    middle = np.array([np.interp(nm[:-1] + 0.5, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    for k in range(len(knots)):
        hat = np.interp(nm, knots, np.eye(len(knots))[k])
        half = np.interp(nm[:-1] + 0.5, knots, np.eye(len(knots))[k])
        for axis in range(3):
            own = 3 * k + axis
            assert bands.names[own] == f"{'xyz'[axis]}.{knots[k]:.6f}"
            np.testing.assert_allclose(bands.responses[own], hat * cmfs[axis], atol=1e-14)
            np.testing.assert_allclose(bands.pieces[0, own], (hat * cmfs[axis])[:-1], atol=1e-14)
            np.testing.assert_allclose(bands.pieces[1, own], half * middle[axis], atol=1e-14)
            np.testing.assert_allclose(bands.pieces[2, own], (hat * cmfs[axis])[1:], atol=1e-14)


def test_hats_of_an_exact_recording_end_with_their_grid() -> None:
    """Beyond 400 and 420 nm nothing is measured, also in the cells that touch the ends."""
    pieces = ExactStorage(SpectralGrid([400.0, 410.0, 420.0])).measured().pieces
    inside = np.zeros(470, bool)
    inside[40:60] = True
    assert not pieces[:, :, ~inside].any()
    assert pieces[0, :3, 40].all() and pieces[2, 6:, 59].all()


def test_amounts_of_another_light_have_the_same_integral_against_every_hat() -> None:
    """Weighted by the observer's sum and a thousandth of its largest value, the projection's residual is orthogonal."""
    knots = np.arange(380.0, 781.0, 20.0)
    storage, light = ExactStorage(SpectralGrid(knots)), lamp()
    found = np.interp(FINE, knots, storage._amounts(light), left=0, right=0)
    own = np.interp(FINE, light.grid.wavelengths_nm, light.values)
    weight = sensitivity().sum(axis=0) + 1e-3 * observer(STANDARD).cmfs.max()
    basis = hats(knots, reaching=False)
    inside = (knots[0] <= FINE) & (knots[-1] >= FINE)
    left = integral(basis * weight * (found - own) * inside)
    assert np.abs(left).max() < 1e-4 * integral(weight * own)
    assert storage._amounts(Illuminant("same", SpectralGrid(knots), knots)) is not None
    np.testing.assert_array_equal(storage._amounts(Illuminant("same", SpectralGrid(knots), knots)), knots)


def test_the_color_of_exact_channels_is_that_of_their_amounts() -> None:
    knots = np.array([400.0, 500.0, 600.0])
    matrix = ExactStorage(SpectralGrid(knots)).rgb_from_channels(Illuminant("x", SpectralGrid(knots), [2.0, 3.0, 5.0]))
    np.testing.assert_allclose(matrix, np.concatenate([f * RGB_FROM_XYZ for f in (2.0, 3.0, 5.0)], axis=1), rtol=1e-15)


def test_exact_recordings_have_knots_at_whole_nanometers_of_the_table() -> None:
    assert EXACT_GRID.same_as(SpectralGrid(np.arange(380.0, 781.0, 10.0)))
    for knots in ([360.0, 830.0], [361.0, 829.0]):
        assert ExactStorage(SpectralGrid(knots)).channel_count == 6
    for knots in ([359.0, 500.0], [500.0, 831.0], [400.0, 500.5]):
        with pytest.raises(InvalidInputError, match="whole nm within 360 to 830"):
            ExactStorage(SpectralGrid(knots))
    names = ExactStorage(SpectralGrid([400.0, 410.0])).channel_names()
    assert names == ("X.400,000000nm", "Y.400,000000nm", "Z.400,000000nm",
                     "X.410,000000nm", "Y.410,000000nm", "Z.410,000000nm")  # fmt: skip


def test_the_flat_light_has_the_value_1_and_relative_lights_its_luminance() -> None:
    flat = flat_light()
    np.testing.assert_array_equal(flat.grid.wavelengths_nm, [360.0, 830.0])
    np.testing.assert_array_equal(flat.values, [1.0, 1.0])
    luminance = integral(sensitivity()[1])
    light = lamp()
    np.testing.assert_allclose(relative_to_flat(light).values, light.values * luminance, rtol=1e-6)


def test_storages_are_recognized_by_their_kind_and_grid() -> None:
    assert isinstance(storage_of_document("dial", None), MixtureStorage)
    exact = storage_of_document("exact", [380.0, 390.0])
    assert isinstance(exact, ExactStorage) and exact.channel_count == 6
    for kind, knots in (("dial", [400.0, 500.0]), ("exact", None), ("bands", None), ("none", None)):
        with pytest.raises(InvalidInputError, match="none of dial"):
            storage_of_document(kind, knots)


def test_bytes_are_four_for_each_number_and_the_peak_is_four_copies() -> None:
    """And half a gigabyte for the renderer, and 56 bytes for each pixel and group."""
    for storage, channels in ((MixtureStorage(), 3), (BandStorage(61), 61), (ExactStorage(EXACT_GRID), 123)):
        stored = 4 * 40 * 30 * (channels * 5 + 1)
        assert storage.bytes_needed(40, 30, 5) == stored
        assert memory.peak_bytes(storage, 40, 30, 5) == 500e6 + 4 * stored + 56 * 40 * 30 * 5
    line = BandStorage(31).describe(1000, 500, 2)
    assert line.startswith("126 MB for 2 light groups at 1000×500, 31 channels each. New spectra: mean ΔE2000")


def test_the_least_of_machine_and_container_is_available(monkeypatch: pytest.MonkeyPatch) -> None:
    for machine, container, expected in ((3.0, 2.0, 2.0), (3.0, None, 3.0), (None, 2.0, 2.0), (None, None, None)):
        monkeypatch.setattr(memory, "_of_machine", lambda found=machine: found)
        monkeypatch.setattr(memory, "_of_container", lambda found=container: found)
        assert memory.available_bytes() == expected


def test_a_recording_that_just_fits_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    storage = MixtureStorage()
    needed = memory.peak_bytes(storage, 100, 80, 3)
    for free in (needed, None, needed + 1):
        monkeypatch.setattr(memory, "available_bytes", lambda found=free: found)
        memory.require_memory(storage, (100, 80), 3)
    monkeypatch.setattr(memory, "available_bytes", lambda: needed - 1)
    with pytest.raises(InvalidInputError, match="a picture of 99×79"):
        memory.require_memory(storage, (100, 80), 3)
    monkeypatch.setattr(memory, "available_bytes", lambda: 500e6)
    with pytest.raises(InvalidInputError, match="What fits: more memory"):
        memory.require_memory(storage, (100, 80), 3)
    for share, fitting in ((0.03, "a picture of 3×2"), (0.01, "more memory")):
        free = memory.RENDERER_BYTES + share**2 * (needed - memory.RENDERER_BYTES) * 1.001
        monkeypatch.setattr(memory, "available_bytes", lambda found=free: found)
        with pytest.raises(InvalidInputError, match=f"What fits: {fitting}"):
            memory.require_memory(storage, (100, 80), 3)
    # of a storage that fits, the one with fewer channels is named, and never the refused one
    big = BandStorage(121)
    monkeypatch.setattr(memory, "available_bytes", lambda: 700e6)
    with pytest.raises(
        InvalidInputError, match=r"takes up to 0.8 GB; 0.7 GB are free. What fits: dial of 3 channels, "
    ):
        memory.require_memory(big, (200, 150), 5)


def test_a_container_never_has_less_than_nothing(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "memory.max").write_text("1000\n")
    (tmp_path / "memory.current").write_text("1700\n")
    (tmp_path / "memory.stat").write_text("active_file 30\n")
    monkeypatch.setattr(memory, "Path", lambda *_: tmp_path)
    assert memory._of_container() == 0.0
    monkeypatch.setattr(memory, "Path", lambda *_: tmp_path / "absent")
    pages = {"SC_PHYS_PAGES": 1000, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(memory.os, "sysconf", pages.__getitem__)
    assert memory._of_machine() == 4096000.0
    monkeypatch.setattr(memory.os, "sysconf", lambda name: (_ for _ in ()).throw(ValueError(name)))
    assert memory._of_machine() is None
