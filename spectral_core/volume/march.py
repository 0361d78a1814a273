# SPDX-License-Identifier: GPL-3.0-or-later
"""The march: one loop that leaps, steps, looks up and composites, for any step grid and either quadrature.

Within a step of length h (world units) source j and extinction σ are taken as constant, so material k gains
T·j_k·h·(1 - exp(-σh))/(σh), which is j_k·h where nothing is taken (X-ray) and exact for a homogeneous step.

- `midpoint` takes them at the middle of the step.
- `preintegrated` takes their mean over the data values between the step's ends, from the table of running
  integrals: no feature of the transfer function is stepped over, however narrow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from spectral_core.volume.device import DeviceGrid, DeviceTable, DeviceVolume
from spectral_core.volume.rules import EMPTY, SHORTEST_STEP

Quadrature = Literal["midpoint", "preintegrated"]
QUADRATURES: tuple[Quadrature, ...] = ("midpoint", "preintegrated")
LEAST_TRANSMITTANCE = 1e-5
_LEAST_ROOT = 0.03  # T^(1/4) at which steps grow no further


@dataclass(frozen=True)
class Marched:
    """What the rays brought back: ``amounts`` per material, ``transmittance``, and step counts if asked for."""

    amounts: list[Any]
    transmittance: Any
    samples: Any = None
    steps: Any = None


@dataclass(frozen=True)
class Rays:
    """Rays in a field's index space: they start at ``origin``, run along the unit ``direction`` for ``length``.

    ``world`` is the world length of one index unit along the ray; ``inverse`` is 1/direction, large where zero.
    """

    origin: list[Any]
    direction: list[Any]
    inverse: list[Any]
    length: Any
    world: Any

    def at(self, distance: Any) -> list[Any]:
        import drjit as dr

        return [dr.fma(self.direction[a], distance, self.origin[a]) for a in range(3)]


@dataclass(frozen=True)
class MarchInput:
    """A field on the device with the tables of one rule and transfer function; ``scale`` multiplies its steps."""

    volume: DeviceVolume
    grid: DeviceGrid
    table: DeviceTable
    scale: Any
    quadrature: Quadrature = "midpoint"
    least_transmittance: Any = LEAST_TRANSMITTANCE
    gradient: DeviceVolume | None = None
    """Gradient magnitudes and, in ``weights``, the materials' weights over them: a two-dimensional function."""
    weights: DeviceTable | None = None

    @property
    def materials(self) -> int:
        return self.table.table.materials

    def optics_at(self, point: list[Any], active: Any) -> tuple[list[Any], Any]:
        """(source per material, extinction) at an index-space point, both per world unit."""
        import drjit as dr

        part, record = self.table.record(self.table.position(self.volume.value(point, active)), active)
        columns = [dr.fma(part, record[c + self.table.columns], record[c]) for c in range(self.table.columns)]
        return self.optics(columns, point, active)

    def optics(self, columns: list[Any], point: list[Any], active: Any) -> tuple[list[Any], Any]:
        """(source per material, extinction) from table columns; the gradient at ``point`` weighs them if need be."""
        import drjit as dr

        k = self.materials
        if self.gradient is None or self.weights is None:
            return columns[:k], columns[k] if len(columns) > k else sum(columns[1:], columns[0])
        part, record = self.weights.record(self.weights.position(self.gradient.value(point, active)), active)
        weights = [dr.fma(part, record[c + k], record[c]) for c in range(k)]
        taken = [columns[c] * weights[c] for c in range(k)]
        return [dr.fma(columns[c + k], weights[c], taken[c]) for c in range(k)], sum(taken[1:], taken[0])


def clip_to_box(grid: DeviceGrid, point: list[Any], along: list[Any], world: Any, begin: Any) -> Rays:
    """The part of rays where ``grid`` shows anything: from the later of ``begin`` (index units along) and the entry.

    ``point`` and ``along`` (unit) are lists of three; ``world`` as in Rays.
    """
    import drjit as dr

    near, far, inverse = begin, grid.types.Float(1e30), []
    for a in range(3):
        d = along[a]
        safe = dr.select(dr.abs(d) < 1e-9, dr.select(d < 0, -1e-9, 1e-9), d)
        inv = dr.rcp(safe)
        low, high = (grid.low[a] - point[a]) * inv, (grid.high[a] - point[a]) * inv
        near, far = dr.maximum(near, dr.minimum(low, high)), dr.minimum(far, dr.maximum(low, high))
        inverse.append(inv)
    length = dr.maximum(far - near, 0.0)
    near = dr.select(length > 0, near, 0.0)
    start = [dr.fma(along[a], near, point[a]) for a in range(3)]
    return Rays(start, along, inverse, length, world)


def march(data: MarchInput, rays: Rays, *, counts: bool = False) -> Marched:
    """Composite along ``rays``; with ``counts``, also steps that showed something and all turns of the loop."""
    import drjit as dr

    types = data.volume.types
    one = types.Float(1.0) + rays.length * 0.0
    zero = one - 1.0
    number = types.UInt32(zero)
    state: dict[str, Any] = {"s": zero, "T": one, "A": [zero + 0.0 for _ in range(data.materials)]}
    if data.grid.grid.weighs_transmittance:
        state["root"] = one + 0.0  # T^(1/4), which costs less to carry than to take
    if counts:
        state |= {"samples": number + 0, "steps": number + 0}
    if data.quadrature == "preintegrated":
        position = data.table.position(data.volume.value(rays.origin, rays.length > 0))
        part, record = data.table.record(position, rays.length > 0)
        state |= {"x": position, "S": _integrals(data.table, part, record)}
    names = list(state)

    def going(*values: Any) -> Any:
        now = dict(zip(names, values, strict=True))
        return (now["s"] < rays.length) & (now["T"] > data.least_transmittance)

    def turn(*values: Any) -> Any:
        now = dict(zip(names, values, strict=True))
        after = _turn(data, rays, now)
        return tuple(after[name] for name in names)

    end = dict(zip(names, dr.while_loop(tuple(state.values()), going, turn), strict=True))
    return Marched(end["A"], end["T"], end.get("samples"), end.get("steps"))


def _turn(data: MarchInput, rays: Rays, now: dict[str, Any]) -> dict[str, Any]:
    """One turn of the loop: a leap, or a step with its light."""
    import drjit as dr

    types, table = data.volume.types, data.table
    s, seen = now["s"], now["T"]
    here = rays.at(s + 1e-3)
    word, brick = data.grid.at(here, True)
    steps = word < int(EMPTY)
    step = data.grid.relative_step(word) * data.scale
    if data.grid.grid.weighs_transmittance:
        step *= dr.rcp(dr.maximum(now["root"], _LEAST_ROOT))
    step = dr.minimum(dr.clip(step, SHORTEST_STEP, data.grid.longest), rays.length - s)
    leap = data.grid.leap(here, rays.inverse, brick, word)
    after = dict(now)
    after["s"] = s + dr.select(steps, step, leap)
    # What float32 really added: steps much shorter than s are rounded, always the same way over many of them.
    step = after["s"] - s
    if data.quadrature == "midpoint":
        source, extinction = data.optics_at(rays.at(dr.fma(step, 0.5, s)), steps)
    else:
        x = table.position(data.volume.value(rays.at(dr.minimum(after["s"], rays.length)), True))
        part, record = table.record(x, True)
        integral = _integrals(table, part, record)
        source, extinction = data.optics(_means(table, now, x, part, record, integral), here, steps)
        after["x"], after["S"] = x, integral
    width = dr.select(steps, step * rays.world, 0.0)
    depth = extinction * width
    if data.grid.grid.weighs_transmittance:
        root = dr.exp(-0.25 * depth)
        passed = dr.square(dr.square(root))
        after["root"] = now["root"] * root
    else:
        passed = dr.exp(-depth)
    reach = mean_attenuation(depth, passed)
    gain = seen * width * reach
    after["A"] = [dr.fma(gain, source[k], now["A"][k]) for k in range(data.materials)]
    after["T"] = seen * passed
    if "steps" in now:
        shows = steps & (sum(source[1:], source[0]) > 0)
        after["samples"] = now["samples"] + dr.select(shows, types.UInt32(1), types.UInt32(0))
        after["steps"] = now["steps"] + 1
    return after


def mean_attenuation(depth: Any, passed: Any) -> Any:
    """(1 - e^-τ)/τ of an optical depth and its e^-τ; by the series where it is small, down to no extinction."""
    import drjit as dr

    series = 1.0 - depth * (0.5 - depth / 6.0)
    return dr.select(depth > 1e-2, (1.0 - passed) / dr.maximum(depth, 1e-2), series)


def _integrals(table: DeviceTable, part: Any, record: list[Any]) -> list[Any]:
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
        dr.maximum(dr.select(far, (integral[k] - now["S"][k]) * inverse, dr.fma(middle, record[k + c], record[k])), 0.0)
        for k in range(c)
    ]
