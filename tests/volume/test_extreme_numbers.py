# SPDX-License-Identifier: GPL-3.0-or-later
"""Data at the limits of their types are rendered as the same data near 1; numbers beyond the limits are refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import LARGEST, Material, TransferFunction
from spectral_core.volume.view import View

DATA = np.random.default_rng(3).integers(0, 9, (7, 6, 5)) / 8.0
COLOR = np.array([0.5, 0.6, 0.7])
CASES: dict[str, Callable[[Any], Any]] = {
    "float32 near its largest": lambda x: (3e38 * x).astype(np.float32),
    "float32, both signs": lambda x: (6e38 * x - 3e38).astype(np.float32),
    "float32 below its smallest": lambda x: (1e-39 * x).astype(np.float32),
    "float64 of 300 digits": lambda x: 1e300 * x,
    "float64 of -300 digits": lambda x: 1e-300 * x,
    "far from zero": lambda x: 1e15 + x,
}


def rendered(scaled: Callable[[Any], Any]) -> Any:
    """Amounts of a picture whose function runs over the data, in steps of 0.05 voxels."""
    volume = ScalarVolume("field", scaled(DATA))
    ends = np.sort(np.asarray(scaled(np.array([0.0, 1.0])), np.float64))
    transfer = TransferFunction((Material("all", ends, np.array([0.0, 0.7]), COLOR),))
    renderer = VolumeRenderer(volume)
    view = View.around(volume, 20.0, 15.0, width=12, height=12, fov_deg=30.0)
    made = plan(renderer, view, transfer, 40.0)
    assert made.is_reached
    # With one brick per voxel too, in the rule of the thesis.
    for way in (Stepping("error", "midpoint"), Stepping("cells", "preintegrated"), Stepping("thesis", "midpoint")):
        assert np.isfinite(renderer.render(view, transfer, way).amounts).all()
    return renderer.render(view, transfer, Stepping("uniform", "midpoint", 0.05)).amounts


@pytest.fixture(scope="module")
def plain() -> Any:
    return rendered(lambda x: x)


@pytest.mark.parametrize("name", CASES)
def test_extreme_data_show_the_same_picture(plain: Any, name: str) -> None:
    """Warnings are errors in tests: differences that exceed single precision gave several."""
    found = rendered(CASES[name])
    assert plain.max() > 0.5
    np.testing.assert_allclose(found, plain, atol=2e-4)


@pytest.mark.parametrize("name", ["extinction", "emission", "color", "gradient_weights"])
def test_numbers_that_make_a_picture_infinite_are_refused(name: str) -> None:
    """An extinction of 1e300 made a picture of NaN."""
    given = {
        "extinction": np.ones(2), "emission": np.ones(2), "color": COLOR, "gradient_values": np.array([0.0, 1.0]),
        "gradient_weights": np.ones(2),
    }  # fmt: skip
    Material("all", np.array([0.0, 1.0]), **{**given, name: LARGEST * given[name] / given[name].max()})
    with pytest.raises(InvalidInputError, match=rf"the largest number of {name} of material 'all' is 1e\+31"):
        Material("all", np.array([0.0, 1.0]), **{**given, name: 10 * LARGEST * given[name] / given[name].max()})


@pytest.mark.parametrize("factor", [1e-310, 1e-200, 1e-100, 1e200])
@pytest.mark.parametrize("name", ["narrow", "edges"])
def test_presets_show_extreme_data(factor: float, name: str) -> None:
    """Data below 1e-308 made a picture of NaN; squares of slopes below 1e-160 and above 1e150 are no doubles."""
    ball = np.sqrt((np.stack(np.mgrid[-5:6, -5:6, -5:6]) ** 2).sum(axis=0))
    pictures = []
    for scale in (1.0, factor):
        volume = ScalarVolume("ball", scale * (9.0 - ball))
        view = View.around(volume, 20.0, 15.0, width=12, height=12)
        shown = VolumeRenderer(volume).render(view, preset(name, volume), Stepping("uniform", "midpoint", 0.02))
        pictures.append(shown.picture())
    assert np.isfinite(pictures[1]).all()
    assert pictures[0].max() > 0.1
    if factor > 1e-300:  # single precision holds the others with all their digits
        np.testing.assert_allclose(pictures[1], pictures[0], atol=0.02)


def test_values_and_knots_whose_difference_is_no_double_are_refused() -> None:
    """Data beyond 9e307 ended in an OverflowError."""
    volume = ScalarVolume("huge", np.array([[[-1.5e308, 1.5e308]]]))
    with pytest.raises(InvalidInputError, match=r"'huge' has values from -1.5e\+308 to 1.5e\+308"):
        VolumeRenderer(volume)
    with pytest.raises(InvalidInputError, match="the largest number of values of material 'all'"):
        Material("all", np.array([-1.7e308, 1.7e308]), np.zeros(2), COLOR)
