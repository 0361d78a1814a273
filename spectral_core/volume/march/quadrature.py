# SPDX-License-Identifier: GPL-3.0-or-later
"""How a turn of the march moves on and what it sees: at the middle of the step, or as means over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.device import DeviceTable
from spectral_core.volume.march.device_grid import BEYOND
from spectral_core.volume.march.march_input import MarchInput, Rays

_GROWTH = 1.3  # of boldness, per step that missed nothing
_UNLIKELY = 0.8  # of the bound on a brick's slope, which is loose: `volume-bold` prints what is missed


@dataclass(frozen=True)
class Ahead:
    """What lies before a turn: whether it ``steps`` or leaps, and lengths in index units (voxels).

    ``planned`` is the step of the rule; ``leap`` ends past the empty bricks, or past this one if it shows something.
    ``per_cell`` is how far a ray goes at least in this brick while the data value moves by one cell of the table; it
    is any number where the ray leaps.
    """

    steps: Any
    planned: Any
    leap: Any
    per_cell: Any = None

    def stays(self, way: Any) -> Any:
        """Whether the ray is still in this brick after ``way``, by a margin over how far ahead bricks are looked up."""
        return self.steps & (way < self.leap - 3.0 * BEYOND)


def midpoint(
    data: MarchInput, rays: Rays, now: dict[str, Any], after: dict[str, Any], ahead: Ahead
) -> tuple[Any, list[Any], Any]:
    """(step in voxels, sources and extinction per world unit) from the middle of a step; fills in ``after``.

    What is known to be clear before the step is passed over, and a leap has its step in the same turn. ``clear`` is a
    length in voxels; it is known only while the ray stays in the brick where the value was looked up.
    """
    import drjit as dr

    s, table, clears = now["s"], data.table, data.grid.grid.adapts
    clear = smaller(now["clear"], ahead.leap) if clears else 0.0
    start = smaller(s + dr.select(ahead.steps, clear, ahead.leap), rays.length)
    end = start + smaller(ahead.planned, rays.length - start)
    # What float32 really added: steps much shorter than s are rounded, always the same way over many of them.
    step = end - start
    point = rays.at(dr.fma(step, 0.5, start))
    part, record = table.record(table.position(data.volume.value(point, True)), True)
    columns = [dr.fma(part, record[c + table.columns], record[c]) for c in range(table.columns)]
    after["s"] = end
    if clears:
        length = larger(dr.fma(table.clear(part, record), ahead.per_cell, -0.5 * step), 0.0)
        after["clear"] = dr.select(ahead.stays(end - s), length, 0.0)
    return step, *data.optics(columns, point, True)


def preintegrated(
    data: MarchInput, rays: Rays, now: dict[str, Any], after: dict[str, Any], ahead: Ahead
) -> tuple[Any, list[Any], Any]:
    """(step in voxels, sources and extinction per world unit) as means between the data values at the ends of the step;
    fills in ``after``. ``clear`` is in cells of the transfer table.

    A step through values that are known to show nothing may be longer than planned: its means are zero. A bold one,
    longer than is known to be clear, is taken back if something showed after all.
    """
    import drjit as dr

    s, table, clears = now["s"], data.table, data.grid.grid.adapts
    step = ahead.planned
    if clears:
        step = larger(step, smaller(now["clear"] * now["bold"] * ahead.per_cell, ahead.leap))
    after["s"] = s + dr.select(ahead.steps, smaller(step, rays.length - s), ahead.leap)
    point = rays.at(smaller(after["s"], rays.length))
    x = table.position(data.volume.value(point, True))
    part, record = table.record(x, True)
    after["x"], after["S"] = x, integrals(table, part, record)
    means = _means(table, now, x, part, record, after["S"])
    if clears:
        after["clear"] = table.clear(part, record)
        bold = ahead.steps & (step > ahead.planned) & (now["bold"] > 1.0)
        _take_back(data, now, after, bold & _missed(now, after, step, ahead))
    return dr.select(ahead.steps, after["s"] - s, 0.0), *data.optics(means, point, ahead.steps)


def _missed(now: dict[str, Any], after: dict[str, Any], step: Any, ahead: Ahead) -> Any:
    """Whether a long step may have met what shows: at its end, between values on both sides, or there and back.

    The last needs a value that changes as fast as any in its brick does, first one way and then the other; as fast as
    ``_UNLIKELY`` of that is left out.
    """
    ends = (now["clear"] + after["clear"]) * ahead.per_cell
    between = sum(after["S"][1:], after["S"][0]) != sum(now["S"][1:], now["S"][0])
    return (after["clear"] <= 0) | between | (ends < _UNLIKELY * step)


def _take_back(data: MarchInput, now: dict[str, Any], after: dict[str, Any], missed: Any) -> None:
    """Where ``missed``, the ray stays, to go on with care; elsewhere it grows bolder."""
    import drjit as dr

    after["bold"] = dr.select(missed, 1.0, smaller(now["bold"] * _GROWTH, data.boldest))
    for name in ("s", "x", "clear"):
        after[name] = dr.select(missed, now[name], after[name])
    after["S"] = [dr.select(missed, old, new) for old, new in zip(now["S"], after["S"], strict=True)]


def integrals(table: DeviceTable, part: Any, record: list[Any]) -> list[Any]:
    """Running integral of each column at a table position: quadratic inside the cell, so exact."""
    import drjit as dr

    c = table.columns
    return [dr.fma(part, dr.fma(part * 0.5, record[k + c], record[k]), record[k + 2 * c]) for k in range(c)]


def _means(
    table: DeviceTable, now: dict[str, Any], x: Any, part: Any, record: list[Any], integral: list[Any]
) -> list[Any]:
    """Mean of each column between the last table position and ``x``.

    Ends that are close would cancel in float32; there the column's line through the middle stands for it.
    """
    import drjit as dr

    c = table.columns
    run = x - now["x"]
    far = dr.abs(run) > table.close
    inverse = dr.rcp(dr.select(far, run, 1.0))
    middle = part - 0.5 * run
    return [
        larger(dr.select(far, (integral[k] - now["S"][k]) * inverse, dr.fma(middle, record[k + c], record[k])), 0.0)
        for k in range(c)
    ]
