# SPDX-License-Identifier: GPL-3.0-or-later
"""Parser of one command's words: an error is one line that says what to do."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Sequence
from typing import NoReturn


class CommandParser(argparse.ArgumentParser):
    """Parser without a page of usage before each error."""

    def error(self, message: str) -> NoReturn:
        """Print the error in one line and exit with 2."""
        end = "" if message.endswith("?") else "."
        self.exit(2, f"{self.prog}: {message}{end} See `{self.prog} --help`\n")

    def refuse(self, words: Sequence[str]) -> NoReturn:
        """Name words that the command does not take, with the options that resemble them."""
        known = [option for action in self._actions for option in action.option_strings]
        near = [each for word in words for each in difflib.get_close_matches(word.partition("=")[0], known, n=1)]
        hint = f"; did you mean {' or '.join(near)}?" if near else ""
        self.error(f"not understood: {', '.join(map(repr, words))}{hint}")
