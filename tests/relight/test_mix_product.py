# SPDX-License-Identifier: GPL-3.0-or-later
"""The product of a live mix: its pixels do not depend on the order of the channels in memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.relight import mix
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.mix import LiveMix
from spectral_core.render.relight.transport import Transport
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized


@pytest.mark.parametrize("order", ["C", "F"])
def test_channels_in_any_order_of_memory(order: str) -> None:
    rng = np.random.default_rng(4)
    storage, lamp = BandStorage(31), normalized(illuminant("A"))
    count = storage.channel_count
    channels = np.asarray(rng.random((2, count, 5, 7)), np.float32, order=order)
    transport = Transport(storage, ("a", "b"), channels, np.ones((5, 7), np.float32), (lamp, lamp), 1.0, "hash", 4, 0)
    live = LiveMix(transport)
    live.set_light("b", illuminant("HP1"))
    found = live.picture((0.5, 2.0))[..., :3]
    alone = []
    for weights in ((0.5, 0.0), (0.0, 2.0)):
        other = LiveMix(replace(transport, channels=np.ascontiguousarray(channels)))
        other.set_light("b", illuminant("HP1"))
        alone.append(other.picture(weights)[..., :3].copy())
    np.testing.assert_allclose(found, sum(alone), rtol=1e-5)
    matrix = storage.rgb_as_recorded(lamp)
    expected = np.einsum("ck,kyx->yxc", matrix, channels[0].astype(np.float64)) * 0.5
    np.testing.assert_allclose(alone[0], expected, rtol=1e-5, atol=1e-6)


def test_a_picture_keeps_nothing_of_the_last_one() -> None:
    """Neither its values, even infinite ones, nor its coverage."""
    rng = np.random.default_rng(5)
    storage, lamp = BandStorage(31), normalized(illuminant("A"))
    channels = rng.random((3, storage.channel_count, 3, 4)).astype(np.float32)
    channels[1, :, 0, 0] = 1e35
    coverage = rng.random((3, 4)).astype(np.float32)
    live = LiveMix(Transport(storage, ("a", "b", "c"), channels, coverage, (lamp,) * 3, 1.0, "hash", 4, 0))
    first = live.picture((1.0, 1.0, 0.5)).copy()
    np.testing.assert_array_equal(first[..., 3], coverage)
    assert np.isfinite(first).all()
    assert np.isinf(live.picture((1.0, 1e5, 0.5))[0, 0, :3]).all()
    np.testing.assert_array_equal(live.picture((1.0, 1.0, 0.5)), first)


def test_a_recording_without_lights_is_black() -> None:
    storage = BandStorage(31)
    channels, coverage = np.zeros((0, storage.channel_count, 2, 3), np.float32), np.full((2, 3), 0.5, np.float32)
    picture = LiveMix(Transport(storage, (), channels, coverage, (), 1.0, "hash", 4, 0)).picture(())
    np.testing.assert_array_equal(picture, np.dstack([np.zeros((2, 3, 3)), coverage]))


@pytest.mark.parametrize("seed", range(4))
def test_any_order_of_lights_and_weights_gives_the_sum(seed: int) -> None:
    """The sum of the lights that are not dragged is kept from picture to picture."""
    rng = np.random.default_rng(seed)
    storage, lamps = BandStorage(31), [illuminant(name) for name in ("A", "HP1", "FL2", "D65", "LED-B1")]
    channels = rng.random((3, storage.channel_count, 3, 4)).astype(np.float32)
    coverage = rng.random((3, 4)).astype(np.float32)
    transport = Transport(storage, ("a", "b", "c"), channels, coverage, (normalized(lamps[0]),) * 3, 0.7, "hash", 4, 0)
    live, given, weights = LiveMix(transport), [lamps[0]] * 3, np.ones(3)
    for _ in range(60):
        if rng.random() < 0.3:
            weights = rng.choice([0.0, 0.5, 1.0, 3.0], 3)
        for index in rng.choice(3, rng.integers(0, 3), replace=False) if rng.random() < 0.7 else ():
            given[index] = lamps[rng.integers(len(lamps))]
            live.set_light("abc"[index], given[index])
        found = live.picture(weights)
        expected = sum(
            weight * 0.7 * np.einsum("ck,kyx->yxc", storage.rgb_as_recorded(normalized(light)), planes.astype(float))
            for weight, light, planes in zip(weights, given, channels, strict=True)
        )
        np.testing.assert_allclose(found[..., :3], expected, rtol=2e-5, atol=1e-4)
        np.testing.assert_array_equal(found[..., 3], coverage)


def test_a_dragged_light_is_one_product(monkeypatch: pytest.MonkeyPatch) -> None:
    from spectral_core.render.relight import mix

    rng = np.random.default_rng(6)
    storage, lamp = BandStorage(31), normalized(illuminant("A"))
    channels = rng.random((4, storage.channel_count, 3, 4)).astype(np.float32)
    live = LiveMix(
        Transport(storage, tuple("abcd"), channels, np.ones((3, 4), np.float32), (lamp,) * 4, 1.0, "h", 4, 0)
    )
    live.picture(np.ones(4))
    calls = {"_add": 0, "_multiply_add": 0}

    def counted(name: str) -> None:
        real = getattr(mix, name)

        def call(*args: object) -> None:
            calls[name] += 1
            real(*args)

        monkeypatch.setattr(mix, name, call)

    for name in calls:
        counted(name)
    for name in ("HP1", "FL2", "D65", "FL11"):
        live.set_light("b", illuminant(name))
        live.picture((1.0, 0.7, 1.0, 1.0))
    assert calls == {"_add": 1, "_multiply_add": 4}
    calls.update(_add=0, _multiply_add=0)
    for weight in (0.1, 0.2, 0.3):
        live.picture((1.0, weight, 1.0, 1.0))
    assert calls == {"_add": 3, "_multiply_add": 1}


# A quick picture of a drag: half the size, each pixel shown as four.


def mixed(height: int, width: int) -> tuple[LiveMix, np.ndarray]:
    rng = np.random.default_rng(6)
    storage, lamp = BandStorage(31), normalized(illuminant("A"))
    channels = rng.random((3, storage.channel_count, height, width)).astype(np.float32)
    coverage = rng.random((height, width)).astype(np.float32)
    return LiveMix(Transport(storage, ("a", "b", "c"), channels, coverage, (lamp,) * 3, 1.0, "hash", 4, 0)), channels


def dragged(live: LiveMix, kelvin: int, *, quick: bool) -> np.ndarray:
    live.set_light("b", illuminant(f"blackbody {kelvin}"))
    return np.array(live.picture((0.5, 2.0, 1.0), quick=quick))


@pytest.mark.parametrize(("height", "width"), [(6, 8), (5, 7), (1, 9), (7, 1), (1, 1)])
def test_a_quick_picture_is_the_mean_of_the_pixels_that_it_covers(height: int, width: int) -> None:
    live, _ = mixed(height, width)
    other, _ = mixed(height, width)
    for each in (live, other):
        each.picture((0.5, 2.0, 1.0))
    live.halve(1, live.halved(1))
    for kelvin in (3000, 7000):  # the sum of the other lights is kept for the second
        full, coarse = dragged(other, kelvin, quick=True), dragged(live, kelvin, quick=True)
        assert (other.is_coarse, live.is_coarse) == (False, True)
        assert coarse.shape == ((height + 1) // 2, (width + 1) // 2, 4)
        for y, x in np.ndindex(coarse.shape[:2]):
            block = full[2 * y : 2 * y + 2, 2 * x : 2 * x + 2]
            np.testing.assert_allclose(coarse[y, x], block.mean(axis=(0, 1)), rtol=1e-5)


def test_the_picture_after_a_drag_is_the_full_one() -> None:
    live, _ = mixed(6, 8)
    other, _ = mixed(6, 8)
    for each in (live, other):
        each.picture((0.5, 2.0, 1.0))
    live.halve(1, live.halved(1))
    for kelvin in (3000, 7000, 4500):
        dragged(live, kelvin, quick=True)
    expected = dragged(other, 4500, quick=False)
    np.testing.assert_allclose(live.picture((0.5, 2.0, 1.0)), expected, rtol=1e-5)
    assert not live.is_coarse
    coarse = dragged(live, 3000, quick=True)
    assert live.is_coarse
    changed = np.array(live.picture((0.0, 2.0, 1.0), quick=True))  # the dial is moved, and no light is dragged
    assert not live.is_coarse
    assert changed.shape == (6, 8, 4)
    assert not np.allclose(changed[::2, ::2], coarse)


def test_only_slow_lights_are_worth_halving(monkeypatch: pytest.MonkeyPatch) -> None:
    for seconds, expected in ((10.0, None), (0.0, 1)):
        monkeypatch.setattr(mix, "QUICK_SECONDS", seconds)
        live, _ = mixed(6, 8)
        live.picture((0.5, 2.0, 1.0))
        dragged(live, 3000, quick=True)
        assert live.worth_halving == expected
    live.halve(1, live.halved(1))
    dragged(live, 4000, quick=False)
    assert live.worth_halving is None
