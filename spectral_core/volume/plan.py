# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality before the picture: a few thousand pilot rays find the step for a wanted error, and the cheapest way there.

The one quality knob is the signal-to-noise ratio in dB of the linear picture, 10·log10(‖x‖²/‖x - y‖²) (thesis 4.2).
Pilot rays through the projected field are marched with a fine step once, and coarsely with each way of stepping that
is allowed; the error follows the step by a power law, so two or three coarse marches fix the step. The pilot's own
SNR at the chosen step is the estimate shown before rendering. `auto` takes uniform stepping unless another way
needs clearly fewer samples and clearly less time for the same error.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.volume.march.march_input import QUADRATURES, REFERENCE, USUAL, Limits, Quadrature
from spectral_core.volume.march.rules import RULES, Rule
from spectral_core.volume.renderer import Stepping, VolumeRenderer, palette_matrix
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

if TYPE_CHECKING:
    Array = NDArray[np.float64]

PILOT_RAYS = 4096
# auto leaves uniform only for at most this share of its samples, and of its time (whose prediction is rougher).
_SAMPLES_GAIN, _TIME_GAIN = 0.95, 0.92
# Time of one turn of the loop, in turns of the uniform midpoint march, and of a ray before its first turn.
_TURN = {("uniform", "midpoint"): 1.0, ("uniform", "preintegrated"): 1.1}
_ADAPTIVE_TURN = {"midpoint": 1.1, "preintegrated": 1.25}
_RAY = 1.2


@dataclass(frozen=True)
class Trial:
    """A way of stepping tried on the pilot rays: SNR in dB, and samples and turns of the loop per ray."""

    stepping: Stepping
    snr_db: float
    samples: float
    steps: float

    @property
    def cost(self) -> float:
        """Time of the march in turns of a midpoint march, per ray."""
        way = (self.stepping.rule, self.stepping.quadrature)
        return _RAY + _TURN.get(way, _ADAPTIVE_TURN[way[1]]) * self.steps


@dataclass(frozen=True)
class Plan:
    """The chosen stepping, its error before rendering in dB, and every way that was tried at the wanted error."""

    stepping: Stepping
    estimate_db: float
    trials: tuple[Trial, ...]
    seconds: float


def plan(
    renderer: VolumeRenderer,
    view: View,
    transfer: TransferFunction,
    quality_db: float = 50.0,
    *,
    rule: Rule | Literal["auto"] = "auto",
    quadrature: Quadrature | Literal["auto"] = "auto",
) -> Plan:
    """Stepping for an error of ``quality_db``, by pilot rays.

    ``rule`` and ``quadrature`` may fix what `auto` would choose. The estimate may fall short of the wish where
    float32 or the shortest step (0.01 voxel) sets the limit; it is what the pilot measured, either way.
    """
    start = time.perf_counter()
    quality = require_range("quality", quality_db, 10.0, 90.0, " dB")
    pilot = Pilot(renderer, view, transfer, quality)
    ways = _ways(rule, quadrature)
    if transfer.uses_gradient:  # has no table of running integrals
        ways = [way for way in ways if way.quadrature == "midpoint"]
        if not ways:
            raise InvalidInputError("a two-dimensional transfer function has no pre-integrated table; use midpoint")
    trials = tuple(pilot.solve(way, quality, 3.0) for way in ways)
    best = pilot.solve(_choose(trials, quality).stepping, quality, 0.25)
    return Plan(best.stepping, best.snr_db, trials, time.perf_counter() - start)


def estimate(renderer: VolumeRenderer, view: View, transfer: TransferFunction, stepping: Stepping) -> Trial:
    """SNR in dB, samples and steps per ray that ``stepping`` will have, from pilot rays."""
    return Pilot(renderer, view, transfer, 60.0).try_out(stepping)


def _ways(rule: str, quadrature: str) -> list[Stepping]:
    if rule not in (*RULES, "auto"):
        raise UnknownNameError.among("step rule", rule, (*RULES, "auto"))
    if quadrature not in (*QUADRATURES, "auto"):
        raise UnknownNameError.among("quadrature", quadrature, (*QUADRATURES, "auto"))
    if rule == "auto":
        ways = [Stepping("uniform", "midpoint"), Stepping("error", "midpoint"), Stepping("error", "preintegrated")]
        return ways if quadrature == "auto" else [w for w in ways if w.quadrature == quadrature]
    chosen = QUADRATURES if quadrature == "auto" and rule == "error" else (quadrature,)
    return [Stepping(rule, "midpoint" if q == "auto" else q) for q in chosen]  # type: ignore[arg-type]


def _choose(trials: tuple[Trial, ...], quality_db: float) -> Trial:
    """The cheapest way whose samples and time both are clearly under uniform's; the first way if there is none."""
    base = trials[0]
    if base.stepping.rule != "uniform":
        return min(trials, key=lambda t: _at(quality_db, t, t.cost))

    def share(trial: Trial, what: str) -> float:
        ours, uniform = (_at(quality_db, t, getattr(t, what)) for t in (trial, base))
        return ours / uniform if uniform > 0 else 1.0  # no ray meets anything

    better = [
        t
        for t in trials[1:]
        if share(t, "samples") <= _SAMPLES_GAIN and share(t, "cost") <= _TIME_GAIN and _reaches(t, base, quality_db)
    ]
    return min(better, key=lambda t: share(t, "cost"), default=base)


def _at(quality_db: float, trial: Trial, amount: float) -> float:
    """``amount`` of samples or time carried from the trial's SNR to ``quality_db``: 40 dB per decade of step."""
    return amount * 10.0 ** (float(np.clip(quality_db - trial.snr_db, -20.0, 20.0)) / 40.0)


def _reaches(trial: Trial, base: Trial, quality_db: float) -> bool:
    return trial.snr_db >= min(base.snr_db, quality_db) - 3.0


class Pilot:
    """Pilot rays of one view with their fine reference."""

    def __init__(self, renderer: VolumeRenderer, view: View, transfer: TransferFunction, quality_db: float) -> None:
        self.renderer, self.view, self.transfer = renderer, view, transfer
        self.palette = palette_matrix(transfer)
        x, y = pilot_places(renderer, view, PILOT_RAYS)
        self.pixels = (renderer.types.Float(x), renderer.types.Float(y))
        self._seen: dict[Stepping, Trial] = {}
        fine = Stepping("error", "midpoint" if transfer.uses_gradient else "preintegrated")
        self.reference_scale, coarse = 0.5, self._march(fine, REFERENCE)[0]
        while True:
            self.reference = self._march(replace(fine, scale=self.reference_scale), REFERENCE)[0]
            # Halving the step takes off three quarters of the error, so the finer is 12 dB better than they differ by.
            if snr_db(self.reference, coarse - self.reference) > quality_db + 6.0 or self.reference_scale < 0.02:
                break
            self.reference_scale, coarse = 0.5 * self.reference_scale, self.reference

    def try_out(self, stepping: Stepping) -> Trial:
        """March the pilot rays with ``stepping``; each way once."""
        if stepping not in self._seen:
            colors, samples, steps = self._march(stepping)
            snr = snr_db(self.reference, colors - self.reference)
            self._seen[stepping] = Trial(stepping, snr, samples, steps)
        return self._seen[stepping]

    def solve(self, way: Stepping, quality_db: float, within_db: float, tries: int = 5) -> Trial:
        """Scale of ``way`` for ``quality_db``: secant steps on dB against log scale, from the given scale."""
        seen = [self.try_out(way)]
        for _ in range(tries - 1):
            last = seen[-1]
            if abs(last.snr_db - quality_db) < within_db or math.isinf(last.snr_db):
                break
            log_scale = self._next(seen, quality_db)
            seen.append(self.try_out(replace(way, scale=float(np.clip(math.exp(log_scale), 5e-3, 64.0)))))
        return min(seen, key=lambda t: abs(t.snr_db - quality_db))

    @staticmethod
    def _next(seen: list[Trial], quality_db: float) -> float:
        """Log of the scale at which the line through the two nearest trials meets ``quality_db``."""
        near = sorted(seen, key=lambda t: abs(t.snr_db - quality_db))[:2]
        here = math.log(near[0].stepping.scale)
        slope = -40.0 / math.log(10.0)  # second order: dB per unit of log scale
        if len(near) == 2 and near[0].stepping.scale != near[1].stepping.scale:
            there = math.log(near[1].stepping.scale)
            measured = (near[1].snr_db - near[0].snr_db) / (there - here)
            slope = float(np.clip(measured, 2.0 * slope, 0.4 * slope))
        return here + float(np.clip((quality_db - near[0].snr_db) / slope, -2.5, 2.5))

    def _march(self, stepping: Stepping, limits: Limits = USUAL) -> tuple[Array, float, float]:
        channels = self.renderer.trace(
            self.view,
            self.transfer,
            stepping,
            self.pixels,
            limits,
        )
        k = len(self.transfer.materials)
        amounts = np.stack(channels[:k], axis=-1).astype(np.float64)
        samples, steps = (float(c.mean()) for c in channels[k + 1 :])
        return amounts @ self.palette, samples, steps


def pilot_places(renderer: VolumeRenderer, view: View, count: int) -> tuple[Array, Array]:
    """Picture places (x, y) in pixels, spread evenly over the rectangle that the field projects to."""
    corners = renderer.volume.corners_world
    inverse = np.linalg.inv(view.to_world)
    local = corners @ inverse[:3, :3].T + inverse[:3, 3]
    box = np.array([[0.0, 0.0], [view.width, view.height]])
    if view.fov_deg is None:
        scale = view.width / view.ortho_width
        places = np.array([view.width, view.height]) / 2 - local[:, :2] * scale
    elif local[:, 2].min() > 1e-3 * local[:, 2].max():
        scale = view.width / (2 * math.tan(math.radians(view.fov_deg) / 2))
        places = np.array([view.width, view.height]) / 2 - local[:, :2] / local[:, 2:] * scale
    else:  # the camera stands in the field, or the field reaches behind it
        places = box
    low, high = np.clip(places.min(0), box[0], box[1]), np.clip(places.max(0), box[0], box[1])
    index = np.arange(count)
    # A rank-1 lattice: no row or column of it runs along the voxels' own.
    across = (index * 0.6180339887498949) % 1.0
    down = (index + 0.5) / count
    # Neighbours march in step, so rays are sorted into tiles of about sixteen.
    tiles = max(1, round(math.sqrt(count / 16)))
    order = np.lexsort((across * tiles // 1, down * tiles // 1))
    across, down = across[order], down[order]
    return low[0] + across * (high[0] - low[0]), low[1] + down * (high[1] - low[1])


def snr_db(signal: Array, error: Array) -> float:
    """10·log10 of signal over error energy; infinite without error."""
    noise, energy = float(np.sum(error**2)), float(np.sum(signal**2))
    return math.inf if noise == 0 else -math.inf if energy == 0 else 10.0 * math.log10(energy / noise)
