# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a scene in this process: plan, load, trace in growing passes, with a report after each."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from spectral_core.child import memory_bytes
from spectral_core.errors import InvalidInputError
from spectral_core.render.catching import with_catchers
from spectral_core.render.cost.asked import is_asked, render_asked, tightened
from spectral_core.render.cost.work import Meter
from spectral_core.render.denoise import denoise, denoise_planes, denoiser_name, require_denoiser
from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.mitsuba_scene.units import at_origin, moved_back
from spectral_core.render.moving import render_moving
from spectral_core.render.plan.effects import EffectPlan, pilot_pays, plan_effects
from spectral_core.render.result import Pixels, Progress, RenderResult
from spectral_core.render.steps import pass_sizes
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import Note, Scene, require_scene
from spectral_core.spectra.spectrum import Spectrum

BUDGET_END = 0.97
"""Part of a time budget after which light of passes is no longer traced."""
LONGEST_PASS_S = 10.0
"""Longer passes are split, so that the picture updates often. Pixels do not depend on the split."""


def render_scene(
    scene: Scene,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    bands: Bands | None = None,
    groups: bool | tuple[str, ...] = False,
    sampling_lights: Sequence[Spectrum] | None = None,
) -> RenderResult:
    """Render ``scene`` in this process, with a picture after 1, 4, 16, 64, … samples; a small one in two passes.

    ``on_progress`` receives the picture after each pass; ``should_stop`` is called between kernel launches; ``Measure``
    explains the others. Raises InvalidInputError for a scene that cannot be rendered, RenderError if Mitsuba fails,
    MissingDependencyError if the scene requires a denoiser and there is none.
    """
    require_scene(scene)
    scene, shift = at_origin(scene)
    measure = Measure(bands, groups, sampling_lights)

    def instant(
        still: Scene,
        show: Callable[[Progress], None] | None,
        stop: Callable[[], bool] | None,
        plan: EffectPlan | None = None,
    ) -> RenderResult:
        return _render_instant(still, show, stop, measure, plan)

    caught = with_catchers(instant)
    made: RenderResult = (
        render_moving(scene, caught, on_progress, should_stop, lambda still: _planned(still, measure))
        if scene.moments
        else caught(scene, on_progress, should_stop)
    )
    if shift.any() and "Position" in made.passes:
        made.passes["Position"] = moved_back(made.passes["Position"], shift)
    return made


def _planned(scene: Scene, measure: Measure) -> EffectPlan:
    """The plan of a scene without motion."""
    # a recording serves lights of any color and strength, so a pilot under the present lights does not apply
    is_recording = measure.groups or measure.bands is not None or measure.sampling_lights is not None
    if measure.bands is not None:
        scene = replace(scene, settings=scene.settings.in_spectra())
    return plan_effects(tightened(scene), pilot=not is_recording and pilot_pays(scene), lights_vary=bool(is_recording))


def _render_instant(
    scene: Scene,
    on_progress: Callable[[Progress], None] | None,
    should_stop: Callable[[], bool] | None,
    measure: Measure,
    plan: EffectPlan | None = None,
) -> RenderResult:
    """Render a scene without motion; ``plan``: an existing plan."""
    meter = Meter()
    made = _traced(scene, on_progress, should_stop, measure, plan)
    return replace(made, work=meter.read().work)


def _traced(
    scene: Scene,
    on_progress: Callable[[Progress], None] | None,
    should_stop: Callable[[], bool] | None,
    measure: Measure,
    plan: EffectPlan | None,
) -> RenderResult:
    """The picture with its passes, denoised if requested."""
    meter = Meter()
    start = meter.started
    bands, groups, sampling_lights = measure.bands, measure.groups, measure.sampling_lights
    if scene.settings.denoise:
        require_denoiser()  # before the render instead of after an hour
    if bands is not None:
        scene = replace(scene, settings=scene.settings.in_spectra())
    asked = is_asked(scene.settings)
    if asked and (groups or sampling_lights is not None):
        raise InvalidInputError("a recording traces equal samples everywhere; give it samples, no error or time")
    if plan is None:
        plan = _planned(scene, measure)
    job = RenderJob(scene, plan, measure)
    if asked:
        timed = _timed(job, start)
        return _finished(_asked(job, scene, meter, on_progress, should_stop, bands), job, start, timed)
    status: Literal["done", "cancelled"] = "done"
    affordable = scene.film.samples
    # each group records its kernel in each pass
    left = pass_sizes(scene, watched=not groups and (on_progress is not None or should_stop is not None))
    while left:
        samples = min(left[0], affordable)
        left[:1] = [left[0] - samples] if left[0] > samples else []
        pass_start = time.perf_counter()
        if not job.trace(samples, should_stop):
            status = "cancelled"
            break
        now = time.perf_counter()
        affordable = max(1, int(LONGEST_PASS_S * samples / (now - pass_start)))
        if on_progress is not None:
            total = scene.film.samples
            left_s = (now - pass_start) / samples * (total - job.samples)
            on_progress(Progress(job.picture(), job.samples, total, now - start, left_s, memory_bytes()))
    made = RenderResult(
        pixels=job.picture(),
        plan=plan,
        notes=scene.notes + job.notes,
        samples=job.samples,
        seconds=time.perf_counter() - start,
        status=status,
        variant=job.variant,
        bands=bands,
        band_pixels=job.band_picture() if bands is not None else None,
        group_pixels=job.group_pictures() if groups else {},
        group_band_pixels=job.group_band_pictures() if groups and bands is not None else {},
    )
    return _finished(made, job, start)


def _timed(job: RenderJob, start: float) -> Any:
    """The passes that a render to a requested time traces before its picture; None for any other."""
    budget = job.scene.settings.time_budget_s
    if budget is None or job.scene.settings.passes is None:
        return None
    from spectral_core.render.passes.finish import timed_passes

    return timed_passes(job, job.scene.settings.passes, start + BUDGET_END * budget)


def _finished(made: RenderResult, job: RenderJob, start: float, timed: Any = None) -> RenderResult:
    """The result with its passes, denoised if the scene requests it; ``timed``: of a render to a requested time."""
    wanted = job.scene.settings.passes
    denoised = _denoised(made, job, start)
    if wanted is None or made.status == "cancelled":
        return denoised
    from spectral_core.render.passes.finish import made_passes

    counts = made.sample_counts
    if counts is None:
        counts = np.full(made.pixels.shape[:2], float(made.samples), np.float32)
    noisy = made.pixels if job.scene.settings.denoise else None
    passes, notes = made_passes(job, wanted, counts, noisy, timed)
    seconds, outcome = time.perf_counter() - start, denoised.outcome
    if timed is not None and outcome is not None:
        outcome = replace(outcome, seconds=seconds)
    return replace(denoised, passes=passes, notes=(*denoised.notes, *notes), seconds=seconds, outcome=outcome)


def _denoised(made: RenderResult, job: RenderJob, start: float) -> RenderResult:
    """The result, denoised if the scene requests it: each group and band separately, all with the same guides."""
    if not job.scene.settings.denoise:
        return made
    if made.status == "cancelled":
        note = Note("Denoising", "the render was stopped early; its picture is not denoised")
        return replace(made, notes=(*made.notes, note))
    guides = job.guides()
    how = denoiser_name() + (", albedo and normals as guides" if guides else ", without guides")
    groups = {name: denoise(pixels, guides) for name, pixels in made.group_pixels.items()}
    group_bands = {name: denoise_planes(planes, guides) for name, planes in made.group_band_pixels.items()}
    pixels, bands = made.pixels, made.band_pixels
    if groups:  # the groups still add up to the picture
        pixels = pixels.copy()
        pixels[..., :3] = sum(group[..., :3] for group in groups.values())
    else:
        pixels = denoise(pixels, guides)
    if bands is not None:
        bands = np.asarray(sum(group_bands.values())) if group_bands else denoise_planes(bands, guides)
    return replace(
        made,
        pixels=pixels,
        band_pixels=bands,
        group_pixels=groups,
        group_band_pixels=group_bands,
        seconds=time.perf_counter() - start,
        denoised=how,
    )


def _asked(
    job: RenderJob,
    scene: Scene,
    meter: Meter,
    on_progress: Callable[[Progress], None] | None,
    should_stop: Callable[[], bool] | None,
    bands: Bands | None,
) -> RenderResult:
    """Render to a requested error or time."""

    def on_round(pixels: Pixels, samples: float, expected: float) -> None:
        if on_progress is not None:
            total = max(round(expected), round(samples))
            wall = meter.read().wall
            left_s = wall * max(expected / samples - 1.0, 0.0)
            on_progress(Progress(pixels, round(samples), total, wall, left_s, memory_bytes()))

    made = render_asked(job, meter, on_round, should_stop)
    return RenderResult(
        pixels=made.pixels,
        plan=job.plan,
        notes=scene.notes + job.notes + made.notes,
        samples=round(made.outcome.samples),
        seconds=meter.read().wall,
        status=made.status,
        variant=job.variant,
        bands=bands,
        band_pixels=made.band_pixels,
        prediction=made.prediction,
        outcome=made.outcome,
        sample_counts=made.sample_counts,
        noise_pixels=made.noise_pixels,
    )
