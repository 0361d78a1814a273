# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette in other units of brightness has the same spectra, the same status, and its colors times the unit."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from spectral_core.palette import (
    Cell,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    PaletteSession,
    PaletteSolution,
    PaletteStatus,
    solve_palette,
)
from spectral_core.palette.alternatives import alternatives
from spectral_core.palette.brightness_unit import brightness_unit
from spectral_core.palette.design import rounds
from spectral_core.palette.presets import design_grid
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import WHITE_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

GRID = SpectralGrid(np.linspace(400.0, 700.0, 31))
DAYLIGHT, SODIUM = (normalized(illuminant(name)) for name in ("D65", "HP1"))
START = Illuminant("lamp", GRID, 0.01 + 0.005 * np.sin(GRID.wavelengths_nm / 50))
LEDS = tuple(
    Illuminant(f"{nm} nm", GRID, np.exp(-(((GRID.wavelengths_nm - nm) / 15) ** 2))) for nm in (450, 520, 560, 620)
)
PAPER = PaletteReflectance("paper", Reflectance("paper", GRID, np.linspace(0.2, 0.6, 31)))
SIZES = [1e-8, 1e-6, 1e6, 1e8]


def lights_of(kind: str, size: float) -> tuple[PaletteLight, ...]:
    daylight, start = PaletteLight(DAYLIGHT.scaled(size)), START.scaled(size)
    if kind == "given":
        return daylight, PaletteLight(SODIUM.scaled(size), variants=(normalized(illuminant("HP2")).scaled(size),))
    if kind == "designed":
        return daylight, PaletteLight(start, free=True, luminance=2 * size, white_xyz=WHITE_XYZ)
    return daylight, PaletteLight(start, free=True, primaries=LEDS)


def palette(kind: str, size: float, seed: int = 0, **settings) -> PaletteProblem:
    """Three materials, one of them measured, under daylight and another light."""
    colors = size * np.random.default_rng(seed).uniform(0.05, 0.4, (3, 2, 3))
    box = size * np.zeros(3), size * np.array([1.0, np.inf, 1.0])
    cells = (
        (Cell.fixed(colors[0, 0], exact=True), Cell.fixed(colors[0, 1])),
        (Cell.same_as((0, 0), box=box, exact=True), Cell.fixed(colors[1, 1])),
        (Cell.ignore(), Cell.fixed(colors[2, 1])),
    )
    surfaces = PaletteReflectance("mark"), PaletteReflectance("wall"), PAPER
    return PaletteProblem(GRID, lights_of(kind, size), surfaces, cells, **settings)


@cache
def near_one(kind: str) -> PaletteSolution:
    """Of the palette near 1, with which those of all sizes are compared. Smooth spectra settle in fewer rounds."""
    return solve_palette(palette(kind, 1.0, smoothness=1.0))


@pytest.mark.parametrize(("kind", "size"), [("given", 1e-8), ("given", 1e8), ("designed", 1e-8), ("primaries", 1e8)])
def test_spectra_and_status_do_not_depend_on_the_unit(kind: str, size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rounds, "thread_time", lambda: 0.0)  # no budget ends on a busy machine
    monkeypatch.setattr(rounds, "perf_counter", lambda: 0.0)
    plain, other = near_one(kind), solve_palette(palette(kind, size, smoothness=1.0))
    assert other.status is plain.status
    assert any(f"relative to a white of {size:g}" in note for note in other.notes)
    assert not any("relative to a white" in note for note in plain.notes)
    np.testing.assert_allclose(other.state.colors(), other.actual_linear_rgb, rtol=1e-9, atol=1e-12 * size)
    if kind == "designed":  # from one start there are several optima, and last digits decide which is found
        np.testing.assert_allclose(xyz_of(other.illuminants[1]), 2 * size * WHITE_XYZ / WHITE_XYZ[1], rtol=1e-6)
        return
    np.testing.assert_allclose(other.delta_e_2000, plain.delta_e_2000, atol=1e-4)
    np.testing.assert_allclose(other.actual_linear_rgb / size, plain.actual_linear_rgb, atol=1e-6)
    np.testing.assert_allclose(other.residuals["color"] / size, plain.residuals["color"], rtol=1e-3, atol=1e-9)
    for one, two in zip(plain.reflectances, other.reflectances, strict=True):
        np.testing.assert_allclose(two.values, one.values, atol=1e-3)
    for one, two in zip(plain.illuminants, other.illuminants, strict=True):
        np.testing.assert_allclose(xyz_of(two) / size, xyz_of(one), rtol=1e-3)
    for one, two in zip(plain.amounts, other.amounts, strict=True):
        assert (one is None) is (two is None)
        if one is not None:
            np.testing.assert_allclose(two / size, one, rtol=1e-2, atol=1e-3 * one.max())


@pytest.mark.parametrize("size", SIZES)
def test_exact_cells_conflict_and_hold_in_every_unit(size: float) -> None:
    for level, status in ((0.5, "solved"), (2.0, "exact_conflict")):
        cells = ((Cell.fixed([level * size] * 3, exact=True),),)
        lights = (PaletteLight(DAYLIGHT.scaled(size)),)
        solution = solve_palette(PaletteProblem(GRID, lights, (PaletteReflectance("paint"),), cells))
        assert solution.status == status


def test_a_warm_start_and_brightened_lights_keep_their_unit() -> None:
    first = solve_palette(palette("designed", 1e6))
    again = solve_palette(palette("designed", 1e6), warm=first)
    # a busy machine may end either before it is optimal, then 0.005 of the unit apart
    found = {first.status, again.status}
    assert found <= {PaletteStatus.COMPROMISE, PaletteStatus.IMPROVING}
    atol = 1e3 if found == {PaletteStatus.COMPROMISE} else 3e4
    np.testing.assert_allclose(again.actual_linear_rgb, first.actual_linear_rgb, atol=atol)
    scaled = [solve_palette(replace(palette("given", each), scale_lights=True)) for each in (1.0, 1e6)]
    assert scaled[1].light_scale == pytest.approx(scaled[0].light_scale, rel=1e-6)
    light = scaled[1].illuminants[0]
    assert xyz_of(light)[1] == pytest.approx(1e6 * scaled[1].light_scale, rel=1e-6)


@pytest.mark.parametrize("size", [1e-9, 1e6])
def test_alternatives_are_those_of_the_palette_near_one(size: float) -> None:
    cells = ((Cell.fixed([0.3 * size] * 3, exact=True), Cell.ignore()), (Cell.fixed([0.2 * size] * 3), Cell.ignore()))
    lights = tuple(PaletteLight(light.scaled(size)) for light in (DAYLIGHT, SODIUM))
    surfaces = PaletteReflectance("mark"), PaletteReflectance("wall")
    found = alternatives(PaletteProblem(GRID, lights, surfaces, cells))
    assert len(found) == 4
    assert min(each.apart for each in found[1:]) > 5
    for each in found:
        assert each.solution.status == "solved"
        np.testing.assert_allclose(each.solution.actual_linear_rgb[0, 0], 0.3 * size, rtol=1e-6)


@pytest.mark.parametrize(
    ("light", "color", "unit"),
    [(1.0, 0.3, 1.0), (1e6, 0.3, 1.0), (1e6, 1e9, 1e6), (0.999999999e6, 1e6, 1e6), (3e-5, 1e-5, 1e-5), (6.0, 1e9, 1.0)],
)
def test_only_palettes_far_from_one_in_all_numbers_have_a_unit(light: float, color: float, unit: float) -> None:
    lights = (PaletteLight(DAYLIGHT.scaled(light)),)
    given = PaletteProblem(design_grid(), lights, (PaletteReflectance("paint"),), ((Cell.fixed([color] * 3),),))
    assert brightness_unit(given) == unit


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", ["given", "primaries"])
def test_a_live_session_counts_in_the_unit_and_returns_given_colors(kind: str, size: float) -> None:
    color, session = np.array([0.02, 0.9, 0.1]), PaletteSession(palette(kind, size))
    live = session.edit((1, 1), Cell.fixed(size * color))
    found = session.solution()
    assert found.status.usable and any(f"relative to a white of {size:g}" in note for note in found.notes)
    np.testing.assert_allclose(session.problem.cells[1][1].target, size * color, rtol=1e-15)
    np.testing.assert_allclose(live.target_linear_rgb[1, 1], size * color, rtol=1e-9)
    for one in (live, found):
        assert one.problem is session.problem
        shown = one.actual_linear_rgb
        np.testing.assert_allclose(one.state.colors(), shown, rtol=1e-9, atol=1e-12 * size)
        expected = delta_e_2000(lab_from_linear_rgb(color), lab_from_linear_rgb(shown[1, 1] / size))
        np.testing.assert_allclose(one.delta_e_2000[1, 1], expected, atol=1e-6)
    if kind == "given":  # one side alone has one optimum, whatever the time
        plain = PaletteSession(palette(kind, 1.0)).edit((1, 1), Cell.fixed(color))
        for one in (plain, solve_palette(session.problem, explain=False)):
            np.testing.assert_allclose(found.delta_e_2000, one.delta_e_2000, atol=1e-3)


def test_an_edit_of_a_live_session_may_change_its_unit() -> None:
    bright = palette("given", 1e4)
    session = PaletteSession(bright)
    plain = {(i, j): Cell.fixed((0.1, 0.2, 0.3)) for i in range(3) for j in range(2)}
    assert session.edit_cells(plain).unit == 1
    assert session.edit((0, 0), Cell.fixed((5e3, 4e3, 3e3))).unit == 1e4
    lights = palette("given", 1.0).lights
    live = session.change(lights=lights, cells=palette("given", 1.0).cells)
    assert live.unit == 1 and session.solution().status is solve_palette(palette("given", 1.0)).status
