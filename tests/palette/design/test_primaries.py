# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights mixed from primaries: the returned spectrum is the one that was designed."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


def test_a_light_of_primaries_is_returned_as_it_was_designed() -> None:
    """Narrow LEDs between the samples of the palette: the returned light had been resampled on its grid."""
    grid = SpectralGrid.uniform(380, 780, 20)
    fine = np.arange(380.0, 781.0, 2.0)
    narrow = [
        normalized(Illuminant(f"{peak:g}", SpectralGrid(fine), np.exp(-0.5 * ((fine - peak) / 6) ** 2)))
        for peak in (451.0, 530.0, 607.0)
    ]
    # One that does not end at zero, inside the range of the others.
    band = Illuminant("band", SpectralGrid(np.array([500.0, 580.0])), np.array([0.002, 0.004]))
    start = normalized(Illuminant("start", grid, np.ones(grid.size)))
    light = PaletteLight(start, free=True, primaries=(*narrow, band), white_xyz=np.array([0.95, 1.0, 1.09]))
    cells = ((Cell.fixed((0.4, 0.3, 0.2)),), (Cell.fixed((0.2, 0.3, 0.4)),))
    solution = solve_palette(
        PaletteProblem(grid, (light,), (PaletteReflectance("a"), PaletteReflectance("b")), cells), seconds=0.5
    )
    (shone,) = solution.illuminants
    assert solution.amounts[0][2:].min() > 0
    for surface, shown in zip(solution.reflectances, solution.actual_linear_rgb[:, 0], strict=True):
        np.testing.assert_allclose(RGB_FROM_XYZ @ xyz_of(shone, surface), shown, rtol=5e-5, atol=1e-6)
    white = xyz_of(shone)
    np.testing.assert_allclose(white / white[1], (0.95, 1.0, 1.09), rtol=5e-5)


@pytest.mark.parametrize("is_day_exact", [False, True])
@pytest.mark.parametrize("white", [None, (0.9505, 1.0, 1.089)])
def test_a_mixture_beside_an_exact_cell_is_as_good_as_the_best_of_a_grid_of_measured_lights(
    white: tuple[float, float, float] | None, is_day_exact: bool
) -> None:
    """The exact cell held the brightness of the light as it began: the first color was missed by ΔE 10.8."""
    fine = np.arange(380.0, 781.0)
    narrow = [Illuminant(f"{p}", SpectralGrid(fine), 0.02 * np.exp(-(((fine - p) / 10) ** 2))) for p in (450, 535, 615)]
    asked = (((0.3, 0.3, 0.3), (0.4, 0.2, 0.1)), ((0.2, 0.3, 0.1), (0.1, 0.2, 0.1)))

    def under(light: PaletteLight) -> PaletteProblem:
        return PaletteProblem(
            SpectralGrid.uniform(380, 780, 10),
            (PaletteLight(normalized(illuminant("D65"))), light),
            (PaletteReflectance("a"), PaletteReflectance("b")),
            tuple(
                (Cell.fixed(day, exact=is_day_exact and day[0] < 0.3), Cell.fixed(night, exact=True))
                for day, night in asked
            ),
        )

    mixtures = [
        Illuminant("mixture", SpectralGrid(fine), np.array(amounts) @ [one.values for one in narrow])
        for amounts in product((1.0, 2.0), repeat=3)
    ]
    by_hand = [solve_palette(under(PaletteLight(mixture)), explain=False) for mixture in mixtures]
    least = min(float(each.delta_e_2000.max()) for each in by_hand if each.status == "solved")
    xyz = None if white is None else np.array(white)
    light = PaletteLight(normalized(illuminant("D65")), free=True, primaries=tuple(narrow), white_xyz=xyz)
    solution = solve_palette(under(light), explain=False)
    assert solution.delta_e_2000.max() <= max(least, 0.5)
    assert solution.status in ("solved", "still_improving")


def test_many_free_lights_of_a_required_white_are_the_inner_side() -> None:
    """SLSQP needs seconds for one step of twelve free spectra: colors that were met were missed by ΔE 11."""
    from dataclasses import replace

    from spectral_core.palette.assemble.requests import compiled_requests
    from spectral_core.palette.design.lights import outer_side
    from spectral_core.palette.presets import design_grid

    grid = design_grid(5.0)
    white = normalized(illuminant("D65")).resampled(grid)
    for count, side in ((3, "lights"), (12, "reflectances")):
        lights = tuple(
            PaletteLight(replace(white, name=f"L{j}"), free=True, white_xyz=np.array([0.95, 1.0, 1.09]))
            for j in range(count)
        )
        row = tuple(Cell.fixed((0.2, 0.3, 0.4), exact=j % 2 == 0) for j in range(count))
        problem = PaletteProblem(grid, lights, (PaletteReflectance("paint"),), (row,))
        assert outer_side(problem, compiled_requests(problem)) == side


@pytest.mark.parametrize("most", [np.inf, 0.8])
@pytest.mark.parametrize("factor", [1e-25, 1e-12, 1e12, 1e25])
def test_the_unit_of_the_primaries_does_not_matter(factor: float, most: float) -> None:
    """Primaries of 1e-12 were inaccurate with ΔE 12, those of 1e12 invisible in other palettes."""

    def solved(unit: float):
        fine = np.arange(380.0, 781.0)
        leds = [
            Illuminant(f"{p}", SpectralGrid(fine), unit * 0.02 * np.exp(-(((fine - p) / 10) ** 2)))
            for p in (450, 535, 615)
        ]
        day = normalized(illuminant("D65"))
        return solve_palette(
            PaletteProblem(
                SpectralGrid.uniform(380, 780, 10),
                (PaletteLight(day), PaletteLight(day, free=True, primaries=tuple(leds))),
                (PaletteReflectance("a"), PaletteReflectance("b")),
                (
                    (Cell.fixed((0.3, 0.3, 0.3)), Cell.fixed((0.4, 0.2, 0.1))),
                    (Cell.fixed((0.2, 0.3, 0.1), exact=True), Cell.fixed((0.1, 0.2, 0.1))),
                ),
                light_bounds=(0.0, most / unit),
            ),
            explain=False,
        )

    plain, scaled = solved(1.0), solved(factor)
    assert plain.status == scaled.status == "solved"
    assert scaled.max_delta_e_2000 == pytest.approx(plain.max_delta_e_2000, rel=1e-2)
    np.testing.assert_allclose(factor * scaled.amounts[1], plain.amounts[1], rtol=1e-3)
    assert (factor * scaled.amounts[1]).max() <= most * (1 + 1e-12)
    shone = scaled.illuminants[1]
    for surface, shown in zip(scaled.reflectances, scaled.actual_linear_rgb[:, 1], strict=True):
        np.testing.assert_allclose(RGB_FROM_XYZ @ xyz_of(shone, surface), shown, rtol=5e-5, atol=1e-6)
