# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures and analyses of ``spectral-scene explore`` on a table that lacks what they need."""

from __future__ import annotations

from pathlib import Path

import pytest

from spectral_core.cli import main


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A Cinema table of ten columns without pictures and without columns of error."""
    names = [f"v{number}" for number in range(10)]
    rows = [",".join(str(number * row) for number in range(1, 11)) for row in (1, 2, 3)]
    (tmp_path / "data.csv").write_text("\n".join([",".join(names), *rows]) + "\n")
    return tmp_path


def test_error_against_time_without_an_error_names_the_option(table: Path, capsys) -> None:
    """It ended in a traceback of the drawing library."""
    assert main(["explore", str(table), "--error-time", str(table / "e.png")]) == 1
    assert "has none of rmse, delta_e_mean, flip; name columns with --columns" in capsys.readouterr().err


def test_a_figure_says_which_columns_it_leaves_out(table: Path, capsys) -> None:
    pytest.importorskip("matplotlib")
    assert main(["explore", str(table), "--figure", str(table / "m.png")]) == 0
    assert "shows 8 of 10 variables; name others with --columns: v8, v9" in capsys.readouterr().out
    assert main(["explore", str(table), "--figure", str(table / "m.png"), "--columns", "v0", "v9"]) == 0
    assert "note" not in capsys.readouterr().out


def test_an_analysis_with_the_number_0_is_not_left_out(table: Path, capsys) -> None:
    assert main(["explore", str(table), "--clusters", "0"]) == 1
    assert "--clusters needs a sweep's folder" in capsys.readouterr().err


def test_a_derived_column_without_numbers_is_named(tmp_path: Path, capsys, monkeypatch) -> None:
    """The column was empty at these points, and nothing said so."""
    monkeypatch.chdir(tmp_path)
    Path("f.py").write_text("def f(a):\n    return {'y': a - 2}\n")
    Path("s.toml").write_text(
        '[compute]\nkind = "function"\nfunction = "f.py:f"\n[[parameters]]\nname = "a"\nlow = 0\nhigh = 4\n'
        'kind = "integer"\n[design]\nbudget = 5\n'
    )
    assert main(["sweep", "s.toml"]) == 0
    capsys.readouterr()
    assert main(["explore", "s", "--derive", "q", "1 / y", "--derive", "r", "y * 2"]) == 0
    said = capsys.readouterr().err
    assert "note: 'q' has no finite value at 1 of 5 points" in said and "'r'" not in said
