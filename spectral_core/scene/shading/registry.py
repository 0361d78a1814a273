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


UV_TANGENT = "attribute_tangent"
"""Input of programs, before a colon and the name of a UV map: its tangent in the space of the object, of any length.
Without a name it is that of the UV map that renders.
"""
UV_SIGN = "attribute_tangent_sign"
"""Input of programs, likewise: 1 where the bitangent is the cross product of normal and tangent, -1 where it is on the
other side, 0 without the UV map.
"""
SENDS_RAYS = frozenset(("occlusion", "bevel"))
"""Operations that send rays from a surface."""
SMOOTH_NORMAL = "attribute_smooth_normal"
"""Input of programs: the interpolated normal of smooth faces in the space of the object, of any length; 0 on flat ones.
"""
