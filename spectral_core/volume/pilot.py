# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot rays: a few thousand rays of a picture, marched finely once, that measure the error of every stepping.

The error is the signal-to-noise ratio of the linear picture in dB, 10·log10(‖x‖²/‖x - y‖²) (thesis 4.2). The rays
estimate the whole picture as well as they sample its error. If a function has hard edges, a few rays in a thousand
carry nearly all of it; so a measurement has a standard error, and ``Pilot.denser`` takes more rays, up to every pixel
of the visible part of the picture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.image import Stepping, palette_matrix
from spectral_core.volume.march.march_input import REFERENCE, USUAL, Limits, quadratures_of
from spectral_core.volume.march.rules import Rule
from spectral_core.volume.pilot_reference import limited_by_rounding, refined_reference, snr_db
from spectral_core.volume.pilot_rounding import Rounded, other_roundings
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Array = NDArray[np.float64]

PILOT_RAYS = 4096
MOST_RAYS = 16 * PILOT_RAYS
# Processor time of what else an iteration of the loop does, in iterations of the uniform midpoint march with one record
# packet, and of a ray before its first iteration; fitted to 360 marches of fields and functions drawn by a seed.
_ADAPTIVE, _FACES, _PREINTEGRATED, _PACKET = 0.05, 0.05, 0.05, 0.1
_RAY, _FIRST_VALUE = 1.6, 0.6
# The error of uniform steps depends on how they align with the voxels: it goes up and down by 5 dB within a tenth of a
# step, so that some coarser steps do better than finer ones. Adaptive steps have no such alignment.
_TUNING: dict[Rule, tuple[float, ...]] = {
    "uniform": (1.07, 1.15, 1.23, 1.32, 1.41, 1.52, 1.62, 1.74, 1.87),
    "error": (1.12, 1.26, 1.41),
}
_IN_TUNE = (1.0, 1.02, 1.04)  # such a gain may lie within a fiftieth of a step
_MORE = 1.06  # times the samples of a rival at which a search ends: more than auto asks a rival to save
_FINEST, _COARSEST = 5e-3, 64.0  # scales beyond which the steps of every rule are at their limits
# Longer uniform steps, in voxels, are not planned: one or two steps per ray reach 40 dB in fog, but show as bands.
_LONGEST: dict[Rule, float] = {"uniform": 4.0}


class RayTracer(Rounded, Protocol):
    """The methods of a renderer that a pilot calls."""

    def shown_corners(self, transfer: TransferFunction) -> Array:
        """World corners (8, 3) of the part of the field that is visible under ``transfer``."""

    def trace(
        self, view: View, transfer: TransferFunction, stepping: Stepping, pixels: tuple[Any, Any], limits: Limits
    ) -> list[NDArray[Any]]:
        """Amounts per material, transmittance, samples and iterations of the rays through ``pixels``."""


@dataclass(frozen=True)
class Trial:
    """A stepping tried on the pilot rays: SNR in dB, and samples and iterations of the loop per ray.

    ``spread`` is the standard error of the error energy relative to that energy: 0 if the rays are all pixels.
    ``iteration`` is the time of one iteration and ``begin`` the time of a ray before its first one; the unit of both is
    one iteration of a uniform midpoint march. ``is_bound``: the error is smaller than that of the reference, so that
    ``snr_db`` is the least value that it may have.
    """

    stepping: Stepping
    snr_db: float
    samples: float
    steps: float
    spread: float = 0.0
    iteration: float = 1.0
    is_bound: bool = False
    begin: float = _RAY

    @property
    def cost(self) -> float:
        """Time of the march in iterations of a midpoint march, per ray."""
        return self.begin + self.iteration * self.steps


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
    """

    def __init__(
        self, renderer: RayTracer, view: View, transfer: TransferFunction, quality_db: float, count: int = PILOT_RAYS
    ) -> None:
        self.renderer, self.view, self.transfer, self.quality_db = renderer, view, transfer, quality_db
        self.palette = palette_matrix(transfer)
        x, y, self.is_whole = pilot_places(view, renderer.shown_corners(transfer), count)
        self.count, self._quadrature = len(x), quadratures_of(transfer.uses_gradient)[-1]
        self.pixels = (renderer.types.Float64(x), renderer.types.Float64(y))
        self._tried: dict[Stepping, Trial] = {}
        made = refined_reference(lambda way: self._march(way, REFERENCE)[0], self._quadrature, quality_db + 6.0)
        for changed, less_db in other_roundings(renderer, view, transfer, x, y):
            made = limited_by_rounding(made, partial(self._referred, changed), self._quadrature, less_db)
        self.reference, self.reference_db, self.reference_scale = made.colors, made.snr_db, made.scale
        self.is_rounded = made.is_rounded

    def _referred(self, changed: dict[str, Any], way: Stepping) -> Array:
        return self._march(way, REFERENCE, **changed)[0]

    def sharper(self) -> Pilot:
        """A pilot of the same rays whose reference has an error 25 dB smaller, as far as single precision allows."""
        return Pilot(self.renderer, self.view, self.transfer, self.quality_db + 25.0, self.count)

    def denser(self, quality_db: float) -> Pilot:
        """A pilot of the same picture with four times the rays, for another quality."""
        return Pilot(self.renderer, self.view, self.transfer, quality_db, 4 * self.count)

    def misses(self, trial: Trial, quality_db: float) -> bool:
        """True if a stepping without an error on the pilot rays has one on many more: tips that few of them graze."""
        x, y, _ = pilot_places(self.view, self.renderer.shown_corners(self.transfer), MOST_RAYS)
        pixels = (self.renderer.types.Float64(x), self.renderer.types.Float64(y))
        fine = Stepping("error", self._quadrature, self.reference_scale)
        colors = self._march(fine, REFERENCE, pixels)[0]
        return snr_db(colors, self._march(trial.stepping, pixels=pixels)[0] - colors) < quality_db

    def try_out(self, stepping: Stepping) -> Trial:
        """March the pilot rays with ``stepping``; each stepping once."""
        if stepping not in self._tried:
            colors, samples, steps = self._march(stepping)
            energies = np.sum((colors - self.reference) ** 2, axis=-1)
            against = snr_db(self.reference, colors - self.reference)
            # An error below that of the reference cannot be measured.
            is_bound = math.isfinite(self.reference_db) and against >= self.reference_db
            snr = self.reference_db if is_bound else against
            # Standard error of a sum of unequal independent terms. Over all pixels the sum is exact.
            known = self.is_whole or not energies.any()
            spread = 0.0 if known else float(np.sqrt(np.sum(energies**2)) / np.sum(energies))
            begin = _RAY + _FIRST_VALUE * (stepping.quadrature == "preintegrated")
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
        """As ``solve``, and then the coarsest of a few steps beyond that reaches the target as well."""
        best = self.solve(way, quality_db, within_db, rival=rival)
        if best.snr_db < quality_db:
            return best
        scale = best.stepping.scale
        further = [
            self.try_out(replace(way, scale=min(scale * factor, coarsest(way.rule))))
            for factor in _TUNING.get(way.rule, _TUNING["error"])
        ]
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
            wanted = math.exp(_next_log_scale(trials, quality_db + 0.5 * within_db))
            scale = float(np.clip(wanted, _FINEST, coarsest(way.rule)))
            if any(abs(math.log(scale / t.stepping.scale)) < 1e-3 for t in trials):
                break
            trials.append(self.try_out(replace(way, scale=scale)))
            if trials[-1].steps == trials[-2].steps and scale > trials[-2].stepping.scale:
                break  # the rule's longest step is reached: no coarser stepping exists
            if rival is not None and _is_beaten(trials[-1], rival, quality_db):
                break
        return cheapest(trials, quality_db)

    def _march(
        self,
        stepping: Stepping,
        limits: Limits = USUAL,
        pixels: tuple[Any, Any] | None = None,
        view: View | None = None,
        transfer: TransferFunction | None = None,
    ) -> tuple[Array, float, float]:
        channels = self.renderer.trace(
            view or self.view, transfer or self.transfer, stepping, pixels or self.pixels, limits
        )
        k = len(self.transfer.materials)
        amounts = np.stack(channels[:k], axis=-1).astype(np.float64)
        samples, steps = (float(c.mean()) for c in channels[k + 1 :])
        return amounts @ self.palette, samples, steps


def coarsest(rule: Rule) -> float:
    """Largest scale of the steps of a rule that is planned."""
    return _LONGEST.get(rule, _COARSEST)


def _is_beaten(trial: Trial, rival: Trial, quality_db: float) -> bool:
    """True if a trial is short of the target and takes more time and more samples than one that reaches it."""
    return (
        trial.snr_db < quality_db <= rival.snr_db and trial.cost > rival.cost and trial.samples > _MORE * rival.samples
    )


def cheapest(trials: list[Trial], quality_db: float) -> Trial:
    """The trial of least cost that reaches ``quality_db``; the one of greatest SNR if none does."""
    reaching = [trial for trial in trials if trial.snr_db >= quality_db]
    return min(reaching, key=lambda t: t.cost) if reaching else max(trials, key=lambda t: t.snr_db)


def _next_log_scale(trials: list[Trial], target_db: float) -> float:
    """Log of the scale at which the SNR is expected to be ``target_db``."""
    second_order = -40.0 / math.log(10.0)  # dB per unit of log scale
    above = [t for t in trials if t.snr_db >= target_db]
    below = [t for t in trials if t.snr_db < target_db]
    nearest = min(trials, key=lambda t: abs(t.snr_db - target_db))
    if above and below:
        # Interpolate between the coarsest scale that reaches it and the finest that does not, if in that order.
        high = max(above, key=lambda t: t.stepping.scale)
        low = min(below, key=lambda t: t.stepping.scale)
        a, b = math.log(high.stepping.scale), math.log(low.stepping.scale)
        if a < b:
            part = (high.snr_db - target_db) / max(high.snr_db - low.snr_db, 1e-9)
            # Stay away from the ends, so that the interval shrinks even where the curve is steep or jumps.
            return a + (b - a) * float(np.clip(part if math.isfinite(part) else 0.5, 0.15, 0.85))
    distance = float(np.clip(target_db - nearest.snr_db, -100.0, 100.0)) / second_order
    slopes = sorted(trials, key=lambda t: t.stepping.scale)[:2]
    if len(slopes) == 2 and below and not above:
        # No trial reaches it: extrapolate the slope at the fine end, if it is steep enough.
        run = math.log(slopes[1].stepping.scale / slopes[0].stepping.scale)
        slope = (slopes[1].snr_db - slopes[0].snr_db) / run
        distance *= float(np.clip(second_order / slope if slope < 0 else 2.5, 0.5, 2.5))
        nearest = slopes[0]
    return math.log(nearest.stepping.scale) + float(np.clip(distance, -2.0, 2.0))


def pilot_places(view: View, corners: Array, count: int) -> tuple[Array, Array, bool]:
    """(x, y, True if they are all pixels) of pilot rays, in pixels, over the rectangle that ``corners`` project to.

    ``corners`` (n, 3) in world space. Where the rectangle has about ``count`` pixels or fewer, their centers are taken.
    """
    inverse = np.linalg.inv(view.world_from_camera)
    local = corners @ inverse[:3, :3].T + inverse[:3, 3]
    picture = np.array([[0.0, 0.0], [view.width, view.height]])
    if view.fov_deg is None:
        scale = view.width / view.ortho_width
        places = picture[1] / 2 - local[:, :2] * scale
    elif local[:, 2].min() > 1e-3 * local[:, 2].max():
        scale = view.width / (2 * math.tan(math.radians(view.fov_deg) / 2))
        places = picture[1] / 2 - local[:, :2] / local[:, 2:] * scale
    else:  # the camera is inside the field, or part of the field is behind it
        places = picture
    low, high = np.clip(places.min(0), picture[0], picture[1]), np.clip(places.max(0), picture[0], picture[1])
    first, last = np.floor(low).astype(int), np.ceil(high).astype(int)
    if 0 < np.prod(last - first) <= 1.3 * count:
        row, column = np.mgrid[first[1] : last[1], first[0] : last[0]]
        # Tiles of 4×4, because rays of one packet should be neighbors.
        order = np.lexsort((column.ravel() % 4, row.ravel() % 4, column.ravel() // 4, row.ravel() // 4))
        return column.ravel()[order] + 0.5, row.ravel()[order] + 0.5, True
    index = np.arange(count)
    # A rank-1 lattice: none of its rows or columns is parallel to those of the voxels.
    across = (index * 0.6180339887498949) % 1.0
    down = (index + 0.5) / count
    tiles = max(1, round(math.sqrt(count / 16)))
    order = np.lexsort((across * tiles // 1, down * tiles // 1))
    across, down = across[order], down[order]
    return low[0] + across * (high[0] - low[0]), low[1] + down * (high[1] - low[1]), False
