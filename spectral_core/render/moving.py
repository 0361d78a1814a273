# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: a picture of each moment with its share of the samples, added up.

The moments are equal parts of the shutter's open time. Each is a scene without motion, so all types of motion are
blurred the same way: cameras, objects, deformed meshes. All moments share their kernels. A requested error is √n times
as large for each of n moments, whose noise averages out; a requested time is divided among them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.adaptive import Outcome
from spectral_core.render.cost.asked import LEAST_BUDGET_S, MOST_ERROR, PLAN_SHARE, is_asked
from spectral_core.render.passes.joined import FIRST_MOMENT, OF_FIRST_SAMPLE, joined_passes
from spectral_core.scene import Film, Moment, Note, RenderSettings, Scene
from spectral_core.scene.passes import CRYPTOMATTES

Pixels = NDArray[np.float32]


def shares(samples: int, moments: int) -> list[int]:
    """Samples of each moment: whole numbers that add up to all of them, or 1 each where there are fewer samples."""
    if samples <= moments:
        return [1] * moments
    return [samples * (k + 1) // moments - samples * k // moments for k in range(moments)]


def in_order(moments: tuple[Moment, ...]) -> list[Moment]:
    """The moments in an order whose first few already cover the whole time: by the reversed bits of their number."""
    bits = max(1, (len(moments) - 1).bit_length())
    reversed_bits = [int(f"{k:0{bits}b}"[::-1], 2) for k in range(len(moments))]
    return [moment for _, moment in sorted(zip(reversed_bits, moments, strict=True), key=lambda pair: pair[0])]


def render_moving(
    scene: Scene,
    render: Callable[..., Any],
    on_progress: Callable[[Any], None] | None,
    should_stop: Callable[[], bool] | None,
) -> Any:
    """Render a scene with moments; ``render`` renders one moment."""
    notes: list[Note] = []
    settings, asked, start = scene.settings, is_asked(scene.settings), time.perf_counter()
    if settings.denoise:
        settings = replace(settings, denoise=False)
        notes.append(Note("Denoising", "a picture with motion blur is not denoised"))
    counts = shares(scene.film.samples, len(scene.moments))
    total, done = sum(counts), 0
    made: Any = None
    parts: list[Any] = []
    for number, (moment, count) in enumerate(zip(in_order(scene.moments), counts, strict=True)):
        film: Film = replace(scene.film, samples=count, seed=(scene.film.seed * len(counts) + number) & 0x7FFFFFFF)
        left = len(counts) - number
        own = _of_moment(settings, len(counts), left, time.perf_counter() - start)
        still = replace(scene.at(moment), film=film, settings=own)
        before, traced = made, number if asked else done

        def show(progress: Any, before: Any = before, traced: int = traced, done: int = done, left: int = left) -> None:
            samples = 1 if asked else progress.samples
            pixels = progress.pixels if before is None else _mean(before.pixels, traced, progress.pixels, samples)
            if on_progress is not None:
                expected = max(total, done + progress.total * left) if asked else total
                on_progress(replace(progress, pixels=pixels, samples=done + progress.samples, total=expected))

        part = render(still, show, should_stop, None if before is None else before.plan)
        if part.samples == 0 and before is not None:
            made = replace(before, status=part.status)
        else:
            # a requested error or time gives moments unequal samples, and the moments are equal parts of the time
            made = part if before is None else _joined(before, (traced, 1) if asked else (done, part.samples), part)
            parts.append(part)
        done += part.samples
        if part.status == "cancelled":
            break
    if any(name in OF_FIRST_SAMPLE or name.startswith(CRYPTOMATTES) for name in made.passes):
        notes.append(Note("Passes", FIRST_MOMENT))
    if asked:
        made = _with_outcome(made, parts, scene, time.perf_counter() - start)
    return replace(made, notes=(*made.notes, *notes))


def _of_moment(settings: RenderSettings, moments: int, left: int, spent_s: float) -> RenderSettings:
    """The settings of one of ``moments``: the errors of independent pictures average out, time is divided."""
    if settings.target_error is not None:
        tolerance = min(settings.tolerance_delta_e, PLAN_SHARE * settings.target_error)
        target = min(MOST_ERROR, settings.target_error * float(np.sqrt(moments)))
        return replace(settings, target_error=target, tolerance_delta_e=tolerance)
    if settings.time_budget_s is not None:
        return replace(settings, time_budget_s=max(LEAST_BUDGET_S, (settings.time_budget_s - spent_s) / left))
    return settings


def _with_outcome(made: Any, parts: list[Any], scene: Scene, seconds: float) -> Any:
    """The result with prediction and outcome of all moments; the prediction is the first moment's for each."""
    said, found = parts[0].prediction, [part.outcome for part in parts]
    if said is None or any(each is None for each in found):
        return made
    moments, settings = len(scene.moments), scene.settings
    error = float(np.sqrt(sum(each.delta_e**2 for each in found))) / len(found)
    spread = float(np.sqrt(sum(each.spread**2 for each in found))) / len(found)
    samples = float(sum(each.samples for each in found))
    reached = error <= settings.target_error if settings.target_error is not None else all(e.reached for e in found)
    prediction = replace(
        said, samples=moments * said.samples, seconds=moments * said.seconds, work=moments * said.work,
        delta_e=said.delta_e / float(np.sqrt(moments)),
    )  # fmt: skip
    if settings.time_budget_s is not None:
        prediction = replace(prediction, seconds=settings.time_budget_s)
    counts = sum(part.sample_counts for part in parts)
    rare = max((each.rare for each in found if each.rare is not None), key=lambda each: each.delta_e, default=None)
    outcome = Outcome(error, spread, seconds, samples, reached, rare)
    return replace(made, prediction=prediction, outcome=outcome, sample_counts=counts)


def _mean(first: Pixels, samples: int, second: Pixels, more: int) -> Pixels:
    """Mean of two pictures by their samples."""
    total = max(samples + more, 1)
    return np.asarray(first * (samples / total) + second * (more / total), dtype=np.float32)


def _joined(before: Any, weights: tuple[int, int], part: Any) -> Any:
    """The result of several moments together with one more; ``weights``: of those and of this one."""

    def mean(first: Any, second: Any) -> Any:
        if isinstance(first, dict):
            return {name: mean(first[name], second[name]) for name in first}
        return None if first is None else _mean(first, weights[0], second, weights[1])

    names = ("pixels", "band_pixels", "group_pixels", "group_band_pixels")
    pictures = {name: mean(getattr(before, name), getattr(part, name)) for name in names}
    fresh = tuple(note for note in part.notes if note not in before.notes)
    return replace(
        before,
        **pictures,
        passes=joined_passes(before.passes, weights[0], part.passes, weights[1]),
        samples=before.samples + part.samples,
        seconds=before.seconds + part.seconds,
        work=before.work + part.work,
        status=part.status,
        notes=(*before.notes, *fresh),
    )
