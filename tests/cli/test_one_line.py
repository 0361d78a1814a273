# SPDX-License-Identifier: GPL-3.0-or-later
"""A failure is one line, whatever the names in it contain; a word that is no number is said to be none."""

from __future__ import annotations

from typing import Any

import pytest

from spectral_core.cli import main

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
