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


def test_no_output_replaces_the_table_or_a_picture(table: Path, capsys) -> None:
    """``--out data.csv`` replaced the table by the page, ``--out ledger.sqlite`` a whole sweep."""
    image = pytest.importorskip("PIL.Image")
    image.new("RGB", (4, 4)).save(table / "one.png")
    text = (table / "data.csv").read_text().splitlines()
    (table / "data.csv").write_text("\n".join([text[0] + ",FILE", *(f"{line},one.png" for line in text[1:])]) + "\n")
    before = {path.name: path.read_bytes() for path in table.iterdir()}
    for name in ("data.csv", "ledger.sqlite", "page"):
        assert main(["explore", str(table), "--out", str(table / name)]) == 1
        assert "the page ends in .html; got --out" in capsys.readouterr().err
    for option in (["--figure"], ["--columns", "v1", "--time", "v2", "--error-time"]):
        assert main(["explore", str(table), *option, str(table / "one.png")]) == 1
        assert "one.png is read by this command and would be lost" in capsys.readouterr().err
    both = str(table / "a.png")
    assert main(["explore", str(table), "--figure", both, "--error-time", both]) == 1
    assert "--figure and --error-time both name" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in table.iterdir()} == before


def test_texts_are_no_errors_and_no_variable_is_drawn_twice(table: Path, capsys) -> None:
    (table / "data.csv").write_text("t,e,word\n1,2,a\n2,1,b\n")
    for columns, time in (("word", "t"), ("e", "word")):
        words = ["explore", str(table), "--error-time", str(table / "e.png"), "--columns", columns, "--time", time]
        assert main(words) == 1
        assert "the column 'word' holds texts; errors and times are numbers" in capsys.readouterr().err
    assert main(["explore", str(table), "--figure", str(table / "m.png"), "--columns", "e", "e"]) == 1
    assert "the variables are e, e; a figure shows 2 to 12, each once" in capsys.readouterr().err


def test_an_empty_name_is_refused(table: Path, tmp_path: Path, capsys, monkeypatch) -> None:
    """It named the present folder: a sweep with ``--out "$X"`` of an unset X went beside that folder."""
    monkeypatch.chdir(tmp_path)
    for words in (["explore", ""], ["explore", ".", "--out", " "], ["sweep", "s.toml", "--out", ""]):
        with pytest.raises(SystemExit) as ended:
            main(words)
        assert ended.value.code == 2 and "the name is empty; expected a file or folder" in capsys.readouterr().err


@pytest.mark.parametrize("option", [["--pending"], ["--plan", "--pending"], ["--share", "1/2"], ["--collect"]])
def test_listed_points_need_a_folder_that_lists_them(option: list[str], tmp_path: Path, capsys, monkeypatch) -> None:
    """With a misspelled folder an empty sweep was made, and the command reported success."""
    monkeypatch.chdir(tmp_path)
    Path("f.py").write_text("def f(a):\n    return {'y': a}\n")
    Path("s.toml").write_text(
        '[compute]\nkind = "function"\nfunction = "f.py:f"\n[[parameters]]\nname = "a"\nlow = 0\nhigh = 4\n'
    )
    assert main(["sweep", "s.toml", "--out", "other", *option]) == 1
    assert "takes points that a folder lists, and other.cdb holds no sweep" in capsys.readouterr().err
    assert not Path("other.cdb").exists()
