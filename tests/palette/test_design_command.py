# SPDX-License-Identifier: GPL-3.0-or-later
"""``spectral-scene design``: files, status and exit codes."""

from __future__ import annotations

import json

import pytest

from blender_addon.commands import main
from spectral_core.palette import Cell
from spectral_core.palette.files import read_solution, read_swatches, write_palette
from spectral_core.palette.presets import hidden_mark
from spectral_core.spectra.files import read_spectra


def last_object(text: str) -> dict:
    return json.loads(text.strip().splitlines()[-1])


def test_a_preset_is_designed_and_written(tmp_path, capsys):
    assert main(["design", "--preset", "hidden mark", "--out", str(tmp_path), "--json"]) == 0
    figures = last_object(capsys.readouterr().out)
    assert figures["status"] == "solved"
    assert sorted(figures["files"]) == sorted(path.name for path in tmp_path.iterdir())
    assert read_solution(tmp_path / "solution.json").max_delta_e_2000 == pytest.approx(figures["max_delta_e_2000"])
    assert [surface.name for surface in read_spectra(tmp_path / "reflectances.csv")] == ["mark", "ground"]
    assert len(read_swatches(tmp_path / "swatches.gpl")) == 4
    assert (tmp_path / "palette.png").read_bytes().startswith(b"\x89PNG")


def test_a_palette_file_with_conflicting_exact_cells_fails_with_a_reason(tmp_path, capsys):
    problem = hidden_mark()
    problem = problem.with_cell(
        (0, 1), Cell.fixed((0.0, 0.9, 0.9), exact=True)
    )  # no surface is blue under sodium light
    write_palette(tmp_path / "hopeless.toml", problem)
    status = main(["design", str(tmp_path / "hopeless.toml"), "--out", str(tmp_path / "out"), "--json"])
    figures = last_object(capsys.readouterr().out)
    assert status == 1
    assert figures["status"] == "exact_conflict"
    assert figures["conflicts"][0].startswith("“mark” under")
    assert (tmp_path / "out" / "solution.json").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give either a palette file or --preset"),
        (["--preset", "hidden marc"], "did you mean 'Hidden mark'"),
        (["nowhere.toml"], "nowhere.toml"),
        (["--preset", "Hidden mark", "--rounds", "0"], "rounds is 0"),
    ],
)
def test_wrong_calls_print_one_clear_line(arguments, message, capsys):
    assert main(["design", *arguments]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) == 1
