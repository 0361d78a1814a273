# SPDX-License-Identifier: GPL-3.0-or-later
"""Equality of scene data by its contents."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np


def equal(first: Any, second: Any) -> bool:
    """True if two pieces of scene data are equal; identical objects are not compared in detail."""
    if first is second:
        return True
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        alike = isinstance(first, np.ndarray) and isinstance(second, np.ndarray) and first.dtype == second.dtype
        return alike and first.shape == second.shape and bool(np.array_equal(first, second))
    if type(first) is not type(second):
        return False
    if dataclasses.is_dataclass(first):
        return all(equal(getattr(first, f.name), getattr(second, f.name)) for f in dataclasses.fields(first))
    if isinstance(first, (tuple, list)):
        return len(first) == len(second) and all(map(equal, first, second))
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(equal(first[key], second[key]) for key in first)
    return bool(first == second)
