# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that an option cannot have: the error names the option, not the argument of the library that it becomes."""

from __future__ import annotations

import argparse
import importlib
import shutil
from pathlib import Path

import numpy as np
import pytest

from spectral_core import cli
from spectral_core.cli.shared.parser import by_option
from spectral_core.spectra.pictures import write_picture

EXAMPLES = Path(__file__).parents[2] / "examples"
WRONG = ("nan", "inf", "-1", "1e30")
BASES = {
    "lamp": ["recipe", "lamp", "leds.csv", "--cct", "4000"],
    "paints": ["recipe", "paints", "paints.csv", "--target", "dark skin"],
    "texture": ["texture", "a.png", "b.png", "--light", "D65", "--light", "A"],
    "wanted": ["texture", "a.png", "--light", "D65", "--light", "A", "--want", "#a02020", "#604020"],
    "design": ["design", "--preset", "Metamer pair"],
    "lattice": ["lattice", "--dims", "2", "--points", "4"],
    "volume": ["volume", "sample:shells:8", "--transfer", "wide", "--size", "4", "4", "--quality", "draft"],
    "sweep": ["sweep", "sweeps/palette.toml", "--plan"],
    "explore": ["explore", "done.cdb"],
}
TAKEN = {"volume --azimuth -1", "volume --elevation -1", "volume --raw-offset -1", "lattice --low -1",
         "lattice --ball inf", "lattice --ball 1e30", "lattice --high 1e30", "volume --spacing 1e30"}  # fmt: skip
"""Wrong for others, not for these options."""


def test_every_word_without_an_option_reads_in_the_help_as_in_errors() -> None:
    """Errors about a missing one asked for "kind", which no help has."""
    for module in cli.command_packages(["blender_addon.commands"]).values():
        parser = argparse.ArgumentParser()
        importlib.import_module(module).add_arguments(parser)
        for action in parser._actions:
            assert action.option_strings or (action.metavar and str(action.metavar) in parser.format_help()), module


def numbers(command: str) -> list[argparse.Action]:
    """The options of a command that take whole numbers or others."""
    parser = argparse.ArgumentParser()
    importlib.import_module(cli.command_packages([])[command]).add_arguments(parser)
    return [action for action in parser._actions if action.type in (int, float)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("options")
    (made / "sweeps").mkdir()
    for name in ("leds.csv", "paints.csv", "sweeps/palette.toml", "metamer_pair.toml"):
        shutil.copy(EXAMPLES / name, made / name)
    assert cli.main(["sweep", f"{made}/sweeps/palette.toml", "--budget", "2", "--out", f"{made}/done.cdb"]) == 0
    for name in "ab":
        write_picture(made / f"{name}.png", np.full((2, 3, 3), 0.4, np.float32))
    return made


def with_option(base: list[str], action: argparse.Action, value: str) -> list[str]:
    option = action.option_strings[-1]
    if option in base:
        index, count = base.index(option), action.nargs if isinstance(action.nargs, int) else 1
        return [*base[: index + 1], *[value] * count, *base[index + 1 + count :]]
    return [*base, option, *[value] * (action.nargs if isinstance(action.nargs, int) else 1)]


@pytest.mark.parametrize("name", BASES)
def test_errors_name_the_option(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    command, silent, tried = BASES[name][0], [], 0
    for action in numbers(command):
        option = action.option_strings[-1]
        for value in WRONG:
            if f"{command} {option} {value}" in TAKEN or (action.type is int and value in ("nan", "inf", "1e30")):
                continue
            try:
                status = cli.main(with_option(BASES[name], action, value))
            except SystemExit as end:
                status = end.code
            error, tried = capsys.readouterr().err, tried + 1
            if not status or option not in error:
                silent.append(f"{option} {value}: {status}, {error.strip()[-200:]}")
    assert not silent
    assert tried >= 1


def test_only_the_beginning_of_a_message_is_replaced() -> None:
    named = {"p": "--ball", "rate": "--rate"}
    assert by_option("p is 0; expected 1 <= p", named) == "--ball is 0; expected 1 <= p"
    assert by_option("rates differ: rate is 4", named) == "rates differ: rate is 4"
    assert by_option("the file is empty", {}) == "the file is empty"
