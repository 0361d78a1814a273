# SPDX-License-Identifier: GPL-3.0-or-later
"""All passes of a finished render, by the names that Cycles gives them."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import RenderError
from spectral_core.render.job import RenderJob
from spectral_core.render.passes.books import LIGHT_ROWS, light_group_names
from spectral_core.render.passes.data import DataPasses
from spectral_core.render.passes.denoising import DenoisingData
from spectral_core.render.passes.subjects import Subjects
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.scene import Note
from spectral_core.scene.passes import DATA_PASSES, GROUP_PREFIX, LOBES, Passes
from spectral_core.spectra.color import RGB_FROM_XYZ

Array = NDArray[np.float32]

ORDERS = ("Direct", "Indirect")
LEAST_COLOR = 1e-6
"""Colors of a lobe below it count as no lobe: light divided by them would be noise."""
WITH_MEDIA = "light passes do not support sampled volumes; the file holds the light in Combined only"
SMOOTH_NORMALS = "normals of passes are smooth: bumps and normal maps change the light, but not the passes"
EQUAL_SAMPLES = (
    "shares of the light were traced beside the picture, whose pixels took different numbers of samples; they add up "
    "to it except for noise"
)

_GROWTH, _LONGEST = 4, 0.05
"""Largest growth of the samples of a launch, whose time is estimated from the last one, and its longest part of the
time: other programs may slow it down.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """Passes of a render to a requested time: those that are ``known`` before the picture takes what is left, and the
    moment of ``time.perf_counter`` at which the light of the others shall ``end``.
    """

    known: dict[str, Array]
    end: float


def timed_passes(job: RenderJob, wanted: Passes | None, end: float) -> Timed | None:
    """The passes that are traced before the picture of a render to a requested time. Raises as ``made_passes``."""
    try:
        return None if wanted is None else Timed(_first_hits(job, wanted, 0), end)
    except Exception as error:
        raise RenderError(f"Mitsuba stopped while tracing passes: {error}") from error


def made_passes(
    job: RenderJob, wanted: Passes, samples: Array, noisy: Array | None, timed: Timed | None = None
) -> tuple[dict[str, Array], tuple[Note, ...]]:
    """Every requested pass (height, width, channels), row 0 at the bottom, and notes for the user.

    ``samples``: (height, width) per pixel. ``noisy``: the picture before it was denoised, None without denoising.
    ``timed``: of a render to a requested time. Raises RenderError if Mitsuba fails.
    """
    try:
        return _made(job, wanted, samples, noisy, timed)
    except Exception as error:
        raise RenderError(f"Mitsuba stopped while tracing passes: {error}") from error


def _made(
    job: RenderJob, wanted: Passes, samples: Array, noisy: Array | None, timed: Timed | None
) -> tuple[dict[str, Array], tuple[Note, ...]]:
    notes: list[Note] = []
    found: dict[str, Array] = {}
    light: dict[str, Array] = {}
    if wanted.light or wanted.light_groups:
        light, told = _light(job, wanted, float(samples.mean()), None if timed is None else timed.end)
        notes += told
    if timed is not None:
        found |= timed.known
    else:
        divides = any(f"{lobe} {order}" in light for lobe in LOBES for order in ORDERS)
        found |= _first_hits(job, wanted, job.light_sums.samples if divides else 0)
    if {"Normal", "Denoising Normal"} & set(wanted.names) and any(
        _bends(material.surface) for material in job.scene.materials
    ):
        notes.append(Note("Passes", SMOOTH_NORMALS))
    found |= light
    for lobe in LOBES:
        color = found.get(f"{lobe} Color")
        for name in (f"{lobe} {order}" for order in ORDERS):
            if name in found and color is not None:
                found[name] = np.divide(found[name], color, out=np.zeros_like(color), where=color > LEAST_COLOR)
    if "Debug Sample Count" in wanted.names:
        found["Debug Sample Count"] = samples.astype(np.float32)[..., None]
    if "Noisy Image" in wanted.names and noisy is not None:
        found["Noisy Image"] = noisy
    for name, kind in wanted.aovs:
        if kind == "VALUE":
            found[name] = found[name][..., :1]
    kept = [name for name in found if name not in DATA_PASSES or name in wanted.names]
    return {name: np.ascontiguousarray(found[name], np.float32) for name in kept}, tuple(notes)


def _first_hits(job: RenderJob, wanted: Passes, light_samples: int) -> dict[str, Array]:
    """Passes of the first hits, without light. ``light_samples``: of light that is divided by their colors."""
    found: dict[str, Array] = {}
    view = (job.scene.camera, job.scene.film)
    if wanted.data or wanted.aovs or wanted.cryptomattes:
        subjects = Subjects(job.mitsuba, job.scene, job.loaded.scene, wanted)
        sampled = job.loaded.integrator.sampled
        tracer = DataPasses(
            job.mitsuba, view, job.loaded.wavelengths, wanted, subjects, job.unit, light_samples, sampled
        )
        found |= tracer.trace(job.loaded.first_hit)
    if wanted.denoising:
        guides = DenoisingData(
            job.mitsuba, view, job.loaded.wavelengths, wanted.denoising, job.loaded.integrator, job.unit,
            shows_background="Environment" in wanted.names,
        )  # fmt: skip
        found |= guides.trace(job.loaded.first_hit)
    return found


def _light(job: RenderJob, wanted: Passes, samples: float, end: float | None) -> tuple[dict[str, Array], list[Note]]:
    """Shares of the light: traced with the picture, or separately if its pixels took different numbers of samples."""
    notes = []
    if not job.tells_light_apart:
        return {}, [Note("Passes", WITH_MEDIA)]
    sums = job.light_sums
    if sums.samples == 0:
        _trace_until(job, max(1, round(samples)), end)
        notes.append(Note("Passes", EQUAL_SAMPLES))
    rows: dict[str, Any] = {**LIGHT_ROWS, **light_group_names(wanted.light_groups)}
    pictures = _pictures(sums, len(rows))
    names = [*wanted.light, *(GROUP_PREFIX + group for group in wanted.light_groups)]
    return {name: pictures[..., rows[name], :] for name in names}, notes


def _trace_until(job: RenderJob, samples: int, end: float | None) -> None:
    """Trace ``samples`` per pixel; with ``end`` as many of them as fit, at least one."""
    if end is None:
        job.trace(samples)
        return
    job.trace(1)  # compiles
    left, step, longest = samples - 1, 1, _LONGEST * (end - time.perf_counter())
    while left > 0:
        start = time.perf_counter()
        job.trace(min(step, left))
        now, left = time.perf_counter(), left - step
        of_each = max(now - start, 1e-9) / step
        if now + of_each > end:
            return
        step = max(1, min(_GROWTH * step, int(min(longest, end - now) / of_each)))


def _pictures(sums: Accumulator, rows: int) -> Array:
    """Means so far of the shares of the light, (height, width, rows, 3) linear sRGB, row 0 at the bottom."""
    width, height = sums.film.size
    means = np.concatenate([tile.mean(tile.light).reshape(tile.count, rows, 3) for tile in sums.tiles])
    colors = means if sums.plan is None else means @ RGB_FROM_XYZ.T
    return np.asarray(colors * sums.film.exposure, np.float32).reshape(height, width, rows, 3)


def _bends(surface: Any) -> bool:
    from spectral_core.scene import leaves

    return any(getattr(leaf, "normal", None) is not None for leaf in leaves(surface))
