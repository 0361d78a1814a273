# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of plans in independent batches, and the difference between two of them beyond noise."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import EffectPlan, everything_on
from spectral_core.scene import Scene
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb

BATCHES = 8
LONGER, TIMED = 8, 4
"""Samples of a timed launch over those of a batch, whose paths take no longer than its launch; and such launches.
"""
BLOCK, SPLITS = 16, 80
"""Pixels of a block; random halves of the batches that tell the noise."""
Array = NDArray[np.float64]


class Batches:
    """Independent pictures (batches, pixels, 3), the least time of one, and the cost of an error.

    Other programs only add to a time: the least of several is the most stable.
    """

    def __init__(self, pictures: Array, seconds: list[float]) -> None:
        self.pictures, self.seconds = pictures, float(np.min(seconds))
        light = luminance_from_linear_rgb(pictures)
        mean = light.mean(axis=0)
        relative = light.var(axis=0, ddof=1) / (mean**2 + (0.05 * mean.mean()) ** 2)
        kept = np.sort(relative)[: max(1, int(0.999 * relative.size))]
        self.cost = self.seconds * float(kept.mean())


def batches(scene: Scene, plan: EffectPlan, samples: int) -> Batches:
    return in_turn(scene, [plan], samples)[0]


def in_turn(scene: Scene, plans: list[EffectPlan], samples: int) -> list[Batches]:
    """Pictures of plans, one batch of each in turn, so that other programs slow all of them equally."""
    tracers = [RenderJob(scene, plan).chosen_pixels() for plan in plans]
    width, height = scene.film.size
    numbers = np.arange(width * height)
    none, more = np.zeros_like(numbers), np.full_like(numbers, samples)
    pictures: list[list[Array]] = [[] for _ in plans]
    seconds: list[list[float]] = [[] for _ in plans]
    for tracer in tracers:
        tracer.trace(numbers, none, none + 1, 99)  # compiles
    for half in range(BATCHES):
        for tracer, mine in zip(tracers, pictures, strict=True):
            mine.append(tracer.trace(numbers, none, more, half).colors / samples)
    for _ in range(TIMED):
        for tracer, spent in zip(tracers, seconds, strict=True):
            start = time.process_time()
            tracer.trace(numbers, none, LONGER * more, 98)
            spent.append((time.process_time() - start) / LONGER)
    return [Batches(np.stack(mine), spent) for mine, spent in zip(pictures, seconds, strict=True)]


def by_hand(scene: Scene, expected: set[str], bounces: int) -> EffectPlan:
    """The plan of an expert who knows which effects matter: those, and a limit on bounces."""
    values = {"transport": "spectral" if "transport" in expected else "rgb", "bounces": str(bounces)}
    full = everything_on(scene)
    changed = []
    for each in full.decisions:
        value = "on" if each.name in expected else "none" if each.name == "environment" else "off"
        kept = each.value.isdecimal() or (value == "on" and each.name == "environment")
        changed.append(replace(each, value=values.get(each.name, each.value if kept else value)))
    return EffectPlan(tuple(changed), 0.0)


def differing(first: Array, second: Array) -> float:
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


def confirmed(
    scene: Scene, plans: tuple[EffectPlan, EffectPlan], samples: int, found: Difference, tolerance: float
) -> Difference:
    """A difference above the tolerance (ΔE) must be found again with other random numbers; the smaller one counts."""
    if found.least <= tolerance:
        return found
    other = replace(scene, film=replace(scene.film, seed=scene.film.seed + 999))
    again = difference(*(batches(other, plan, samples).pictures for plan in plans))
    return min(found, again, key=lambda each: each.least)
