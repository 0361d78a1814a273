# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent surfaces on paths: a path from the camera continues at wavelengths that excite dyes.

At a hit with dyes a path either stays at its wavelengths, and the surface reflects, or continues at others, λ', and the
surface is diffuse with the reradiation D(λ, λ') = Σ amount · emission density(λ) · excitation(λ'). λ' is drawn by
excitation times the scene's lights, in cells that end at the lights' knots (``wavelengths``), so that a lamp of one
line excites without noise. The throughput is divided by the probability of the choice.

The tables of a dye have its own knots beside the whole nm: of a line that is emitted between two whole nm, these alone
would show nothing, and of one of 0.2 nm at a whole nm five times its power.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import Rows, table
from spectral_core.render.trace.below.leaving import exit_normal, outer_normal
from spectral_core.render.trace.wavelengths import cell_edges, share_by_cell, single_precision_spectrum
from spectral_core.scene import Fluorescent
from spectral_core.scene.fluorescent import EXCITED_NM
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]

FLAT_SHARE = 0.2
"""Share of wavelengths that are drawn by excitation alone, for light that other surfaces reflect or emit."""
LEAST_CHANCE, MOST_CHANCE = 0.05, 0.95
"""Probability of continuing at other wavelengths, if a dye emits at those of the path."""


@dataclass(frozen=True, slots=True, eq=False)
class Dyed:
    """Fluorescence of a material: closures, each with the texture of its share of the surface (None for all of it), and
    the shapes with the material.
    """

    parts: list[tuple[Fluorescent, Any | None]] = field(default_factory=list)
    shapes: list[Any] = field(default_factory=list)


class Reradiation:
    """Tables of the excitation and emission of the dyes of shapes.

    ``lights``: spectra of the scene's lights. ``teeth``: different wavelengths per path, 4 or 1.
    """

    def __init__(self, mitsuba: Any, dyed: Sequence[Dyed], lights: Sequence[Spectrum], teeth: int = 4) -> None:
        import drjit as dr

        mi = self._mi = mitsuba
        self._teeth = teeth
        counts = [sum(len(closure.dyes) for closure, _ in item.parts) for item in dyed]
        self._dyes = max(counts)
        dyes = [dye for item in dyed for closure, _ in item.parts for dye in closure.dyes]
        taken = [dye.excitation for dye in dyes]
        knots = cell_edges([*taken, *(dye.emission for dye in dyes)], EXCITED_NM)
        self._knots, self._is_even = table(mi.Float, knots), knots.size == EXCITED_NM.size
        self._size = knots.size - 1
        excitation, emission = np.zeros((2, len(dyed), self._dyes, self._size, 2))
        self._weights: list[tuple[int, int, Any]] = []
        """Material's row from 1, number of one of its dyes, and that dye's share of the surface."""
        for row, item in enumerate(dyed):
            k = 0
            for closure, weight in item.parts:
                for dye, amount in zip(closure.dyes, closure.amounts, strict=True):
                    excitation[row, k] = _ends_of_cells(dye.excitation, knots)
                    emission[row, k] = amount * _ends_of_cells(dye.emission, knots) / dye.emission_area
                    if weight is not None:
                        self._weights.append((row + 1, k, weight))
                    k += 1
        # Tables, not constants of the kernel: another dye needs no new kernel.
        self._excitation, self._emission = table(mi.Float, excitation), table(mi.Float, emission)
        edges = cell_edges([*lights, *taken], EXCITED_NM)
        self._cells = edges.size - 1
        self._starts, self._widths = table(mi.Float, edges[:-1]), table(mi.Float, np.diff(edges))
        draws = [_cumulative(edges, lights, knots, *both) for both in zip(excitation, emission, strict=True)]
        self._cumulative = table(mi.Float, np.stack(draws))
        seen = np.stack([_seen_light([closure for closure, _ in item.parts], lights, knots) for item in dyed])
        seen = np.stack([seen[..., :-1], seen[..., 1:]], axis=-1)
        self._sent, self._left = table(mi.Float, seen[:, 0]), table(mi.Float, seen[:, 1])
        numbers = [
            (int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]), row + 1)
            for row, item in enumerate(dyed)
            for shape in item.shapes
        ]
        # By Mitsuba's number of a shape: one lookup at a hit finds the dyes. 0: not fluorescent.
        rows = np.zeros(max((number for number, _ in numbers), default=0) + 1, np.uint32)
        for number, row in numbers:
            rows[number] = row
        self._rows = Rows.of(table(mi.UInt32, rows))

    def shift(self, si: Any, sampler: Any, active: Any) -> tuple[Any, Any, Any]:
        """Wavelengths at which a path continues, the factor on its throughput, and True if they differ from those
        before.
        """
        import drjit as dr

        mi = self._mi
        shape = dr.reinterpret_array(mi.UInt32, si.shape)
        row = self._rows.look_up(shape, active=active)
        dyed = active & (row > 0)
        weights = self._weights_at(si, row, dyed)
        index = row - 1
        sent, left = mi.Float(0.0), mi.Float(0.0)
        own = [self._place(si.wavelengths[k], dyed) for k in range(4)]
        for place in own:
            # One decision for all four wavelengths of the path, by the light that the observer sees of all.
            sent += self._at(self._sent, index, place)
            left += self._at(self._left, index, place)
        chance = sent / dr.maximum(left, 1e-30)
        chance = dr.select(
            dyed & (chance > 0.0) & (sum(weights) > 0.0), dr.clip(chance, LEAST_CHANCE, MOST_CHANCE), 0.0
        )
        pick, place = sampler.next_1d(), sampler.next_1d()
        shifted = dyed & (pick < chance)
        found: list[Any] = []
        factors: list[Any] = []
        for k in range(4):
            # Under dispersion the four are one wavelength; four exciting ones would separate them.
            if k and self._teeth == 1:
                found.append(found[0])
                factors.append(factors[0])
                continue
            # A comb again: four numbers a quarter apart from one random number, as the path's own wavelengths are.
            moved = place + 0.25 * k
            wavelength, density = self._drawn(index, moved - dr.floor(moved), shifted)
            reradiated, excited = mi.Float(0.0), self._place(wavelength, shifted)
            for dye, weight in enumerate(weights):
                which = index * self._dyes + dye
                sent = weight * self._at(self._emission, which, own[k])
                reradiated += sent * self._at(self._excitation, which, excited)
            found.append(wavelength)
            # D(λ, λ') over the probability of this choice; the surface's cosine and π belong to the even lobe.
            factors.append(reradiated / dr.maximum(density * chance, 1e-30))
        # The paths that stay carry the weight of those that changed.
        stays = dr.rcp(1.0 - chance)
        factor = dr.select(shifted, mi.Spectrum(*factors), mi.Spectrum(stays))
        return dr.select(shifted, mi.Spectrum(*found), si.wavelengths), factor, shifted

    def _weights_at(self, si: Any, row: Any, active: Any) -> list[Any]:
        """Share of the surface of each dye."""
        import drjit as dr

        weights = [self._mi.Float(1.0) for _ in range(self._dyes)]
        for number, dye, texture in self._weights:
            mine = active & (row == number)
            weights[dye] = dr.select(mine, dr.maximum(texture.eval_1(si, mine), 0.0), weights[dye])
        return weights

    def _drawn(self, row: Any, place: Any, active: Any) -> tuple[Any, Any]:
        """Exciting wavelength of a number in [0, 1), and its density per nm."""
        import drjit as dr

        mi = self._mi
        first = row * (self._cells + 1)

        def cumulative(cell: Any) -> Any:
            return dr.gather(mi.Float, self._cumulative, first + cell, active)

        # Inverse of the cumulative distribution; within a cell the density is constant, so the rest is linear.
        cell = dr.binary_search(0, self._cells, lambda cell: cumulative(cell + 1) <= place)
        cell = dr.minimum(cell, self._cells - 1)
        low, high = cumulative(cell), cumulative(cell + 1)
        start, width = (dr.gather(mi.Float, of, cell, active) for of in (self._starts, self._widths))
        share = dr.maximum(high - low, 1e-12)
        within = dr.clip((place - low) / share, 0.0, 1.0)
        return dr.fma(width, within, start), share / dr.maximum(width, 1e-12)

    def _place(self, wavelength: Any, active: Any) -> tuple[Any, Any, Any]:
        """Cell of the tables of a wavelength, its position within the cell, and True if it is in any."""
        import drjit as dr

        mi = self._mi
        first, last = float(EXCITED_NM[0]), float(EXCITED_NM[-1])
        inside = active & (wavelength >= first) & (wavelength <= last)
        if self._is_even:
            low = mi.UInt32(dr.clip(wavelength - first, 0.0, self._size - 1.0))
            return low, wavelength - first - mi.Float(low), inside
        begins = lambda cell: dr.gather(mi.Float, self._knots, cell, inside) <= wavelength  # noqa: E731
        low = dr.clip(dr.binary_search(0, self._size, begins), 1, self._size) - 1
        start, end = (dr.gather(mi.Float, self._knots, low + k, inside) for k in (0, 1))
        return low, (wavelength - start) / dr.maximum(end - start, 1e-12), inside

    def _at(self, values: Any, row: Any, place: tuple[Any, Any, Any]) -> Any:
        """A row of a table at a place, linear within its cell and zero outside of all."""
        import drjit as dr

        low, within, inside = place
        ends = dr.gather(self._mi.Vector2f, values, row * self._size + low, inside)
        return dr.select(inside, dr.lerp(ends.x, ends.y, within), 0.0)


def even_lobe(integrator: Any, si: Any, path: Any, sampler: Any, active: Any) -> tuple[Any, Any]:
    """True if light leaves diffusely for any closure, and the normal about which it leaves.

    This holds for light from below the surface, and for the emission of a dye: the path then continues at the
    wavelengths that excite the dye.
    """
    import drjit as dr
    import mitsuba as mi

    toward, tables = mi.Vector3f(si.dn_du), integrator.tables.reradiation
    if tables is None:
        return path.leaves, exit_normal(mi, dr, integrator.tables, si, -toward, path.leaves & active)
    others, factor, shifted = tables.shift(si, sampler, active & ~path.leaves)
    si.wavelengths = others
    path.throughput *= factor
    normal = outer_normal(mi, dr, si, toward)
    if integrator.tables.subsurface:
        normal = dr.select(
            path.leaves, exit_normal(mi, dr, integrator.tables, si, -toward, path.leaves & active), normal
        )
    return path.leaves | shifted, normal


def _ends_of_cells(spectrum: Spectrum, knots: Array) -> Array:
    """(m, 2) a spectrum at the start and the end of the cells between ``knots``: it may jump to zero at its ends."""
    own, values = single_precision_spectrum(spectrum)
    found = np.interp(knots, own, values, left=0.0, right=0.0)
    inside = (knots[:-1] >= own[0]) & (knots[1:] <= own[-1])
    return np.asarray(np.stack([found[:-1], found[1:]], axis=1) * inside[:, None])


def _response(nm: Array) -> Array:
    """(n,) the observer's response to light of each wavelength: the sum of the color matching functions."""
    viewer = observer(STANDARD)
    return np.interp(nm, viewer.wavelengths_nm, viewer.cmfs.sum(axis=0), left=0, right=0)


def _cumulative(edges: Array, lights: Sequence[Spectrum], knots: Array, excitation: Array, emission: Array) -> Array:
    """(m + 1,) cumulative probability of exciting wavelengths, in cells between ``edges``; ``excitation``,
    ``emission``: (dyes, n, 2) of a surface, at both ends of cells between ``knots``.
    """
    middle, sent = (knots[1:] + knots[:-1]) / 2, emission.mean(axis=2) * np.diff(knots)
    # dyes are weighted by the observer's response to their emission; a tenth more for the excitation of other dyes
    shares = sent @ _response(middle) + 0.1 * sent.sum(axis=1)
    zero = np.zeros((len(excitation), 1))
    before, behind = np.append(zero, excitation[..., 1], axis=1), np.append(excitation[..., 0], zero, axis=1)
    wanted = shares @ np.maximum(before, behind)
    flat = share_by_cell(edges, knots, wanted)
    lit = np.zeros_like(flat)
    for light in lights:
        lit += share_by_cell(edges, knots, wanted, light)
    if lit.sum() > 0:
        flat = FLAT_SHARE * flat + (1 - FLAT_SHARE) * lit / lit.sum()
    return np.concatenate([[0.0], np.cumsum(flat)]) / max(float(flat.sum()), 1e-300)


def _seen_light(closures: Sequence[Fluorescent], lights: Sequence[Spectrum], knots: Array) -> Array:
    """(2, n) what the observer sees, at each wavelength, of the light that dyes of a surface send out, and of all that
    leaves it, under all lights.
    """
    grid = SpectralGrid(knots)
    light = np.zeros(knots.size)
    for spectrum in lights:
        light += spectrum.resampled(grid, average=True).values
    # A twentieth of even light: the emission of other dyes or surfaces may excite as well.
    light += 0.05 * float(light.mean()) if light.any() else 1.0
    mean = Spectrum("light", grid, light)
    sent = np.sum([closure.sent_out(mean, knots) for closure in closures], axis=0)
    reflected = [
        closure.reflected(knots) if closure.checks_energy else np.full(knots.size, 0.5) for closure in closures
    ]
    seen = _response(knots)
    seen += 0.05 * float(seen.max())  # invisible light counts a little: it may excite other dyes
    total = (sent + np.mean(reflected, axis=0) * light) * seen
    return np.stack([sent * seen, total]) / max(float(total.max()), 1e-300)
