# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes in which one or two effects matter: the effects that the plan turns on, and the time that it saves.

Each scene is rendered as planned and with everything on (spectra, media, transparency, 64 bounces), in independent
batches. Printed: effects that are on against those that must be; the share of pixels at which a Welch test between
batches, corrected for their number (Šidák, 1 %), finds a difference, as Mitsuba's own tests do (Subr and Arvo 2007);
mean ΔE2000 between the pictures beyond their noise, at least (by a permutation test at 2.5 %), and the smallest that
this test would have found (scenes of rare light are traced up to 64 times as long for it); the largest error that the
plan states for all that it omits, which no difference may exceed; how many times less time of the processor the plan
takes for equal error (time times relative variance), against four wavelengths for each path, and against one, as
dispersion needs. Then a sweep of the tolerance. ``--only WORDS``: scenes of these names, or whose name has the word,
separated by commas. ``--sweep N``: number of scenes of the sweep, 8 without it.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks._plan_others import OTHERS
from benchmarks._plan_scenes import PAIRS, SINGLE, staged
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import EffectPlan, everything_on, plan_effects
from spectral_core.scene import Scene
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb

OPTIONS = ("--only", "--sweep")
BATCHES = 8
BLOCK, SPLITS = 16, 80
"""Pixels of a block; random halves of the batches that tell the noise."""
TOLERANCE = 1.0
SHARP, MOST_LONGER = 1.0, 64
"""A test that would find only larger differences, as a part of the tolerance, is repeated with more samples; and how
many times as many at most.
"""
SWEPT = (0.1, 0.3, 1.0, 3.0, 10.0)
Array = NDArray[np.float64]


def run(options: Options) -> dict[str, Any]:
    """Print the tables and return them."""
    size, samples = ((16, 12), 16) if options.quick else ((48, 36), 24)
    swept, options = options.number("--sweep", 2 if options.quick else 8)
    scenes = {**SINGLE, **PAIRS, **OTHERS}
    scenes = {name: scenes[name] for name in options.only(scenes)}
    if options.quick and not options.extra:
        scenes = {name: scenes[name] for name in ("nothing", "sodium", "glass ball", "lens + texture")}
    columns = ("mean ΔE", "at least", "finds", "omits", "faster", "(1 λ)")
    head = f"{'scene':32} {'plan':5} {'pixels that differ':>18} " + " ".join(f"{each:>8}" for each in columns)
    print(f"{head}  on (− missing, + too much)")
    rows = {name: _row(name, *staged(effects, size, TOLERANCE), samples) for name, effects in scenes.items()}
    ratios = [row["faster"] for row in rows.values()]
    print(f"median: {np.median(ratios):.1f} times less time at equal error; planned exactly in "
          f"{sum(row['exact'] for row in rows.values())} of {len(rows)}")  # fmt: skip
    sweep = _sweep(scenes, size, int(swept), samples)
    figures: dict[str, Any] = {
        "scenes": rows,
        "median_faster": float(np.median(ratios)),
        "sweep": sweep,
        "holds": {
            "the plan turns on just what matters": all(row["exact"] for row in rows.values()),
            "no more than noise, mean error below the tolerance": all(
                row["differing"] <= 0.005 and row["least_delta_e"] < TOLERANCE for row in rows.values()
            ),
            "no difference beyond the error that the plan states": all(
                row["least_delta_e"] <= row["stated"] for row in rows.values()
            ),
            "a difference of the tolerance would have been found": all(
                row["found_from"] <= TOLERANCE for row in rows.values()
            ),
            "median at least 2.5 times faster": float(np.median(ratios)) >= 2.5,
        },
    }
    if sweep:
        ordered = all(each["holds"] for each in sweep.values())
        figures["holds"]["effects leave in order, error below the tolerance"] = ordered
    return figures


def effects_on(plan: EffectPlan) -> set[str]:
    """Effects that a plan simulates; bounces count where there are any."""
    on = {each.name for each in plan.decisions if each.is_on and not each.value.isdecimal() and each.value != "rgb"}
    return on | ({"bounces"} if plan.bounces > 0 else set())


def _row(name: str, scene: Scene, expected: set[str], samples: int) -> dict[str, Any]:
    plan = plan_effects(scene)
    on = effects_on(plan)
    full_plan = everything_on(scene)
    four_plan = four_wavelengths(full_plan)
    planned, full, four = (_batches(scene, each, samples) for each in (plan, full_plan, four_plan))
    # the color noise of one wavelength would tell the pictures apart: clipped and not linear, it has another mean
    apart, count = difference(planned.pictures, four.pictures), samples
    while apart.found_from > SHARP * TOLERANCE and count < MOST_LONGER * samples:
        count *= 4
        apart = difference(*(_batches(scene, each, count).pictures for each in (plan, four_plan)))
    apart = _confirmed(scene, (plan, four_plan), count, apart)
    row: dict[str, Any] = {
        "on": sorted(on),
        "missing": sorted(expected - on),
        "too_much": sorted(on - expected),
        "exact": on == expected,
        "differing": _differing(planned.pictures, full.pictures),
        "delta_e": apart.delta_e,
        "least_delta_e": apart.least,
        "found_from": apart.found_from,
        "stated": plan.accepted,
        "faster": four.cost / planned.cost,
        "faster_than_one": full.cost / planned.cost,
        "seconds": [planned.seconds, four.seconds, full.seconds],
        "bounces": plan.bounces,
        "plan_seconds": plan.seconds,
    }
    wrong = [*(f"−{each}" for each in row["missing"]), *(f"+{each}" for each in row["too_much"])]
    text = ", ".join([*sorted(on & expected), *wrong])
    figures = f"{row['differing']:18.2%} {apart.delta_e:8.3f} {apart.least:8.3f} {apart.found_from:8.3f}"
    figures += f" {plan.accepted:8.3f}"
    figures += f" {row['faster']:8.1f} {row['faster_than_one']:8.1f}"
    verdict = "exact" if row["exact"] else "OFF"
    print(f"{name:32} {verdict:5} {figures}  {text} (bounces {plan.bounces})", flush=True)
    return row


def four_wavelengths(plan: EffectPlan) -> EffectPlan:
    """Everything on, but where no glass disperses four wavelengths for each path instead of one: less noise."""
    absent = disperses_nothing(plan)
    changed = tuple(
        replace(each, value="off") if each.name == "dispersion" and absent else each for each in plan.decisions
    )
    return EffectPlan(changed, plan.tolerance_delta_e)


def disperses_nothing(plan: EffectPlan) -> bool:
    """True if nothing disperses: the effect can then be no choice of the artist's."""
    return plan["dispersion"].choices == ("off",)


class _Batches:
    """Independent pictures (batches, pixels, 3), the time of all except the first, and the cost of an error."""

    def __init__(self, pictures: Array, seconds: float) -> None:
        self.pictures, self.seconds = pictures, seconds
        light = luminance_from_linear_rgb(pictures)
        mean = light.mean(axis=0)
        relative = light.var(axis=0, ddof=1) / (mean**2 + (0.05 * mean.mean()) ** 2)
        kept = np.sort(relative)[: max(1, int(0.999 * relative.size))]
        self.cost = seconds * float(kept.mean())


def _batches(scene: Scene, plan: EffectPlan, samples: int) -> _Batches:
    pixels = RenderJob(scene, plan).chosen_pixels()
    width, height = scene.film.size
    numbers = np.arange(width * height)
    none, more = np.zeros_like(numbers), np.full_like(numbers, samples)
    pixels.trace(numbers, none, none + 1, 99)  # compiles
    start = time.process_time()
    pictures = [pixels.trace(numbers, none, more, half).colors / samples for half in range(BATCHES)]
    return _Batches(np.stack(pictures), time.process_time() - start)


def _differing(first: Array, second: Array) -> float:
    """Share of pixels whose means differ by more than noise."""
    from scipy import stats

    light = [luminance_from_linear_rgb(each) for each in (first, second)]
    means, errors = [each.mean(axis=0) for each in light], [each.var(axis=0, ddof=1) / len(each) for each in light]
    # float rounding is no difference: a thousandth of the light, a ten-thousandth of the picture's
    spread = np.sqrt(errors[0] + errors[1]) + 1e-3 * np.maximum(*means) + 1e-4 * float(means[1].mean())
    value = np.abs(means[0] - means[1]) / spread
    degrees = (errors[0] + errors[1]) ** 2 / np.maximum((errors[0] ** 2 + errors[1] ** 2) / (BATCHES - 1), 1e-300)
    chance = 2 * stats.t.sf(value, np.clip(degrees, 1, 2 * BATCHES - 2))
    return float((chance < 1 - (1 - 0.01) ** (1 / value.size)).mean())


@dataclass(frozen=True)
class Difference:
    """Mean ΔE2000 between two limits, the ``least`` of which noise leaves a chance of one in forty, and the smallest
    difference that is told from noise (``found_from``).

    Light on rare paths (a prism's under a lamp) leaves some blocks far off in any picture of few samples: the first
    number is then that of the noise.
    """

    delta_e: float
    least: float
    found_from: float


def difference(first: Array, second: Array) -> Difference:
    """The difference between two pictures (batches, pixels, 3), by blocks of pixels, beyond what noise makes.

    A permutation test: if both had one limit, their batches could be exchanged. The difference is compared with those
    of pictures that random halves of all batches make.
    """
    every = np.concatenate([first, second])
    blocks = every[:, : every.shape[1] // BLOCK * BLOCK].reshape(len(every), -1, BLOCK, 3).mean(axis=2)

    def apart(chosen: NDArray[np.bool_]) -> float:
        lab = [lab_from_linear_rgb(np.maximum(blocks[each].mean(axis=0), 0.0)) for each in (chosen, ~chosen)]
        return float(np.mean(delta_e_2000(*lab) ** 2))

    rng = np.random.default_rng(7)
    mine = np.arange(len(every)) < len(first)
    seen, noise = apart(mine), [apart(rng.permutation(mine)) for _ in range(SPLITS)]
    beyond = lambda part: float(np.sqrt(max(0.0, seen - float(part))))  # noqa: E731
    high = float(np.quantile(noise, 0.975))
    found_from = float(np.sqrt(max(0.0, high - float(np.mean(noise)))))
    return Difference(beyond(np.mean(noise)), beyond(high), found_from)


def _confirmed(
    scene: Scene, plans: tuple[EffectPlan, EffectPlan], samples: int, found: Difference, tolerance: float = TOLERANCE
) -> Difference:
    """A difference above the tolerance must be found again with other random numbers; the smaller one counts."""
    if found.least <= tolerance:
        return found
    other = replace(scene, film=replace(scene.film, seed=scene.film.seed + 999))
    again = difference(*(_batches(other, plan, samples).pictures for plan in plans))
    return min(found, again, key=lambda each: each.least)


def _sweep(scenes: dict[str, Any], size: tuple[int, int], count: int, samples: int) -> dict[str, Any]:
    """Plans of some scenes over tolerances, with the error of each against everything on."""
    rows: dict[str, Any] = {}
    print(f"\n{'tolerance sweep':32} " + " ".join(f"{tolerance:>19g}" for tolerance in SWEPT))
    for name in list(scenes)[:: max(1, len(scenes) // max(count, 1))][:count]:
        scene, _ = staged(scenes[name], size, TOLERANCE)
        full_plan = four_wavelengths(everything_on(scene))
        full = _batches(scene, full_plan, samples)
        plans = [plan_effects(scene, tolerance) for tolerance in SWEPT]
        found = [difference(_batches(scene, plan, samples).pictures, full.pictures) for plan in plans]
        errors = [
            _confirmed(scene, (plan, full_plan), samples, each, tolerance)
            for plan, each, tolerance in zip(plans, found, SWEPT, strict=True)
        ]
        on = [effects_on(plan) for plan in plans]
        ordered = all(after <= before for before, after in itertools.pairwise(on))
        fewer = all(b.bounces <= a.bounces for a, b in itertools.pairwise(plans))
        below = all(error.least <= tolerance for error, tolerance in zip(errors, SWEPT, strict=True))
        rows[name] = {
            "errors": [error.delta_e for error in errors],
            "least_errors": [error.least for error in errors],
            "bounces": [plan.bounces for plan in plans],
            "holds": ordered and fewer and below,
        }
        cells = " ".join(
            f"{f'{error.delta_e:.2f}>{error.least:.2f} {len(each)} on {plan.bounces}b':>19}"
            for error, each, plan in zip(errors, on, plans, strict=True)
        )
        print(f"{name:32} {cells} {'' if rows[name]['holds'] else 'FAILS'}", flush=True)
    return rows
