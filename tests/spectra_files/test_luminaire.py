# SPDX-License-Identifier: GPL-3.0-or-later
"""Photometric tables of the three types, and their interpolation as in Cycles."""

from __future__ import annotations

import re

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.spectra.luminaire import WATTS_PER_CANDELA, every_degree, read_ies


def text(kind, vertical, horizontal, values):
    numbers = " ".join(map(str, [*vertical, *horizontal, *np.ravel(values)]))
    return f"IESNA:LM-63-1995\nTILT=NONE\n1 -1 1 {len(vertical)} {len(horizontal)} {kind} 2 0 0 0\n1 1 100\n{numbers}\n"


def degrees(kind, vertical, horizontal, values):
    return every_degree(*read_ies(text(kind, vertical, horizontal, values))) / WATTS_PER_CANDELA


def test_a_smooth_profile_is_interpolated_by_cubic_pieces():
    """A parabola between even angles: the cubic of Cycles is exact where both neighbors are known."""
    angles = np.arange(0, 91, 15)
    table = degrees(1, angles, [0], [100 - (angles / 10.0) ** 2])
    np.testing.assert_allclose(table[0, 15:76], 100 - (np.arange(15, 76) / 10.0) ** 2, rtol=1e-12)
    assert np.all(table[0, 91:] == 0)  # nothing is known beyond the last angle
    # linear interpolation would be off by this much in the middle of a piece
    assert abs(np.interp(37.5, angles, 100 - (angles / 10.0) ** 2) - (100 - 3.75**2)) > 0.5


@pytest.mark.parametrize("last", [90.0, 180.0, 360.0])
def test_a_quarter_and_a_half_are_mirrored_all_around(last):
    around = np.linspace(0, last, int(last / 30) + 1)
    values = np.outer(10 + np.cos(np.radians(2 * around)), np.ones(3))
    table = degrees(1, [0, 90, 180], around, values)
    assert table.shape == (361, 181)
    np.testing.assert_allclose(table[30:, 45], 10 + np.cos(np.radians(2 * np.arange(30.0, 361.0))), atol=0.03)


def test_the_ends_are_those_of_cycles():
    """Before 0° around and beyond the pole above it takes the last value once more (single precision misses 360°)."""
    rows = np.array([[9, 8, 5], [7, 9, 2], [4, 9, 1]])
    table = degrees(1, [0, 90, 180], [0, 45, 90], rows)
    first, second, third = (row[1] for row in rows)
    x = 10 / 45
    cubic = first + 0.5 * x * (
        second - first + x * (2 * first - 5 * first + 4 * second - third + x * (3 * (first - second) + third - first))
    )
    assert table[10, 90] == pytest.approx(cubic)
    x, (a, b, c) = 1 / 3, rows[0]
    assert table[0, 120] == pytest.approx(
        b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 3 * c + x * (3 * (b - c) + c - a)))
    )


def test_a_circle_without_its_last_entry_is_closed():
    around = np.arange(0, 360, 30)
    table = degrees(1, [0, 90, 180], around, np.outer(10 + np.sin(np.radians(around)), np.ones(3)))
    np.testing.assert_allclose(table[[315, 360], 90], 10 + np.sin(np.radians([315, 360])), atol=0.01)


def test_type_a_counts_from_the_horizon():
    """Straight ahead (0°, 0°) of type A is 90° from straight down, and 180° around."""
    values = np.zeros((3, 3))
    values[1, 1] = 5.0
    table = degrees(3, [-90, 0, 90], [-90, 0, 90], values)
    assert table[180, 90] == pytest.approx(5.0) and table[90, 90] == pytest.approx(0.0)
    assert np.all(table[:80] == 0)  # behind the lamp


def test_type_b_exchanges_the_angles():
    values = np.zeros((3, 5))
    values[1, 3] = 5.0  # 0° across, 45° along
    table = degrees(2, [-90, -45, 0, 45, 90], [-90, 0, 90], values)
    assert np.unravel_index(np.argmax(table), table.shape) == (135, 90)
    half = degrees(2, [0, 45, 90], [0, 90], np.array([[1.0, 5.0, 1.0], [1.0, 1.0, 1.0]]))
    assert half[135, 90] == pytest.approx(half[45, 90]) == pytest.approx(5.0)


@pytest.mark.parametrize("vertical", [[-90, -30, 0, 20, 90], [0, 20, 90]])
@pytest.mark.parametrize("horizontal", [[-90, -20, 0, 50, 90], [0, 30, 90]])
def test_type_b_lights_one_half_of_the_sphere(vertical, horizontal):
    """As a floodlight does, and as Cycles 5.0.1 renders; the other half was as bright, so that the flux was doubled."""
    even = np.full((len(horizontal), len(vertical)), 3.0)
    table = degrees(2, vertical, horizontal, even)
    np.testing.assert_allclose(table[:181], 3.0)
    assert not table[181:].any()
    # the flux by the standard's own angles: a hemisphere of 3 cd
    sines = np.sin(np.radians(np.arange(181.0)))
    assert np.radians(1) ** 2 * (table[:360] * sines).sum() == pytest.approx(3 * 2 * np.pi, rel=0.01)


def test_dark_dips_do_not_become_negative():
    table = degrees(1, [0, 30, 60, 90], [0], [[100, 0, 0, 100]])
    assert table.min() == 0.0


@pytest.mark.parametrize("after", ["\x1a", "END of file\n", "7 8\n"])
def test_what_follows_the_table_is_ignored(after):
    """Files from DOS end with Control-Z; Cycles reads as many numbers as the table has."""
    plain = text(1, [0, 45, 90], [0], [[9, 8, 7]])
    for ours, expected in zip(read_ies(plain + after), read_ies(plain), strict=True):
        np.testing.assert_array_equal(ours, expected)


def test_negative_candelas_are_kept_for_the_caller_and_give_no_light():
    vertical, around, strength = read_ies(text(1, [0, 30, 60, 90], [0], [[100, -50, 20, 0]]))
    np.testing.assert_allclose(strength / WATTS_PER_CANDELA, [[100, -50, 20, 0]])
    assert every_degree(vertical, around, strength).min() == 0.0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1 -1 1 3 1", "1 -1 1 nan 1", "this one 3, and then 'nan'"),
        ("1 -1 1 3 1", "1 -1 1 2.7 1", "whole number of vertical angles up to 65536; this one 2.7"),
        ("1 -1 1 3 1 1 2", "1 -1 1 3 1 1.5 2", "this one has 1.5"),
        ("TILT=NONE", "TILT=INCLUDE\n1 -4 0", "whole number of angles of tilt"),
        ("9 8 7", "9,0 8,0 7,5", "write 0.5 for 0,5"),
        ("9 8 7", "9 8", "needs 20 numbers; it has 19"),
        ("9 8 7", "9 8 x7", "it has 19, and then 'x7'"),
    ],
)
def test_damaged_tables_are_refused_with_what_is_wrong(old, new, said):
    plain = text(1, [0, 45, 90], [0], [[9, 8, 7]])
    with pytest.raises(FileFormatError, match=re.escape(said)):
        read_ies(plain.replace(old, new))
