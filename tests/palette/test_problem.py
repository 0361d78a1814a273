# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems refuse contradictory input with a remedy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import GridMismatchError, InvalidInputError, UnknownNameError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, presets, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.cell import CellMode
from spectral_core.palette.conflicts import conflicting_cells
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.presets import PRESETS, design_grid, split_light
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

D65 = normalized(illuminant("D65"))
GREY = (0.2, 0.2, 0.2)


def problem(*rows: tuple[Cell, ...], **settings: object) -> PaletteProblem:
    materials = tuple(PaletteReflectance(f"r{i}") for i in range(len(rows)))
    return PaletteProblem(design_grid(), (PaletteLight(D65),), materials, rows, **settings)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Cell.fixed((0.1, 0.2)), "target color of a cell has shape"),
        (lambda: Cell.fixed((0.1, np.nan, 0.2)), "not finite"),
        (lambda: Cell.fixed(GREY, weight=-1), "weight of a cell is -1"),
        (lambda: Cell("fixed"), "'fixed' and only it has one"),
        (lambda: Cell("same"), "refers to 0 other cells"),
        (lambda: Cell.free(((0.5, 0, 0), (0.1, 1, 1))), "swap its ends"),
        (lambda: problem((Cell.fixed(GREY), Cell.fixed(GREY))), "lengths"),
        (lambda: problem((Cell.same_as((3, 0)),)), "another cell of the table"),
        (lambda: problem((Cell.same_as((0, 0)),)), "another cell of the table"),
        (lambda: problem((Cell.fixed(GREY),), (Cell.constant((0, 0)),)), "in the same row"),
        (lambda: problem((Cell.fixed(GREY),), match="cielab"), "match is 'cielab'"),
        (lambda: problem((Cell.fixed(GREY),), rounds=0), "rounds is 0"),
        (lambda: problem((Cell.fixed(GREY),), reflectance_bounds=(1.0, 0.0)), "the lower one first"),
        (lambda: PaletteProblem(design_grid(), (), (), ()), "at least one of its lights"),
        (lambda: PaletteLight(D65, luminance=2.0), "is fixed, so luminance cannot be required"),
        (lambda: PaletteLight(D65, free=True, variants=(D65,)), "only a measured light can have variants"),
        (lambda: split_light().with_cells({(9, 9): Cell.ignore()}), "outside the table of 5×3"),
    ],
)
def test_contradictory_input_is_refused(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()


def test_a_designed_light_must_be_on_the_grid():
    with pytest.raises(GridMismatchError, match="use .resampled"):
        PaletteProblem(
            design_grid(),
            (PaletteLight(D65, free=True),),
            (PaletteReflectance("r"),),
            ((Cell.fixed(GREY),),),
        )


def test_an_error_names_an_unknown_observer():
    with pytest.raises(UnknownNameError, match="no observer is named 'cie_1932'"):
        problem((Cell.fixed(GREY),), observers=("cie_1932",))


@pytest.mark.parametrize("exact", [False, True])
def test_boxes_without_a_common_color_are_a_conflict_that_names_their_cells(exact: bool) -> None:
    low, high = ((0.1,) * 3, (0.2,) * 3), ((0.5,) * 3, (0.7,) * 3)
    apart = problem(
        (Cell.same_as((2, 0), box=low, exact=exact),),
        (Cell.fixed(GREY),),
        (Cell.same_as((0, 0), box=high, exact=exact),),
    )
    solution = solve_palette(apart)
    assert solution.status == ("exact_conflict" if exact else "compromise")
    np.testing.assert_allclose(solution.actual_linear_rgb[[0, 2], 0], 0.35, atol=0.01)  # the middle of the gap
    assert solution.delta_e_2000[0, 0] > 5 and solution.delta_e_2000[2, 0] > 5
    names = [f"“{apart.reflectances[row].name}” under “{apart.lights[0].name}”" for row in (0, 2)]
    assert any(f"boxes of {names[0]}, {names[1]} have no color in common" in note for note in solution.notes)
    assert conflicting_cells(solution) == (((0, 0), (2, 0)) if exact else ())
    widened = apart.with_cell((0, 0), Cell.same_as((2, 0), exact=exact))
    assert solve_palette(widened).status == "solved"


def test_weights_are_limited_to_ten_thousand_with_a_message():
    requests = compiled_requests(problem((Cell.fixed(GREY, weight=1e12),), (Cell.fixed(GREY),), (Cell.fixed(GREY),)))
    weights = [target.weight for target in requests.targets]
    assert max(weights) / min(weights) == pytest.approx(1e4)
    assert any("ratio of 10000" in note for note in requests.notes)
    assert compiled_requests(problem((Cell.fixed(GREY, weight=1000.0),), (Cell.fixed(GREY),))).notes == ()


def test_same_cells_form_one_group_in_any_order():
    rows = ((Cell.same_as((2, 0)),), (Cell.same_as((0, 0)),), (Cell.fixed(GREY),), (Cell.same_as((1, 0), weight=3.0),))
    (group,) = compiled_requests(problem(*rows)).groups
    assert group.members == ((0, 0), (1, 0), (2, 0), (3, 0))


@pytest.mark.parametrize("name", list(PRESETS))
def test_presets_build_and_stay_editable(name):
    preset = PRESETS[name]()
    assert replace(preset, smoothness=0.5).smoothness == 0.5
    assert preset.grid.wavelengths_nm[0] == 380.0
    assert preset.grid.interpolation == "linear"


@pytest.mark.parametrize("mode", list(CellMode))
def test_only_cells_with_references_accept_others(mode):
    target = np.array(GREY) if mode is CellMode.FIXED else None
    box = (np.zeros(3), np.ones(3)) if mode is CellMode.FREE else None
    refers = mode in (CellMode.SAME, CellMode.CONSTANT, CellMode.DISTINCT)
    wrong = ((),) if refers else (((0, 0),), ((0, 0), (1, 1)))
    wrong += (((0, 0), (1, 0)),) if mode is CellMode.SAME else ()
    for others in wrong:
        with pytest.raises(InvalidInputError, match=rf"refers to {len(others)} other cells?;"):
            Cell(mode, target=target, others=others, box=box)
    Cell(mode, target=target, others=((0, 0),) if refers else (), box=box)


@pytest.mark.parametrize("size", [1e31, 1e300])
def test_numbers_whose_squares_overflow_are_refused(size: float) -> None:
    """A target of 1e300 was called solved."""
    grid = SpectralGrid.uniform(400, 700, 100)
    bright = Illuminant("sun", grid, np.full(grid.size, size))
    with pytest.raises(InvalidInputError, match=r"the target color of a cell is .*expected a value from 0.0 to 1e\+30"):
        Cell.fixed((0.2, -size, 0.2))
    with pytest.raises(InvalidInputError, match=r"box's greatest color is .*expected a value from 0.0 to 1e\+30"):
        Cell.free(((0, 0, 0), (1, size, np.inf)))
    with pytest.raises(InvalidInputError, match="the largest number of light 'sun' is"):
        PaletteLight(bright)
    plain = Illuminant("plain", grid, np.ones(grid.size))
    with pytest.raises(InvalidInputError, match="the largest number of light 'sun' is"):
        PaletteLight(plain, variants=(bright,))
    with pytest.raises(InvalidInputError, match="the largest number of light 'sun' is"):
        PaletteLight(plain, free=True, primaries=(plain, bright))


def test_a_distinct_cell_of_weight_0_has_no_request() -> None:
    problem = presets.most_distinct(3)
    assert wants_distinct(problem)
    none = {
        (i, j): replace(cell, weight=0.0)
        for i, row in enumerate(problem.cells)
        for j, cell in enumerate(row)
        if cell.mode is CellMode.DISTINCT
    }
    assert not wants_distinct(problem.with_cells(none))
