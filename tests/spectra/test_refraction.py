# SPDX-License-Identifier: GPL-3.0-or-later
"""Indices of refraction by name and by Abbe number, compared with the numbers that their makers state."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.spectra.refraction import (
    NAMED_INDICES,
    bubble_in,
    index_by_abbe,
    named_index,
)

# n_d and V_d of data sheets and handbooks
STATED = {
    "BK7": (1.51680, 64.17),
    "F2": (1.62004, 36.37),
    "SF11": (1.78472, 25.68),
    "SILICA": (1.45846, 67.82),
    "WATER": (1.33336, 55.8),
    "SAPPHIRE": (1.7682, 72.2),
    "DIAMOND": (2.4175, 55.3),
}


def test_every_named_index_has_a_stated_value():
    assert set(STATED) == set(NAMED_INDICES)


@pytest.mark.parametrize("name", NAMED_INDICES)
def test_named_indices_are_those_that_makers_state(name):
    index, abbe = STATED[name]
    made = named_index(name)
    assert float(made.at(587.5618)) == pytest.approx(index, abs=1e-4)
    at_d, at_f, at_c = NAMED_INDICES[name].at(np.array([587.5618, 486.1327, 656.2725]))  # helium, hydrogen
    assert (at_d - 1) / (at_f - at_c) == pytest.approx(abbe, rel=2e-3)
    fine = np.linspace(360, 830, 2000)
    np.testing.assert_allclose(made.at(fine), NAMED_INDICES[name].at(fine), atol=6e-5)
    assert (np.diff(made.values) < 0).all()  # violet is refracted the most


@pytest.mark.parametrize(("index", "abbe"), [(1.5, 64.0), (1.33, 20.0), (2.4, 5.0), (1.001, 100.0)])
def test_an_abbe_number_gives_the_index_that_it_is_defined_by(index, abbe):
    at_d, at_f, at_c = index_by_abbe(index, abbe).at([587.5618, 486.1327, 656.2725])
    assert at_d == pytest.approx(index, abs=1e-4 * (index - 1))
    assert (at_d - 1) / (at_f - at_c) == pytest.approx(abbe, rel=2e-3)


def test_a_bubble_has_the_inverse_of_the_index_around_it():
    bubble, water = index_by_abbe(1 / 1.33, 55.0), index_by_abbe(1.33, 55.0)
    np.testing.assert_allclose(bubble.values * water.values, 1.0, rtol=1e-12)
    assert float(bubble_in(named_index("WATER")).at(587.5618)) == pytest.approx(1 / STATED["WATER"][0], abs=1e-4)


def test_indices_reach_to_the_ultraviolet_that_excites_dyes():
    """Fused silica has 1.4878 at 300 nm (Malitson 1965)."""
    assert float(named_index("SILICA").at(300.0)) == pytest.approx(1.48779, abs=2e-4)
    assert index_by_abbe(1.5, 60.0).at(300.0) > index_by_abbe(1.5, 60.0).at(360.0) > 1.5


@pytest.mark.parametrize(("index", "abbe"), [(0.0, 50.0), (-1.5, 50.0), (np.nan, 50.0), (1.5, 4.0), (1.5, np.inf)])
def test_impossible_numbers_are_refused(index, abbe):
    with pytest.raises(InvalidInputError, match="the index of refraction|the Abbe number"):
        index_by_abbe(index, abbe)


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match="DIAMOND"):
        named_index("DIAMANT")
