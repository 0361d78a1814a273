# SPDX-License-Identifier: GPL-3.0-or-later
"""The climb to two lights: its colors, gradients, starts and steps against direct computation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.texture import lights as module
from spectral_core.palette.texture.lights import STARTING_PEAKS_NM, _Climb, design_lights, led, led_range
from spectral_core.palette.texture.reach import TEXTURE_GRID, reachable_scales
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, delta_e_2000, lab_from_xyz
from spectral_core.spectra.observer import normalized, xyz_from_product, xyz_of

LEDS = [led(peak, 25) for peak in (440, 470, 500, 530, 560, 600, 640)]


def test_a_led_has_its_peak_and_its_width_at_half_maximum() -> None:
    nm = np.arange(380.0, 781.0)
    values = led(520.0, 30.0).values
    assert values[140] == 1.0 and values[155] == pytest.approx(0.5) and values[125] == pytest.approx(0.5)
    np.testing.assert_allclose(values, 0.5 ** (((nm - 520) / 15) ** 2), rtol=1e-9)
    peaks = [light.grid.wavelengths_nm[light.values.argmax()] for light in led_range()]
    np.testing.assert_array_equal(peaks, np.arange(430.0, 671.0, 5.0))
    assert len(led_range(10, 500, 520, 10)) == 3
    for width in (1.9, 201.0):
        with pytest.raises(InvalidInputError, match="LED width"):
            led(500, width)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_starts_have_the_wanted_white_with_the_nearest_primaries(share: float) -> None:
    climb = _Climb(LEDS, 0.05, share, None)
    found = climb.start(STARTING_PEAKS_NM[0])
    daylight = normalized(illuminant("D65"))
    rest = WHITE_XYZ - (share * xyz_from_product(daylight, TEXTURE_GRID).sum(axis=1) if share else 0)
    stimuli = np.stack([xyz_from_product(each, TEXTURE_GRID).sum(axis=1) for each in LEDS])
    np.testing.assert_allclose(found @ stimuli, np.stack([rest, rest]), atol=1e-9)
    centers = np.array([440, 470, 500, 530, 560, 600, 640.0])
    for row, peaks in zip(found, STARTING_PEAKS_NM[0], strict=True):
        cost = 1 + (np.abs(centers[:, None] - np.array(peaks)).min(axis=1) / 10) ** 2
        least = linprog(cost, A_eq=stimuli.T, b_eq=rest, bounds=(0, None)).fun
        assert cost @ row == pytest.approx(least, rel=1e-9)
    # the lights themselves have that white, and the luminance 1
    for light in climb.lights(found):
        xyz = xyz_of(light)
        np.testing.assert_allclose(xyz, WHITE_XYZ, atol=2e-3)
        assert xyz[1] == pytest.approx(1.0, abs=1e-9)
        assert climb.white_error(light) == pytest.approx(
            float(delta_e_2000(lab_from_xyz(xyz), lab_from_xyz(WHITE_XYZ / WHITE_XYZ[1]))), abs=1e-6
        )


@pytest.mark.parametrize("share", [0.0, 0.4])
def test_colors_and_gradients_of_the_climb(share: float) -> None:
    climb = _Climb(LEDS, 0.05, share, None)
    amounts = climb.start(STARTING_PEAKS_NM[1])
    matrix = climb.matrix(amounts)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-9)  # the wanted white is (1, 1, 1)
    daylight = normalized(illuminant("D65"))
    for row, part in zip(amounts, np.split(matrix, 2), strict=True):
        xyz = sum(a * xyz_from_product(each, TEXTURE_GRID) for a, each in zip(row, LEDS, strict=True))
        xyz = xyz + share * xyz_from_product(daylight, TEXTURE_GRID)
        np.testing.assert_allclose(part, RGB_FROM_XYZ @ xyz / (RGB_FROM_XYZ @ WHITE_XYZ)[:, None], atol=1e-9)
    reach = reachable_scales(matrix, climb.corners, 0.05)
    gradients = climb._gradients(reach)
    rng = np.random.default_rng(1)
    change = 1e-7 * rng.normal(size=amounts.shape) * amounts.max()
    ahead, behind = (reachable_scales(climb.matrix(amounts + s * change), climb.corners, 0.05).scales for s in (1, -1))
    numeric = (ahead - behind) / 2
    predicted = np.einsum("vlm,lm->v", gradients, change)
    inner = reach.scales < 0.95 - 1e-6
    assert inner.sum() > 20
    close = np.abs(numeric - predicted)[inner] <= 1e-3 * np.abs(predicted).max()
    assert close.mean() > 0.9  # a program whose active bounds change has two derivatives


def test_a_step_keeps_the_white_and_the_trust_region() -> None:
    climb = _Climb(LEDS, 0.05, 0.0, None)
    amounts = climb.start(STARTING_PEAKS_NM[2])
    reach = reachable_scales(climb.matrix(amounts), climb.corners, 0.05)
    gradients = climb._gradients(reach)
    radius = 0.1
    step = climb._step(amounts, reach.scales, gradients, radius)
    np.testing.assert_allclose(step @ climb.whites.T, 0.0, atol=1e-9)
    assert np.all(amounts + step >= -1e-12)
    limit = radius * amounts.max(axis=1, keepdims=True)
    assert np.all(np.abs(step) <= limit + 1e-12) and np.any(np.abs(step) >= limit * (1 - 1e-9))
    linear = reach.scales + np.einsum("vlm,lm->v", gradients, step)
    assert linear.min() > reach.scales.min()


def test_the_design_climbs_from_three_starts() -> None:
    found = design_lights(LEDS, floor=0.1, iterations=4)
    assert len(found.starts) == 3 and max(found.starts) == pytest.approx(found.slope, rel=1e-3)
    assert 3 <= found.iterations <= 12 and found.floor == 0.1 and max(found.white_delta_e) < 0.3
    climb = _Climb(LEDS, 0.1, 0.0, None)
    begin = [
        reachable_scales(climb.matrix(climb.start(peaks)), climb.corners, 0.1).scales.min()
        for peaks in STARTING_PEAKS_NM
    ]
    assert all(end >= start - 1e-9 for start, end in zip(begin, found.starts, strict=True))
    assert sum(found.starts) > sum(begin) + 1e-3
    slope, amounts, used = climb.run(climb.start(STARTING_PEAKS_NM[0]), 2)
    assert used == 2 and slope >= begin[0]
    assert slope == pytest.approx(reachable_scales(climb.matrix(amounts), climb.corners, 0.1).scales.min())


def test_limits_of_light_designs() -> None:
    for wrong in ({"floor": 0.004}, {"floor": 0.51}, {"daylight_share": 0.91}, {"daylight_share": -0.1}):
        with pytest.raises(InvalidInputError):
            design_lights(LEDS, **wrong)
    with pytest.raises(InvalidInputError, match="at least 6 primaries; got 5"):
        design_lights(LEDS[:5])
    with pytest.raises(SolveError, match="no mix of the 6 primaries"):
        design_lights([led(peak, 10) for peak in (600, 610, 620, 630, 640, 650)])
    assert module.MOST_ITERATIONS == 40
    warm = design_lights(LEDS, daylight=illuminant("A"), daylight_share=0.2, iterations=1)
    for light in warm.lights:
        xyz, wanted = xyz_of(light), xyz_of(illuminant("A"))
        np.testing.assert_allclose(xyz / xyz[1], wanted / wanted[1], atol=5e-3)
