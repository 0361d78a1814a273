# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot rays: a few thousand rays of a picture, marched finely once, that measure the error of every stepping.

The error is the signal-to-noise ratio of the linear picture in dB, 10·log10(‖x‖²/‖x - y‖²) (thesis 4.2). The rays
estimate the whole picture as well as they sample its error. If a function has hard edges, a few rays in a thousand
carry nearly all of it; so a measurement has a standard error, and ``Pilot.denser`` takes more rays, up to every pixel
of the visible part of the picture. Where a stepping may be wrong in a few pixels only, ``Pilot.odd_pixels`` finds them,
and ``Pilot.joined`` measures these pixels themselves beside the sample of the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import REFERENCE, USUAL, Limits, Quadrature, quadratures_of
from spectral_core.volume.march.rules import Rule
from spectral_core.volume.pilot.places import (
    BAND,
    Places,
    RaySet,
    RayTracer,
    missed_by_sample,
    most_apart,
    on_device,
    places_with,
)
from spectral_core.volume.pilot.reference import limited_by_rounding, refined_reference, snr_db, worst
from spectral_core.volume.pilot.trials import (
    RAY,
    Trial,
    cheapest,
    falls_behind,
    finest_worth,
    is_beaten,
    next_log_scale,
)
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Array = NDArray[np.float64]

PILOT_RAYS = 4096
MOST_RAYS = 16 * PILOT_RAYS
# Steps of one voxel that also end at faces and turning points pass over no value, so that they see every small object;
# midpoints need shorter ones.
_SIGHT = Limits(1e-3, 1.0, 1.0 / 4.0, ends_at_faces=True, ends_at_turns=True)
_SIGHT_2D = Limits(1e-3, 1.0, 1.0 / 16.0, ends_at_faces=True)
_SIGHTS: dict[Quadrature, tuple[float, Limits]] = {"preintegrated": (1.0, _SIGHT), "midpoint": (1.0 / 16.0, _SIGHT_2D)}
# Shares of the measured error, and of their differences, that odd pixels have beyond what the sample expects of them.
_WORTH, _UNEXPECTED = 0.25, 0.35
_NARROW = 1.0 / 32.0  # of a voxel, on the way through a peak: more than thirty steps of a voxel pass it by for each hit
# Processor time of what else an iteration of the loop does, in iterations of the uniform midpoint march with one record
# packet, and of a ray's first value; fitted to 360 marches of fields and functions drawn by a seed.
_ADAPTIVE, _FACES, _PREINTEGRATED, _PACKET = 0.05, 0.05, 0.05, 0.1
_FIRST_VALUE = 0.6
# The error of uniform steps depends on how they align with the voxels: it goes up and down by 5 dB within a tenth of a
# step, so that some coarser steps do better than finer ones. Adaptive steps have no such alignment.
_TUNING: dict[Rule, tuple[float, ...]] = {
    "uniform": (1.07, 1.15, 1.23, 1.32, 1.41, 1.52, 1.62, 1.74, 1.87),
    "error": (1.12, 1.26, 1.41),
}
_IN_TUNE = (1.0, 1.02, 1.04)  # such a gain may lie within a fiftieth of a step
_FINEST, _COARSEST = 5e-3, 64.0  # scales beyond which the steps of every rule are at their limits
# Longer uniform steps, in voxels, are not planned: one or two steps per ray reach 40 dB in fog, but show as bands.
_LONGEST: dict[Rule, float] = {"uniform": 4.0}


class Pilot:
    """Pilot rays of one view with their fine reference.

    Parameters
    ----------
    renderer
        Marches the rays.
    view, transfer
        The picture that the rays sample.
    quality_db : float
        The reference is refined until it is clearly better than this.
    count : int
        Number of rays; all pixels where the picture has fewer.
    single
        (n, 2) columns and rows of pixels that are measured themselves; the other rays are a sample of the rest.
    before
        A pilot of as many sampled rays of this picture, and of the first of the single ones, whose marches are known.
    """

    def __init__(
        self,
        renderer: RayTracer,
        view: View,
        transfer: TransferFunction,
        quality_db: float,
        count: int = PILOT_RAYS,
        single: NDArray[np.int64] | None = None,
        before: Pilot | None = None,
    ) -> None:
        self.renderer, self.view, self.transfer, self.quality_db = renderer, view, transfer, quality_db
        self.parts = renderer.parts + transfer.has_dark  # the last part is the opacity, see ``_colors``
        self.places: Places = places_with(view, renderer.shown_corners(transfer), count, single)
        x, y, self.is_whole = self.places.x, self.places.y, self.places.is_whole
        self.count, self._quadrature = self.places.sampled, quadratures_of(transfer.uses_gradient)[-1]
        self._sets: list[RaySet] = [] if before is None else list(before._sets)
        self._seen: dict[tuple[float, float], Array] = {} if before is None else before._seen
        known = sum(each.count for each in self._sets)
        if known < len(x):
            first = self._sets[0] if self._sets else None
            keeps = count <= PILOT_RAYS
            self._sets.append(RaySet(renderer, view, transfer, x[known:], y[known:], keeps=keeps, first=first))
        self._tried: dict[Stepping, Trial] = {}
        made = refined_reference(self._referred(0), self._quadrature, quality_db + 6.0, self.parts)
        for rounding, (_, less_db) in enumerate(self._sets[0].roundings[1:], 1):
            made = limited_by_rounding(made, self._referred(rounding), self._quadrature, less_db, self.parts)
        self.reference, self.reference_db, self.reference_scale = made.colors, made.snr_db, made.scale
        self.is_rounded = made.is_rounded

    def _referred(self, rounding: int) -> Callable[[Stepping], Array]:
        return lambda way: self._march(way, REFERENCE, rounding)[0]

    @property
    def signal_spread(self) -> float:
        """Standard error of the picture's energy, relative to it: large where a sample meets a few bright pixels."""
        if self.is_whole:
            return 0.0
        return max(self._spread(part) for part in np.split(self.reference, self.parts, axis=-1))

    def _spread(self, colors: Array) -> float:
        """Standard error of the sum of the colors' energies, relative to it: a sum of unequal independent terms."""
        energies = np.sum(colors**2, axis=-1)
        return float(np.sqrt(np.sum(energies[: self.count] ** 2)) / np.sum(energies)) if energies.any() else 0.0

    @property
    def opacity(self) -> float:
        """Most light that a voxel takes or emits: extinction plus emission, times its longest edge."""
        materials = self.transfer.materials
        emission = [0.0 if m.emission is None else float(m.emission.max()) for m in materials]
        source = max(float(m.extinction.max()) + e for m, e in zip(materials, emission, strict=True))
        return source * float(self.renderer.volume.voxel_size.max())

    @property
    def is_narrow(self) -> bool:
        """True if the value may pass a peak, an edge or a gap within a small part of a voxel: few steps then meet it,
        and these few are wrong by all of it.
        """
        widths = np.concatenate([np.diff(material.values) for material in self.transfer.materials])
        return bool(widths[widths > 0].min(initial=np.inf) < _NARROW * self.renderer.steepest(self.transfer))

    def sharper(self) -> Pilot:
        """A pilot of the same rays whose reference has an error 25 dB smaller, as far as single precision allows."""
        return self._like(self.quality_db + 25.0)

    def denser(self, quality_db: float) -> Pilot:
        """A pilot of the same picture with four times the rays, for another quality."""
        return self._like(quality_db, times=4)

    def joined(self, pixels: NDArray[np.int64]) -> Pilot:
        """A pilot that measures the ``pixels`` (n, 2) themselves as well."""
        return self._like(self.quality_db, pixels=pixels)

    def _like(self, quality_db: float, *, times: int = 1, pixels: NDArray[np.int64] | None = None) -> Pilot:
        single = self.places.single if pixels is None else np.concatenate([self.places.single, pixels])
        known = self if times == 1 else None
        return Pilot(self.renderer, self.view, self.transfer, quality_db, times * self.count, single, known)

    def odd_pixels(self, trial: Trial, *, always: bool = False) -> NDArray[np.int64]:
        """(n, 2) columns and rows of the pixels in which a stepping is most likely wrong, ``PILOT_RAYS`` / 4 at most.

        Every pixel of the visible part is marched with ``trial`` and with steps that pass over no value. If more pixels
        are wrong than are returned, the sample of the others contains many of them. Without ``always`` there are none
        if the sample has its share of them, or if they would hardly change the error of ``trial``.
        """
        scale, limits = _SIGHTS[self._quadrature]
        fine = Stepping("uniform", self._quadrature, scale)

        def compared(x: Array, y: Array) -> tuple[Array, Array]:
            pixels = on_device(self.renderer, x, y)
            shown, place = self._traced(trial.stepping, USUAL, pixels), (float(x[0]), float(y[0]))
            seen = self._seen[place] if place in self._seen else self._traced(fine, limits, pixels)
            if self.places.pixels <= BAND:  # a search may follow for other steps; of larger pictures it is rare
                self._seen[place] = seen
            return np.sum((shown - seen) ** 2, axis=-1), np.sum(seen**2, axis=-1)

        corners = self.renderer.shown_corners(self.transfer)
        odd, apart, energy = most_apart(self.view, corners, compared, PILOT_RAYS // 4)
        whole, missed = missed_by_sample(self.places, self.view, odd, apart)
        least = _WORTH * energy * 10.0 ** (-trial.snr_db / 10.0)
        return odd if always or (missed > least and missed > _UNEXPECTED * whole) else odd[:0]

    def try_out(self, stepping: Stepping) -> Trial:
        """March the pilot rays with ``stepping``; each stepping once."""
        if stepping not in self._tried:
            colors, samples, steps = self._march(stepping)
            signal, error = worst(self.reference, colors - self.reference, self.parts)
            against = snr_db(signal, error)
            # An error below that of the reference cannot be measured.
            is_bound = math.isfinite(self.reference_db) and against >= self.reference_db
            snr = self.reference_db if is_bound else against
            # Over all pixels, or single ones, the sum is exact.
            spread = 0.0 if self.is_whole else self._spread(error)
            begin = RAY + _FIRST_VALUE * (stepping.quadrature == "preintegrated")
            iteration = self._iteration(stepping)
            self._tried[stepping] = Trial(stepping, snr, samples, steps, spread, iteration, is_bound, begin)
        return self._tried[stepping]

    def _iteration(self, stepping: Stepping) -> float:
        columns = len(self.transfer.materials) + self.transfer.has_emission
        integrates = stepping.quadrature == "preintegrated"
        packets = -(-(2 + (3 if integrates else 2) * columns) // 8)
        rule = _ADAPTIVE * (stepping.rule in ("error", "cells")) + _FACES * (stepping.rule == "cells")
        return 1.0 + rule + _PREINTEGRATED * integrates + _PACKET * (packets - 1)

    def tuned(self, way: Stepping, quality_db: float, within_db: float, rival: Trial | None = None) -> Trial:
        """As ``solve``, and then the coarsest of a few steps beyond that reaches the target as well.

        None of these is tried if even the longest one would be worse than ``rival``, which reaches the target.
        """
        best = self.solve(way, quality_db, within_db, rival=rival)
        factors = _TUNING.get(way.rule, _TUNING["error"])
        behind = rival is not None and falls_behind(best, rival, factors[-1], within_db)
        if best.snr_db < quality_db or behind:
            return best
        scale = best.stepping.scale
        further = [self.try_out(replace(way, scale=min(scale * factor, coarsest(way.rule)))) for factor in factors]
        return cheapest([best, *further], quality_db)

    def in_tune(self, trial: Trial, quality_db: float, rival: Trial) -> Trial:
        """The trial, or one of coarser steps that reaches the target with fewer samples than ``rival``.

        Hard-edged and opaque objects make the error of uniform steps go up and down by up to 40 dB within a tenth of a
        step, so that a search along the curve misses the steps in tune with the voxels, or ends at finer ones than the
        coarsest of them.
        """
        scale = trial.stepping.scale * max(trial.samples / max(rival.samples, 1e-9), 1.0)
        steps = [min(scale * factor, coarsest("uniform")) for factor in (*_IN_TUNE, *_TUNING["uniform"])]
        found = [self.try_out(replace(trial.stepping, scale=each)) for each in dict.fromkeys(steps)]
        return cheapest([trial, *found], quality_db)

    def solve(
        self, way: Stepping, quality_db: float, within_db: float, tries: int = 7, rival: Trial | None = None
    ) -> Trial:
        """The cheapest trial of ``way`` that reaches ``quality_db``; the one of greatest SNR if none does.

        The scale is found by secant steps on dB against log scale, from the scale of ``way``, until a trial lies at
        most ``within_db`` above the target. Trials below the target are never the answer if one reached it. The search
        ends at a trial below the target that takes more time and more samples than ``rival``, which reaches it: finer
        steps take even more.
        """
        trials = [self.try_out(way)]
        for _ in range(tries - 1):
            if any(0.0 <= t.snr_db - quality_db < within_db for t in trials):
                break
            wanted = math.exp(next_log_scale(trials, quality_db + 0.5 * within_db))
            if rival is not None and trials[-1].snr_db < quality_db:
                wanted = max(wanted, finest_worth(trials[-1], rival))
            scale = float(np.clip(wanted, _FINEST, coarsest(way.rule)))
            if any(abs(math.log(scale / t.stepping.scale)) < 1e-3 for t in trials):
                break
            trials.append(self.try_out(replace(way, scale=scale)))
            if trials[-1].steps == trials[-2].steps and scale > trials[-2].stepping.scale:
                break  # the rule's longest step is reached: no coarser stepping exists
            if rival is not None and is_beaten(trials[-1], rival, quality_db):
                break
        return cheapest(trials, quality_db)

    def _march(self, stepping: Stepping, limits: Limits = USUAL, rounding: int = 0) -> tuple[Array, float, float]:
        """Colors of the pilot rays, times the root of what each counts; mean samples and iterations."""
        parts = [each.march(stepping, limits, rounding) for each in self._sets]
        channels = [np.concatenate(each) for each in zip(*parts, strict=True)]
        weights = self.places.weights
        samples, steps = (float(np.average(each, weights=weights)) for each in channels[-2:])
        return self._colors(channels, self.renderer) * np.sqrt(weights)[:, None], samples, steps

    def _traced(self, stepping: Stepping, limits: Limits, pixels: tuple[Any, Any]) -> Array:
        sight = self.renderer.sight
        return self._colors(sight.trace(self.view, self.transfer, stepping, pixels, limits), sight)

    def _colors(self, channels: list[NDArray[Any]], renderer: RayTracer) -> Array:
        """The picture of marched rays; with dark materials their opacity, too, as an error of these hardly shows in the
        light.
        """
        palette = renderer.palette(self.transfer)
        colors: Array = np.stack(channels[: len(palette)], axis=-1).astype(np.float64) @ palette
        opacity = np.tile(1.0 - channels[-3].astype(np.float64)[:, None], palette.shape[1] // renderer.parts)
        return np.append(colors, opacity, axis=-1) if self.transfer.has_dark else colors


def coarsest(rule: Rule) -> float:
    """Largest scale of the steps of a rule that is planned."""
    return _LONGEST.get(rule, _COARSEST)
