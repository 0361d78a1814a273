# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes in files: bit-exact round trips, and errors that state their position in the file."""

from __future__ import annotations

import json
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.palette import (
    Cell,
    Conflict,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
    SubspaceCriterion,
    solve_palette,
)
from spectral_core.palette.files import read_palette, read_solution, write_palette, write_solution
from spectral_core.palette.presets import PRESETS, sine_light
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import WHITE_XYZ, linear_from_display_rgb
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

EXAMPLES = Path(__file__).parents[2] / "examples"
PALETTES = sorted(path for path in EXAMPLES.glob("*.toml") if "spectral-scene palette" in path.read_text("utf-8"))


def everything() -> PaletteProblem:
    """A problem that uses every field, with values away from their defaults."""
    grid = SpectralGrid(np.array([380.0, 410, 455, 500, 540, 590, 640, 700, 780]), "sampled")
    rng = np.random.default_rng(1)
    own = Illuminant('odd "name"\n\x7f', grid, rng.uniform(size=grid.size), source="a lab\tsomewhere")
    finer = Illuminant("finer", SpectralGrid.uniform(400, 700, 100), rng.uniform(size=4))
    lights = (
        PaletteLight(
            normalized(catalogue.illuminant("HP1"), luminance=3.0), variants=(catalogue.illuminant("A"), finer)
        ),
        PaletteLight(own, free=True, white_xyz=WHITE_XYZ, luminance=2.5),
        PaletteLight(finer, free=True, primaries=(finer, catalogue.illuminant("D65"))),
    )
    rows = (
        PaletteReflectance("free one"),
        PaletteReflectance("measured", catalogue.reflectance("dark skin")),
        PaletteReflectance("twin", Reflectance("sampled", grid, rng.uniform(size=grid.size))),
        PaletteReflectance("twin"),
    )
    cells = (
        (Cell.fixed([0.1, 1 / 3, 1.5], weight=2.0, exact=True), Cell.free(([0, 0, 0], [1, 1, 1])), Cell.black()),
        (Cell.ignore(), Cell.same_as((0, 1), box=([0.1] * 3, [0.9] * 3), weight=0.5), Cell.constant((1, 0), (1, 1))),
        (Cell.distinct_from((3, 0), (0, 0), weight=3.0), Cell.free(), Cell.ignore()),
        (Cell.black(exact=True), Cell.ignore(), Cell.ignore()),
    )
    return PaletteProblem(
        grid,
        lights,
        rows,
        cells,
        smoothness=0.3,
        smoothness_operator="thesis",
        match="perceptual",
        subspace=SubspaceCriterion(rng.normal(size=(9, 2)), weight=0.25, componentwise=False),
        reflectance_bounds=(-np.inf, 0.9),
        light_bounds=(-0.5, np.inf),
        rounds=7,
        scale_lights=True,
        observers=("cie_1931_2deg", "cie_1964_10deg"),
        robustness="worst_case",
        robust_weight=0.75,
    )


def assert_same(one: Any, other: Any, place: str = "problem", rounding: float = 0.0) -> None:
    """Field by field, to the bit; ``rounding``: what the numbers of arrays may differ by."""
    assert type(one) is type(other), place
    if isinstance(one, np.ndarray):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=rounding, err_msg=place)
    elif isinstance(one, (tuple, list)):
        assert len(one) == len(other), place
        for index, (a, b) in enumerate(zip(one, other, strict=True)):
            assert_same(a, b, f"{place}[{index}]", rounding)
    elif isinstance(one, SpectralGrid):
        assert one.same_as(other), place
    elif hasattr(one, "__dataclass_fields__"):
        for each in fields(one):
            if each.name != "state":
                assert_same(getattr(one, each.name), getattr(other, each.name), f"{place}.{each.name}", rounding)
    elif isinstance(one, float):
        assert one == other or np.isnan([one, other]).all(), place
    else:
        assert one == other, place


@pytest.mark.parametrize("ending", [".toml", ".json"])
@pytest.mark.parametrize("problem", [everything, *PRESETS.values()], ids=lambda make: make.__name__)
def test_problems_are_read_back_to_the_bit(tmp_path: Path, problem: Any, ending: str) -> None:
    written = problem()
    write_palette(tmp_path / f"p{ending}", written)
    assert_same(read_palette(tmp_path / f"p{ending}"), written)


def test_the_full_problem_uses_every_field() -> None:
    """Fails for a new field of the problem until this file, and so the test of files, has it."""
    problem = everything()
    for each in fields(problem):
        assert getattr(problem, each.name) is not each.default, each.name
    for kind, made in ((PaletteLight, problem.lights), (PaletteReflectance, problem.reflectances)):
        for each in fields(kind):
            assert any(getattr(one, each.name) is not each.default for one in made), each.name
    cells = [cell for row in problem.cells for cell in row]
    for each in fields(Cell):
        assert any(getattr(cell, each.name) is not each.default for cell in cells), each.name


@pytest.mark.parametrize("path", PALETTES, ids=lambda path: path.stem)
def test_examples_are_read_and_solved(path: Path) -> None:
    problem = read_palette(path)
    presets = {make.__name__: make for make in PRESETS.values()}
    if path.stem in presets:
        # the file was written on another processor, whose BLAS adds in another order
        assert_same(problem, presets[path.stem](), rounding=1e-14)
    status = solve_palette(problem).status
    # The three white lights of the preset smoke converge slowly to the last digit.
    assert status.usable if path.stem == "xray_smoke" else status.trusted


def test_every_preset_has_an_example() -> None:
    assert {make.__name__ for make in PRESETS.values()} <= {path.stem for path in EXAMPLES.glob("*.toml")}


def test_solutions_are_read_back(tmp_path: Path) -> None:
    solution = solve_palette(PRESETS["Metamer pair"]())
    write_solution(tmp_path / "s.json", solution)
    assert_same(read_solution(tmp_path / "s.json"), solution, "solution")
    json.loads((tmp_path / "s.json").read_text(), parse_constant=pytest.fail)  # JSON has no NaN
    with pytest.raises(InvalidInputError, match=r"solutions are written as \.json, got 's\.toml'"):
        write_solution(tmp_path / "s.toml", solution)


def test_conflicts_are_kept(tmp_path: Path) -> None:
    from dataclasses import replace

    plain = solve_palette(PRESETS["Metamer pair"]())
    told = replace(plain, conflicts=(Conflict((0, 1), 5.0, ((1, 1), (0, 0)), 0.5, "too red"),))
    write_solution(tmp_path / "s.json", told)
    assert_same(read_solution(tmp_path / "s.json").conflicts, told.conflicts)


HEAD = """format = "spectral-scene palette"
version = 1
grid = {start_nm = 400, stop_nm = 700, step_nm = 10}
lights = [{spectrum = "D65"}, {spectrum = "A"}]
reflectances = [{name = "one"}, {name = "two"}]
"""


def palette(folder: Path, text: str) -> PaletteProblem:
    (folder / "p.toml").write_text(text, encoding="utf-8")
    return read_palette(folder / "p.toml")


def test_abbreviations_of_documents(tmp_path: Path) -> None:
    grid = SpectralGrid.uniform()
    paint = Spectrum("paint", grid, np.linspace(0.1, 0.9, 31))
    write_spectra(tmp_path / "paints.csv", [paint, Spectrum("other", grid, np.zeros(31))])
    problem = palette(
        tmp_path,
        """format = "spectral-scene palette"
        version = 1
        grid = {start_nm = 400, stop_nm = 700, step_nm = 10}
        lights = [
            {spectrum = "D65"}, {name = "street", spectrum = {catalogue = "sodium", luminance = 2}},
            {name = "designed", free = true, spectrum = "D65"}, {free = true, spectrum = {sine_nm = 60}},
        ]
        reflectances = [{name = "a"}, {name = "b", spectrum = {file = "paints.csv", name = "paint"}}]
        cells = [
            {reflectance = "a", light = 0, mode = "fixed", color = "#808080"},
            {reflectance = 1, light = "street", mode = "same", others = [["a", "D65"]]},
        ]""",
    )
    np.testing.assert_array_equal(problem.cells[0][0].target, linear_from_display_rgb([128 / 255] * 3))
    assert problem.cells[1][1].others == ((0, 0),)
    assert [light.name for light in problem.lights] == ["D65", "street", "designed", "sine 60 nm"]
    assert xyz_of(problem.lights[1].spectrum)[1] == pytest.approx(2.0, rel=1e-9)
    assert problem.lights[2].spectrum.grid.same_as(grid)  # the start of a design is converted to its grid
    np.testing.assert_array_equal(problem.lights[3].spectrum.values, sine_light(60, grid).values)
    np.testing.assert_array_equal(problem.reflectances[1].spectrum.values, paint.values)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("format = ?\nversion = 1", r"p\.toml: Invalid value .*line 1.*; expected a palette in TOML"),
        ("format = 'gimp'\nversion = 1", r"p\.toml: format is \"gimp\"; expected 'spectral-scene palette'"),
        ("format = 'spectral-scene palette'\nversion = 1", r"p\.toml: the document has no 'grid'"),
        (HEAD.replace("scene palette", "scene"), r"format is \"spectral-scene\"; expected 'spectral-scene palette'"),
        (HEAD.replace("version = 1", "version = 2"), r"version is 2; expected 1"),
        (HEAD + "colour = 1", r"the document has the unknown entry 'colour'; known: \$schema, cells"),
        (HEAD.replace('"D65"', '"D66"'), r"lights\[0\]: no illuminant is named 'D66'; did you mean 'D65'"),
        (
            HEAD.replace('"D65"', "{values = [1, 2]}"),
            r"lights\[0\]: spectrum 'unnamed' has 2 values, its grid .* has 31",
        ),
        (HEAD.replace('"D65"', "{file = 'no.csv'}"), r"there is no file .*no\.csv"),
        (HEAD.replace('"D65"', "{}"), r"lights\[0\]: a spectrum gives nothing; expected one of"),
        (HEAD.replace('"D65"', "{values = [1]}"), r"lights\[0\]\.spectrum\.values has 1 entry; expected at least 2"),
        (HEAD.replace('"D65"', "3"), r"lights\[0\]\.spectrum is 3; expected a"),
        (HEAD.replace("step_nm = 10", "step_nm = 7"), r"no whole number of steps of 7 nm"),
        (HEAD.replace("step_nm = 10", "step_nm = 1e-4"), r"step_nm is 0\.0001"),
        (
            HEAD.replace("start_nm = 400", "start_nm = -3e12"),
            r"start_nm is -3000000000000\.0 nm; expected a value from",
        ),
        (HEAD.replace(", step_nm = 10", ""), r"grid gives start_nm, stop_nm; expected"),
        (HEAD + "[settings]\nsmoothness = -1", r"settings\.smoothness is -1; expected at least 0"),
        (HEAD + "[settings]\nmatch = 'rgb'", r"settings\.match is \"rgb\"; expected one of 'linear', 'perceptual'"),
        (HEAD + "[settings]\nobservers = ['cat']", r"no observer is named 'cat'"),
        (HEAD + "[settings]\nlight_bounds = [2, 1]", r"light_bounds are \(2\.0, 1\.0\); expected the lower one first"),
    ],
)
def test_errors_state_their_position(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        palette(tmp_path, text)


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        ("light = 'D65', mode = 'free'", r"cells\[0\] has no 'reflectance'"),
        (
            "reflectance = 'tow', light = 'D65', mode = 'free'",
            r"cells\[0\]: no reflectance is named 'tow'; did you mean",
        ),
        ("reflectance = 'one', light = 2, mode = 'free'", r"cells\[0\]: light number 2; expected 0 to 1"),
        ("reflectance = 'one', light = 0, mode = 'red'", r"cells\[0\]\.mode is \"red\"; expected one of 'fixed'"),
        ("reflectance = 'one', light = 0, mode = 'fixed'", r"cells\[0\]: a cell of mode fixed with target None"),
        ("reflectance = 'one', light = 0, mode = 'fixed', color = [1, 2]", r"color has 2 entries; expected 3"),
        ("reflectance = 'one', light = 0, mode = 'fixed', color = 'red'", r"color is \"red\"; expected #rrggbb"),
        ("reflectance = 'one', light = 0, mode = 'same', others = [['one', 0]]", r"cell \(0, 0\) is same with cell"),
    ],
)
def test_errors_in_cells(tmp_path: Path, cell: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        palette(tmp_path, HEAD + f"cells = [{{{cell}}}]")


def test_a_cell_that_is_stated_twice_is_refused(tmp_path: Path) -> None:
    cell = "{reflectance = 'one', light = 'A', mode = 'free'}"
    with pytest.raises(FileFormatError, match=r"cells\[1\] is the same cell as cells\[0\]"):
        palette(tmp_path, HEAD + f"cells = [{cell}, {cell}]")
    twins = HEAD.replace('"two"', '"one"')
    with pytest.raises(FileFormatError, match=r"2 reflectances are named 'one'; use its number"):
        palette(tmp_path, twins + f"cells = [{cell}]")


def test_json_errors_and_endings(tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"format": 1,', encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"p\.json: Expecting .* line 1 .*expected a palette in JSON"):
        read_palette(tmp_path / "p.json")
    (tmp_path / "p.json").write_text("[1]", encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"the document is \[1\]; expected a table"):
        read_palette(tmp_path / "p.json")
    with pytest.raises(FileFormatError, match=r"a list; expected the table of a palette solution"):
        read_solution(tmp_path / "p.json")
    (tmp_path / "p.json").write_text("{}", encoding="utf-8")
    with pytest.raises(FileFormatError, match=r"format None, version None, without \['actual_linear_rgb'"):
        read_solution(tmp_path / "p.json")
    with pytest.raises(InvalidInputError, match=r"cannot tell the format of 'p\.yaml'; name palettes \.toml or \.json"):
        write_palette(tmp_path / "p.yaml", everything())


def test_a_comment_is_written_at_the_top(tmp_path: Path) -> None:
    write_palette(tmp_path / "p.toml", everything(), comment="two\n\nlines = 3")
    text = (tmp_path / "p.toml").read_text("utf-8")
    assert text.startswith("# two\n#\n# lines = 3\n\nformat")
    assert tomllib.loads(text)["version"] == 1
