# SPDX-License-Identifier: GPL-3.0-or-later
"""Parser of one command's words: an error is one line that says what to do."""

from __future__ import annotations

import argparse
import difflib
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from spectral_core.cli.shared.terminal import one_line
from spectral_core.errors import InvalidInputError

NEGATIVE = re.compile(r"-(\.?\d|(inf|infinity|nan)$)", re.IGNORECASE)
"""Start of a word that is a value, not an option: no option of a command starts with a digit or is named so."""

_STORE = type(argparse.ArgumentParser().add_argument("--option"))
"""Class of options that keep one value; argparse gives it no public name."""


class CommandParser(argparse.ArgumentParser):
    """Parser without a page of usage before each error, and with values such as ``-1e-3`` and ``-0.5,0.3``."""

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        # argparse of before Python 3.14 takes only -1 and -1.5 for numbers, and other such words for options
        self._negative_number_matcher = NEGATIVE

    def parse_known_args(self, *given: Any, **options: Any) -> Any:
        """The arguments and the words that are left, see argparse; an option that is given twice is refused."""
        self._given: dict[str, Any] = {}
        return super().parse_known_args(*given, **options)

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        """The value of an argument. Of two different ones for an option, argparse would take the last in silence."""
        value = super()._get_values(action, arg_strings)
        if action.option_strings and type(action) is _STORE:
            first = self._given.setdefault(action.dest, value)
            if _words(first) != _words(value):  # as words: NaN differs from itself
                raise argparse.ArgumentError(
                    action, f"given twice, as {_words(first)} and {_words(value)}; give it once"
                )
        return value

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        """The value of a word. An empty one is what a shell makes of a variable that is not set: it is refused.

        Shells leave the ``~`` of ``--out=~/pictures`` as it is; the folder would have this name.
        """
        if not arg_string.strip():
            if action.type is Path:
                raise argparse.ArgumentError(action, "the name is empty; expected a file or folder")
            # of a pair one may be empty, as a label of rows; a command's own parser sees its words
            if action.type is None and action.nargs not in (2, argparse.PARSER):
                raise argparse.ArgumentError(action, "the value is empty; give one, or leave the option out")
        if arg_string == "-" and action.type is Path:
            raise argparse.ArgumentError(action, "'-' names no file, as commands read and write files only; use ./-")
        try:
            return super()._get_value(action, _with_home(arg_string))
        except argparse.ArgumentError as error:
            if action.type not in (int, float):
                raise
            expected = "a whole number" if action.type is int else "a number"
            raise argparse.ArgumentError(action, f"got {arg_string!r}; expected {expected}") from error

    def error(self, message: str) -> NoReturn:
        """Print the error in one line and exit with 2."""
        end = "" if message.endswith("?") else "."
        self.exit(2, f"{self.prog}: {one_line(message)}{end} See `{self.prog} --help`\n")

    def refuse(self, words: Sequence[str]) -> NoReturn:
        """Name words that the command does not take, with the options that resemble them."""
        if any(word.startswith("-") and word in self._option_string_actions for word in words):
            self.error(f"not understood: {', '.join(map(repr, words))}; write options before '--'")
        known = [option for action in self._actions for option in action.option_strings]
        near = [each for word in words for each in difflib.get_close_matches(word.partition("=")[0], known, n=1)]
        hint = f"; did you mean {' or '.join(near)}?" if near else ""
        self.error(f"not understood: {', '.join(map(repr, words))}{hint}")

    def refuse_unused(self, arguments: argparse.Namespace, unused: Mapping[str, str]) -> None:
        """Raise InvalidInputError for an option that was given and that this call would ignore.

        ``unused``: name of each such option, and why it has no effect.
        """
        for action in self._actions:
            if action.dest in unused and getattr(arguments, action.dest) != action.default:
                name = _option_of(action, getattr(arguments, action.dest))
                raise InvalidInputError(f"{name} has no effect here: {unused[action.dest]}")


def _option_of(action: argparse.Action, value: Any) -> str:
    """Name of the option that gave a value: ``--denoise`` or ``--no-denoise``, for one."""
    if isinstance(action, argparse.BooleanOptionalAction) and value:
        return action.option_strings[0]
    return action.option_strings[-1] if action.option_strings else action.dest


def _words(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def _with_home(word: str) -> str:
    """A word that begins with ``~/`` with the user's home folder instead."""
    return os.path.expanduser(word) if word.startswith(("~/", f"~{os.sep}")) else word  # noqa: PTH111


def by_option(message: str, named: Mapping[str, str]) -> str:
    """The message of the library with the option in place of the library's own name of a number, where it begins so.

    ``named``: option of each such name, as ``NAMED`` of a command's module states it.
    """
    for name, option in named.items():
        if message.startswith(f"{name} "):
            return option + message.removeprefix(name)
    return message


def without_companion(arguments: argparse.Namespace, needs: Mapping[str, str]) -> dict[str, str]:
    """Options whose companion is not given, for ``refuse_unused``. ``needs``: options, and what each of them needs."""
    missing = {name: other for name, other in needs.items() if not getattr(arguments, other)}
    return {name: f"it needs --{other.replace('_', '-')}" for name, other in missing.items()}
