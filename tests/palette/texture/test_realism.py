# SPDX-License-Identifier: GPL-3.0-or-later
"""Realism of two lights by its table and integrals, and the fast method of texels alone."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture import basis, nearest, realism
from spectral_core.palette.texture.reach import TEXTURE_GRID, stimulus_matrix
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Illuminant

D65, HP1 = illuminant("D65"), illuminant("HP1")


def test_realism_is_the_table_and_linear_slopes_between() -> None:
    for i, width in enumerate(realism.LED_WIDTHS_NM):
        for j, share in enumerate(realism.DAYLIGHT_SHARES):
            found = realism.realism_cost(share, width)
            assert found.contrast == pytest.approx(realism._CONTRAST[i, j])
            assert found.rendering_delta_e == pytest.approx(realism._RENDERING[i, j])
    between = realism.realism_cost(0.05, 15.0)
    assert between.contrast == pytest.approx((20.0 + 18.98 + 19.89 + 17.39) / 4)
    assert between.rendering_delta_e == pytest.approx((10.8 + 10.5 + 11.1 + 10.2) / 4)
    # two thirds of the way from 0.7 to 1, where nothing is left
    beyond = realism.realism_cost(0.9, 10.0)
    assert beyond.contrast == pytest.approx(1 + (3.27 - 1) / 3) and beyond.rendering_delta_e == pytest.approx(4.2 / 3)
    assert realism.realism_cost(0.0, 5.0).contrast == 20.0
    for share, width in ((-0.01, 20), (0.91, 20), (0.1, 4.9), (0.1, 60.1)):
        with pytest.raises(InvalidInputError):
            realism.realism_cost(share, width)


def test_whites_differ_for_other_observers_as_their_integrals_do() -> None:
    found = realism.white_differences([D65, HP1])
    for each in found:
        eye = observer(each.observer)
        fine = np.linspace(360, 830, 9401)
        table = np.array([np.interp(fine, eye.wavelengths_nm, row, left=0, right=0) for row in eye.cmfs])

        def white(light: Illuminant, table: np.ndarray = table, fine: np.ndarray = fine) -> np.ndarray:
            xyz = table @ light.at(fine)
            return xyz / xyz[1]

        lab = lab_from_linear_rgb(RGB_FROM_XYZ @ (white(HP1) / white(D65) * WHITE_XYZ))
        expected = float(delta_e_2000(lab, lab_from_linear_rgb(np.ones(3))))
        assert each.to_daylight == pytest.approx(expected, rel=1e-3)
        assert each.between == pytest.approx(expected, rel=1e-3)
    assert realism.white_differences([HP1])[0].between == 0.0
    patches = np.stack([reflectance(name).at(TEXTURE_GRID.wavelengths_nm) for name in ("foliage", "light skin")])
    assert realism.rendering_delta_e(D65, patches, TEXTURE_GRID) == pytest.approx(0.0, abs=1e-9)
    under = [lab_from_linear_rgb((stimulus_matrix([light]) @ patches.T).T) for light in (HP1, D65)]
    expected = float(np.mean([delta_e_2000(a, b) for a, b in zip(*under, strict=True)]))
    assert realism.rendering_delta_e(HP1, patches, TEXTURE_GRID) == pytest.approx(expected, rel=1e-9)


def test_the_page_has_the_table_of_realism() -> None:
    """Two digits of contrast, and the color errors, by width of the LEDs."""
    page = (Path(__file__).parents[3] / "docs" / "spectral_textures.md").read_text("utf-8")
    rows = re.findall(r"^\| (\d+) nm \| ([\d., ]+) \| ([\d., ]+) \|$", page, re.MULTILINE)
    assert [float(width) for width, *_ in rows] == realism.LED_WIDTHS_NM.tolist()
    for (_, contrasts, errors), measured, rendering in zip(rows, realism._CONTRAST, realism._RENDERING, strict=True):
        np.testing.assert_allclose(list(map(float, contrasts.split(","))), measured, rtol=0.05)
        np.testing.assert_array_equal(list(map(float, errors.split(","))), rendering)
    assert realism.DAYLIGHT_SHARES.tolist() == [0, 0.1, 0.2, 0.3, 0.5, 0.7]


@pytest.mark.parametrize("lights", [1, 2])
def test_multipliers_of_bounds_settle_for_nearly_all_texels(lights: int) -> None:
    """The fast method in the multipliers alone: it settles, and the gradient vanishes where a weight is free."""
    lamps = [D65, HP1][:lights]
    matrix = stimulus_matrix(lamps)
    own = matrix @ basis.design_basis(matrix, 3 * lights, floor=0.1, iterations=4).spectra.T
    search = nearest.NearestInBox(own, (1.0,) * lights)
    assert search.invertible
    rng = np.random.default_rng(5)
    outside = rng.uniform(-0.08, 1.08, (3 * lights, 400))
    wanted = np.clip(own @ outside, 0.01, None).astype(np.float32)
    target = nearest._f(search.ratio_from_rgb @ wanted)[0]
    weights = np.full((3 * lights, 400), 0.5, np.float32)
    left = search._by_multipliers(target, weights, np.arange(400))
    outside = np.linalg.solve(own, wanted)
    some = np.any((outside < 0) | (outside > 1), axis=0)
    assert some.sum() > 20 and (~some).sum() > 20 and len(left) < 0.1 * 400
    settled = np.setdiff1d(np.arange(400), left)
    inside = np.setdiff1d(settled, np.flatnonzero(some))
    np.testing.assert_allclose(weights[:, inside], outside[:, inside], atol=3e-3)

    def missed(w: np.ndarray, k: int) -> float:
        shown, asked = (lab_from_linear_rgb(each.reshape(lights, 3)) for each in (own @ w, wanted[:, k].astype(float)))
        return float(np.sum((shown - asked) ** 2))

    for k in np.intersect1d(settled, np.flatnonzero(some))[:12]:
        here = weights[:, k].astype(float)
        base = missed(here, k)
        for axis in range(3 * lights):
            for step in (-2e-2, 2e-2):
                moved = here.copy()
                moved[axis] = np.clip(moved[axis] + step, 0, 1)
                assert missed(moved, k) > base - 0.02 * max(base, 1.0)
