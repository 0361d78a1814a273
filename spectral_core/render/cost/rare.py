# SPDX-License-Identifier: GPL-3.0-or-later
"""Light on paths so rare that no sample contains it, or too few: an estimate from the samples is then a lower bound.

Where no lamp can be sampled, through sharp glass and over mirrors, and where a narrow cone crosses a medium, paths find
small bright sources by chance only. An event that n paths do not contain has a chance of at most 3/n at 95 %
confidence, so the brightest source limits the light that is missing. Where that limit matters, the same pixels are
traced with larger sources of equal power (``softened``): they send about as much light over glass and into media, on
paths that are common.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.errors import block_means
from spectral_core.render.cost.model import RareLight
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.softened import narrow_cones, softened
from spectral_core.render.cost.work import Meter
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.decision import EffectPlan
from spectral_core.render.plan.inventory import is_sharp, shown_materials
from spectral_core.render.plan.light.sources import radiances
from spectral_core.scene import Material, Scene, leaves
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb

Array = NDArray[np.float64]

MATTERS = 0.25
"""Part of the estimated error from which missing light is looked for, and reported."""
UNMET = 0.5
"""Part of the light under larger sources below which a block of pixels has not met that light."""
AGREED, DIFFERED = 0.85, 0.6
"""Parts of that light which both halves show in the same blocks, and of its sum under larger sources which the scene's
own show: from the first on it is not rare, up to the second it is. Larger sources spread light over more blocks, which
then lack none.
"""
SOFT_SHARE, SOFT_PATHS = 4, 1 << 17
"""Samples of the probe over those with larger sources, and least number of paths with these."""
OVER_GLASS = "light of {!r} over glass or mirrors"
IN_MEDIUM = "light of {!r} that is scattered in a medium"
_AWAY, _WAYS = 1e-4, 256
"""Least length of a ray that finds the distance of surfaces from a lamp, and the number of such rays."""


@dataclass(frozen=True, slots=True)
class Search:
    """Result of ``find_rare_light``: what is missing, None if nothing that matters; ``work``: seconds of processor."""

    rare: RareLight | None = None
    work: float = 0.0


def find_rare_light(scene: Scene, plan: EffectPlan, probe: Probe, delta_e: float, *, traces: bool = True) -> Search:
    """Light that a probe misses and that matters beside an error ``delta_e`` of noise; without ``traces`` only a limit
    of it, which takes no time.
    """
    if scene.volumes:
        return Search()
    shown = shown_materials(scene)
    materials = [material for material in scene.materials if material.name in shown]
    known, what = _limit(scene, materials, probe)
    limit: float | None = known
    cones = narrow_cones(scene) if plan.is_on("media") else []
    if known <= MATTERS * delta_e:
        if not cones or scene.settings.light_paths.clamp_indirect > 0:  # no path carries more than that
            return Search()
        limit, what = None, IN_MEDIUM.format(cones[0])
    if not traces:
        return Search(RareLight(0.0, limit, what))
    meter = Meter()
    scene = replace(scene, settings=replace(scene.settings, passes=None))
    large = softened(scene, _clearance(scene, plan))
    if large is scene:
        return Search(RareLight(0.0, limit, what), meter.read().work)
    missing = _missing(scene, large, plan, probe)
    if missing > MATTERS * delta_e:
        return Search(RareLight(missing, limit, what), meter.read().work)
    # the rest of the limit is that of sources which cannot grow
    rest, what = _limit(large, materials, probe)
    return Search(RareLight(0.0, rest, what) if rest > MATTERS * delta_e else None, meter.read().work)


def _limit(scene: Scene, materials: list[Material], probe: Probe) -> tuple[float, str]:
    """Mean ΔE2000 of the light over glass and mirrors that all paths of the probe may have missed, and its name."""
    if not any(is_sharp(leaf) for material in materials for leaf in leaves(material.surface)):
        return 0.0, ""
    brightest, name = max(radiances(scene, materials), default=(0.0, ""))
    most = scene.settings.light_paths.clamp_indirect
    brightest = min(brightest, most) if most > 0 else brightest
    radiance = 3.0 / (2 * probe.samples * len(probe.pixels)) * brightest * scene.displayed_film.exposure
    seen = probe.halves().mean(axis=0)
    return float(np.mean(_apart(seen + radiance, seen))), OVER_GLASS.format(name)


def _missing(scene: Scene, large: Scene, plan: EffectPlan, probe: Probe) -> float:
    """Mean ΔE2000 of the light that larger sources show in blocks whose pixels have met little of it."""
    fewer = max(2, probe.samples // SOFT_SHARE, SOFT_PATHS // (2 * len(probe.pixels)))
    own = probe.halves() - _traced(_direct_only(scene), plan, probe.pixels, probe.samples)
    soft = _traced(large, plan, probe.pixels, fewer) - _traced(_direct_only(large), plan, probe.pixels, fewer)
    halves = np.stack([block_means(luminance_from_linear_rgb(half), probe.blocks) for half in own])
    total = float(halves.mean(axis=0) @ probe.shares)
    large_total = float(luminance_from_linear_rgb(soft.mean(axis=1)).min())  # one bright path of a half is chance
    agreed = float(np.minimum(*halves) @ probe.shares) / max(total, 1e-30)
    agreed = min(agreed, total / max(large_total, 1e-30))
    rare = float(np.clip((AGREED - agreed) / (AGREED - DIFFERED), 0.0, 1.0))
    there = np.stack([block_means(np.maximum(column, 0.0), probe.blocks) for column in soft.mean(axis=0).T], axis=1)
    met = np.stack([block_means(column, probe.blocks) for column in own.mean(axis=0).T], axis=1)
    unmet = halves.mean(axis=0) < UNMET * luminance_from_linear_rgb(there)
    lacking = np.where(unmet[:, None], np.maximum(there - met, 0.0), 0.0)
    seen = probe.halves().mean(axis=0)
    return float(np.mean(_apart(seen + rare * lacking[probe.blocks], seen)))


def _direct_only(scene: Scene) -> Scene:
    """Without light over glass and mirrors after a diffuse surface, and without that scattered twice in media."""
    limits = replace(scene.settings.light_paths, reflective_caustics=False, refractive_caustics=False, volume=0)
    return replace(scene, settings=replace(scene.settings, light_paths=limits))


def _traced(scene: Scene, plan: EffectPlan, pixels: NDArray[np.int64], samples: int) -> Array:
    """(2, n, 3): the halves of a probe's pixels, by its random numbers."""
    none = np.zeros(len(pixels), np.int64)
    sums = RenderJob(scene, plan).chosen_pixels().trace_halves(pixels, none, none + samples)
    return np.asarray(sums.colors.reshape(2, -1, 3) / samples)


def _apart(one: Array, other: Array) -> Array:
    return np.asarray(delta_e_2000(*(lab_from_linear_rgb(np.maximum(each, 0.0)) for each in (one, other))))


def _clearance(scene: Scene, plan: EffectPlan) -> Callable[[Array], float]:
    """Distance from a point (3,) to the nearest surface, by rays in all directions."""
    golden = np.pi * (3 - np.sqrt(5)) * np.arange(_WAYS)
    z = 1 - (2 * np.arange(_WAYS) + 1) / _WAYS
    flat = np.sqrt(1 - z * z)
    ways = np.stack([flat * np.cos(golden), flat * np.sin(golden), z]).astype(np.float32)
    loaded: list[Any] = []

    def nearest(point: Array) -> float:
        if not loaded:
            loaded.append(RenderJob(scene, plan).traced_scene())
        traced = loaded[0]
        mi = traced.mitsuba
        ray = mi.Ray3f(mi.Point3f(*(float(x) * traced.unit for x in point)), mi.Vector3f(ways))
        distance = np.array(traced.scene.ray_intersect_preliminary(ray).t, dtype=np.float64)
        return float(distance[distance > _AWAY].min(initial=np.inf)) / float(traced.unit)

    return nearest
