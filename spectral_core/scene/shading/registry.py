# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations by name: the widths of their inputs and results, and the functions that compute them.

A function's first argument ``xp`` is a backend (``numpy_backend.NumPy``, or Dr.Jit's in the renderer). A value of
width 1 is one array, a value of width 3 a tuple of three; settings follow the inputs. One function serves both
backends, so it uses only arithmetic, comparisons and what a backend offers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Operation:
    """``widths``: of the inputs; ``result``: of the value; ``folds``: True if constants may be computed ahead."""

    name: str
    function: Callable[..., Any]
    widths: tuple[int, ...]
    result: int
    folds: bool = True


OPERATIONS: dict[str, Operation] = {}
"""Every operation of programs, registered by the modules of this folder."""


def operation(
    inputs: str, result: int, *, name: str | None = None, folds: bool = True
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function under its name; ``inputs`` lists the widths, as in ``"3 1"``."""

    def enter(function: Callable[..., Any]) -> Callable[..., Any]:
        key = name or function.__name__
        OPERATIONS[key] = Operation(key, function, tuple(int(width) for width in inputs.split()), result, folds)
        return function

    return enter
