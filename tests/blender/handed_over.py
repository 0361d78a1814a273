# SPDX-License-Identifier: GPL-3.0-or-later
"""What F12 gives to the renderer: the scene of each view with its moments, passes and notes, without a picture."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np

from blender_addon import jobs


def handed_over(monkeypatch: Any) -> Any:
    """Function that presses F12 and returns everything that reaches the renderer, and how the result is written."""
    given: list[Any] = []

    def render(scene: Any, **options: Any) -> Any:
        given.append((scene, sorted(options.keys() - {"on_progress", "should_stop"})))
        film = scene.film
        width, height = (film.width, film.height) if film.crop is None else film.crop[2:]
        return SimpleNamespace(
            pixels=np.zeros((height, width, 4), np.float32), passes={}, header={}, status="done", notes=scene.notes,
            samples=film.samples, seconds=0.0,
        )  # fmt: skip

    monkeypatch.setattr(jobs, "render", render)

    def press() -> Any:
        given.clear()
        count = len(jobs.records)
        bpy.ops.render.render()
        made = jobs.records[count:]
        assert all(each.status == "done" for each in made), made[-1].message
        return tuple(given), tuple(bpy.data.images["Render Result"].size)

    return press
