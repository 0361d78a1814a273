# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: a picture of each moment with its share of the samples, added up.

The moments are equal parts of the shutter's open time. Each is a scene without motion, so all types of motion are
blurred the same way: cameras, objects, deformed meshes. All moments share their kernels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.asked import is_asked
from spectral_core.render.passes.joined import FIRST_MOMENT, OF_FIRST_SAMPLE, joined_passes
from spectral_core.scene import Film, Moment, Note, Scene
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
    settings = scene.settings
    if is_asked(settings):
        settings = replace(settings, target_error=None, time_budget_s=None)
        notes.append(Note("Motion blur", "it is rendered with a number of samples; the error or time is not followed"))
    if settings.denoise:
        settings = replace(settings, denoise=False)
        notes.append(Note("Denoising", "a picture with motion blur is not denoised"))
    counts = shares(scene.film.samples, len(scene.moments))
    total, done = sum(counts), 0
    made: Any = None
    for number, (moment, count) in enumerate(zip(in_order(scene.moments), counts, strict=True)):
        film: Film = replace(scene.film, samples=count, seed=(scene.film.seed * len(counts) + number) & 0x7FFFFFFF)
        still = replace(scene.at(moment), film=film, settings=settings)
        before, traced = made, done

        def show(progress: Any, before: Any = before, traced: int = traced) -> None:
            pixels = (
                progress.pixels if before is None else _mean(before.pixels, traced, progress.pixels, progress.samples)
            )
            if on_progress is not None:
                on_progress(replace(progress, pixels=pixels, samples=traced + progress.samples, total=total))

        part = render(still, show, should_stop, None if before is None else before.plan)
        if part.samples == 0 and before is not None:
            made = replace(before, status=part.status)
        else:
            made = part if before is None else _joined(before, done, part)
        done += part.samples
        if part.status == "cancelled":
            break
    if any(name in OF_FIRST_SAMPLE or name.startswith(CRYPTOMATTES) for name in made.passes):
        notes.append(Note("Passes", FIRST_MOMENT))
    return replace(made, notes=(*made.notes, *notes))


def _mean(first: Pixels, samples: int, second: Pixels, more: int) -> Pixels:
    """Mean of two pictures by their samples."""
    total = max(samples + more, 1)
    return np.asarray(first * (samples / total) + second * (more / total), dtype=np.float32)


def _joined(before: Any, samples: int, part: Any) -> Any:
    """The result of several moments together with one more."""

    def mean(first: Any, second: Any) -> Any:
        if isinstance(first, dict):
            return {name: mean(first[name], second[name]) for name in first}
        return None if first is None else _mean(first, samples, second, part.samples)

    names = ("pixels", "band_pixels", "group_pixels", "group_band_pixels")
    pictures = {name: mean(getattr(before, name), getattr(part, name)) for name in names}
    fresh = tuple(note for note in part.notes if note not in before.notes)
    return replace(
        before,
        **pictures,
        passes=joined_passes(before.passes, samples, part.passes, part.samples),
        samples=samples + part.samples,
        seconds=before.seconds + part.seconds,
        status=part.status,
        notes=(*before.notes, *fresh),
    )
