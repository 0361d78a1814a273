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
from typing import Any

from spectral_core.volume.march.arithmetic import bounded, larger, step_growth
from spectral_core.volume.march.march_input import MarchInput, Rays
from spectral_core.volume.march.quadrature import Ahead, integrals, midpoint, preintegrated
from spectral_core.volume.march.rules import EMPTY, SHORTEST_STEP


@dataclass(frozen=True)
class Marched:
    """What the rays brought back: ``amounts`` per material, ``transmittance``, and step counts if asked for."""

    amounts: list[Any]
    transmittance: Any
    samples: Any = None
    steps: Any = None


def march(data: MarchInput, rays: Rays, *, counts: bool = False) -> Marched:
    """Composite along ``rays``; with ``counts``, also steps that showed something and all turns of the loop."""
    import drjit as dr

    types = data.volume.types
    one = types.Float(1.0) + rays.length * 0.0
    zero = one - 1.0
    number = types.UInt32(zero)
    state: dict[str, Any] = {"s": zero, "T": one, "A": [zero + 0.0 for _ in range(data.materials)]}
    if data.grid.grid.adapts:
        state["clear"] = zero + 0.0  # how far nothing can show, as the quadrature counts it
    if counts:
        state |= {"samples": number + 0, "steps": number + 0}
    if data.quadrature == "preintegrated":
        position = data.table.position(data.volume.value(rays.origin, rays.length > 0))
        part, record = data.table.record(position, rays.length > 0)
        state |= {"x": position, "S": integrals(data.table, part, record)}
        if data.grid.grid.adapts:
            state |= {"bold": one + 0.0, "clear": data.table.clear(part, record)}
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
    """One turn of the loop: a leap, a step with its light, or both."""
    import drjit as dr

    types, s, seen = data.volume.types, now["s"], now["T"]
    place = rays.line.look(s)
    steps = place.word < int(EMPTY)
    planned = dr.select(steps, data.grid.relative_step(place.word), data.grid.grid.first) * data.scale
    if data.grid.grid.adapts:
        planned *= step_growth(types, seen)
    planned = bounded(planned, SHORTEST_STEP, data.grid.longest)
    if data.grid.grid.first == 0.0:
        planned = dr.select(steps, planned, 0.0)
    per_cell = data.grid.voxels_per_cell(place.word) if data.grid.grid.adapts else None
    ahead = Ahead(steps, planned, rays.line.leap(place), per_cell)
    after = dict(now)
    advance = midpoint if data.quadrature == "midpoint" else preintegrated
    step, source, extinction = advance(data, rays, now, after, ahead)
    width = step * rays.world
    depth = extinction * width
    passed = dr.exp(-depth)
    reach = mean_attenuation(depth, passed)
    gain = seen * width * reach
    after["A"] = [dr.fma(gain, source[k], now["A"][k]) for k in range(data.materials)]
    after["T"] = seen * passed
    if "steps" in now:
        shows = (width > 0) & (sum(source[1:], source[0]) > 0)
        after["samples"] = now["samples"] + dr.select(shows, types.UInt32(1), types.UInt32(0))
        after["steps"] = now["steps"] + 1
    return after


def mean_attenuation(depth: Any, passed: Any) -> Any:
    """(1 - e^-τ)/τ of an optical depth and its e^-τ; by the series where it is small, down to no extinction."""
    import drjit as dr

    series = 1.0 - depth * (0.5 - depth / 6.0)
    return dr.select(depth > 1e-2, (1.0 - passed) / larger(depth, 1e-2), series)
