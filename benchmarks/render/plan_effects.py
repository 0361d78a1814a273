# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes in which one or two effects matter: the effects that the plan turns on, and the time that it saves.

Each scene is rendered as planned and with everything on (spectra, media, transparency, 64 bounces), in independent
batches. Printed: effects that are on against those that must be; the share of pixels at which a Welch test between
batches, corrected for their number (Šidák, 1 %), finds a difference, as Mitsuba's own tests do (Subr and Arvo 2007);
mean ΔE2000 between the pictures beyond their noise, at least (by a permutation test at 2.5 %; a difference above the
error that the plan states must be found in two runs), and the smallest that this test would have found (scenes of rare
light are traced up to 64 times as long for it); the largest error that the plan states for all that it omits, and of
spectra in a gray scene, whose white is rounded, which no difference may exceed; how many times less time of the
processor the plan takes for equal error (time times relative variance), against four wavelengths for each path, and
against one, as dispersion needs; and the time for equal error
over that of settings by hand: of the effects that must be on, and of the fewest bounces whose picture the test cannot
tell from everything on (those of the plan where the test is too coarse).
Then a sweep of the tolerance. ``--only WORDS``:
scenes of these names, or whose name has the word, separated by commas. ``--sweep N``: number of scenes of the sweep, 8
without it.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.cases.plan_others import OTHERS
from benchmarks.render.cases.plan_scenes import PAIRS, SINGLE, staged
from benchmarks.render.checks.plan_compared import Array, batches, by_hand, confirmed, difference, differing, in_turn
from spectral_core.render.plan.effects import EffectPlan, everything_on, plan_effects
from spectral_core.scene import Scene

OPTIONS = ("--only NAMES…", "--sweep SCENES")
TOLERANCE = 1.0
SHARP, MOST_LONGER = 1.0, 64
"""A test that would find only larger differences, as a part of the tolerance, is repeated with more samples; and how
many times as many at most.
"""
SWEPT = (0.1, 0.3, 1.0, 3.0, 10.0)
LONGER = 1.1
"""Time of a plan over that of settings by hand, at most."""
BY_HAND = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Bounces that are tried by hand."""


def run(options: Options) -> dict[str, Any]:
    """Print the tables and return them."""
    size, samples = ((16, 12), 16) if options.quick else ((48, 36), 24)
    swept, options = options.number("--sweep", 2 if options.quick else 8)
    scenes = {**SINGLE, **PAIRS, **OTHERS}
    scenes = {name: scenes[name] for name in options.only(scenes)}
    if options.quick and not options.extra:
        scenes = {name: scenes[name] for name in ("nothing", "sodium", "glass ball", "lens + texture")}
    columns = ("mean ΔE", "at least", "finds", "omits", "faster", "(1 λ)", "by hand")
    head = f"{'scene':32} {'plan':5} {'pixels that differ':>18} " + " ".join(f"{each:>8}" for each in columns)
    print(f"{head}  on (− missing, + too much)")
    rows = {name: _row(name, *staged(effects, size, TOLERANCE), samples) for name, effects in scenes.items()}
    ratios = [row["faster"] for row in rows.values()]
    print(f"median: {np.median(ratios):.1f} times less time at equal error; planned exactly in "
          f"{sum(row['exact'] for row in rows.values())} of {len(rows)}")  # fmt: skip
    longer = float(np.median([row["over_by_hand"] for row in rows.values()]))
    told = sum(row["least_delta_e"] > 0 for row in rows.values())
    print(f"median: {longer:.2f} times the time of settings by hand; pictures that the test tells apart: {told}")
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
            "no difference between any pictures, but by chance": told <= _by_chance(len(rows)),
            "median at least 2.5 times faster": float(np.median(ratios)) >= 2.5,
            "at most 1.1 times the time of settings by hand in the median": longer <= LONGER,
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
    planned, full, four = (batches(scene, each, samples) for each in (plan, full_plan, four_plan))
    # the color noise of one wavelength would tell the pictures apart: clipped and not linear, it has another mean
    apart, count = difference(planned.pictures, four.pictures), samples
    while apart.found_from > SHARP * TOLERANCE and count < MOST_LONGER * samples:
        count *= 4
        apart = difference(*(batches(scene, each, count).pictures for each in (plan, four_plan)))
    # of 45 scenes, one differs by chance at 2.5 %: what the plan does not state must be found twice
    stated = plan.accepted + full_plan.accepted  # the white of spectra is rounded
    apart = confirmed(scene, (plan, four_plan), count, apart, min(TOLERANCE, stated))
    bounces, longer = _by_hand(scene, plan, expected, four.pictures, samples)
    row: dict[str, Any] = {
        "on": sorted(on),
        "missing": sorted(expected - on),
        "too_much": sorted(on - expected),
        "exact": on == expected,
        "differing": differing(planned.pictures, full.pictures),
        "delta_e": apart.delta_e,
        "least_delta_e": apart.least,
        "found_from": apart.found_from,
        "stated": stated,
        "faster": four.cost / planned.cost,
        "faster_than_one": full.cost / planned.cost,
        "over_by_hand": longer,
        "bounces_by_hand": bounces,
        "seconds": [planned.seconds, four.seconds, full.seconds],
        "bounces": plan.bounces,
        "plan_seconds": plan.seconds,
    }
    wrong = [*(f"−{each}" for each in row["missing"]), *(f"+{each}" for each in row["too_much"])]
    text = ", ".join([*sorted(on & expected), *wrong])
    figures = f"{row['differing']:18.2%} {apart.delta_e:8.3f} {apart.least:8.3f} {apart.found_from:8.3f}"
    figures += f" {stated:8.3f}"
    figures += f" {row['faster']:8.1f} {row['faster_than_one']:8.1f} {longer:8.2f}"
    verdict = "exact" if row["exact"] else "OFF"
    print(f"{name:32} {verdict:5} {figures}  {text} (bounces {plan.bounces}, by hand {bounces})", flush=True)
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


def _by_hand(scene: Scene, plan: EffectPlan, expected: set[str], full: Array, samples: int) -> tuple[int, float]:
    """The fewest bounces whose picture the test cannot tell from ``full``, with the effects that must be on; and the
    cost of the plan over that of these settings.

    Where light is so rare that the test finds only differences above the tolerance, it cannot tell which bounces
    matter: an expert who needs the light then takes those of the plan.
    """
    other = by_hand(scene, expected, plan.bounces)
    for bounces in BY_HAND:
        tried = by_hand(scene, expected, bounces)
        found = difference(batches(scene, tried, samples).pictures, full)
        if found.found_from > SHARP * TOLERANCE:
            break
        if found.least == 0.0:
            other = tried
            break
    mine, theirs = in_turn(scene, [plan, other], samples)
    return other.bounces, mine.cost / theirs.cost


def _by_chance(count: int) -> int:
    """Scenes of ``count`` that a test at 2.5 % tells apart at most, at a confidence of 99 %, if none differs."""
    from scipy import stats

    return int(stats.binom.ppf(0.99, count, 0.025))


def _sweep(scenes: dict[str, Any], size: tuple[int, int], count: int, samples: int) -> dict[str, Any]:
    """Plans of some scenes over tolerances, with the error of each against everything on."""
    rows: dict[str, Any] = {}
    print(f"\n{'tolerance sweep':32} " + " ".join(f"{tolerance:>19g}" for tolerance in SWEPT))
    for name in list(scenes)[:: max(1, len(scenes) // max(count, 1))][:count]:
        scene, _ = staged(scenes[name], size, TOLERANCE)
        full_plan = four_wavelengths(everything_on(scene))
        full = batches(scene, full_plan, samples)
        plans = [plan_effects(scene, tolerance) for tolerance in SWEPT]
        found = [difference(batches(scene, plan, samples).pictures, full.pictures) for plan in plans]
        errors = [
            confirmed(scene, (plan, full_plan), samples, each, tolerance)
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
