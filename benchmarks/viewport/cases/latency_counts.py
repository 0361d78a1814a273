# SPDX-License-Identifier: GPL-3.0-or-later
"""What each kind of change costs in counts, which a busy machine does not change: launches recorded, kernels compiled.

The stage of a live view traces the first launch after each change in this process, where Dr.Jit's history of kernels
can be read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Scene

Change = Callable[[Scene, np.random.Generator], Scene]


@dataclass
class Counts:
    """Of one kind of change. ``first``: recordings and kernels of the first; ``later``: of all later ones."""

    first: tuple[int, int] = (0, 0)
    later: tuple[int, int] = (0, 0)
    how: list[str] = field(default_factory=list)


def counted(
    scene: Scene, changes: Mapping[str, Change], views: Mapping[str, Callable[[Any], Viewpoint]], rounds: int
) -> dict[str, Counts]:
    """Counts by kind: ``changes`` of the scene, and ``views``, which make a viewpoint from random numbers."""
    rng = np.random.default_rng(11)
    stage = Stage()
    stage.show(scene)
    stage.activate()
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    _trace(stage, viewpoint, scene)
    found = {kind: Counts() for kind in (*views, *changes)}
    for number in range(rounds):
        for kind, counts in found.items():
            before = stage.launcher.recordings
            if kind in views:
                viewpoint = views[kind](rng)
            else:
                scene = changes[kind](scene, rng)
                stage.show(scene)
            kernels = _trace(stage, viewpoint, scene)
            recordings = stage.launcher.recordings - (0 if stage.how == "loaded" and kind in changes else before)
            counts.how.append("" if kind in views else stage.how)
            if number:
                counts.later = counts.later[0] + recordings, counts.later[1] + kernels
            else:
                counts.first = recordings, kernels
    stage.forget()
    return found


def _trace(stage: Stage, viewpoint: Viewpoint, scene: Scene) -> int:
    """Trace the first launch of a picture; the number of kernels that were compiled for it."""
    import drjit as dr

    request = ViewRequest("stage", viewpoint, scene.film.width, scene.film.height, 4, 0)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        stage.look_from(viewpoint)
        ViewPicture(stage.launcher, request, 4).step()
        launched = dr.kernel_history()
    return sum(not each["cache_hit"] for each in launched if "cache_hit" in each)
