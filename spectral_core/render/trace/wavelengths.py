# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths to trace and their weights in the picture.

Radiance is integrated against measurement functions (the observer's three, or spectral bands) that are linear between
knots of 1 nm. Four wavelengths per path are drawn where the picture's channels and the lights have their power, in
cells that end at the knots of the lights, so that a sodium lamp or a laser is as quiet as daylight; and where the
scene's reflectances send that power to the eye, so that a designed reflectance that is high near 700 nm alone shows
its color from the first samples on. The four are a comb with teeth about a quarter apart in probability, whose position
is one dimension of the path's Sobol point (``measure.wavelength_sets``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_declared, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.render.trace.measure.sensitivity import responses_at_1_nm, sensitivity
from spectral_core.render.trace.measure.slots import in_slots
from spectral_core.render.trace.measure.wavelength_sets import WavelengthSets, wavelength_sets
from spectral_core.spectra.observer import integration_points
from spectral_core.spectra.spectrum import FIRST_NM, LAST_NM, WAVELENGTHS_NM, Spectrum

Array = NDArray[np.float64]

_OBSERVER_SHARE = 0.2
"""Share of samples that follow the picture's channels alone, for wavelengths of indirect light or fluorescence."""
_REFLECTED_SHARE = 0.4
"""Share of samples that follow lights times reflectances, if some are given as spectra. Light that hits no such surface
keeps half of its samples: at most twice its variance, while a spike gains ten times and more.
"""
MOST_LIGHT_KNOTS = 2048
"""Most knots of lights between whole nm that are ends of cells. The least important ones beyond are ignored: the
picture converges to the same integral, with a little more noise.
"""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Spectral channels to measure beside the picture.

    ``names``: one per channel. ``responses``: (n_bands, 471) at 360 to 830 nm, 1 nm; a channel is ∫ L · response dλ.
    ``pieces``: (3, n_bands, 470), responses at the start, middle and end of each 1 nm cell, for responses that are
    quadratic within a cell and may be discontinuous between cells; None if ``responses`` are linear in between.
    """

    names: tuple[str, ...]
    responses: Array
    pieces: Array | None = None

    def __post_init__(self) -> None:
        require_declared(self)
        shape = (len(self.names), WAVELENGTHS_NM.size)
        object.__setattr__(self, "responses", frozen_array("band responses", self.responses, shape))
        if self.pieces is not None:
            pieces = frozen_array("band pieces", self.pieces, (3, shape[0], shape[1] - 1))
            object.__setattr__(self, "pieces", pieces)
        if len(set(self.names)) < len(self.names):
            raise InvalidInputError("two spectral bands share a name; give each its own")

    @classmethod
    def uniform(cls, start_nm: float = 400.0, stop_nm: float = 700.0, count: int = 31) -> Bands:
        """Mean radiance per nm around ``count`` equally spaced wavelengths: triangles that overlap to 1 everywhere.

        Named by their center wavelength in nm. Raises InvalidInputError outside 360 to 830 nm, and for fewer than 2 or
        more than one per nm.
        """
        count = require_whole("count of spectral bands", count, 2, LAST_NM - FIRST_NM + 1)
        if not (FIRST_NM <= start_nm < stop_nm <= LAST_NM):
            raise InvalidInputError(
                f"bands from {start_nm:g} to {stop_nm:g} nm; expected a rising range in {FIRST_NM} to {LAST_NM} nm"
            )
        centers = np.linspace(start_nm, stop_nm, count)
        step = centers[1] - centers[0]
        if step < 1:
            raise InvalidInputError(f"bands {step:g} nm apart; expected 1 nm or more")
        hats = np.maximum(0.0, 1 - np.abs(WAVELENGTHS_NM - centers[:, None]) / step)
        return cls(tuple(f"{center:.6f}" for center in centers), hats / step)


@dataclass(frozen=True, slots=True, eq=False)
class WavelengthPlan:
    """Density of wavelengths, and the measured responses.

    ``edges_nm``: (m + 1,) ends of m cells of constant density: the whole nm and the knots of lights between them, in
    single precision as the renderer has them. ``probability``: (m,), multiples of 1 / ``slots.SLOTS``, sums to 1.
    ``responses``: (n_channels, 471) at whole nm, x̄ ȳ z̄ first. ``pieces``: (3, n_channels, m), the responses at the
    start, middle and end of each cell, in which they are quadratic. ``teeth``: different wavelengths per path, 4, or 1
    where glass disperses (the path of one wavelength is then not that of another). ``sets``: the sets of four and their
    weights; None with one wavelength, and for equal weights.
    """

    edges_nm: Array
    probability: Array
    responses: Array
    pieces: Array
    teeth: int = 4
    sets: WavelengthSets | None = None

    @property
    def widths_nm(self) -> Array:
        """Width of each cell, (m,)."""
        return np.diff(self.edges_nm)


def plan_wavelengths(
    lights: Sequence[Spectrum],
    bands: Bands | None = None,
    *,
    reflectances: Sequence[Spectrum] = (),
    colors: Sequence[Spectrum] = (),
    disperses: bool = False,
    follow_bands: bool = True,
) -> WavelengthPlan:
    """Draw in proportion to the picture's response to all ``lights``, plus a fifth by its ``sensitivity`` alone.

    With ``reflectances``, two fifths follow the picture's response to the lights after each reflectance, in equal
    shares. They and the smooth reflectances of ``colors`` determine how often each channel of the picture is sampled,
    and the weights of the sets. With ``bands`` half of all follow these, so that every channel gets samples; without
    ``follow_bands`` they do not, and there are no sets: the same wavelengths are then drawn, with equal weights,
    whatever is measured.
    """
    counted = _counted(lights)
    edges = cell_edges([light for light, _ in counted])
    cmfs = responses_at_1_nm()
    # Equal shares of each light, not of their powers: a dim lamp alone in a corner is sampled as well as a bright one.
    tints = [spectrum.at(WAVELENGTHS_NM) for spectrum in (*reflectances, *colors)]
    has_sets = follow_bands and not disperses
    share = share_by_cell(edges, WAVELENGTHS_NM, sensitivity(of_sets=has_sets))
    power = np.zeros_like(share)
    for light, count in counted:
        response = sensitivity(light, tints, of_sets=has_sets)
        power += count * share_by_cell(edges, WAVELENGTHS_NM, response, light)
    if power.sum() > 0:
        power /= power.sum()
        reflected = _reflected(edges, power, reflectances)
        straight = 1 - _OBSERVER_SHARE - (_REFLECTED_SHARE if reflected.any() else 0.0)
        share = _OBSERVER_SHARE * share + straight * power + _REFLECTED_SHARE * reflected
    # The picture's three responses come first, so that every reader knows their index.
    responses = cmfs if bands is None else np.concatenate([cmfs, bands.responses])
    if bands is not None and follow_bands:
        wanted = share_by_cell(edges, WAVELENGTHS_NM, bands.responses.sum(axis=0))
        # Half for the picture, half for the channels: either has at most twice the variance of a separate render.
        share = 0.5 * share + 0.5 * wanted if wanted.any() else share
    pieces = _pieces(edges, cmfs, bands)
    # A response over a cell of zero density would be lost: every measured cell keeps some density.
    measured = np.any(pieces != 0, axis=(0, 1))
    probability = in_slots(share, measured)
    sets = wavelength_sets(edges, probability, pieces, counted, reflectances, colors) if has_sets else None
    return WavelengthPlan(edges, probability, responses, pieces, 1 if disperses else 4, sets)


def noise_of(light: Spectrum, plan: WavelengthPlan) -> float:
    """Variance of the picture's response to a light with the wavelengths of a plan, over that of wavelengths drawn in
    proportion to the response, 1; 0 for a light that the picture does not show.
    """
    points, weights = integration_points(plan.edges_nm, light.grid.wavelengths_nm)
    response = sensitivity(light, of_sets=plan.sets is not None)
    amount = np.maximum(light.at(points), 0.0) * np.interp(points, WAVELENGTHS_NM, response, left=0.0, right=0.0)
    cell = np.clip(np.searchsorted(plan.edges_nm, points, side="right") - 1, 0, plan.edges_nm.size - 2)
    density = np.maximum(plan.probability / plan.widths_nm, 1e-30)[cell]
    total = float(weights @ amount)
    return float(weights @ (amount**2 / density)) / total**2 if total > 0 else 0.0


def _counted(lights: Sequence[Spectrum]) -> list[tuple[Spectrum, float]]:
    """Different spectra and the number of lights of each, the most frequent first."""
    found: dict[bytes, tuple[Spectrum, float]] = {}
    for light in lights:
        key = light.grid.wavelengths_nm.tobytes() + light.values.tobytes()
        found[key] = (light, found[key][1] + 1.0 if key in found else 1.0)
    return sorted(found.values(), key=lambda pair: -pair[1])


def single_precision_spectrum(spectrum: Spectrum) -> tuple[Array, Array]:
    """Give knots (nm) that single precision holds, and values, with the same integral around every knot.

    The renderer computes in single precision, whose numbers are 6e-5 nm apart at 600 nm. Rounding the knots alone would
    change the power of a line of 0.01 nm by half a percent; here each value compensates the change of its hat's width.
    Knots with equal rounded values are merged.
    """
    knots, values = spectrum.grid.wavelengths_nm, spectrum.values
    # Whole and half nm are exact in single precision: most spectra pass unchanged.
    rounded = _single(knots)
    if np.array_equal(rounded, knots):
        return knots, values
    held, index = np.unique(rounded, return_inverse=True)
    if held.size < 2:  # the whole spectrum is narrower than the spacing: the narrowest possible triangle
        at = np.float32(held[0])
        held = np.array([np.nextafter(at, np.float32(0)), at, np.nextafter(at, np.float32(1e9))], dtype=np.float64)
        index = np.ones(knots.size, dtype=np.intp)
    # Merged knots give their areas to the common knot.
    areas = np.bincount(index, values * _hat_areas(knots), held.size)
    return held, areas / _hat_areas(held)


def _single(values: Array) -> Array:
    return values.astype(np.float32).astype(np.float64)


def _hat_areas(knots: Array) -> Array:
    steps = np.diff(knots)
    return (np.concatenate([[0.0], steps]) + np.concatenate([steps, [0.0]])) / 2


def cell_edges(lights: Sequence[Spectrum], whole_nm: Array = WAVELENGTHS_NM) -> Array:
    """Whole nm and the lights' knots between them, in single precision: (m + 1,) ends of m cells."""
    found, weights = [np.zeros(0)], [np.zeros(0)]
    for light in lights:
        knots, values = single_precision_spectrum(light)
        # Whole nm are edges anyway.
        between = (knots != np.round(knots)) & (knots > whole_nm[0]) & (knots < whole_nm[-1])
        if between.sum() > MOST_LIGHT_KNOTS:
            # power in the wrong position if a cell does not end at this knot, relative to the light's. A knot is
            # important by the change of slope there: feet and tip of a line, not the slope between.
            slope = np.diff(values) / np.diff(knots)
            bend = np.abs(np.diff(slope, prepend=slope[0], append=slope[-1])) * _hat_areas(knots)
            importance = bend * _hat_areas(knots) / max(float((values * _hat_areas(knots)).sum()), 1e-300)
        else:
            importance = np.ones_like(values)
        found.append(knots[between])
        weights.append(importance[between])
    extra, weight = np.concatenate(found), np.concatenate(weights)
    if extra.size > MOST_LIGHT_KNOTS:
        # The largest changes of slope first: a cell across a small one loses least.
        extra = extra[np.argsort(-weight, kind="stable")[:MOST_LIGHT_KNOTS]]
    return np.union1d(whole_nm, extra)


def share_by_cell(edges: Array, nm: Array, response: Array, light: Spectrum | None = None) -> Array:
    """Share of ∫ light · response dλ of each cell, (m,); zeros if there is none. ``response``: at ``nm``."""
    knots = [] if light is None else [light.grid.wavelengths_nm]
    # Exact for products of linear pieces, as everywhere in the integration of spectra.
    points, weights = integration_points(edges, *knots)
    amount = weights * np.interp(points, nm, response)
    amount = amount if light is None else amount * light.at(points)
    # Every point lies inside one cell, as edges are among the knots of the rule.
    cell = np.clip(np.searchsorted(edges, points, side="right") - 1, 0, edges.size - 2)
    total = np.maximum(np.bincount(cell, amount, edges.size - 1), 0.0)
    return total / total.sum() if total.sum() > 0 else np.zeros_like(total)


def _reflected(edges: Array, power: Array, reflectances: Sequence[Spectrum]) -> Array:
    """Share of reflected light of each cell, the mean over reflectances, (m,); zeros if there is none."""
    # A reflectance changes little within 1 nm: its value at the middle represents the cell.
    middle = (edges[:-1] + edges[1:]) / 2
    total = np.zeros_like(power)
    for reflectance in reflectances:
        light = power * np.maximum(reflectance.at(middle), 0.0)
        if light.sum() > 0:
            total += light / light.sum()
    return total / total.sum() if total.sum() > 0 else total


def _pieces(edges: Array, cmfs: Array, bands: Bands | None) -> Array:
    """Responses at the start, middle and end of each cell, (3, channels, m)."""
    # Responses are known per whole nm: each cell takes its part of the polynomial of its nm.
    nm = np.floor(edges[:-1]).astype(np.intp) - FIRST_NM
    ends = (edges[:-1], (edges[:-1] + edges[1:]) / 2, edges[1:])
    within = [end - FIRST_NM - nm for end in ends]
    linear = cmfs if bands is None or bands.pieces is not None else np.concatenate([cmfs, bands.responses])
    measured = np.stack([linear[:, nm] * (1 - t) + linear[:, nm + 1] * t for t in within])
    if bands is None or bands.pieces is None:
        return measured
    first, middle, last = (piece[:, nm] for piece in bands.pieces)
    # Lagrange's polynomials through start, middle and end.
    quadratic = [first * (1 - t) * (1 - 2 * t) + middle * 4 * t * (1 - t) + last * t * (2 * t - 1) for t in within]
    return np.concatenate([measured, np.stack(quadratic)], axis=1)
