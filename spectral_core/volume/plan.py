# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of step and stepping before the picture: pilot rays find the step for a wanted error, and the cheapest
stepping.

The single quality setting is the signal-to-noise ratio in dB of the linear picture. Each allowed stepping is tried on
the pilot rays until its step reaches the target; of those that reach it, the cheapest is taken. If none does, the one
of greatest SNR is taken and the plan reports it. `auto` replaces uniform midpoint steps only by a stepping that needs
clearly fewer samples and clearly less time.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_range
from spectral_core.errors import UnknownNameError
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import QUADRATURES, Quadrature, no_integrals, quadratures_of
from spectral_core.volume.march.rules import RULES, Rule
from spectral_core.volume.pilot.places import RayTracer
from spectral_core.volume.pilot.rays import MOST_RAYS, PILOT_RAYS, Pilot
from spectral_core.volume.pilot.trials import Trial, cheapest
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

# `auto` leaves uniform only for at most this share of its samples, and of its predicted time.
_SAMPLES_GAIN, _TIME_GAIN = 0.95, 0.93
# Decibels above the target within which a search of steps ends: while rules are compared, and for the chosen rule.
_COMPARED_DB, _CHOSEN_DB = 2.0, 0.3
_SHORT_DB = 0.5  # dB below the target that still count as reached: no viewer can tell the difference
# The error of a trial is measured if it is this many dB above the reference's; references are refined up to the second.
_CLEAR_DB, _BEST_DB = 12.0, 90.0
# More rays are taken while the relative standard error of the error energy is above this, which is about 0.4 dB.
_SPREAD = 0.1
_FAINT = 0.5  # optical depth of a voxel up to which a few pixels with a small object do not count
_MOST_PIXELS = 1 << 20  # of a picture with a measured error that are looked at: as much work as some samples per pixel
# Times that other steps are chosen after pixels were found in which the chosen ones are wrong, and that a way may fail.
_SEARCHES, _FAILURES = 4, 2


@dataclass(frozen=True)
class Plan:
    """The chosen stepping, its error before rendering in dB, and every stepping that was tried at the wanted error.

    ``interval_db`` contains the picture's SNR with 95 % confidence, as estimated from the pilot rays. If ``is_bound``,
    the error is too small to be measured in single precision: the SNR is at least ``estimate_db``. ``trials`` has one
    entry per stepping, `uniform` with `midpoint` first if it was allowed.
    """

    stepping: Stepping
    estimate_db: float
    interval_db: tuple[float, float]
    wanted_db: float
    trials: tuple[Trial, ...]
    seconds: float
    is_bound: bool = False

    @property
    def is_reached(self) -> bool:
        """True if the wanted error is expected to be met."""
        return self.estimate_db >= self.wanted_db - _SHORT_DB

    @property
    def shortfall(self) -> str | None:
        """One sentence for the user if the wanted error is not reached; else None."""
        if self.is_reached:
            return None
        if self.estimate_db < 10.0:
            effect = "the picture will be wrong: the transfer function has features that no allowed step resolves"
        else:
            effect = "this is the best that the allowed step rules and quadratures reach"
        return (
            f"the wanted quality of {self.wanted_db:g} dB is not reached; {self.estimate_db:.1f} dB is expected. "
            f"{effect[0].upper()}{effect[1:]}; set rule and quadrature to 'auto' or widen the narrowest peak"
        )


def plan(
    renderer: RayTracer,
    view: View,
    transfer: TransferFunction,
    quality_db: float = 50.0,
    *,
    rule: Rule | Literal["auto"] = "auto",
    quadrature: Quadrature | Literal["auto"] = "auto",
) -> Plan:
    """Choose the stepping that reaches an error of ``quality_db`` at least cost, by pilot rays.

    Parameters
    ----------
    renderer
        The field's renderer.
    view, transfer
        The picture to come.
    quality_db : float
        Wanted SNR of the linear picture, 10 to 90 dB.
    rule, quadrature
        Fix what `auto` would choose.

    Returns
    -------
    Plan
        Its ``shortfall`` is a message if no plan reaches the target: float32 or the shortest step (0.01 voxel) then
        sets the limit.

    Raises
    ------
    InvalidInputError
        For a quality out of range, and for `preintegrated` with a two-dimensional transfer function.
    UnknownNameError
        For an unknown rule or quadrature.
    """
    start = time.perf_counter()
    quality = require_range("quality", quality_db, 10.0, 90.0, " dB")
    ways = [way for way in _ways(rule, quadrature) if way.quadrature in quadratures_of(transfer.uses_gradient)]
    if not ways:
        raise no_integrals()
    pilot = Pilot(renderer, view, transfer, quality)
    trials, best = _found(pilot, ways, quality)
    pilot, trials, best = _seen_everywhere(pilot, ways, trials, best, quality)
    first, seen = pilot, best.stepping
    pilot, best = _stated(pilot, best, quality)
    if best.snr_db < quality - _SHORT_DB and pilot.count > first.count:  # another way may be right on more rays, too
        trials, best = _found(pilot, ways, quality)
    if best.stepping != seen and len(odd := _odd_pixels(pilot, best)):
        pilot = pilot.joined(odd)
        best = cheapest([pilot.try_out(each) for each in (best.stepping, seen)], quality - _SHORT_DB)
    return Plan(
        best.stepping,
        best.snr_db,
        _interval(best, pilot.reference_db, pilot.signal_spread),
        quality,
        trials,
        time.perf_counter() - start,
        best.is_bound,
    )


def estimate(renderer: RayTracer, view: View, transfer: TransferFunction, stepping: Stepping) -> Trial:
    """SNR in dB, samples and iterations per ray that ``stepping`` will have, from pilot rays."""
    return Pilot(renderer, view, transfer, 60.0).try_out(stepping)


def _ways(rule: str, quadrature: str) -> list[Stepping]:
    if rule not in (*RULES, "auto"):
        raise UnknownNameError.among("step rule", rule, (*RULES, "auto"))
    if quadrature not in (*QUADRATURES, "auto"):
        raise UnknownNameError.among("quadrature", quadrature, (*QUADRATURES, "auto"))
    rules: list[Rule] = ["uniform", "error"] if rule == "auto" else [rule]  # type: ignore[list-item]
    quadratures = QUADRATURES if quadrature == "auto" else (quadrature,)
    ways = [Stepping(r, q) for r in rules for q in quadratures]  # type: ignore[arg-type]
    # The middle of a step does not see a tip at its end: steps that end at faces gain by pre-integration alone.
    if rule == "auto" and "preintegrated" in quadratures:
        ways.append(Stepping("cells", "preintegrated"))
    return ways


def _found(pilot: Pilot, ways: list[Stepping], quality_db: float) -> tuple[tuple[Trial, ...], Trial]:
    """Every way's trial, and the chosen one at the target."""
    trials = _tried(pilot, ways, quality_db)
    return trials, pilot.solve(_choose(trials, quality_db).stepping, quality_db, _CHOSEN_DB)


def _seen_everywhere(
    pilot: Pilot, ways: list[Stepping], trials: tuple[Trial, ...], best: Trial, quality_db: float
) -> tuple[Pilot, tuple[Trial, ...], Trial]:
    """The pilot with the pixels in which ``best`` is wrong, and another choice if it misses the target there.

    Steps of another length may be wrong in other pixels, so each choice is looked at. A way that fails twice is left
    out; if every choice fails, the one of greatest SNR is taken.
    """
    failed: list[Stepping] = []
    while len(odd := _odd_pixels(pilot, best)):
        pilot = pilot.joined(odd)
        best = pilot.try_out(best.stepping)
        if best.snr_db >= quality_db - _SHORT_DB:
            break
        failed.append(best.stepping)
        if len(failed) > _SEARCHES:
            best = max((pilot.try_out(each) for each in failed), key=lambda trial: trial.snr_db)
            break
        names = [_way(each) for each in failed]
        left = [way for way in ways if names.count(_way(way)) < _FAILURES] or ways
        again, best = _found(pilot, left, quality_db)
        trials = tuple({_way(each.stepping): each for each in (*trials, *again)}.values())
    return pilot, trials, best


def _way(stepping: Stepping) -> tuple[str, str]:
    return stepping.rule, stepping.quadrature


def _odd_pixels(pilot: Pilot, best: Trial) -> NDArray[np.int64]:
    """(n, 2) pixels that pilot rays may have missed.

    A sample without an error says nothing of a few pixels, and one whose error is that of a few rays says little. Where
    a voxel is opaque, an object smaller than a step is as bright as a large one, so that any sample may have missed it.
    Where a peak is narrow, the one step in thousands that meets it counts it as wide as the step.
    """
    is_measured = math.isfinite(best.snr_db) and not best.is_bound and _uncertainty(pilot, best) <= _SPREAD
    is_mild = pilot.opacity <= _FAINT and not pilot.is_narrow
    is_certain = is_measured and (is_mild or pilot.places.pixels > _MOST_PIXELS)
    return (
        np.zeros((0, 2), np.int64)
        if pilot.is_whole or is_certain
        else pilot.odd_pixels(best, always=_uncertainty(pilot, best) > _SPREAD)
    )


def _tried(pilot: Pilot, ways: list[Stepping], quality_db: float) -> tuple[Trial, ...]:
    """Each way at the target, or where another way beats it; the ways that usually take least time are tried first."""
    found: dict[Stepping, Trial] = {}
    rival: Trial | None = None
    for way in reversed(ways):
        trial = found[way] = pilot.tuned(way, quality_db, _COMPARED_DB, rival)
        if trial.snr_db >= quality_db and (rival is None or trial.cost < rival.cost):
            rival = trial
    base = found[ways[0]]
    if rival is not None and base.stepping.rule == "uniform" and _is_behind(base, rival, quality_db):
        found[ways[0]] = pilot.in_tune(base, quality_db, rival)
    return tuple(found[way] for way in ways)


def _is_behind(base: Trial, rival: Trial, quality_db: float) -> bool:
    """True if a trial misses the target, or reaches it with more samples than the rival."""
    return base.snr_db < quality_db or base.samples > rival.samples


def _choose(trials: tuple[Trial, ...], quality_db: float) -> Trial:
    """The cheapest trial that reaches the target and beats uniform midpoint clearly; the greatest SNR if none reaches.

    Trials overshoot the target by different amounts up to ``_COMPARED_DB``; that much is subtracted by the power law,
    but no more, so that the cost of a stepping far above the target is not extrapolated.
    """
    reaching = [trial for trial in trials if trial.snr_db >= quality_db - _SHORT_DB]
    if not reaching:
        return max(trials, key=lambda t: t.snr_db)

    def at_target(trial: Trial, amount: float) -> float:
        return float(amount * 10.0 ** (-min(trial.snr_db - quality_db, _COMPARED_DB) / 40.0))

    base = trials[0]
    best = min(reaching, key=lambda t: at_target(t, t.cost))
    if base not in reaching or (base.stepping.rule, base.stepping.quadrature) != ("uniform", "midpoint"):
        return best
    samples, cost = at_target(base, base.samples), at_target(base, base.cost)
    better = [
        t
        for t in reaching
        if at_target(t, t.samples) <= _SAMPLES_GAIN * samples and at_target(t, t.cost) <= _TIME_GAIN * cost
    ]
    return min(better, key=lambda t: at_target(t, t.cost), default=base)


def _stated(pilot: Pilot, best: Trial, quality_db: float) -> tuple[Pilot, Trial]:
    """Repeat the trial with more rays until its estimate is certain enough; find the step again if they disagree.

    If the error of the trial is as small as that of the reference, it is measured against a better one.
    """
    while (
        math.isfinite(best.snr_db)
        and best.snr_db > pilot.reference_db - _CLEAR_DB
        and pilot.quality_db < _BEST_DB
        and not pilot.is_rounded  # shorter steps have the same rounding
    ):
        pilot = pilot.sharper()
        best = pilot.try_out(best.stepping)
    while pilot.count < MOST_RAYS and not pilot.is_whole and _uncertainty(pilot, best) > _SPREAD:
        # Few rays carry much of the error: of four times as many rays, four times as many are of this kind.
        pilot = pilot.denser(pilot.quality_db)
        best = pilot.solve(best.stepping, quality_db, 5 * _CHOSEN_DB, tries=4)
    return pilot, best


def _uncertainty(pilot: Pilot, best: Trial) -> float:
    """Standard error of the ratio of the error's and the picture's energy, relative to it."""
    return math.hypot(best.spread, pilot.signal_spread)


def _interval(best: Trial, reference_db: float, signal_spread: float = 0.0) -> tuple[float, float]:
    """95 % interval of the SNR: the energies of error and picture as log-normal, and the reference's own error."""
    if not math.isfinite(best.snr_db):
        return best.snr_db, best.snr_db
    if best.is_bound:
        return best.snr_db, math.inf
    # The two errors may have the same sign everywhere: amplitudes are then subtracted, or added.
    own = 2.0 * 10.0 ** ((best.snr_db - reference_db) / 20.0)
    width = 10.0 / math.log(10.0) * math.hypot(1.96 * best.spread, 1.96 * signal_spread, min(own, 1.0))
    return best.snr_db - width, best.snr_db + width


__all__ = ["PILOT_RAYS", "Plan", "estimate", "plan"]
