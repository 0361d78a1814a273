# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture that is stopped within a pass is the mean of the samples that it has."""

from __future__ import annotations

import pytest

from spectral_core.render import render_scene, still
from spectral_core.render.trace import accumulate
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import Film, World, gray

from ..scenes import lit_plane

pytest.importorskip("mitsuba")
SIZE, SAMPLES = 8, 64
"""Of a picture in two passes, of 1 sample and of the rest."""


def stopped_at(call, **measure):
    """The picture of a furnace of reflectance 0.5, stopped where ``should_stop`` is asked for the ``call``-th time."""
    calls = iter(range(1, 100))
    scene = lit_plane(film=Film(SIZE, SIZE, samples=SAMPLES), world=World(gray(1.0)))
    return render_scene(scene, should_stop=lambda: next(calls) >= call, **measure)


@pytest.mark.parametrize(("call", "samples"), [(1, 1), (2, SAMPLES)])
def test_a_picture_that_is_stopped_is_as_bright_as_a_finished_one(call, samples):
    stopped = stopped_at(call)
    assert (stopped.status, stopped.samples) == ("cancelled", samples)
    assert stopped.pixels[..., :3].mean() == pytest.approx(0.5, rel=0.05)
    assert stopped.pixels[..., 3] == pytest.approx(1.0)


@pytest.mark.parametrize("call", range(1, 9))
def test_each_tile_counts_its_own_samples(call, monkeypatch):
    monkeypatch.setattr(accumulate, "TILE_PIXELS", SIZE * SIZE // 4)
    monkeypatch.setattr(still, "LONGEST_PASS_S", 1e9)  # a busy machine would split the second pass
    stopped = stopped_at(call)
    rows = stopped.pixels[..., 3].reshape(4, -1)
    assert (stopped.status, stopped.samples) == ("cancelled", 0 if call < 4 else 1 if call < 8 else SAMPLES)
    for number, row in enumerate(rows):
        assert row == pytest.approx(1.0 if number < call or call >= 4 else 0.0)


def test_bands_that_are_stopped_are_means(monkeypatch):
    monkeypatch.setattr(accumulate, "TILE_PIXELS", SIZE * SIZE // 2)
    finished, stopped = (stopped_at(call, bands=Bands.uniform(420.0, 680.0, 3)) for call in (100, 3))
    assert (stopped.status, stopped.samples) == ("cancelled", 1)
    lower, upper = stopped.band_pixels.reshape(2, -1, 3)
    assert lower.mean(axis=0) == pytest.approx(finished.band_pixels.mean(axis=(0, 1)), rel=0.05)
    assert upper.mean() == pytest.approx(finished.band_pixels.mean(), rel=0.3)
