# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths of paths, their colors and their bands, on the just-in-time variants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import table
from spectral_core.render.trace.measure.slots import SLOTS
from spectral_core.render.trace.measure.wavelength_sets import SAMPLES, SHIFTS, STEPS, TEETH
from spectral_core.render.trace.wavelengths import WavelengthPlan


@dataclass(frozen=True, eq=False)
class Drawn:
    """Wavelengths of a path: their cells, the positions within these, and the number of their set (None without)."""

    cells: list[Any]
    within: list[Any]
    number: Any


class SpectralMeasure:
    """Tables of a plan of wavelengths; kernels read them, so that another plan of equal size needs no new kernel."""

    def __init__(self, mitsuba: Any, plan: WavelengthPlan) -> None:

        mi = self._mi = mitsuba
        self._teeth = plan.teeth
        self.band_count = len(plan.responses) - 3
        counts = np.round(plan.probability * SLOTS).astype(np.int64)
        density = np.maximum(plan.probability / plan.widths_nm, 1e-30)
        self._cell_of_slot = table(mi.UInt32, np.repeat(np.arange(counts.size), counts))
        # packets of four numbers per cell, each of which is read at once
        firsts, per_count = np.cumsum(counts) - counts, 1.0 / np.maximum(counts, 1)
        self._cells = table(mi.Float, np.stack([firsts, per_count, plan.edges_nm[:-1], plan.widths_nm], axis=1))
        # response / density at both ends of a cell: within it the response is linear and the density constant
        starts, _, ends = plan.pieces[:, :3]
        self._starts = table(mi.Float, np.stack([*(starts / density / TEETH), 1.0 / density], axis=1))
        self._ends = table(mi.Float, np.stack([*(ends / density / TEETH), 1.0 / density], axis=1))
        self._has_sets = plan.sets is not None
        if plan.sets is not None:
            self._shifts = table(mi.UInt32, plan.sets.shifts % STEPS)
            padded = np.pad(plan.sets.corrections, ((0, 0), (0, 0), (0, 0), (0, 0), (0, 1)))
            self._corrections = table(mi.Float, padded)
            self._per_order = SHIFTS * STEPS * TEETH
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
        self._band_index = [table(mi.UInt32, row) for row in index]
        self._band_start = [table(mi.Float, row) for row in start]
        self._band_end = [table(mi.Float, row) for row in end]
        self._band_bulge = [table(mi.Float, row) for row in bulge] if np.any(bulge) else None

    def draw(self, sampler: Any) -> tuple[Any, Drawn]:
        """Wavelengths of a path, and where they lie."""
        import drjit as dr

        mi = self._mi
        slots, rest, number = self._slots(sampler)
        cells, within, found = [], [], []
        for slot in slots:
            cell = dr.gather(mi.UInt32, self._cell_of_slot, slot)
            first, per_count, start, width = dr.gather(mi.Vector4f, self._cells, cell)
            # the remainder of the random number is the position within: the stratification extends into cells
            share = (mi.Float(slot) - first + rest) * per_count
            cells.append(cell)
            within.append(share)
            found.append(dr.fma(width, share, start))
        return mi.Spectrum(*found), Drawn(cells, within, number)

    def _slots(self, sampler: Any) -> tuple[list[Any], Any, Any]:
        """Slots of probability of the wavelengths, the position within them, and the number of their set."""
        import drjit as dr

        mi = self._mi
        position = sampler.next_1d()
        if self._teeth == 1:  # under dispersion one tooth represents all
            slot, rest = self._divided(position, SLOTS)
            return [slot] * TEETH, rest, None
        if not self._has_sets:
            slot, rest = self._divided(position, SLOTS // TEETH)
            return [slot + k * (SLOTS // TEETH) for k in range(TEETH)], rest, None
        # within a step by the same number: one place for all steps of a shift would leave its error in their mean
        step, within = self._divided(position, STEPS)
        turn = sampler.turn(SAMPLES, SHIFTS)
        slot, rest = self._divided(within, SLOTS // (TEETH * STEPS))
        shift, slots = turn % SHIFTS, []
        for k in range(TEETH):
            moved = (step + dr.gather(mi.UInt32, self._shifts, shift * TEETH + k)) % STEPS
            slots.append((moved + STEPS * k) * (SLOTS // (TEETH * STEPS)) + slot)
        return slots, rest, shift * STEPS + step

    def _divided(self, position: Any, count: int) -> tuple[Any, Any]:
        """Which of ``count`` equal parts of [0, 1) a position is in, and where in it."""
        import drjit as dr

        scaled = position * count
        part = dr.minimum(self._mi.UInt32(scaled), count - 1)
        return part, scaled - self._mi.Float(part)

    def color(self, radiance: Any, drawn: Drawn, later: Any = None) -> Any:
        """XYZ of one sample; ``later``: the parts of its radiance that two surfaces, and that more, have reflected
        diffusely.
        """
        import drjit as dr

        mi = self._mi
        total = mi.Color3f(0.0)
        for k, (cell, within) in enumerate(zip(drawn.cells, drawn.within, strict=True)):
            weight = dr.lerp(
                dr.gather(mi.Vector4f, self._starts, cell), dr.gather(mi.Vector4f, self._ends, cell), within
            )
            if drawn.number is None:
                total += radiance[k] * mi.Color3f(weight.x, weight.y, weight.z)
                continue
            at, parts = drawn.number * TEETH + k, [] if later is None else [part[k] for part in later]
            added = (radiance[k] - sum(parts)) * dr.gather(mi.Vector4f, self._corrections, at)
            for order, part in enumerate(parts, 1):
                added += part * dr.gather(mi.Vector4f, self._corrections, at + order * self._per_order)
            own = radiance[k] * weight + added * weight.w
            total += mi.Color3f(own.x, own.y, own.z)
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
