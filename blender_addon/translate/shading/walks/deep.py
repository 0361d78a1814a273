# SPDX-License-Identifier: GPL-3.0-or-later
"""Results that ask for others, each made once; a chain of any length needs no deep recursion."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")

DEEPEST = 25
"""Results that are made inside each other. Each takes about ten nested calls of Python, which allows a thousand."""


class _TooDeep(Exception):
    """Raised through the results that are being made, when another one is to be made before them."""

    def __init__(self, key: Hashable, make: Callable[[], Any]) -> None:
        super().__init__(key)
        self.key, self.make = key, make


class Results(Generic[Result]):
    """Results by key."""

    def __init__(self) -> None:
        self._known: dict[Hashable, Result] = {}
        self._open: set[Hashable] = set()
        """Keys of the results that are not finished."""
        self._depth = 0

    def of(self, key: Hashable, make: Callable[[], Result], in_circle: Callable[[], Result]) -> Result:
        """The result of a key, from ``make`` at the first time, which may ask for others; from ``in_circle`` if it asks
        for itself. A ``make`` may be called again if results before it are many.
        """
        if key in self._known:
            return self._known[key]
        if key in self._open:
            return in_circle()
        if not self._open:
            return self._settled(key, make)
        if self._depth == DEEPEST:
            raise _TooDeep(key, make)
        return self._made(key, make)

    def _made(self, key: Hashable, make: Callable[[], Result]) -> Result:
        self._open.add(key)
        self._depth += 1
        try:
            self._known[key] = make()
        finally:
            self._depth -= 1
            self._open.discard(key)
        return self._known[key]

    def _settled(self, key: Hashable, make: Callable[[], Result]) -> Result:
        """The result that nothing else waits for."""
        waiting = [(key, make)]
        try:
            while waiting:
                last, make = waiting[-1]
                try:
                    self._made(last, make)
                except _TooDeep as deeper:
                    self._open.add(last)  # still unfinished
                    waiting.append((deeper.key, deeper.make))
                else:
                    waiting.pop()
        finally:
            self._open.clear()
        return self._known[key]
