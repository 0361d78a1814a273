# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: a picture of each moment with its share of the samples, added up.

The moments are equal parts of the shutter's open time. Each is a scene without motion, so all types of motion are
blurred the same way: cameras, objects, deformed meshes. All moments share their kernels and one plan, made of the
first, the middle and the last. A requested error is √n times as large for each of n moments, whose noise averages out;
a requested time is divided among them.

That is right only where all moments are equally bright: ΔE2000 is not linear in radiance, and where one moment has most
of the light, its noise is not averaged out. So the error is estimated from the noise of the picture, which is the mean
of its moments', and where it exceeds the request, all moments are rendered once more with other random numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.adaptive import Outcome
from spectral_core.render.cost.asked import LEAST_BUDGET_S, LEAST_ERROR, MOST_ERROR, PLAN_SHARE, is_asked
from spectral_core.render.cost.errors import pixel_errors, scatter
from spectral_core.render.passes.joined import FIRST_MOMENT, OF_FIRST_SAMPLE, joined_passes
from spectral_core.render.plan.decision import EffectPlan, fullest
from spectral_core.scene import Film, Moment, Note, RenderSettings, Scene
from spectral_core.scene.passes import CRYPTOMATTES

Pixels = NDArray[np.float32]
_MOST_ROUNDS = 4
"""Most renders of each moment for a requested error."""
_AIM = 0.97
"""Estimated error that a further round approaches, over the limit."""
_SEED_OF_ROUND = 0x3C6EF35F


@dataclass(frozen=True, slots=True, eq=False)
class _Round:
    """One render of each moment: its number, when the first began, factor on the error of a moment, picture so far.

    ``plan``: that of all moments.
    """

    number: int
    start: float
    factor: float = 1.0
    before: Any = None
    plan: EffectPlan | None = None


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
    plan: Callable[[Scene], EffectPlan],
) -> Any:
    """Render a scene with moments; ``render`` renders one moment, ``plan`` plans one."""
    notes: list[Note] = []
    settings, asked, start = scene.settings, is_asked(scene.settings), time.perf_counter()
    shown = settings.display_exposure
    if settings.denoise:
        settings = replace(settings, denoise=False)
        notes.append(Note("Denoising", "a picture with motion blur is not denoised"))
    together = _plan_of_all(scene, plan)
    state = _Round(0, start, plan=together)
    made, parts = _rendered(replace(scene, settings=settings), state, render, on_progress, should_stop)
    while settings.target_error is not None and made.status == "done" and state.number < _MOST_ROUNDS - 1:
        error, limit = _error(made, parts, shown), _limit(made, settings.target_error, shown)
        if error <= limit:
            break
        # two pictures with weights by their squared errors
        more = 1 / float(np.sqrt(max(1 / (_AIM * limit) ** 2 - 1 / error**2, 1e-12)))
        state = _Round(state.number + 1, start, state.factor * more / error, made, together)
        again, others = _rendered(replace(scene, settings=settings), state, render, on_progress, should_stop)
        if again.status == "cancelled":
            made = replace(made, status="cancelled")  # the moments have unequal parts of this round
            break
        share = error**2 / (error**2 + _error(again, others, shown) ** 2)
        made = _joined(made, (1 - share, share), again)
        parts += others
    if any(name in OF_FIRST_SAMPLE or name.startswith(CRYPTOMATTES) for name in made.passes):
        notes.append(Note("Passes", FIRST_MOMENT))
    if asked:
        made = _with_outcome(made, parts, scene, time.perf_counter() - start)
    return replace(made, notes=(*made.notes, *notes))


def _plan_of_all(scene: Scene, plan: Callable[[Scene], EffectPlan]) -> EffectPlan:
    """The plan of all moments: what is out of view at first may fill the picture at last."""
    last = len(scene.moments) - 1
    chosen = sorted({0, (last + 1) // 2, last})
    budget = scene.settings.time_budget_s
    settings = replace(scene.settings, time_budget_s=None if budget is None else budget / len(chosen))
    film = replace(scene.film, samples=max(1, scene.film.samples // len(chosen)))  # a pilot of each must pay
    stills = [replace(scene.at(scene.moments[number]), film=film, settings=settings) for number in chosen]
    return fullest([plan(still) for still in stills])


def _rendered(
    scene: Scene,
    state: _Round,
    render: Callable[..., Any],
    on_progress: Callable[[Any], None] | None,
    should_stop: Callable[[], bool] | None,
) -> tuple[Any, list[Any]]:
    """The picture of all moments, each rendered once, and the moments' own."""
    settings, asked = scene.settings, is_asked(scene.settings)
    counts = shares(scene.film.samples, len(scene.moments))
    first = 0 if state.before is None else state.before.samples
    total, done, made = sum(counts), first, None
    parts: list[Any] = []
    for number, (moment, count) in enumerate(zip(in_order(scene.moments), counts, strict=True)):
        seed = scene.film.seed * len(counts) + number + _SEED_OF_ROUND * state.number
        film: Film = replace(scene.film, samples=count, seed=seed & 0x7FFFFFFF)
        left = len(counts) - number
        own = _of_moment(settings, len(counts), left, time.perf_counter() - state.start, state.factor)
        still = replace(scene.at(moment), film=film, settings=own)
        before, traced = made, number if asked else done

        def show(progress: Any, before: Any = before, traced: int = traced, done: int = done, left: int = left) -> None:
            samples = 1 if asked else progress.samples
            pixels = progress.pixels if before is None else _mean(before.pixels, traced, progress.pixels, samples)
            if state.before is not None:
                pixels = _mean(state.before.pixels, state.before.samples, pixels, done - first + samples)
            if on_progress is not None:
                expected = max(total, done + progress.total * left) if asked else total
                on_progress(progress.within(pixels, done + progress.samples, expected, state.start))

        part = render(still, show, should_stop, state.plan)
        if part.samples == 0 and before is not None:
            made = replace(before, status=part.status)
        else:
            # a requested error or time gives moments unequal samples, and the moments are equal parts of the time
            made = part if before is None else _joined(before, (traced, 1) if asked else (done, part.samples), part)
            parts.append(part)
        done += part.samples
        if part.status == "cancelled":
            break
    return made, parts


def _error(made: Any, parts: list[Any], shown: float) -> float:
    """ΔE2000 of the mean of moments: by its noise, times what each moment's estimate adds to that of its own noise."""
    own = sum(float(_pixel_errors(part, shown).mean()) ** 2 for part in parts)
    told = sum(part.outcome.delta_e**2 for part in parts)
    if own <= 0:
        return float(np.sqrt(told)) / len(parts)
    return float(_pixel_errors(made, shown).mean() * np.sqrt(told / own))


def _limit(made: Any, wanted: float, shown: float) -> float:
    """The error to estimate, so that the true one of this picture is ``wanted``: it varies by chance."""
    return wanted / (1 + scatter(_pixel_errors(made, shown)))


def _pixel_errors(made: Any, shown: float) -> NDArray[np.float64]:
    """ΔE2000 (n,) of each pixel by the difference of the halves; ``shown``: exposure of the display."""
    mean = made.pixels[..., :3].reshape(-1, 3).astype(np.float64)
    away = made.noise_pixels.reshape(-1, 3).astype(np.float64)
    return pixel_errors(shown * (mean + away), shown * (mean - away))


def _of_moment(settings: RenderSettings, moments: int, left: int, spent_s: float, factor: float) -> RenderSettings:
    """The settings of one of ``moments``: the errors of independent pictures average out, time is divided.

    ``factor``: on a requested error.
    """
    if settings.target_error is not None:
        tolerance = min(settings.tolerance_delta_e, PLAN_SHARE * settings.target_error)
        wanted = factor * settings.target_error * float(np.sqrt(moments))
        target = min(MOST_ERROR, max(LEAST_ERROR, wanted))
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
    error = _error(made, parts, scene.settings.display_exposure)
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
    made = replace(made, prediction=prediction, outcome=outcome, sample_counts=counts)
    if settings.target_error is None or reached or made.status != "done":
        return made
    text = f"the requested ΔE {settings.target_error:g} was not reached; it is about {error:.2g}"
    return replace(made, notes=(*made.notes, Note("Accuracy", f"{text} in the mean of all moments")))


def _mean(first: Pixels, samples: float, second: Pixels, more: float) -> Pixels:
    """Mean of two pictures by their samples."""
    total = samples + more or 1.0
    return np.asarray(first * (samples / total) + second * (more / total), dtype=np.float32)


def _joined(before: Any, weights: tuple[float, float], part: Any) -> Any:
    """The result of several moments together with one more; ``weights``: of those and of this one."""

    def mean(first: Any, second: Any) -> Any:
        if isinstance(first, dict):
            return {name: mean(first[name], second[name]) for name in first}
        return None if first is None else _mean(first, weights[0], second, weights[1])

    names = ("pixels", "noise_pixels", "band_pixels", "group_pixels", "group_band_pixels")
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
