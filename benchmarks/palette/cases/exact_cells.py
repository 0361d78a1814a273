# SPDX-License-Identifier: GPL-3.0-or-later
"""Random palettes of catalogue lamps with exact and coupled cells, many of which cannot hold together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from time import process_time
from typing import Any

import numpy as np

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.live.session import PaletteSession
from spectral_core.palette.presets import design_grid, metamer_pair
from spectral_core.palette.problem import CellIndex
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import linear_from_display_rgb
from spectral_core.spectra.observer import normalized

LAMPS = ("D65", "HP1", "A", "FL2", "FL11", "E", "LED-B3")
STEP = 0.1
"""Standard deviation of a drag, in linear RGB."""


def exact_palettes(seed: int, count: int) -> Iterator[tuple[PaletteProblem, list[CellIndex]]]:
    """Palettes of 2 to 5 materials under 2 or 3 lamps, and their cells with wanted colors."""
    rng = np.random.default_rng(seed)
    while count:
        rows, columns = int(rng.integers(2, 6)), int(rng.integers(2, 4))
        base = rng.uniform(0.15, 0.7, 3)
        cells = [[_cell(rng, row, column, base) for column in range(columns)] for row in range(rows)]
        places = [(row, column) for row in range(rows) for column in range(columns)]
        wanted = [place for place in places if cells[place[0]][place[1]].target is not None]
        if not wanted:
            continue
        lamps = [PaletteLight(normalized(illuminant(name))) for name in rng.choice(LAMPS, columns, replace=False)]
        materials = tuple(PaletteReflectance(f"R{row}") for row in range(rows))
        grid = design_grid(float(rng.choice([5.0, 10.0])))
        yield PaletteProblem(grid, tuple(lamps), materials, tuple(map(tuple, cells))), wanted
        count -= 1


def _cell(rng: np.random.Generator, row: int, column: int, base: np.ndarray) -> Cell:
    kind, color = rng.random(), np.clip(base + rng.normal(scale=0.08, size=3), 0.02, 0.95)
    if row and kind < 0.35:
        return Cell.same_as((0, column), exact=bool(rng.random() < 0.6))
    return Cell.free() if kind < 0.5 else Cell.fixed(color, exact=bool(rng.random() < 0.3))


def jumped(seed: int, edits: int) -> dict[str, float]:
    """Milliseconds of processor time of a wanted color that jumps anywhere, in a pair of exact metamers."""
    session, busy = PaletteSession(metamer_pair()), []
    for color in np.random.default_rng(seed).uniform(0.2, 0.8, (edits, 3)):
        started = process_time()
        session.edit((0, 0), Cell.fixed(linear_from_display_rgb(color)))
        busy.append(1e3 * (process_time() - started))
    return {"median": float(np.median(busy)), "p99": float(np.percentile(busy, 99)), "largest": max(busy)}


def dragged(seed: int, count: int, edits: int) -> dict[str, Any]:
    """Milliseconds of processor time of one drag of a wanted color, and how the drags ended."""
    rng, busy, statuses = np.random.default_rng(seed), [], Counter[str]()
    for problem, wanted in exact_palettes(seed, count):
        session = PaletteSession(problem)
        for _ in range(edits):
            row, column = wanted[int(rng.integers(len(wanted)))]
            old = session.problem.cells[row][column]
            color = np.clip(old.target + rng.normal(scale=STEP, size=3), 0.02, 0.95)
            started = process_time()
            session.edit((row, column), Cell.fixed(color, weight=old.weight, exact=old.exact))
            busy.append(1e3 * (process_time() - started))
            statuses[str(session.solution().status)] += 1
    return {
        "median": float(np.median(busy)),
        "p95": float(np.percentile(busy, 95)),
        "p99": float(np.percentile(busy, 99)),
        "largest": max(busy),
        "statuses": dict(statuses),
    }
