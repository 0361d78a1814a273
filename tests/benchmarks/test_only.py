# SPDX-License-Identifier: GPL-3.0-or-later
"""``--only`` chooses cases of a benchmark by their names."""

from __future__ import annotations

import pytest

from benchmarks import Options
from benchmarks.__main__ import main
from spectral_core.errors import UnknownNameError

NAMES = ("room", "mirror", "mirror caustic", "glass caustic", "sky", "sky image")


def test_words_choose_equal_names_or_else_all_that_contain_them() -> None:
    def only(*words: str) -> list[str]:
        return Options(extra=list(words)).only(NAMES)

    assert only() == list(NAMES)
    assert only("--only", "mirror") == ["mirror"]
    assert only("--only", "caustic") == ["mirror caustic", "glass caustic"]
    assert only("--only", "sky, room") == ["room", "sky"]
    with pytest.raises(UnknownNameError, match="mirror"):
        only("--only", "miror")


@pytest.mark.parametrize(
    "line",
    [
        ["palette-hard", "abc"],  # ended in a traceback
        ["palette-joint", "1", "2", "3", "4"],  # the fourth number was ignored
        ["mutation", "1.5"],
        ["render-closed-forms", "--only", "nosuch"],  # nothing ran, with status 0
        ["render-closed-forms", "--only"],
        ["viewport-latency", "nosuch"],  # all parts ran
        ["plan-effects", "nosuch"],  # as here, and in the next two
        ["cost-prediction", "nosuch"],
        ["shading-cost", "nosuch"],
        ["volume-stranger", "nosuch"],  # ended in a traceback, as the next one
        ["render-cycles", "somewhat strange"],
    ],
)
def test_words_that_a_benchmark_does_not_know_are_refused(line: list[str], capsys, tmp_path) -> None:
    assert main([*line, "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "expected" in said or "nown:" in said or "did you mean" in said


@pytest.mark.parametrize(
    ("name", "line", "expected"),
    [("fuzz", ["--inputs", "many"], "--inputs expects a whole number, as in --inputs 2000; got many"),
     ("fuzz", ["--seconds", "long"], "--seconds expects a number"), ("fuzz", ["--source"], "--source expects a word"),
     ("fault-kill", ["--kills"], "--kills expects a whole number, as in --kills 200; got none"),
     ("setup-kill", ["--seed", "1.5"], "--seed expects a whole number")],
)  # fmt: skip
def test_a_word_in_place_of_a_number_is_named(name: str, line: list[str], expected: str) -> None:
    """It ended in a traceback."""
    with pytest.raises(SystemExit, match=expected):
        main([name, *line])


@pytest.mark.parametrize("line", [["shading-hard", "nosuch"], ["render-noise", "nosuch"], ["setup-kill", "5"]])
def test_words_for_a_benchmark_that_reads_none_are_refused(line: list[str], capsys) -> None:
    """They were ignored, and the whole benchmark ran."""
    assert main(line) == 2
    assert f"takes no words; got {line[1]}" in capsys.readouterr().err
