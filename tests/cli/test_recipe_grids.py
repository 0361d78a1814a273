# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes of paints that were measured at different wavelengths."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from spectral_core.cli import main
from spectral_core.palette.paint.mixtures import paint_mixture
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid, common_grid

NM = np.arange(400.0, 701.0, 20.0)
GRID = SpectralGrid(NM)
RED = Reflectance("red", GRID, 0.06 + 0.6 / (1 + np.exp((590 - NM) / 12)))
BLUE = Reflectance("blue", GRID, 0.07 + 0.5 * np.exp(-(((NM - 460) / 45) ** 2)))


def recipe(folder: Path, paints: list[Reflectance], target: Reflectance, capsys) -> tuple[dict, str]:
    """The figures of a recipe, and its printed text."""
    write_spectra(folder / "paints.csv", paints)
    write_spectra(folder / "target.csv", [target])
    words = ["recipe", "paints", str(folder / "paints.csv"), "--target", str(folder / "target.csv"), "--json"]
    assert main(words) == 0
    printed = capsys.readouterr().out
    return json.loads(printed[printed.index("{") :]), printed


def test_a_paint_of_two_samples_does_not_coarsen_the_others(tmp_path: Path, capsys) -> None:
    white = Reflectance("white", SpectralGrid([400.0, 700.0]), [0.85, 0.85])
    parts = paint_mixture([0.5, 0.3, 0.2], np.stack([np.full(NM.size, 0.85), RED.values, BLUE.values]))
    # A peak that the two samples of the white do not show, so that no mixture is exact.
    target = Reflectance("wanted", GRID, parts + 0.1 * np.exp(-(((NM - 540) / 30) ** 2)))
    found = [recipe(tmp_path, paints, target, capsys) for paints in ([RED, BLUE, white], [white, RED, BLUE])]
    first, second = (figures["amounts"] for figures, _ in found)
    assert second == pytest.approx(first, abs=1e-3)
    assert found[1][0]["delta_e"] == pytest.approx(found[0][0]["delta_e"], abs=1e-2)
    assert found[0][0]["delta_e"]["D65"] > 3
    assert "note:" not in found[1][1]


def test_paints_of_different_ranges_are_compared_where_all_are_measured(tmp_path: Path, capsys) -> None:
    part = SpectralGrid(NM[2:-1])
    short = Reflectance("blue", part, BLUE.at(part.wavelengths_nm))
    parts = paint_mixture([0.7, 0.3], np.stack([RED.values, BLUE.values]))
    figures, printed = recipe(tmp_path, [RED, short], Reflectance("wanted", GRID, parts), capsys)
    assert figures["amounts"]["red"] == pytest.approx(0.7, abs=0.01)
    assert "note: the recipe has 440 to 680 nm, the range that all spectra have ('red' 400 to 700 nm, " in printed


def test_paints_without_a_common_range_are_refused(tmp_path: Path, capsys) -> None:
    far = Reflectance("far", SpectralGrid([720.0, 800.0]), [0.5, 0.5])
    write_spectra(tmp_path / "paints.csv", [RED, far])
    assert main(["recipe", "paints", str(tmp_path / "paints.csv"), "--target", "dark skin"]) != 0
    assert "no wavelength is in all spectra ('red' 400 to 700 nm, 'far' 720 to 800 nm" in capsys.readouterr().err


def test_equal_grids_stay_as_they_are() -> None:
    sampled = SpectralGrid(NM, "sampled")
    assert common_grid([Reflectance("a", sampled, np.full(NM.size, 0.5))] * 2, "all") == (sampled, "")
    cut, note = common_grid([RED, Reflectance("b", SpectralGrid([405.0, 695.0]), [0.1, 0.2])], "all")
    np.testing.assert_array_equal(cut.wavelengths_nm, [405.0, *NM[1:-1], 695.0])
    assert note.startswith("all has 405 to 695 nm")
