# SPDX-License-Identifier: GPL-3.0-or-later
"""``--only`` chooses cases of a benchmark by their names."""

from __future__ import annotations

import importlib

import pytest

from benchmarks import Options
from benchmarks.__main__ import known, main
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
        ["relight-memory", "nosuch"],
        ["render-files", "nosuch"],
        ["volume-speed", "engine", "shells"],  # the second volume was ignored
        ["viewport-against-cycles", "nosuch"],
        ["render-start", "--only", "nosuch"],  # nothing ran, with status 0
        ["spectral-textures", "--pictures", "one.png"],
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


def _arguments_that_no_benchmark_reads() -> list[list[str]]:
    """A lone word for each benchmark that declares none, and one more word after each option than it takes."""
    lines = []
    for name, file in known().items():
        module = importlib.import_module(f"benchmarks.{file.parent.name}.{file.stem}")
        if hasattr(module, "WORDS"):
            continue
        lines.append([name, "nosuch"])
        for option, *words in map(str.split, getattr(module, "OPTIONS", ())):
            if not " ".join(words).endswith("…"):
                lines.append([name, option, *("1" for _ in words), "nosuch"])
    return lines


def test_words_that_no_benchmark_reads_are_refused(capsys, monkeypatch, tmp_path) -> None:
    """Most ignored them, and the whole benchmark ran."""
    lines = _arguments_that_no_benchmark_reads()
    assert len(lines) > 60
    for line in lines:
        module = importlib.import_module(f"benchmarks.{known()[line[0]].parent.name}.{line[0].replace('-', '_')}")
        monkeypatch.setattr(module, "run", lambda _, line=line: pytest.fail(f"{line} ran"))
        assert main([*line, "--out", str(tmp_path)]) == 2
        assert "takes no words; got nosuch" in capsys.readouterr().err, line
