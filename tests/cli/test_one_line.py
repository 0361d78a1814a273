# SPDX-License-Identifier: GPL-3.0-or-later
"""A failure is one line, whatever the names in it contain; a word that is no number is said to be none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from spectral_core.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
ODD = "a\nb\x1b[31m\r\u2028c.toml"


@pytest.mark.parametrize(
    "words",
    [["design", ODD], ["relight", ODD, "--out", "x.png"], ["sweep", ODD], ["mix", "cyan:1", "--light", ODD],
     ["volume", ODD, "--transfer", "wide"]],
)  # fmt: skip
def test_names_with_line_ends_and_escapes(words: list[str], capsys: Any) -> None:
    """The message had a line for each line of the name, and colored the terminal."""
    assert main(words) == 1
    error = capsys.readouterr().err
    assert error.endswith("\n") and len(error.splitlines()) == 1
    assert "\x1b" not in error and r"a\nb" in error


def test_unknown_words_with_line_ends(capsys: Any) -> None:
    with pytest.raises(SystemExit, match="^2$"):
        main(["mix", "cyan:1", "--law", ODD])
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "expected"),
    [(["lattice", "--dims", "1.5"], "--dims: got '1.5'; expected a whole number"),
     (["lattice", "--ball", "round"], "--ball: got 'round'; expected a number"),
     (["lattice", "--points", ""], "--points: got ''; expected a whole number")],
)  # fmt: skip
def test_no_number(words: list[str], expected: str, capsys: Any) -> None:
    """It was an "invalid int value"."""
    with pytest.raises(SystemExit, match="^2$"):
        main(words)
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [["sweep", "s.toml", "--dask", ""], ["explore", "f.cdb", "--reference="], ["relight", "t.exr", "--mix", " "],
     ["recipe", "paints", "p.csv", "--target", ""], ["volume", "", "--transfer", "wide"], ["design", "--preset", ""]],
)  # fmt: skip
def test_empty_values_are_refused(words: list[str], capsys: Any) -> None:
    """``sweep --dask "$SCHEDULER"`` without that variable computed on this machine, without a word."""
    with pytest.raises(SystemExit, match="^2$"):
        main(words)
    assert "is empty" in capsys.readouterr().err


@pytest.mark.parametrize("count", ["0", "-1", "99999999999999999999"])
def test_shares_are_counted_before_points_are_listed(count: str, tmp_path: Path, capsys: Any) -> None:
    """A huge count of commands was printed without an end; 0 was refused after the folder was made."""
    document = tmp_path / "s.toml"
    document.write_text((EXAMPLES / "sweeps/palette.toml").read_text("utf-8"), "utf-8")
    (tmp_path.parent / "metamer_pair.toml").write_text((EXAMPLES / "metamer_pair.toml").read_text("utf-8"), "utf-8")
    assert main(["sweep", str(document), "--out", str(tmp_path / "made"), "--shell", count]) == 1
    assert "--shell is" in capsys.readouterr().err
    assert not (tmp_path / "made.cdb").exists()
