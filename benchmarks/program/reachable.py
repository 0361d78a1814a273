# SPDX-License-Identifier: GPL-3.0-or-later
"""Reachable colors of cells: extents against linear programs on random cells, time of a click, the blocking color."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from scipy.optimize import linprog

from benchmarks import Options
from spectral_core.palette.reach.reachable import CellReach
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.spectrum import SpectralGrid

LAMPS = ("D65", "A", "HP1", "FL11", "LED-B5")


def run(options: Options) -> dict[str, Any]:
    """Print and return the figures."""
    rng = np.random.default_rng(3)
    grid = SpectralGrid.uniform(400, 700, 10)
    worst, clicks, named = 0.0, [], []
    for number in range(60 if options.quick else 1000):
        lights = [illuminant(name) for name in rng.choice(LAMPS, 3, replace=False)]
        values = rng.random(grid.size) ** rng.uniform(0.5, 3)
        exact = [(light, CellReach(light, grid).matrix @ values) for light in lights[1 : 1 + number % 3]]
        reach = CellReach(lights[0], grid, exact)
        held = np.concatenate([CellReach(light, grid).matrix for light, _ in exact]) if exact else None
        colors = np.concatenate([color for _, color in exact]) if exact else None
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        answer = linprog(-direction @ reach.matrix, A_eq=held, b_eq=colors, bounds=(0, 1), method="highs-ipm")
        worst = max(worst, abs(reach.extent(direction)[0] + answer.fun))
        wanted = rng.random(3)
        started = time.thread_time()
        found = reach.nearest(wanted)
        clicks.append(1e3 * (time.thread_time() - started))
        if len(exact) == 2 and not found.reachable:
            released = [CellReach(lights[0], grid, [exact[1 - k]]).nearest(wanted).delta_e_2000 for k in range(2)]
            if abs(released[0] - released[1]) > 1:
                named.append(int(np.argmin(released)) == int(np.argmax(found.in_the_way)))
    median, p99 = float(np.median(clicks)), float(np.percentile(clicks, 99))
    print(f"extents differ from linear programs by at most {worst:.1e}")
    print(f"a click takes {median:.2f} ms in the median, {p99:.2f} ms at the 99th percentile (processor time)")
    print(f"the multipliers name the color whose release helps more in {np.mean(named):.0%} of {len(named)} cells")
    holds = {
        "reachable sets agree with linear programs to 1e-6": worst < 1e-6,
        "a click answers within 5 ms (99th percentile)": p99 < 5,
        "multipliers name the conflict": bool(np.mean(named) > 0.75),
    }
    return {
        "largest_difference": worst, "click_ms_median": median, "click_ms_p99": p99,
        "named_share": float(np.mean(named)), "holds": holds,
    }  # fmt: skip
