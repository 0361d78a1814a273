# SPDX-License-Identifier: GPL-3.0-or-later
"""Equality of scene data by its contents."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np

PLAIN = frozenset((str, int, float, bool, type(None)))


def equal(first: Any, second: Any) -> bool:
    """True if two pieces of scene data are equal; identical objects are not compared in detail."""
    if first is second:
        return True
    kind = type(first)
    if kind in PLAIN and kind is type(second):
        return bool(first == second)
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        alike = isinstance(first, np.ndarray) and isinstance(second, np.ndarray) and first.dtype == second.dtype
        return alike and first.shape == second.shape and bool((first == second).all())
    return kind is type(second) and _have_equal_parts(first, second)


def _have_equal_parts(first: Any, second: Any) -> bool:
    """``equal`` for two objects of one type that is not an array."""
    kind: Any = type(first)
    names = _fields_of(kind)
    if names is not None:
        # a loop, and names that are looked up once: there may be tens of thousands of instances
        for name in names:
            one, other = getattr(first, name), getattr(second, name)
            if one is not other and not equal(one, other):
                return False
        return True
    if isinstance(first, (tuple, list)):
        return len(first) == len(second) and all(map(equal, first, second))
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(equal(first[key], second[key]) for key in first)
    return bool(first == second)


@cache
def _fields_of(kind: Any) -> tuple[str, ...] | None:
    """Names of the fields of a dataclass; None for another type."""
    return tuple(field.name for field in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else None
