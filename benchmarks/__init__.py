# SPDX-License-Identifier: GPL-3.0-or-later
"""Every figure that the docs name is printed from here: ``python -m benchmarks NAME [--json]``.

A benchmark is a module in one of this package's folders (``palette/palette_speed.py``); what it measures and what it
checks with are in folders below that. It is called by its name with dashes (``palette-speed``), the first line of its
docstring is its description, and its ``run(options)`` prints a readable report and returns the figures as one flat or
nested dict of plain numbers, strings and lists. Its entry ``holds`` maps each claim to True or False; the claims are
printed after the report. Nothing is claimed that was not measured in this run. ``options`` is an ``Options``; a module
reads further arguments from ``options.extra`` and declares them: ``OPTIONS`` lists its options, each with the words
that follow it, and ``WORDS`` states what its other words are. Anything else is refused before the run.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from spectral_core.errors import UnknownNameError

ROOT = Path(__file__).resolve().parents[1]
"""The repository's folder."""


@dataclass(frozen=True)
class Options:
    """Options of the command line for every benchmark."""

    quick: bool = False
    """Use smaller inputs, for tests: the benchmark runs, but its figures are not those of the docs."""
    out: Path = Path("out/benchmarks")
    """Folder of pictures and tables."""
    extra: list[str] = field(default_factory=list)
    """Arguments that the benchmark itself understands."""

    def number(self, name: str, usual: float) -> tuple[float, Options]:
        """The number after the option ``name``, or ``usual``, and the options without it.

        Raises SystemExit with a message if no number follows.
        """
        if name not in self.extra:
            return usual, self
        place = self.extra.index(name)
        given = self.extra[place + 1 : place + 2]
        rest = replace(self, extra=self.extra[:place] + self.extra[place + 2 :])
        try:
            return float(given[0]), rest
        except (IndexError, ValueError):
            got = " ".join(given) or "none"
            raise SystemExit(f"{name} expects a number, as in {name} {usual:g}; got {got}") from None

    def whole(self, name: str, usual: int) -> int:
        """The whole number after the option ``name``, or ``usual``. Raises SystemExit for another word."""
        if name not in self.extra:
            return usual
        given = self.extra[self.extra.index(name) + 1 :][:1]
        try:
            return int(given[0])
        except (IndexError, ValueError):
            got = " ".join(given) or "none"
            raise SystemExit(f"{name} expects a whole number, as in {name} {usual}; got {got}") from None

    def word(self, name: str, usual: str) -> str:
        """The word after the option ``name``, or ``usual``. Raises SystemExit if no word follows."""
        if name not in self.extra:
            return usual
        given = self.extra[self.extra.index(name) + 1 :][:1]
        if not given:
            raise SystemExit(f"{name} expects a word after it")
        return given[0]

    def lone(self, declared: Iterable[str]) -> list[str]:
        """The words that follow none of the ``declared`` options.

        Each option is declared with the words that it takes: ``--quiet``, ``--seed N``, ``--only NAMES…`` (all words
        up to the next option).
        """
        takes = {name: words for name, *words in map(str.split, declared)}
        found: list[str] = []
        left = 0.0
        for word in self.extra:
            if word in takes:
                words = takes[word]
                left = math.inf if words and words[-1].endswith("…") else len(words)
            elif left > 0:
                left -= 1
            else:
                found.append(word)
        return found

    def counts(self, *meanings: str) -> list[int]:
        """The whole numbers among the words, at most one for each meaning.

        Raises UnknownNameError for another word or for more of them.
        """
        words = [word for word in self.extra if not word.startswith("-")]
        if len(words) > len(meanings) or not all(word.isdecimal() for word in words):
            raise UnknownNameError(f"{' '.join(words)!r}: expected whole numbers: {', '.join(meanings)}")
        return [int(word) for word in words]

    def only(self, names: Iterable[str]) -> list[str]:
        """The ``names`` that ``--only`` chooses, all without it.

        Its words are separated by commas; each chooses the name that it equals, or else the names that contain it.
        Raises UnknownNameError for a word that chooses nothing.
        """
        known = list(names)
        if not self.extra:
            return known
        if self.extra[0] != "--only":
            raise UnknownNameError(f"{' '.join(self.extra)!r}: expected --only and names, separated by commas")
        wanted: set[str] = set()
        for word in " ".join(self.extra[1:]).split(","):
            each = word.strip()
            found = [each] if each in known else [name for name in known if each in name]
            if not found:
                raise UnknownNameError.among("case", each, known)
            wanted.update(found)
        return [name for name in known if name in wanted]
