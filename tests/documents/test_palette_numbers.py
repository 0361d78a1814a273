# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that JSON has no word for, and NumPy's own numbers, in palette documents."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.files import read_palette, read_solution, write_palette, write_solution
from spectral_core.palette.presets import design_grid
from spectral_core.palette.problem import SubspaceCriterion
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant

OPEN = ((0.1, -np.inf, 0.0), (0.4, np.inf, np.inf))


def problem() -> PaletteProblem:
    lights = (PaletteLight(normalized(illuminant("D65"))), PaletteLight(normalized(illuminant("A"))))
    cells = ((Cell.free(OPEN), Cell.same_as((0, 0), box=OPEN)),)
    return PaletteProblem(design_grid(), lights=lights, reflectances=(PaletteReflectance("wall"),), cells=cells)


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_an_open_side_of_a_box_is_kept(tmp_path, ending) -> None:
    file = tmp_path / f"open.{ending}"
    write_palette(file, problem())
    for cell in read_palette(file).cells[0]:
        np.testing.assert_array_equal(cell.box, OPEN)


def test_an_open_side_of_a_box_is_kept_in_a_solution(tmp_path) -> None:
    write_solution(tmp_path / "open.json", solve_palette(problem()))
    np.testing.assert_array_equal(read_solution(tmp_path / "open.json").problem.cells[0][0].box, OPEN)


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_numbers_of_numpy_are_written_as_numbers(tmp_path, ending) -> None:
    file = tmp_path / f"numbers.{ending}"
    basis = SubspaceCriterion(np.ones((problem().grid.size, 1)), np.float64(2.5), np.bool_(False))
    given = replace(problem(), rounds=np.int64(40), scale_lights=np.bool_(True), subspace=basis)
    write_palette(file, given)
    found = read_palette(file)
    assert (found.rounds, found.scale_lights) == (40, True)
    assert (found.subspace.weight, found.subspace.componentwise) == (2.5, False)


def test_a_start_light_as_a_reflectance_is_refused_with_the_reason(tmp_path) -> None:
    file = tmp_path / "sine.toml"
    write_palette(file, problem())
    text = file.read_text("utf-8").replace('name = "wall"', 'name = "wall"\nspectrum = {sine_nm = 60}')
    file.write_text(text, "utf-8")
    with pytest.raises(FileFormatError, match=r"reflectances\[0\]: the spectrum 'sine 60 nm' is a light"):
        read_palette(file)


def test_a_comment_with_many_dots_is_no_key(tmp_path) -> None:
    file = tmp_path / "scene.toml"
    write_palette(file, problem(), comment="Scene a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r = 1")
    assert read_palette(file).grid.same_as(problem().grid)


def test_a_key_with_many_dots_is_refused_once(tmp_path) -> None:
    file = tmp_path / "dots.toml"
    file.write_text(".".join("abcdefghijklmnopqrs") + " = 1", "utf-8")
    with pytest.raises(FileFormatError, match="a key has over 16 dots; expected a plain name$") as raised:
        read_palette(file)
    assert str(raised.value).count("dots.toml") == 1


@pytest.mark.parametrize(
    "text",
    [
        "x = {a" + ".a" * 20 + " = 1}",
        "[a" + ".a" * 20 + "]",
        "a" + ".a" * 20,
        'x = [0.5, 0.25]\ny = """\n\'""", z' + ".a" * 20 + " = ''",
        '"a,"' + '."a,"' * 20 + " = 1",
    ],
)
def test_a_key_with_many_dots_is_refused_wherever_it_is(tmp_path, text: str) -> None:
    file = tmp_path / "dots.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(FileFormatError, match=f"line {text.count(chr(10)) + 1}: a key has over 16 dots"):
        read_palette(file)


def test_a_subspace_with_rows_of_short_numbers_reads_back(tmp_path) -> None:
    """A row that needs several lines is followed by short rows and, on the same line, by the next key."""
    given = problem()
    basis = np.eye(given.grid.size, 8)
    basis[0] = np.random.default_rng(11).random(8)
    basis[3:6] = 0.0
    given = replace(given, subspace=SubspaceCriterion(basis, 0.5))
    write_palette(tmp_path / "a.toml", given)
    back = read_palette(tmp_path / "a.toml").subspace
    assert back is not None and back.weight == 0.5
    np.testing.assert_array_equal(back.basis, basis)


@pytest.mark.parametrize("name", ["sine 1.2.3 nm", "sine . nm", "sine 0 nm", "sine 0.0 nm", "sine 60 nm"])
def test_a_light_that_is_named_like_a_sine_reads_back(tmp_path, name: str) -> None:
    given = problem()
    light = Illuminant(name, given.grid, np.linspace(0.25, 1.0, given.grid.size))
    given = replace(given, lights=(replace(given.lights[0], spectrum=light), *given.lights[1:]))
    write_palette(tmp_path / "a.toml", given)
    back = read_palette(tmp_path / "a.toml").lights[0].spectrum
    assert back.name == name
    np.testing.assert_array_equal(back.values, light.values)


def test_a_sine_without_a_period_is_refused_at_its_place(tmp_path) -> None:
    file = tmp_path / "sine.toml"
    write_palette(file, problem())
    text = file.read_text("utf-8") + "\n[[lights]]\nspectrum = {sine_nm = 0}\n"
    file.write_text(text, "utf-8")
    with pytest.raises(FileFormatError, match=r"lights\[\d\]: the period of a sine light is 0 nm; expected at least"):
        read_palette(file)
