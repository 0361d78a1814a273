# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects that a pilot decides: their errors and shares of the time.

If rare paths may carry light that a pilot misses (sharp mirrors and glass under small bright sources), the errors
include an upper limit of that light, at 95 % confidence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plan import bounds
from spectral_core.render.plan.decision import MOST_BOUNCES
from spectral_core.render.plan.effects_from_data import THIN, Found
from spectral_core.render.plan.errors.spectral import rgb_transport_error
from spectral_core.render.plan.inventory import is_sharp, names
from spectral_core.render.plan.levels import Effect, Level
from spectral_core.render.plan.light.reflections import is_linear
from spectral_core.render.plan.light.shown import bodies_in_view, emission_in_view, error_of_bodies
from spectral_core.render.plan.light.sources import radiances
from spectral_core.render.plan.measured import error_of_loss, unseen_radiance
from spectral_core.render.plan.pilot import LEVELS, PILOT_BOUNCES, Pilot
from spectral_core.scene import leaves

COUNTED = (PILOT_BOUNCES, 32, 24, 16, 12, 8, 6, 5, 4, 3, 2, 1, 0)
"""Candidate numbers of bounces."""
HIDDEN, WORTHWHILE = 0.01, 0.1
"""ΔE2000 of light that nobody misses; and the further share of the time that a limit on bounces must save to omit more.
Few paths are left after some bounces: omitting them saves a hundredth of the time and darkens corners.
"""
WITHIN_A_SURFACE = 7
"""Reflections that are compared for a surface whose own facets, coat or inside reflect light several times."""
_KINDS = {
    "diffuse_bounces": ("diffuse", "diffuse surfaces illuminate each other", "dark corners"),
    "glossy_bounces": ("glossy", "surfaces mirror each other", "dark reflections"),
    "transmission_bounces": ("transmission", "light passes surfaces", "what lies behind glass is dark"),
}


def measured_effects(found: Found, effects: Mapping[str, Effect], pilot: Pilot) -> dict[str, Effect]:
    """The effects with the results of the pilot."""
    known = dict(effects)
    unseen = _unseen(found, pilot)
    for name in ("environment", "emissive_meshes", "transparency"):
        effect = effects[name]
        if len(effect.levels) > 1 and effect.how != "exact":
            error = error_of_loss(pilot, pilot.flagged(name), _unseen(found, pilot, name))
            if effect.how == "bounded":
                error = min(error, effect.levels[-1].error)
            if name == "emissive_meshes":
                radiance = emission_in_view(found.scene, found.materials)
                error = max(error, bounds.error_of_light(radiance * found.scene.film.exposure))
            seen = pilot.flagged("environment_in_view")[..., :3].any() and not found.scene.film.transparent
            if name == "environment" and seen:
                error = max(error, effect.levels[-1].error)  # a small window to the sky would be black
            known[name] = _with_last(effect, error, effect.share)
    for name in ("reflective_caustics", "refractive_caustics"):
        effect = effects[name]
        if effect.how != "exact":
            light = pilot.flagged(name)
            known[name] = _with_last(effect, error_of_loss(pilot, light, unseen), _share(pilot, light))
    bounces = known.pop("bounces")
    if bounces.how != "exact":
        bodies = bodies_in_view(found.scene, found.materials)
        for name, (kind, reason, loses) in _KINDS.items():
            known[name] = _chain(name, kind, reason, loses, pilot, unseen, bodies & {kind})
        limit = found.scene.settings.scene_bounces
        further = MOST_BOUNCES if limit is None else min(limit, MOST_BOUNCES)
        bounces = _chain("bounces", "bounces", "", bounces.loses, pilot, unseen, bodies, further)
    known["bounces"] = bounces
    known["transport"] = _as_often_reflected(found, known["transport"], bounces)
    return known


def _as_often_reflected(found: Found, transport: Effect, bounces: Effect) -> Effect:
    """Surfaces are compared after as many others as visible light meets; one by one, if none is reflected twice."""
    inventory = found.inventory
    if transport.how == "exact" or inventory.media or inventory.dispersive:
        return transport
    small = [int(level.value) for level in bounces.levels if level.error <= THIN]
    most = min([*small, PILOT_BOUNCES])
    if inventory.transparent or inventory.refractive:
        most = PILOT_BOUNCES  # straight ways through a surface are no bounces
    elif not is_linear(found.materials):
        most = max(most, WITHIN_A_SURFACE)
    error = rgb_transport_error(found.scene, most + 1)
    first, rgb = transport.levels
    often = "twice" if most == 0 else f"more than {most + 1} times"
    reason = (
        f"there are spectra in {names(inventory.spectra)}; no light of ΔE {THIN:g} is reflected {often}, and surfaces "
        f"under all lights have an error of ΔE {error:.2g} in three channels"
    )
    return replace(transport, levels=(first, replace(rgb, error=min(error, rgb.error))), reason=reason)


def unmeasured_kinds() -> dict[str, Effect]:
    """Bounces by type without a pilot: the limit of each equals the limit on all bounces."""
    return {
        name: Effect(name, (Level(str(PILOT_BOUNCES)),), "no limit except that on all bounces", how="not known")
        for name in _KINDS
    }


def _with_last(effect: Effect, error: float, share: float) -> Effect:
    first, *_, last = effect.levels
    return replace(effect, levels=(first, replace(last, error=error, saves=share)), how="measured")


def _chain(
    name: str, count: str, reason: str, loses: str, pilot: Pilot, unseen: float, bodies: frozenset[str],
    further: int = PILOT_BOUNCES,
) -> Effect:  # fmt: skip
    """Numbers of bounces, each with the light beyond it in the pilot, except those that omit visible light and save
    little. Light that the pilot may have missed adds to the error only, not to this exception. ``bodies``: types of
    bounces that small mirrors and bodies of glass need. ``further``: the scene's own limit; where it is above the
    pilot's, the light between them counts, too.
    """
    counts = (further, *COUNTED) if further > PILOT_BOUNCES else COUNTED
    after = pilot.after_last_bounce(count) if further > PILOT_BOUNCES else None
    levels, hidden = [Level(str(counts[0]))], 0.0
    error, seen, saves = 0.0, 0.0, 0.0
    for most in counts[1:]:
        lost = pilot.beyond(count, LEVELS if most == PILOT_BOUNCES else most)
        lost = lost if after is None else lost + after
        error, saves = max(error_of_loss(pilot, lost, unseen), error), max(_share(pilot, lost), saves)
        small = max((error_of_bodies(pilot, kind, most) for kind in bodies), default=0.0)
        error, seen = max(error, small), max(error_of_loss(pilot, lost), seen, small)
        hidden = saves if seen <= HIDDEN else hidden
        pays = seen <= HIDDEN or saves >= hidden + WORTHWHILE
        if error <= 100 and (pays or most == 0):
            levels.append(Level(str(most), error, saves, pays))
    return Effect(name, tuple(levels), reason, loses, "measured")


def _share(pilot: Pilot, lost: NDArray[np.float64]) -> float:
    return float(lost[..., 3].sum() / max(pilot.surfaces_met, 1.0))


def _unseen(found: Found, pilot: Pilot, name: str = "") -> float:
    """Upper limit of the radiance in paths over sharp mirrors and glass; ``name``: of one kind of source alone, none
    for an effect that is no kind of source.
    """
    sharp = any(is_sharp(leaf) for material in found.materials for leaf in leaves(material.surface))
    if not sharp:
        return 0.0
    kinds = {"environment": {"World"}, "emissive_meshes": set(found.inventory.emissive)}
    sources = radiances(found.scene, found.materials)
    brightest = max((radiance for radiance, of in sources if not name or of in kinds.get(name, ())), default=0.0)
    return unseen_radiance(pilot, brightest * found.scene.film.exposure)
