# SPDX-License-Identifier: GPL-3.0-or-later
"""What F12 gives to the renderer: the scene of each view with its moments, passes and notes, without a picture."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from blender_addon import engine, jobs
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.result import RenderResult


def handed_over(monkeypatch: Any) -> Any:
    """Function that presses F12 and returns what reaches the renderer, and how its result would be written."""
    given: list[Any] = []

    def render(scene: Any, **options: Any) -> Any:
        given.append((scene, sorted(options.keys() - {"on_progress", "should_stop"})))
        film = scene.film
        width, height = (film.width, film.height) if film.crop is None else film.crop[2:]
        pixels = np.zeros((height, width, 4), np.float32)
        return RenderResult(pixels, EffectPlan((), 0.0), scene.notes, film.samples, 0.0, "done", "none")

    def write(_engine: Any, _pixels: Any, place: Any, *_: Any) -> None:
        given.append(place)

    monkeypatch.setattr(jobs, "render", render)
    monkeypatch.setattr(engine.SpectralRenderEngine, "_write", write)

    def press() -> Any:
        given.clear()
        count = len(jobs.records)
        bpy.ops.render.render()
        made = jobs.records[count:]
        assert all(each.status == "done" for each in made), made[-1].message
        return tuple(given)

    return press
