# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a view against that of a process without earlier data, which loads a full translation of the scene."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.viewport.edits.session import HEIGHT, SAMPLES, WIDTH

PATIENCE_S = 300.0
LARGEST_ERROR = 2e-3
"""Mean difference, as a share of the mean, between a view and a fresh one: their random numbers are the same."""
CERTAIN_SAMPLES = (64, 1024, 4096)
"""Samples with which pictures that differ are compared again: a ray that meets an edge may pass it in one of the two
processes, whose trees were built in another order, and a picture of few samples shows that path. In spectral transport
64 miss the mean of a small object in the dark by up to 5 %.
"""
LARGEST_MEAN_ERROR = 1e-2
"""The same of a picture's mean in spectral transport: wavelengths are drawn by the spectra with which a scene was
loaded, so that after an edit in place the noise differs from that of a fresh view.
"""
DEVIATIONS = 5.0
"""Standard errors by which the mean of a picture in spectral transport may differ from one of other noise."""

Measure = Callable[[Any, Any], float]
"""Difference of two pictures."""


@dataclass(frozen=True)
class Comparison:
    """``error``: the difference. ``trouble``: what is wrong, "" if nothing is. ``is_dark``: the picture is black.
    ``repeated``: more samples were needed. ``evidence``: pictures and scenes, fresh and shown.
    """

    error: float
    trouble: str
    is_dark: bool = False
    repeated: bool = False
    evidence: Any = None

    def keep(self, folder: Path, name: str, made: list[str]) -> None:
        """Write the scene and the evidence, for whoever looks for the cause. ``made``: the types of all changes."""
        import bpy

        folder.mkdir(parents=True, exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder.resolve() / f"{name}.blend"), copy=True)
        (folder / f"{name}.pickle").write_bytes(pickle.dumps((self.evidence, made)))


class FreshView:
    """The process without earlier data."""

    def __init__(self) -> None:
        from spectral_core.render.live.link import LiveLink

        self._link = LiveLink()

    def compared(self, session: Any, shown: Any, name: str) -> Comparison:
        """Compare a finished picture of a session; with more samples if noise may be the difference."""
        import bpy

        from blender_addon.editing.palette.picture import shown_in
        from blender_addon.translate.scene import translate_scene
        from spectral_core.scene import Camera

        depsgraph, side = bpy.context.evaluated_depsgraph_get(), session._sides[0]
        own, stage = session._stage_of(side), f"fresh {name}"
        known = session.link._scenes[own]
        camera = Camera(world_from_camera=np.eye(4))
        true = translate_scene(depsgraph, film=known.film, seen_from=camera, designed=shown_in(depsgraph.scene))
        self._link.show(stage, true)
        try:
            found = _pictured(self._link, stage, side.viewpoint, SAMPLES)
            if found is None:
                return Comparison(np.inf, f"the fresh process shows nothing: {self._link.trouble(stage)}")
            error, limit, repeated, is_other = _difference(found, shown), LARGEST_ERROR, False, False
            if error > limit:
                # both see the same scene, so that more samples tell noise from another scene
                limit = LARGEST_MEAN_ERROR if shown.frame.is_spectral else LARGEST_ERROR
                measure = _difference_of_means if shown.frame.is_spectral else _difference
                error, repeated = self._certain_error(session, stage, measure, limit), True
                is_other = not _is_rendered(session, shown)
        finally:
            self._link.drop(stage)
        trouble = f"differs from a fresh view by {error:.1e} of its mean" if error > limit else ""
        if is_other and not trouble:
            trouble = "is another picture than the process renders, as if it were one of before the change"
        is_dark = not found.pixels[..., :3].any()
        return Comparison(error, trouble, is_dark, repeated, ((found.pixels, shown.pixels), (true, known)))

    def _certain_error(self, session: Any, stage: str, measure: Measure, limit: float) -> float:
        """The difference of the two pictures by a measure, with more samples until it is small."""
        error, side = float(np.inf), session._sides[0]
        for samples in CERTAIN_SAMPLES:
            own = _pictured(session.link, session._stage_of(side), side.viewpoint, samples)
            sure = _pictured(self._link, stage, side.viewpoint, samples)
            if own is None or sure is None:
                return float(np.inf)
            error = measure(sure, own)
            if error <= limit:
                break
        return error

    def close(self) -> None:
        """End the process."""
        self._link.close()


def _is_rendered(session: Any, shown: Any) -> bool:
    """True if the session's process renders the shown picture again. In spectral transport a process that was killed
    after it is replaced by one with other noise.
    """
    side = session._sides[0]
    again = _pictured(session.link, session._stage_of(side), side.viewpoint, SAMPLES)
    if again is None:
        return False
    if _difference(again, shown) <= LARGEST_ERROR:
        return True
    apart = (again.pixels - shown.pixels).reshape(-1, shown.pixels.shape[-1])
    allowed = DEVIATIONS * apart.std(axis=0) / np.sqrt(len(apart)) + LARGEST_ERROR * _mean(again)
    return bool(shown.frame.is_spectral and (np.abs(apart.mean(axis=0)) <= allowed).all())


def _pictured(link: Any, stage: str, viewpoint: Any, samples: int) -> Any:
    """The finished picture of a stage; None if it does not come."""
    from spectral_core.render.live.view import ViewRequest

    name = f"{stage} at {samples}"
    request = ViewRequest(stage, viewpoint, WIDTH, HEIGHT, samples, 0)
    generation = link.look(name, request, lambda: None)
    end = time.monotonic() + PATIENCE_S
    try:
        while time.monotonic() < end:
            link.wait(name, generation, 1.0)
            latest = link.latest(name)
            if latest is not None and latest.frame.is_done:
                return latest
            time.sleep(0.01)
        return None
    finally:
        link.close_view(name)


def _difference(found: Any, shown: Any) -> float:
    """Mean difference of two pictures, as a share of the mean."""
    return float(np.abs(found.pixels - shown.pixels).mean()) / _mean(found)


def _difference_of_means(found: Any, shown: Any) -> float:
    """Largest difference of a channel's mean, as a share of the mean."""
    return float(np.abs((found.pixels - shown.pixels).mean(axis=(0, 1))).max()) / _mean(found)


def _mean(picture: Any) -> float:
    return max(float(np.abs(picture.pixels[..., :3]).mean()), 1e-3)
