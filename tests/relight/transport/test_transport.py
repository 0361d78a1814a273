# SPDX-License-Identifier: GPL-3.0-or-later
"""Relighting: relit pictures equal renders of the same paths; other and damaged files are refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.relight.cases.scenes import under_lights
from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.mix import LiveMix, relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport, record_transport
from spectral_core.render.relight.transport_file import is_transport, read_transport, write_transport
from spectral_core.scene import (
    Film,
    Scene,
    scene_hash,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.relight.comparison import relative_error

pytest.importorskip("mitsuba")
GRID = SpectralGrid.uniform(380, 780, 20)


def test_a_dial_is_exact_for_every_mixture(scene: Scene) -> None:
    transport = record_transport(scene, MixtureStorage())
    dimmed = replace(scene, lights=(replace(scene.lights[0], power_w=18.0), scene.lights[1]),
                     world=replace(scene.world, strength=0.25))  # fmt: skip

    assert set(transport.groups) == {"Key", "Fill", "Sky"}
    assert relative_error(relight(transport), render_scene(scene, sampling_lights=SAMPLING_LIGHTS).pixels) < 1e-5
    mixed = relight(transport, mix={"Key": 0.3, "Sky": 0.25})
    assert relative_error(mixed, render_scene(dimmed, sampling_lights=SAMPLING_LIGHTS).pixels) < 1e-5


def test_exact_storage_equals_rendering_with_new_spectra(scene: Scene) -> None:
    """Sodium, a triphosphor lamp and a laser line on one grid, all bounces included."""
    line = Illuminant("line", GRID, np.where(GRID.wavelengths_nm == 540, 1.0, 0.0))
    lights = {"Key": catalogue.illuminant("HP1").resampled(GRID), "Fill": catalogue.illuminant("FL11").resampled(GRID),
              "Sky": line}  # fmt: skip
    transport = record_transport(scene, ExactStorage(GRID))
    lit = under_lights(replace(scene, settings=replace(scene.settings, transport="spectral")), lights)
    rendered = render_scene(lit, groups=True, sampling_lights=SAMPLING_LIGHTS)

    assert relative_error(relight(transport, lights=lights), rendered.pixels) < 1e-5
    for group in lights:
        alone = relight(transport, lights=lights, mix={name: float(name == group) for name in lights})
        assert relative_error(alone, rendered.group_pixels[group]) < 1e-5


@pytest.fixture(scope="module")
def bands(scene: Scene) -> Transport:
    """A recording of the fewest bands."""
    return record_transport(scene, BandStorage(31))


@pytest.fixture(scope="module")
def small(scene: Scene) -> Scene:
    return replace(scene, film=Film(8, 6, samples=2))


@pytest.fixture(scope="module")
def transports(small: Scene) -> list[Transport]:
    """Small recordings of each kind."""
    return [record_transport(small, storage) for storage in (MixtureStorage(), BandStorage(31), ExactStorage(GRID))]


def test_bands_have_a_small_error_for_smooth_lights(scene: Scene, bands: Transport) -> None:
    """Compares the mean color of the picture, because the noise of a band in a pixel differs from that of the light."""
    lights = {name: catalogue.illuminant("A") for name in ("Key", "Fill", "Sky")}
    lit = under_lights(replace(scene, settings=replace(scene.settings, transport="spectral")), lights)
    rendered = render_scene(lit, sampling_lights=SAMPLING_LIGHTS).pixels.mean(axis=(0, 1))
    relit = relight(bands, lights=lights).mean(axis=(0, 1))

    np.testing.assert_allclose(relit, rendered, rtol=0.01)


def test_lights_without_a_new_spectrum_emit_as_in_the_scene(scene: Scene) -> None:
    """A white light's spectrum is kept; a group with different spectra needs a new one."""
    # the white light ends at 780 nm, with a step that a grid beyond it cannot represent
    transport = record_transport(scene, ExactStorage(SpectralGrid.uniform(360, 780, 5)))
    rendered = render_scene(
        replace(scene, settings=replace(scene.settings, transport="spectral")),
        groups=True,
        sampling_lights=SAMPLING_LIGHTS,
    )
    alone = relight(transport, mix={"Key": 0, "Sky": 0})
    assert relative_error(alone, rendered.group_pixels["Fill"]) < 3e-5  # 32-bit sums in a different order

    merged = replace(scene, lights=tuple(replace(light, group="all") for light in scene.lights))
    mixed = record_transport(replace(merged, film=Film(4, 4, samples=1)), BandStorage())
    with pytest.raises(InvalidInputError, match="the lights of group 'all' had different spectra"):
        relight(mixed)


def test_files_are_read_back_to_the_bit(small: Scene, transports: list[Transport], tmp_path: Path) -> None:
    for transport in transports:
        storage = transport.storage
        path = tmp_path / f"{storage.kind}.exr"
        write_transport(path, transport)
        back = read_transport(path, scene_hash=scene_hash(small))

        np.testing.assert_array_equal(back.channels, transport.channels)
        np.testing.assert_array_equal(back.coverage, transport.coverage)
        assert back.groups == transport.groups
        assert back.scene_hash == transport.scene_hash
        expected = relight(transport, mix={"Key": 0.0} if storage.kind == "dial" else {"Key": 0})
        np.testing.assert_allclose(relight(back, mix={"Key": 0}), expected, rtol=1e-6, atol=1e-7)


def test_truncated_edited_and_other_files_are_refused(transports: list[Transport], tmp_path: Path) -> None:
    import OpenEXR

    path = tmp_path / "transport.exr"
    write_transport(path, transports[0])
    whole = path.read_bytes()

    with pytest.raises(FileFormatError, match="was recorded from another scene"):
        read_transport(path, scene_hash="0" * 64)
    for share in (0.3, 0.6, 0.9):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(FileFormatError, match="record"):
            read_transport(path)
    path.write_bytes(whole)
    edited = OpenEXR.File(str(path), separate_channels=True)
    edited.parts[0].channels["G"].pixels[2, 3] += 0.25
    edited.write(str(path))
    with pytest.raises(FileFormatError, match="edited or damaged"):
        read_transport(path)
    with pytest.raises(
        FileFormatError, match="there is no file .*absent.exr; if it was moved or renamed, name its present path"
    ):
        read_transport(tmp_path / "absent.exr")
    # The first part determines the type of a file: a picture followed by a transport's parts is never overwritten.
    path.write_bytes(whole)
    assert is_transport(path)
    parts = OpenEXR.File(str(path), separate_channels=True).parts
    OpenEXR.File([parts[-1], *parts[:-1]]).write(str(path))
    assert not is_transport(path)
    OpenEXR.File({}, {"R": np.zeros((2, 2), np.float32)}).write(str(path))
    with pytest.raises(FileFormatError, match="but no transport"):
        read_transport(path)


def test_errors_for_unknown_names_list_the_known_ones(transports: list[Transport]) -> None:
    transport = transports[0]
    with pytest.raises(UnknownNameError, match="no light group of this transport is named 'Kay'; did you mean 'Key'"):
        relight(transport, mix={"Kay": 1.0})
    unnamed = replace(transport, groups=("",), channels=transport.channels[:1], lights=transport.lights[:1])
    with pytest.raises(
        UnknownNameError, match="'Key': all lights are in one group without a name; record one group per"
    ):
        relight(unnamed, mix={"Key": 1.0})
    with pytest.raises(InvalidInputError, match="the light group 'Key' is -1; a light cannot absorb light"):
        relight(transport, mix={"Key": -1.0})
    with pytest.raises(
        InvalidInputError, match="a 'dial' transport holds no spectra; record again with the storage bands31"
    ):
        LiveMix(transport).set_light("Key", catalogue.illuminant("A"))
    with pytest.raises(InvalidInputError, match="whole nm within 360 to 830"):
        ExactStorage(SpectralGrid(np.linspace(400, 700, 100)))
    with pytest.raises(InvalidInputError, match="one of"):
        BandStorage(40)


def test_memory_is_stated_before_rendering(transports: list[Transport]) -> None:
    """The stated size equals that of the arrays, to the byte."""
    for transport in transports:
        assert transport.storage.bytes_needed(8, 6, 3) == transport.channels.nbytes + transport.coverage.nbytes
    assert "829 MB" in MixtureStorage().describe(3840, 2160, 8)


def test_a_recording_too_large_for_memory_is_refused_with_one_that_fits(scene, monkeypatch):
    from spectral_core.render.relight import memory

    storage = ExactStorage(SpectralGrid.uniform(380, 780, 10))
    assert storage.bytes_needed(3840, 2160, 8) == 4 * 3840 * 2160 * (3 * 41 * 8 + 1)
    monkeypatch.setattr(memory, "available_bytes", lambda: 24e9)
    memory.require_memory(MixtureStorage(), (3840, 2160), 8)
    with pytest.raises(InvalidInputError, match=r"3840×2160 for 8 light groups.*24.0 GB are free. What fits: dial"):
        memory.require_memory(storage, (3840, 2160), 8)
    monkeypatch.setattr(memory, "available_bytes", lambda: 1e6)
    with pytest.raises(InvalidInputError, match="are free"):
        record_transport(scene, storage, render=lambda *_, **__: pytest.fail("it must not render"))


def test_a_colored_light_keeps_its_brightness_when_relit_from_bands(scene, bands):
    """A light's color dims it; the relit light has the same luminance, not that of white."""
    rendered = render_scene(replace(scene, settings=replace(scene.settings, transport="spectral"))).pixels
    relit = relight(bands)
    assert relit[..., :3].mean() == pytest.approx(rendered[..., :3].mean(), rel=0.05)
