# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow catchers: surfaces that show only how much the rest of the scene darkens them.

As in Cycles a picture is put together from three: the scene without its catchers, which stay where light bounces; the
catchers with all objects; and the catchers alone. The light that the second lacks relative to the third is shadow.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.asked import is_asked
from spectral_core.scene import Instance, Note, Rays, Scene

Pixels = NDArray[np.float32]

BUT_CAMERA = ~Rays.CAMERA & (Rays.DIFFUSE | Rays.GLOSSY | Rays.TRANSMISSION | Rays.VOLUME | Rays.SHADOW)
"""Every ray that is not the camera's own."""
EDGES = "on a film that is not transparent, Cycles draws a dark line along the edges of objects before it"
PASSES = "passes, bands and light groups are those of the scene without its shadow catchers"


def with_catchers(render: Callable[..., Any]) -> Callable[..., Any]:
    """``render`` for scenes that may have shadow catchers; it takes a scene, callbacks and a plan."""

    def caught(scene: Scene, on_progress: Any, should_stop: Any, plan: Any = None) -> Any:
        if any(item.is_shadow_catcher for item in scene.instances):
            return render_catching(scene, render, on_progress, should_stop)
        return render(scene, on_progress, should_stop, plan)

    return caught


def render_catching(
    scene: Scene,
    render: Callable[..., Any],
    on_progress: Callable[[Any], None] | None,
    should_stop: Callable[[], bool] | None,
) -> Any:
    """Result of a scene with shadow catchers; ``render`` makes one of a scene without, and is given those two."""
    notes: list[Note] = []
    settings = scene.settings
    if is_asked(settings):
        settings = replace(settings, target_error=None, time_budget_s=None)
        notes.append(
            Note("Shadow catcher", "it is rendered with a number of samples; the error or time is not followed")
        )
    if settings.denoise:
        settings = replace(settings, denoise=False)
        notes.append(Note("Denoising", "a picture with shadow catchers is not denoised"))
    scene = replace(scene, settings=settings)
    plain = replace(settings, passes=None)
    transparent = replace(scene.film, transparent=True)
    # The camera does not see volumes there: the first picture shows them, and what they leave of the shadows.
    volumes = tuple(replace(volume, hidden_from=volume.hidden_from | Rays.CAMERA) for volume in scene.volumes)
    sees = replace(scene, film=transparent, settings=plain, volumes=volumes)

    count, start = 3 if scene.film.transparent else 4, time.perf_counter()
    parts: list[Any] = []

    def show(progress: Any) -> None:
        """Show the first of the renders, whose pixels stay while the others give the shadows."""
        if on_progress is not None:
            pixels = parts[0].pixels if parts else progress.pixels
            samples = (len(parts) * progress.total + progress.samples) // count
            on_progress(progress.within(pixels, samples, progress.total, start))

    rest = render(_with(scene, _as_holdout, _same), show, should_stop, None)
    if settings.passes is not None or rest.group_pixels or rest.bands is not None:
        notes.append(Note("Shadow catcher", PASSES))
    parts.append(rest)
    if rest.status == "done":
        parts.append(render(_with(sees, _same, _as_holdout), show, should_stop, None))
    if parts[-1].status == "done":
        alone = replace(sees, volumes=(), lights=tuple(light for light in scene.lights if light.is_in_footage))
        parts.append(render(_with(alone, _same, _as_absent), show, should_stop, parts[-1].plan))
    if parts[-1].status == "done" and not scene.film.transparent:
        empty = replace(sees, film=scene.film, instances=(), lights=(), volumes=())
        parts.append(render(empty, show, should_stop, None))
    if parts[-1].status != "done" or parts[-1].samples == 0:
        return replace(rest, status="cancelled", notes=(*rest.notes, *notes))
    lit, unshadowed = parts[1].pixels, parts[2].pixels
    background = None if scene.film.transparent else parts[3].pixels
    if background is not None:
        notes.append(Note("Shadow catcher", EDGES))
    seconds, work = (sum(getattr(part, name) for part in parts) for name in ("seconds", "work"))
    fresh = [note for part in parts[1:3] for note in part.notes if note not in rest.notes]
    told = tuple(dict.fromkeys((*rest.notes, *fresh, *notes)))
    return replace(
        rest, pixels=joined(rest.pixels, lit, unshadowed, background), seconds=seconds, work=work, notes=told
    )


def joined(rest: Pixels, lit: Pixels, alone: Pixels, background: Pixels | None) -> Pixels:
    """The picture (h, w, 4) of the scene without catchers, and their shadows on a transparent film or a background.

    ``lit``, ``alone``: the catchers with the rest of the scene and without it, on transparent films.
    """
    share = lit[..., 3:]
    # a channel without light has no shadow, as in Cycles
    ratio = np.divide(lit[..., :3], alone[..., :3], out=np.ones_like(lit[..., :3]), where=alone[..., :3] > 0)
    covered = 1.0 if background is not None else np.clip(rest[..., 3:] + share, 0, 1)
    ratio = (1 - covered) + covered * ratio
    bright = np.where(share > 0, np.clip(ratio.mean(-1, keepdims=True), 0, 1), 1.0)
    made = np.array(rest, dtype=np.float32)
    if background is None:
        alpha = np.clip(rest[..., 3:], 0, 1)
        made[..., 3:] = alpha + (1 - alpha) * (1 - bright)
    else:
        # of the background behind a catcher only what volumes in front of it leave
        made[..., :3] += np.minimum(share, np.clip(1 - rest[..., 3:], 0, 1)) * bright * background[..., :3]
        made[..., 3:] = 1.0
    return made


def _with(scene: Scene, catcher: Callable[[Instance], Instance], other: Callable[[Instance], Instance]) -> Scene:
    made = tuple((catcher if item.is_shadow_catcher else other)(item) for item in scene.instances)
    return replace(scene, instances=tuple(replace(item, is_shadow_catcher=False) for item in made))


def _same(item: Instance) -> Instance:
    return item


def _as_holdout(item: Instance) -> Instance:
    return replace(item, is_holdout=True)


def _as_absent(item: Instance) -> Instance:
    """In front of the camera it still hides the background, but receives no light."""
    return replace(item, is_holdout=True, hidden_from=item.hidden_from | BUT_CAMERA)
