# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaves of equal build as one leaf with a table: a mix of a hundred shaders costs the kernel of one.

Two leaves are of equal build where the same code renders both: the same closure, the same parts of it in use, programs
of equal shape. They differ in numbers and colors, which become the rows of tables that one leaf reads.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np

from spectral_core.render.plugins.paints.programs import RowsOfPrograms
from spectral_core.render.plugins.paints.rows import Cursor, Rows
from spectral_core.scene import Color, Computed, Weight

FEWEST = 3
"""Fewer leaves of equal build are rendered each by its own code, which is faster."""
MOST_FACTORS = 6
"""Factors that vary over the surface, up to which a leaf's weight is worth a table."""
LIMITS: dict[str, float | None] = {
    "ior": None,
    "coat_ior": None,
    "specular_level": None,
    "roughness": 0.03,
    "metallic": 0.5,
}
"""Numbers on whose side of a limit the code depends; None: the closures hold tables for the very number."""


def grouped(leaves: list[tuple[Weight, Any]]) -> Iterator[tuple[Weight, Any, int, Cursor | None]]:
    """Weight, closure, number of rows and cursor of each leaf; leaves of equal build as one, where the first stood."""
    keys = [_build(weight, closure) for weight, closure in leaves]
    members: dict[Any, list[int]] = {}
    for number, key in enumerate(keys):
        members.setdefault(key if key is not None else ("alone", number), []).append(number)
    for numbers in members.values():
        if len(numbers) < FEWEST:
            yield from ((*leaves[number], 1, None) for number in numbers)
            continue
        cursor = Cursor()
        yield (*_merged([leaves[number] for number in numbers], cursor), len(numbers), cursor)


def _build(weight: Weight, closure: Any) -> Any:
    """What must be equal for two leaves to share a table; None for a leaf that cannot have one."""
    parts: list[Any] = [type(closure)]
    for item in fields(closure):
        value = getattr(closure, item.name)
        kind = _kind(value)
        if kind is None:
            return None
        limited = item.name in LIMITS and (item.name != "metallic" or getattr(closure, "normal", None) is not None)
        if limited and isinstance(value, (int, float)):
            limit = LIMITS[item.name]
            kind = (kind, value if limit is None else value < limit)
        parts.append(kind)
    if len(weight.varying) > MOST_FACTORS:
        return None
    for factor, complement in weight.varying:
        kind = _kind(factor)
        if kind is None:
            return None
        parts.append((kind, complement))
    return tuple(parts)


def _kind(value: Any) -> Any:
    """What a kernel must know of a value; None where no table holds it."""
    if value is None or isinstance(value, (bool, str)):
        return ("fixed", value)
    if isinstance(value, (int, float)):
        return ("number", value == 0, value == 1)
    if isinstance(value, Color):
        return ("color", bool(np.all(value.linear_rgb == 1)))
    if isinstance(value, Computed) and all(i.data is None for i in value.program.instructions):
        return ("program", value.program.shape)
    return None


def _merged(leaves: list[tuple[Weight, Any]], cursor: Cursor) -> tuple[Weight, Any]:
    """One leaf that reads its numbers from tables of all."""
    closures = [closure for _, closure in leaves]
    changes = {
        item.name: _table([getattr(closure, item.name) for closure in closures], cursor)
        for item in fields(closures[0])
        if LIMITS.get(item.name, 0) is not None
    }
    constants = Rows(cursor, np.array([weight.constant for weight, _ in leaves]))
    factors: list[tuple[Any, bool]] = [(constants, False)]
    for place, (_, complement) in enumerate(leaves[0][0].varying):
        factors.append((_table([weight.varying[place][0] for weight, _ in leaves], cursor), complement))
    return Weight(tuple(factors)), replace(closures[0], **changes)


def _table(values: list[Any], cursor: Cursor) -> Any:
    first = values[0]
    if isinstance(first, Color):
        white = bool(np.all(first.linear_rgb == 1))
        return first if white else Rows(cursor, np.array([value.linear_rgb for value in values]))
    if isinstance(first, Computed):
        return Computed(RowsOfPrograms(cursor, tuple(value.program for value in values)))  # type: ignore[arg-type]
    if isinstance(first, bool) or not isinstance(first, (int, float)) or first in (0, 1):
        return first
    return Rows(cursor, np.array(values, dtype=np.float64))
