# SPDX-License-Identifier: GPL-3.0-or-later
"""Plan the effects of a scene: from its data if they are sufficient, else from a pilot.

``plan_effects`` finds the features of the scene (lights with spectra, glass, media, an open aperture), estimates the
error of omitting each effect, and omits effects whose error is below the tolerance. The renderer simulates only the
rest; the artist reads the plan and may override each decision by name through ``RenderSettings.overrides``.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, MissingDependencyError, UnknownNameError
from spectral_core.render.plan import bounds
from spectral_core.render.plan.decision import MOST_BOUNCES, Decision, EffectPlan
from spectral_core.render.plan.effects_from_data import Found, effects_of
from spectral_core.render.plan.effects_from_pilot import measured_effects, unmeasured_kinds
from spectral_core.render.plan.errors.spectral import rgb_transport_error
from spectral_core.render.plan.inventory import take_inventory
from spectral_core.render.plan.levels import KEEP, Effect, chosen, indirect_error
from spectral_core.render.plan.light.shown import points_beside_surfaces
from spectral_core.render.plan.pilot import PILOT_BOUNCES, Pilot, run_pilot
from spectral_core.scene import Camera, Film, Scene, require_scene

__all__ = ["MOST_BOUNCES", "Decision", "EffectPlan", "everything_on", "pilot_pays", "plan_effects", "plan_from_data"]

PAYING_PATHS = 3_000_000
"""Least number of paths of a render for which a pilot is traced: a few seconds of time."""
PAYING_SECONDS, USUAL_SAMPLES = 10.0, 64
"""The same for a time budget; and the assumed number of samples of a requested error."""
SAME_COLORS = 0.1
"""ΔE2000 below which three channels and spectra show the same picture; that of gray surfaces is the rounding of the
white's colors.
"""
_PILOTED = ("bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces")


def plan_effects(
    scene: Scene, tolerance: float | None = None, *, pilot: bool = True, lights_vary: bool = False
) -> EffectPlan:
    """Decide what must be simulated for ``scene``.

    Parameters
    ----------
    scene
        The scene to render.
    tolerance
        Color error (ΔE2000) that all effects that are left out may make together; None takes the scene's own setting.
    pilot
        Whether a pilot may be traced (in this process, under a second where kernels are warm) for what data do not
        decide. Without it, or without Mitsuba, such effects stay.
    lights_vary
        Whether the plan serves lights of any place and strength, as that of a recording or of a view does: an edit of
        a lamp then changes no number of bounces.

    Raises
    ------
    UnknownNameError : an override of an effect that does not exist.
    InvalidInputError : a value that it cannot take, two values for one effect, or a tolerance below 0.
    """
    start = time.perf_counter()
    require_scene(scene)
    if tolerance is None:
        tolerance = scene.settings.tolerance_delta_e
    if not lights_vary:
        scene = replace(scene, film=scene.displayed_film)
    tolerance = require_range("the tolerance (ΔE2000)", tolerance, 0.0, 1e9)
    is_exact = lights_vary and tolerance == 0
    beside = points_beside_surfaces(scene)
    points = np.concatenate([bounds.seen_points(scene), beside])
    found = Found(scene, take_inventory(scene), points, lights_vary, is_exact)
    effects = effects_of(found)
    choices = _checked_choices(scene, {**effects, **unmeasured_kinds()})
    seen = _look(found, effects, choices, tolerance) if pilot else None
    if seen is not None:
        found = replace(found, points=np.concatenate([seen.points, beside]))
        effects = measured_effects(found, effects_of(found), seen)
    else:
        bounces = effects.pop("bounces")
        effects |= unmeasured_kinds() | {"bounces": bounces}
    left = chosen((effect for effect in effects.values() if effect.name not in choices), tolerance)
    asked = chosen(effects.values(), tolerance)
    decisions = [
        _overridden(effect, choices[name], effect.levels[asked[name]].value)
        if name in choices
        else _decided(effect, left[name], scene, seen is not None)
        for name, effect in effects.items()
    ]
    paths, clamped = (0, None) if seen is None else (seen.paths, seen.clamped_share)
    elapsed, indirect = time.perf_counter() - start, indirect_error(effects.values())
    return EffectPlan(tuple(decisions), tolerance, paths, elapsed, indirect, clamped)


def plan_from_data(scene: Scene, tolerance: float | None = None, *, lights_vary: bool = False) -> EffectPlan:
    """``plan_effects`` without a pilot: nothing is traced, and Mitsuba is not needed. Raises the same errors."""
    return plan_effects(scene, tolerance, pilot=False, lights_vary=lights_vary)


def pilot_pays(scene: Scene) -> bool:
    """True if a picture is so large that a pilot takes a small part of its time; smaller ones are planned from data."""
    width, height = scene.film.size
    if scene.settings.time_budget_s is not None:
        return scene.settings.time_budget_s >= PAYING_SECONDS
    samples = scene.film.samples if scene.settings.target_error is None else USUAL_SAMPLES
    return width * height * samples >= PAYING_PATHS


def everything_on(scene: Scene) -> EffectPlan:
    """The plan with all effects: spectra, dispersion, media and transparency, many bounces.

    Reference for other plans: time saved, error made. Where no light and no material has a spectrum, three channels
    define the picture: spectra are on if they show the same picture, as for gray surfaces, and off where products of
    colors differ from products of their spectra. If they are on, ``accepted`` of the transport is their error.
    """
    plan = plan_from_data(scene, 0.0)
    rounding = rgb_transport_error(scene) if plan["transport"].how == "exact" else 0.0
    transport = "rgb" if rounding > SAME_COLORS else "spectral"
    values = {"transport": transport, "bounces": str(PILOT_BOUNCES), "textures": "on"}
    full = []
    for each in plan.decisions:
        value = values.get(each.name, each.value if each.name == "environment" or "bounces" in each.name else "on")
        accepted = rounding if each.name == "transport" and transport == "spectral" else 0.0
        full.append(replace(each, value=value, reason="everything is on", cost_if_left_out="", accepted=accepted))
    return EffectPlan(tuple(full), 0.0)


def _look(found: Found, effects: Mapping[str, Effect], choices: Mapping[str, str], tolerance: float) -> Pilot | None:
    """The pilot, if it can decide anything that the data leave open."""
    scene = found.scene
    open_questions = [
        effect.name
        for effect in effects.values()
        if effect.name not in choices and effect.how != "exact" and (len(effect.levels) > 1 or effect.name in _PILOTED)
    ]
    media = effects["media"]
    matters = choices.get("media", "on") == "on" and 0 < media.levels[-1].error > tolerance
    scatters = matters and found.scatters
    lit = scene.lights or not scene.world.is_black or effects["emissive_meshes"].how != "exact"
    sampled = choices.get("volumes", "on") == "on" and effects["volumes"].levels[-1].error > tolerance
    if not (open_questions and scene.instances and lit) or scatters or sampled:
        return None
    in_spectra = choices.get("transport", "spectral") == "spectral" and (
        "transport" in choices or effects["transport"].levels[-1].error > tolerance
    )
    try:
        films = choices.get("thin_film", "on") == "on" and effects["thin_film"].levels[-1].error > tolerance
        dyes = choices.get("fluorescence", "on") == "on"
        return run_pilot(scene, pilot_plan(scene, absorbs=matters, spectral=in_spectra, films=films, dyes=dyes))
    except MissingDependencyError:
        return None


def pilot_plan(
    scene: Scene, *, absorbs: bool = False, spectral: bool = False, films: bool = False, dyes: bool = True
) -> EffectPlan:
    """The plan of the pilot: surfaces and lamps, with shadows through transparent surfaces, and with media that only
    absorb light. ``spectral``: in spectra, else in three channels. ``dyes``, ``films``: with the light of dyes and with
    thin films, which may send on several times the light of a bare surface.
    """
    values = {
        "transport": "spectral" if spectral else "rgb", "fluorescence": "on" if dyes else "off",
        "dispersion": "off", "thin_film": "on" if films else "off",
        "media": "on" if absorbs else "off", "volumes": "off",
        "transparency": "on", "emissive_meshes": "on", "lamp_bodies": "on", "textures": "on", "depth_of_field": "off",
        "reflective_caustics": "on", "refractive_caustics": "on",
        "environment": "on" if scene.world.parts else "none", **dict.fromkeys(_PILOTED, str(PILOT_BOUNCES)),
    }  # fmt: skip
    return EffectPlan(tuple(Decision(name, value, "pilot") for name, value in values.items()), 0.0)


def require_possible(overrides: Mapping[str, str]) -> None:
    """Raise for an override that no scene takes, before the scene is known.

    Raises UnknownNameError for an effect that does not exist, and InvalidInputError for a value that it never has.
    """
    nothing = Scene(camera=Camera(world_from_camera=np.eye(4)), film=Film(width=1, height=1))
    effects = effects_of(Found(nothing, take_inventory(nothing), bounds.seen_points(nothing))) | unmeasured_kinds()
    for name, value in overrides.items():
        if name not in effects:
            raise UnknownNameError.among("effect", name, effects)
        if len(effects[name].choices) != 1:  # an effect that this scene lacks can be "off" only
            _checked_choice(effects[name], value)


def _checked_choices(scene: Scene, effects: Mapping[str, Effect]) -> dict[str, str]:
    """The artist's overrides by name."""
    settings = scene.settings
    stated: list[tuple[str, object, str]] = [
        (name, value, "overrides") for name, value in dict(settings.overrides).items()
    ]
    if settings.transport is not None:
        stated.append(("transport", settings.transport, "transport"))
    if settings.max_bounces is not None:
        stated.append(("bounces", settings.max_bounces, "max_bounces"))
    choices: dict[str, str] = {}
    for name, value, where in stated:
        if name not in effects:
            raise UnknownNameError.among("effect", name, effects)
        choice = _checked_choice(effects[name], value)
        if choices.setdefault(name, choice) != choice:
            raise InvalidInputError(
                f"effect {name!r} is {choices[name]!r} in overrides and {choice!r} in {where}; state it once"
            )
    return choices


def _checked_choice(effect: Effect, stated: object) -> str:
    """The value that an override states, as text; a number of bounces may be a number."""
    value = str(stated)
    if not effect.overridable:
        raise InvalidInputError(f"effect {effect.name!r} follows from the scene and cannot be set to {value!r}")
    if effect.choices:
        if value not in effect.choices:
            raise InvalidInputError(f"effect {effect.name!r} cannot be {value!r}; choose {' or '.join(effect.choices)}")
    elif not value.isdecimal() or int(value) > MOST_BOUNCES:
        raise InvalidInputError(f"effect {effect.name!r} is {value!r}; expected a whole number, 0 to {MOST_BOUNCES}")
    return value


def _decided(effect: Effect, number: int, scene: Scene, piloted: bool) -> Decision:
    level = effect.levels[number]
    value, reason = level.value, effect.reason
    if effect.name in _PILOTED and effect.how == "measured":
        rest = f"later bounces change colors by ΔE {level.error:.2g}"
        reason = f"{reason}; {rest}" if reason else rest
    elif effect.how == "bounded" and effect.name == "bounces":
        reason = f"{reason}, so later bounces change colors by ΔE {level.error:.2g} at most"
    elif number > 0 and effect.how in ("bounded", "measured"):
        reason = f"{reason}: ΔE {level.error:.2g}, {effect.how}"
    elif number == 0 and effect.how == "not known" and not piloted and len(effect.levels) > 1:
        reason = f"{reason}; no pilot has measured it, so it stays"
    limit = scene.settings.scene_bounces
    if effect.name == "bounces" and limit is not None and int(value) > limit:
        reason = f"the scene's light paths end there; {value} would be followed because {reason}"
        value = str(limit)
    cost = _cost(effect) if number == 0 or effect.name in _PILOTED else ""
    return Decision(
        effect.name, value, reason, cost, effect.choices, effect.overridable, "scene", _shown(effect.known), effect.how,
        level.error, effect.share,
    )  # fmt: skip


def _overridden(effect: Effect, value: str, own: str) -> Decision:
    accepted = next((level.error for level in effect.levels if level.value == value), None)
    if accepted is None and value.isdecimal():
        fewer = [level for level in effect.levels if level.value.isdecimal() and int(level.value) <= int(value)]
        accepted = fewer[0].error if fewer else None
    reason = f"set by the artist; the scene needs {own} because {effect.reason}".removesuffix(" because ")
    cost = _cost(effect) if value != own else ""
    return Decision(
        effect.name, value, reason, cost, effect.choices, effect.overridable, "artist", _shown(effect.known),
        effect.how, _shown(accepted), effect.share,
    )  # fmt: skip


def _cost(effect: Effect) -> str:
    """The loss without the effect, with its error."""
    if not effect.loses:
        return ""
    error = effect.known
    return effect.loses if error is None or error == KEEP else f"{effect.loses} (ΔE {error:.2g}, {effect.how})"


def _shown(error: float | None) -> float | None:
    return None if error is None or error == KEEP else error
