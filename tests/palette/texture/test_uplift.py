# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture with pins: exact under the first light, pinned under the second, distant colors unchanged."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.palette.texture.uplift import Pin, Uplift, design_uplift
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

D65, HP1 = illuminant("D65"), illuminant("HP1")
PINNED = np.array([[0.6, 0.1, 0.1], [0.2, 0.5, 0.2], [0.3, 0.3, 0.7]])
FACTORS = np.array([[0.6, 0.6, 0.6], [1.3, 1.1, 0.5], [0.8, 1.2, 1.0]])


@pytest.fixture(scope="module")
def plain() -> Uplift:
    return design_uplift(D65, HP1)


@pytest.fixture(scope="module")
def pinned(plain: Uplift) -> Uplift:
    colors = plain.spectra(PINNED) @ stimulus_matrix([HP1]).T
    return design_uplift(D65, HP1, [Pin(c, np.clip(w, 0, 1)) for c, w in zip(PINNED, colors * FACTORS, strict=True)])


def colors(count: int = 1500) -> np.ndarray:
    return np.random.default_rng(11).random((count, 3))


def test_every_color_is_exact_under_the_first_light_and_bounded(plain: Uplift, pinned: Uplift) -> None:
    wanted = np.concatenate([colors(), np.eye(3), 1 - np.eye(3), np.ones((1, 3)), np.zeros((1, 3))])
    for uplift in (plain, pinned):
        spectra = uplift.spectra(wanted)
        shown = spectra @ stimulus_matrix([D65]).T
        assert delta_e_2000(lab_from_linear_rgb(shown), lab_from_linear_rgb(wanted)).max() < 0.06
        assert spectra.min() >= 0
        assert spectra.max() <= 1 + 1e-6


def test_pins_are_met_and_distant_colors_are_unchanged(plain: Uplift, pinned: Uplift) -> None:
    assert all(result.reachable and result.delta_e < 0.3 for result in pinned.pins)
    under_second = stimulus_matrix([HP1]).T
    moved = delta_e_2000(
        lab_from_linear_rgb(plain.spectra(colors()) @ under_second),
        lab_from_linear_rgb(pinned.spectra(colors()) @ under_second),
    )
    distance = np.linalg.norm(colors()[:, None] - PINNED, axis=2).min(axis=1)
    assert moved[distance > 0.45].mean() < 0.05
    assert moved[distance < 0.1].mean() > 2


def test_an_unreachable_pin_is_reported_and_gets_the_nearest_color(plain: Uplift) -> None:
    result = design_uplift(D65, HP1, [Pin([0.5, 0.5, 0.5], [0.0, 0.0, 1.0])]).pins[0]
    assert not result.reachable
    assert result.delta_e > 10
    assert result.delta_e_nearest < 4  # near the border of possible colors, neighboring nodes reduce the bump


def test_contradictions_are_refused(plain: Uplift) -> None:
    with pytest.raises(InvalidInputError, match="keep one"):
        design_uplift(D65, HP1, [Pin([0.5, 0.5, 0.5], [0.4, 0.4, 0.4]), Pin([0.51, 0.5, 0.5], [0.6, 0.4, 0.4])])
    with pytest.raises(InvalidInputError, match="without a second light"):
        design_uplift(D65, None, [Pin([0.5, 0.5, 0.5], [0.4, 0.4, 0.4])])
    with pytest.raises(InvalidInputError, match="under 'FL3' no reflectance .* looks white .* lower the slope"):
        design_uplift(illuminant("FL3"))
    with pytest.raises(InvalidInputError, match="linear RGB from 0 to 1"):
        Pin([1.5, 0, 0], [0, 0, 0])
    with pytest.raises(InvalidInputError, match="has linear RGB from 0 to 1"):
        plain.spectra([[0.2, 0.3, 1.2]])
