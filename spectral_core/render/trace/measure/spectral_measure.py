# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths of paths, their colors and their bands, on the just-in-time variants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import table
from spectral_core.render.trace.measure.wavelength_sets import SHIFTS, STEPS, TEETH
from spectral_core.render.trace.wavelengths import WavelengthPlan

SLOTS = 1024
"""Intervals of probability in which the search for a cell starts."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """Wavelengths of a path: their cells, the positions within these, and the number of their set (None without)."""

    cells: list[Any]
    within: list[Any]
    number: Any


class SpectralMeasure:
    """Tables of a plan of wavelengths; kernels read them, so that another plan of equal size needs no new kernel."""

    def __init__(self, mitsuba: Any, plan: WavelengthPlan) -> None:
        import drjit as dr

        mi = self._mi = mitsuba
        self._teeth = plan.teeth
        self.band_count = len(plan.responses) - 3
        draw = mi.DiscreteDistribution(mi.Float(plan.probability.astype(np.float32)))
        # the exact probability of the table in single precision, or narrow lines would be off by its rounding
        cumulative = np.concatenate([[0.0], np.array(draw.cdf, dtype=np.float64)])
        cumulative /= cumulative[-1]
        share = np.diff(cumulative)
        density = np.maximum(share / plan.widths_nm, 1e-30)
        self._cumulative = table(mi.Float, cumulative)
        self._last = dr.opaque(mi.UInt32, int(np.flatnonzero(share)[-1]))
        # where the search starts and ends in each of equal intervals of probability; most have one cell or two
        slots = np.searchsorted(cumulative.astype(np.float32), np.arange(SLOTS + 1) / SLOTS, side="right") - 1
        self._guide = table(mi.UInt32, np.clip(slots, 0, len(share) - 1))
        # packets of four numbers per cell, each of which is read at once
        self._cell_places = table(
            mi.Float,
            np.stack([cumulative[:-1], 1.0 / np.maximum(share, 1e-30), plan.edges_nm[:-1], plan.widths_nm], axis=1),
        )
        # response / density at both ends of a cell: within it the response is linear and the density constant
        starts, _, ends = plan.pieces[:, :3]
        self._starts = table(mi.Float, np.stack([*(starts / density / TEETH), 1.0 / density], axis=1))
        self._ends = table(mi.Float, np.stack([*(ends / density / TEETH), 1.0 / density], axis=1))
        self._has_sets = plan.sets is not None
        if plan.sets is not None:
            self._shifts = table(mi.UInt32, plan.sets.shifts % STEPS)
            padded = np.pad(plan.sets.corrections, ((0, 0), (0, 0), (0, 0), (0, 1)))
            self._corrections = table(mi.Float, padded)
        if self.band_count:
            self._band_tables(plan.pieces[:, 3:], density)

    def _band_tables(self, pieces: NDArray[np.float64], density: NDArray[np.float64]) -> None:
        """Per cell the few bands that respond in it, their weights at both ends, and their quadratic part."""
        mi = self._mi
        touched = np.any(pieces != 0, axis=0)
        self._band_slots = max(1, int(touched.sum(axis=0).max()))
        cells = touched.shape[1]
        index = np.zeros((self._band_slots, cells), np.uint32)
        start, end, bulge = np.zeros((3, self._band_slots, cells), np.float32)
        bulges = 4 * (pieces[1] - (pieces[0] + pieces[2]) / 2)
        bulges[np.abs(bulges) < 1e-12 * np.abs(pieces).max(initial=0)] = 0.0  # rounding error of linear parts
        for cell in range(cells):
            for slot, band in enumerate(np.flatnonzero(touched[:, cell])):
                index[slot, cell] = band
                start[slot, cell] = pieces[0, band, cell] / density[cell]
                end[slot, cell] = pieces[2, band, cell] / density[cell]
                bulge[slot, cell] = bulges[band, cell] / density[cell]
        self._band_index = [mi.UInt32(row) for row in index]
        self._band_start = [mi.Float(row) for row in start]
        self._band_end = [mi.Float(row) for row in end]
        self._band_bulge = [mi.Float(row) for row in bulge] if np.any(bulge) else None

    def draw(self, sampler: Any) -> tuple[Any, Drawn]:
        """Wavelengths of a path, and where they lie."""
        import drjit as dr

        mi = self._mi
        places, number = self._positions(sampler)
        cells, within, found = [], [], []
        for place in places:
            # One number chooses the cell, and its remainder the position within: the stratification extends into cells.
            cell = dr.minimum(self._cell_of(place), self._last)
            low, per_share, start, width = dr.gather(mi.Vector4f, self._cell_places, cell)
            rest = dr.clip((place - low) * per_share, 0.0, 1.0)
            cells.append(cell)
            within.append(rest)
            found.append(dr.fma(width, rest, start))
        return mi.Spectrum(*found), Drawn(cells, within, number)

    def _cell_of(self, place: Any) -> Any:
        """The last cell that starts at or before a position in the cumulative probability."""
        import drjit as dr

        mi = self._mi
        slot = dr.minimum(mi.UInt32(place * SLOTS), SLOTS - 1)
        low, high = (dr.gather(mi.UInt32, self._guide, slot + k) for k in (0, 1))

        def halve(low: Any, high: Any) -> tuple[Any, Any]:
            middle = (low + high) >> 1
            after = dr.gather(mi.Float, self._cumulative, middle + 1) <= place
            return dr.select(after, middle + 1, low), dr.select(after, high, middle)

        return dr.while_loop((low, high), lambda low, high: low < high, halve, labels=("low", "high"))[0]

    def _positions(self, sampler: Any) -> tuple[list[Any], Any]:
        """Positions of the wavelengths in their cumulative probability, and the number of their set."""
        import drjit as dr

        mi = self._mi
        position = sampler.next_1d()
        if self._teeth == 1:  # under dispersion one tooth represents all
            return [position] * TEETH, None
        if not self._has_sets:
            return [(position + k) / TEETH for k in range(TEETH)], None
        step = dr.minimum(mi.UInt32(position * STEPS), STEPS - 1)
        turn, rest = sampler.turn(STEPS, SHIFTS)
        shift = turn % SHIFTS
        places = []
        for k in range(TEETH):
            moved = (step + dr.gather(mi.UInt32, self._shifts, shift * TEETH + k)) % STEPS
            places.append((mi.Float(moved + STEPS * k) + rest) * (1.0 / (TEETH * STEPS)))
        return places, shift * STEPS + step

    def color(self, radiance: Any, drawn: Drawn) -> Any:
        """XYZ of one sample."""
        import drjit as dr

        mi = self._mi
        total = mi.Color3f(0.0)
        for k, (cell, within) in enumerate(zip(drawn.cells, drawn.within, strict=True)):
            weight = dr.lerp(
                dr.gather(mi.Vector4f, self._starts, cell), dr.gather(mi.Vector4f, self._ends, cell), within
            )
            if drawn.number is not None:
                weight += dr.gather(mi.Vector4f, self._corrections, drawn.number * TEETH + k) * weight.w
            total += radiance[k] * mi.Color3f(weight.x, weight.y, weight.z)
        return total

    def scatter_bands(self, bands: Any, lane: Any, radiance: Any, drawn: Drawn) -> None:
        """Add a sample to its pixel's band channels; each lane owns its pixel, so no two lanes collide."""
        import drjit as dr

        mi = self._mi
        for k, (cell, within) in enumerate(zip(drawn.cells, drawn.within, strict=True)):
            for slot in range(self._band_slots):
                weight = dr.lerp(
                    dr.gather(mi.Float, self._band_start[slot], cell),
                    dr.gather(mi.Float, self._band_end[slot], cell),
                    within,
                )
                if self._band_bulge is not None:
                    # A parabola over the chord: 0 at both ends, greatest in the middle.
                    weight += dr.gather(mi.Float, self._band_bulge[slot], cell) * within * (1.0 - within)
                target = lane * self.band_count + dr.gather(mi.UInt32, self._band_index[slot], cell)
                dr.scatter_add(bands, radiance[k] * weight * 0.25, target, mode=dr.ReduceMode.NoConflicts)
