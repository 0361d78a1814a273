# SPDX-License-Identifier: GPL-3.0-or-later
"""The color under a second light that is nearest to a wanted one, beside an exact color under a first light."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from spectral_core.palette.texture.nearest_color import nearest_weights
from spectral_core.palette.texture.reach import TEXTURE_GRID, stimulus_matrix
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import lab_from_linear_rgb

D65, HP1 = illuminant("D65"), illuminant("HP1")
HATS = np.stack([np.interp(np.arange(TEXTURE_GRID.size), [0, 20, 40, 60, 80], row) for row in np.eye(5)])


def test_nearest_weights_are_those_of_a_general_search() -> None:
    first, second = stimulus_matrix([D65]) @ HATS.T, stimulus_matrix([HP1]) @ HATS.T
    color = first @ np.array([0.3, 0.5, 0.2, 0.6, 0.4])
    for wanted in (np.array([0.2, 0.2, 0.6]), np.array([0.6, 0.2, 0.1])):
        found = nearest_weights(first, second, color, wanted)
        assert found is not None
        np.testing.assert_allclose(first @ found, color, atol=1e-7)
        target = lab_from_linear_rgb(wanted)

        def distance(w: np.ndarray, target: np.ndarray = target) -> float:
            return float(np.sum((lab_from_linear_rgb(np.maximum(second @ w, 0)) - target) ** 2))

        held = {"type": "eq", "fun": lambda w: first @ w - color}
        starts = (found, np.array([0.3, 0.5, 0.2, 0.6, 0.4]))
        searches = [minimize(distance, start, bounds=[(0, 1)] * 5, constraints=held) for start in starts]
        best = min(searches, key=lambda each: each.fun)
        assert distance(found) <= best.fun * 1.01 + 1e-3
    assert nearest_weights(first, second, np.array([2.0, 0.0, 0.0]), wanted) is None


@pytest.mark.parametrize(
    ("lamp", "color", "wanted"),
    [
        ("HP1", (0.004, 0.709, 0.72), (0.274, 0.007, 0.646)),
        ("HP5", (0.0, 0.002, 0.145), (0.695, 0.042, 0.413)),
        ("FL11", (0.3, 0.4, 0.2), (0.1, 0.2, 0.8)),
    ],
)
def test_no_reflectance_is_nearer_to_a_color_far_away(
    lamp: str, color: tuple[float, ...], wanted: tuple[float, ...]
) -> None:
    """By a linear program: no direction within the possible colors comes nearer. Full steps ended up to 8 units of
    CIELAB too far away, and colors outside of sRGB were measured at its border.
    """
    first, second = stimulus_matrix([D65]), stimulus_matrix([illuminant(lamp)])
    found = nearest_weights(first, second, np.array(color), np.array(wanted))
    assert found is not None
    np.testing.assert_allclose(first @ found, color, atol=1e-7)
    shown, target = second @ found, lab_from_linear_rgb(np.array(wanted))

    def distance(rgb: np.ndarray) -> float:
        return float(np.linalg.norm(lab_from_linear_rgb(rgb) - target))

    slope = np.array([(distance(shown + each) - distance(shown - each)) / 2e-6 for each in 1e-6 * np.eye(3)])
    farthest = linprog(slope @ second, A_eq=first, b_eq=color, bounds=(0, 1), method="highs").fun
    assert slope @ shown - farthest < 1e-2
