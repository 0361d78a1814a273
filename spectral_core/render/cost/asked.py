# SPDX-License-Identifier: GPL-3.0-or-later
"""A render for a requested error or time: predicted by a probe, sampled adaptively, its outcome estimated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, counted
from spectral_core.render.cost.adaptive import MANY, AdaptivePicture, Outcome
from spectral_core.render.cost.allocate import Laws
from spectral_core.render.cost.errors import Estimate, Wide, expected_errors, pixel_errors
from spectral_core.render.cost.model import DRAWN, LATER, CostModel, Prediction, RareLight, measured_model
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.rare import find_rare_light
from spectral_core.render.cost.rounds import AIM, until_error, until_time
from spectral_core.render.cost.work import Meter, Spent
from spectral_core.render.job import RenderJob
from spectral_core.scene import Note, RenderSettings, Scene

LEAST_ERROR, MOST_ERROR, LEAST_BUDGET_S = 0.02, 100.0, 0.1
"""Least and largest error and shortest time that can be requested."""
PLAN_SHARE = 0.25
"""Part of a requested error that the plan may use; the rest is the target for the noise."""
_FIRST_SHARE, _FIRST_SHARE_OF_FEW, _FEW = 0.3, 0.7, 16.0
"""Part of the expected samples that is spread over the whole picture before tiles are treated differently: more of it
up to a few samples of each half, where the error falls in steps and tiles cannot be told apart.
"""
_LEAST, _MOST = 16, 64
"""Samples of each half of a probe, at least and at most."""
_LEAST_PATHS = 1 << 17
"""Paths of the probe of a small picture: fewer of them may have met no light on rare paths at all."""
_UNSURE = 4
"""Part of these samples of a small picture, whose probe predicts them badly."""
_ROUNDS = 2
"""Rounds of adaptive sampling after the first samples that a prediction assumes."""
_NEAR = 8.0
"""Samples, over those of the probe, up to which the slope that it measured last holds."""
_DEARER_SHARE = 0.02
"""Largest part of a time budget in which the longer paths of noisy places are measured."""
PICTURE_SHARE = 0.5
"""Part of a time budget for the picture, if shares of its light are traced, too."""
_LOOK_SHARE = 0.25
"""Largest part of a time budget spent before a render looks for rare light, which takes about as long."""
_HOPELESS = 4.0
"""Samples over the predicted ones at which a render with rare light ends, whatever its error."""
_LOOKED_AT = 16384
"""Pixels at which the time of a comparison is measured."""


@dataclass(frozen=True, slots=True, eq=False)
class AskedRender:
    """Result of such a render: picture (height, width, 4), bands if they were measured, prediction and outcome."""

    pixels: NDArray[np.float32]
    band_pixels: NDArray[np.float32] | None
    status: Literal["done", "cancelled"]
    prediction: Prediction
    outcome: Outcome
    notes: tuple[Note, ...]
    sample_counts: NDArray[np.float32]
    """(height, width) samples of each pixel."""
    noise_pixels: NDArray[np.float32]
    """(height, width, 3) half the difference of two halves of the samples."""


def is_asked(settings: RenderSettings) -> bool:
    """True if an error or a time is requested. Raises InvalidInputError if both are, or if neither can be reached."""
    error, budget = settings.target_error, settings.time_budget_s
    if error is not None and budget is not None:
        raise InvalidInputError(f"an error of {error:g} and a time of {budget:g} s are requested; request one of them")
    if error is not None and not LEAST_ERROR <= error <= MOST_ERROR:
        raise InvalidInputError(f"the requested error is {error:g}; expected ΔE2000 from 0.02 to {MOST_ERROR:g}")
    if budget is not None and not LEAST_BUDGET_S <= budget <= 1e7:
        raise InvalidInputError(f"the time budget is {budget:g} s; expected 0.1 to 10,000,000 s")
    return error is not None or budget is not None


def tightened(scene: Scene) -> Scene:
    """The scene with a tolerance that leaves most of a requested error for the noise."""
    asked = scene.settings.target_error
    if asked is None:
        return scene
    tolerance = min(scene.settings.tolerance_delta_e, PLAN_SHARE * asked)
    return replace(scene, settings=replace(scene.settings, tolerance_delta_e=tolerance))


def render_asked(
    job: RenderJob,
    meter: Meter,
    on_round: Callable[[NDArray[np.float32], float, float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> AskedRender:
    """Render with the error or time that the scene's settings request.

    Parameters
    ----------
    job
        The loaded scene.
    meter
        Started with the render: a budget counts from there.
    on_round
        Sees the picture, mean samples per pixel so far, and those that are expected, after each round.
    should_stop
        Asked between kernel launches.
    """
    settings = job.scene.settings
    wanted, budget = settings.target_error, time_of_picture(job.scene)
    probe = Probe(job)
    least = _LEAST if len(probe.pixels) >= MANY else max(_LEAST, _LEAST_PATHS // (2 * len(probe.pixels)))
    fixed = meter.read().work
    most = max(_MOST, least)
    model = measured_model(probe, least=least, most=most, share=0.03, fixed_s=fixed, asked=wanted, budget_s=budget)
    rare = _rare(job, probe, model, meter.read().wall)
    picture = AdaptivePicture(job, probe)
    if wanted is not None:
        # of one picture, whose error is larger or smaller by chance than that of others of its samples
        noise = (wanted if rare is None else rare.noise_for(wanted)) / (1 + probe.scatter())
        prediction, picture.dearer = predicted_error(probe, model, meter, noise)
    else:
        prediction, picture.dearer = predicted_time(probe, model, meter.read().wall, budget or 0.0)
        prediction = replace(prediction, seconds=max(settings.time_budget_s or 0.0, prediction.seconds))
    prediction = prediction.with_rare(rare)
    first = _first_samples(prediction.samples)
    if len(picture.counts) < MANY:
        first = max(1, first // _UNSURE)
    stopped = False

    def after_round(_: Estimate) -> bool:
        nonlocal stopped
        if on_round is not None:
            on_round(picture.picture(), picture.mean_samples, max(prediction.samples, picture.mean_samples))
        stopped = should_stop is not None and should_stop()
        # each new path that meets rare light raises the estimate: the request may be out of reach
        hopeless = rare is not None and picture.mean_samples > _HOPELESS * prediction.samples
        return stopped or hopeless

    if wanted is not None:
        found = until_error(picture, noise, first, after_round, _halved(model).slope_from)
        reached = _in_all(found, rare) <= wanted
    else:
        found = until_time(picture, meter.started + (budget or 0.0), first, after_round)
        reached = meter.read().wall <= 1.1 * (settings.time_budget_s or 0.0)
    seconds = meter.read().wall
    return AskedRender(
        picture.picture(),
        picture.band_picture(),
        "cancelled" if stopped else "done",
        prediction,
        Outcome(_in_all(found, rare), found.spread, seconds, picture.mean_samples, reached, rare),
        _notes(picture, (_in_all(found, rare), rare), seconds, settings, reached or stopped),
        (2.0 * picture.counts).astype(np.float32).reshape(picture.size[::-1]),
        picture.noise_picture(),
    )


def time_of_picture(scene: Scene) -> float | None:
    """The part of a requested time for the picture: passes of its light are traced apart from it."""
    budget, passes = scene.settings.time_budget_s, scene.settings.passes
    apart = passes is not None and (passes.light or passes.light_groups) and not scene.volumes
    return PICTURE_SHARE * budget if budget is not None and apart else budget


def _rare(job: RenderJob, probe: Probe, model: CostModel, spent_s: float) -> RareLight | None:
    """Light that the probe hardly contains; only a limit of it where a requested time is too short to look for it."""
    wanted, budget = job.scene.settings.target_error, job.scene.settings.time_budget_s
    looks = budget is None or spent_s + probe.seconds < _LOOK_SHARE * budget
    usual = wanted if wanted is not None else model.for_time(budget or 0.0).delta_e
    settings = replace(job.scene.settings, target_error=None, time_budget_s=None)
    return find_rare_light(replace(job.scene, settings=settings), job.plan, probe, usual, traces=looks).rare


def _in_all(found: Estimate, rare: RareLight | None) -> float:
    return found.delta_e if rare is None else rare.added_to(found.delta_e)


def predicted_error(probe: Probe, model: CostModel, before: Meter | Spent, wanted: float) -> tuple[Prediction, float]:
    """Samples and time to reach an error by adaptive sampling, predicted from the law of each run of the probe's
    pixels, and ``Probe.dearer`` for them; ``before``: time before the samples, or its meter.
    """
    traced, dearer = 2.0 * probe.samples, 1.0
    laws = _laws(probe)
    if laws.mean(np.full(len(laws.weights), traced)) <= AIM * wanted:  # fewer samples: the measured law holds
        total = _halved(model).for_error(AIM * wanted).samples
        reached = min(AIM * wanted, _halved(model).error(max(total, 2.0)))
        total = max(total, 2.0)
    else:
        total = 2.0
        for _ in range(2):  # the first samples are spread everywhere, and their number depends on the total
            samples = laws.for_error(AIM * wanted, 2.0 * _first_samples(total))
            total = float(laws.weights @ samples)
        dearer = probe.dearer(samples)
        # The laws assume independent random numbers; the Sobol points are more evenly spread and need fewer samples.
        slope = model.last_slope if total < _NEAR * traced else model.slope
        total = traced * max(1.0, total / traced) ** (-0.5 / min(slope, -0.5))
        reached = AIM * wanted
    work = _beside_paths(probe, total, _looking(probe)) + model.seconds_per_sample * dearer * total
    spent = before.read() if isinstance(before, Meter) else before
    return Prediction(total, spent.wall + model.slowness * work, reached, spent.work + work), dearer


def _first_samples(total: float) -> int:
    """Samples of each half that begin everywhere: a power of two, where the random numbers are most even."""
    half = total / 2
    share = _FIRST_SHARE if half > _FEW else _FIRST_SHARE_OF_FEW
    return int(2 ** round(np.log2(max(1.0, share * half))))


def _looking(probe: Probe) -> float:
    """Work of a comparison of the two halves of the picture."""
    times = -(-_LOOKED_AT // len(probe.pixels))
    halves = np.tile(probe.halves(), (1, times, 1))
    pools, blocks = (
        np.concatenate([numbers + k * (numbers.max() + 1) for k in range(times)])
        for numbers in (probe.pools, probe.blocks)
    )
    meter = Meter()
    expected_errors(halves, pools, Wide(blocks, probe.wide().repeated))
    pixel_errors(halves[0], halves[1])  # the comparison with an earlier picture takes as long
    width, height = probe.film.size
    return meter.read().work * width * height / len(pools)


def _beside_paths(probe: Probe, total: float, looking: float) -> float:
    """Work of adaptive sampling beside ``total`` samples: launches, and comparisons of ``looking`` seconds."""
    first = _first_samples(total)
    begun = 1 if first == 1 else 2  # launches: all at once, or a quarter and the rest
    looks = begun  # the halves are compared after each step
    if total <= 2 * first:
        return begun * probe.launch_s + looks * looking
    return (begun + _ROUNDS) * probe.launch_s + (looks + _ROUNDS) * looking


def predicted_time(probe: Probe, model: CostModel, spent_s: float, budget_s: float) -> tuple[Prediction, float]:
    """The error that adaptive sampling reaches in a time, and ``Probe.dearer`` for it."""
    left = (0.97 * budget_s - spent_s) / model.slowness - (_ROUNDS + 2) * probe.launch_s
    total = max(2.0, left / max(model.seconds_per_sample, 1e-12))
    traced = 2.0 * probe.samples
    if total <= traced:
        return Prediction(total, max(budget_s, spent_s), _halved(model).error(total)), 1.0
    laws = _laws(probe)
    most_work = _DEARER_SHARE * budget_s / model.slowness
    dearer = probe.dearer(laws.for_samples(total, 2.0 * _first_samples(total)), most_work)
    total = max(traced, total / dearer)
    slope = model.last_slope if total < _NEAR * traced else model.slope
    even = traced * (total / traced) ** (min(slope, -0.5) / -0.5)  # as many independent numbers as the Sobol points
    reached = laws.mean(laws.for_samples(even, 2.0 * _first_samples(total)))
    return Prediction(total, max(budget_s, spent_s), reached), dearer


def _laws(probe: Probe) -> Laws:
    """Error of the probe's blocks by their samples of both halves."""
    growth = [LATER**k for k in range(DRAWN + 1)]
    return Laws(2.0 * probe.samples * np.array(growth), probe.later(growth), probe.shares)


def _halved(model: CostModel) -> CostModel:
    """The law of pictures in two halves: √2 less error than one half with half the samples."""
    return replace(
        model,
        counts=tuple(2 * count for count in model.counts),
        errors=tuple(error / np.sqrt(2) for error in model.errors),
    )


def _notes(
    picture: AdaptivePicture,
    found: tuple[float, RareLight | None],
    seconds: float,
    settings: RenderSettings,
    kept: bool,
) -> tuple[Note, ...]:
    delta_e, rare = found
    notes = [] if rare is None else [Note("Accuracy", rare.text)]
    if not kept and settings.target_error is not None:
        text = f"the requested ΔE {settings.target_error:g} was not reached; it is about {delta_e:.2g}"
        notes.append(Note("Accuracy", f"{text} after {counted(picture.mean_samples, 'sample', form='.0f')} per pixel"))
    elif not kept and settings.time_budget_s is not None:
        text = f"{settings.time_budget_s:g} s were requested and {seconds:.1f} s taken"
        notes.append(Note("Accuracy", f"{text}: loading the scene and two samples for each pixel take as long"))
    if picture.lost:
        lost = counted(
            picture.lost, "sample was no finite number and counts", "samples were not finite numbers and count"
        )
        text = f"{lost} as black; look for extreme lights or materials"
        notes.append(Note("Renderer", text))
    return tuple(notes)
