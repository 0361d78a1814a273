# SPDX-License-Identifier: GPL-3.0-or-later
"""The work of a render apart from its paths, measured on a picture of a few pixels: plan, loading, passes."""

from __future__ import annotations

from dataclasses import replace

from spectral_core.render.cost.asked import tightened
from spectral_core.render.cost.work import Meter
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.plan.effects import pilot_pays, plan_effects
from spectral_core.render.steps import pass_sizes
from spectral_core.scene import Scene

_SIZE = (8, 6)
"""Size of the measured picture; its paths take no time worth counting."""
_REPEATS = 4


def plan_of_render(scene: Scene) -> EffectPlan:
    """The plan of a render of ``scene``: with a pilot where that pays. Raises the same errors as ``plan_effects``."""
    return plan_effects(tightened(scene), pilot=pilot_pays(scene))


def plan_at(scene: Scene, tolerance: float | None = None) -> EffectPlan:
    """The plan of ``scene`` with a pilot, for a table: at the tolerance of its render, which is lower where an error is
    requested, or at another one. Raises the same errors as ``plan_effects``.
    """
    return plan_effects(tightened(scene), tolerance)


def fixed_work(scene: Scene, plan: EffectPlan) -> float:
    """Seconds of the processor that a render takes beside its paths, if its kernels are compiled."""
    planning = Meter()
    plan_of_render(scene)
    planned = planning.read().work
    width, height = _SIZE
    few = replace(scene, film=replace(scene.film, width=width, height=height, crop=None))
    loads, passes = [], []
    job: RenderJob | None = None
    for _ in range(_REPEATS):
        del job  # two loaded scenes at once would compile other kernels than one
        loading = Meter()
        job = RenderJob(few, plan)
        loads.append(loading.read().work)
        tracing = Meter()
        job.trace(1)
        job.picture()
        passes.append(tracing.read().work)
    # the first two of each may have compiled
    load, one_pass = (sorted(times)[1] for times in (loads, passes))
    moments = max(1, len(scene.moments))
    share = replace(scene, film=replace(scene.film, samples=max(1, scene.film.samples // moments)))
    return planned + moments * (load + len(pass_sizes(share)) * one_pass)
