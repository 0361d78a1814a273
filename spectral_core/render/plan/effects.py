# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene needs simulated, decided from the scene itself, each decision with its reason.

``plan_effects`` looks at what is there (lights with spectra, glass, media, an open aperture) and decides the least
that shows it. The renderer simulates just that; the artist reads the plan and may override each decision by name
through ``RenderSettings.overrides``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render.plan.inventory import Inventory, take_inventory
from spectral_core.scene import Scene

MOST_BOUNCES = 1024


@dataclass(frozen=True, slots=True)
class Decision:
    """One effect. ``value``: what is simulated (``"spectral"``, ``"off"``, ``"6"``).

    ``reason``: why, in words of the scene. ``cost_if_left_out``: what goes wrong in the picture without it, "" where
    nothing does. ``choices``: what an override may say, () for a whole number from 0. ``source``: "scene" or "artist".
    """

    name: str
    value: str
    reason: str
    cost_if_left_out: str = ""
    choices: tuple[str, ...] = ()
    overridable: bool = True
    source: str = "scene"


@dataclass(frozen=True, slots=True)
class EffectPlan:
    """All decisions, in the order in which they are shown."""

    decisions: tuple[Decision, ...]
    tolerance_delta_e: float

    def __getitem__(self, name: str) -> Decision:
        """Decision by name; raises UnknownNameError."""
        for decision in self.decisions:
            if decision.name == name:
                return decision
        raise UnknownNameError.among("effect", name, [decision.name for decision in self.decisions])

    @property
    def is_spectral(self) -> bool:
        """Whether wavelengths are traced instead of red, green and blue."""
        return self["transport"].value == "spectral"

    @property
    def bounces(self) -> int:
        """Bounces after the first surface that the camera sees."""
        return int(self["bounces"].value)

    def is_on(self, name: str) -> bool:
        """Whether an effect is simulated at all."""
        return self[name].value not in ("off", "none")

    def as_rows(self) -> list[dict[str, str | bool]]:
        """The plan as plain data, for reports."""
        return [
            {
                "effect": decision.name,
                "value": decision.value,
                "reason": decision.reason,
                "cost_if_left_out": decision.cost_if_left_out,
                "decided_by": decision.source,
                "overridable": decision.overridable,
            }
            for decision in self.decisions
        ]


def plan_effects(scene: Scene, tolerance: float | None = None) -> EffectPlan:
    """Decide what must be simulated for ``scene``.

    ``tolerance``: color error (ΔE2000) below which an effect may be left out; None takes the scene's own setting.
    Raises UnknownNameError for an override of an effect that does not exist, InvalidInputError for a value that it
    cannot take.
    """
    tolerance = scene.settings.tolerance_delta_e if tolerance is None else float(tolerance)
    found = take_inventory(scene)
    decisions = {decision.name: decision for decision in (rule(scene, found, tolerance) for rule in _RULES)}
    for name, value in _artists_choices(scene):
        if name not in decisions:
            raise UnknownNameError.among("effect", name, decisions)
        decisions[name] = _overridden(decisions[name], value)
    return EffectPlan(tuple(decisions.values()), tolerance)


def _artists_choices(scene: Scene) -> list[tuple[str, str]]:
    choices = list(scene.settings.overrides)
    if scene.settings.transport is not None:
        choices.append(("transport", scene.settings.transport))
    if scene.settings.max_bounces is not None:
        choices.append(("bounces", str(scene.settings.max_bounces)))
    return choices


def _overridden(decision: Decision, value: str) -> Decision:
    if not decision.overridable:
        raise InvalidInputError(f"effect {decision.name!r} follows from the scene and cannot be set to {value!r}")
    if decision.choices:
        if value not in decision.choices:
            raise InvalidInputError(
                f"effect {decision.name!r} cannot be {value!r}; choose {' or '.join(decision.choices)}"
            )
    elif not value.isdecimal() or int(value) > MOST_BOUNCES:
        raise InvalidInputError(f"effect {decision.name!r} is {value!r}; expected a whole number, 0 to {MOST_BOUNCES}")
    reason = f"set by the artist; the scene asks for {decision.value} because {decision.reason}"
    cost = decision.cost_if_left_out if value != decision.value else ""
    return Decision(decision.name, value, reason, cost, decision.choices, source="artist")


def _names(names: tuple[str, ...], most: int = 3) -> str:
    shown = ", ".join(repr(name) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def _transport(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    choices = ("rgb", "spectral")
    if found.spectra:
        return Decision(
            "transport",
            "spectral",
            f"spectra are given for {_names(found.spectra)}",
            "colors under these spectra; products of spectra are not products of their colors",
            choices,
        )
    return Decision(
        "transport", "rgb", "no light or material carries a spectrum; three channels say all that is given", "", choices
    )


def _dispersion(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if found.dispersive:
        return Decision(
            "dispersion",
            "on",
            f"the index of refraction varies with wavelength in {_names(found.dispersive)}",
            "no rainbows; everything refracts as at 589 nm",
            ("on", "off"),
        )
    return Decision("dispersion", "off", "every index of refraction is one number", "", ("off",))


def _media(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if found.media:
        return Decision(
            "media",
            "on",
            f"light scatters inside {_names(found.media)}",
            "fog, smoke and milk vanish",
            ("on", "off"),
        )
    return Decision("media", "off", "no material has a volume", "", ("off",))


def _volumes(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if scene.volumes:
        names = tuple(volume.name for volume in scene.volumes)
        return Decision(
            "volumes", "on", f"the scene shows {_names(names)}", "the sampled volumes vanish", ("on", "off")
        )
    return Decision("volumes", "off", "the scene has no sampled volume", "", ("off",))


def _depth_of_field(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if scene.camera.aperture_radius > 0:
        return Decision(
            "depth_of_field",
            "on",
            f"the lens is open {2 * scene.camera.aperture_radius:.3g} units wide",
            "everything is in focus",
            ("on", "off"),
        )
    return Decision("depth_of_field", "off", "the camera's aperture is closed", "", ("off",))


def _environment(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    world = scene.world
    if world.is_black:
        return Decision("environment", "none", "the world is black", "", ("none",))
    kind = "image" if world.is_image else "constant"
    reason = "an image surrounds the scene" if world.is_image else "the world has one color everywhere"
    return Decision("environment", kind, reason, "the world's light is missing", (kind, "none"))


def _emissive_meshes(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if found.emissive:
        return Decision(
            "emissive_meshes",
            "on",
            f"surfaces glow: {_names(found.emissive)}",
            "these surfaces are dark and light nothing",
            ("on", "off"),
        )
    return Decision("emissive_meshes", "off", "no surface emits light", "", ("off",))


def _transparency(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    choices = ("on", "off")
    if found.transparent:
        return Decision(
            "transparency",
            "on",
            f"light passes straight through {_names(found.transparent)}",
            "shadows of transparent surfaces are black",
            choices,
        )
    if found.visible_lights:
        return Decision(
            "transparency",
            "on",
            f"the camera sees {_names(found.visible_lights)} and what lies behind",
            "lights that the camera sees are black",
            choices,
        )
    if found.light_bodies and found.source_count > 1:
        return Decision(
            "transparency",
            "on",
            f"lights with a size ({_names(found.light_bodies)}) must not shade the other lights",
            "lights shade each other as if they were objects",
            choices,
        )
    return Decision("transparency", "off", "nothing is transparent, so shadow rays stop at the first hit", "", choices)


def _textures(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if not found.images:
        return Decision("textures", "off", "no material uses an image", overridable=False)
    return Decision("textures", "on", f"images color {_names(found.images)}", overridable=False)


def _bounces(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    needed, limit = _needed_bounces(scene, found, tolerance), scene.settings.scene_bounces
    if limit is None or int(needed.value) <= limit:
        return needed
    reason = f"the scene's light paths end there; {needed.value} would be followed because {needed.reason}"
    return Decision("bounces", str(limit), reason, needed.cost_if_left_out)


def _needed_bounces(scene: Scene, found: Inventory, tolerance: float) -> Decision:
    if not found.surfaces:
        return Decision("bounces", "0", "there is no surface to bounce from")
    if found.media:
        return Decision("bounces", "64", "light scatters many times inside a medium", "dark media")
    if found.refractive:
        return Decision(
            "bounces",
            "24",
            f"light enters and leaves {_names(found.refractive)}, some of it after inner reflections",
            "black spots in glass",
        )
    if found.glossy:
        return Decision(
            "bounces", "12", f"{_names(found.glossy)} reflect other surfaces", "dark reflections of reflections"
        )
    needed = found.diffuse_bounces(tolerance)
    return Decision(
        "bounces",
        str(needed),
        f"surfaces are matt and reflect at most {found.largest_reflectance:.0%}, "
        f"so later bounces change colors by less than ΔE {tolerance:g}",
        "dark corners",
    )


_RULES: tuple[Callable[[Scene, Inventory, float], Decision], ...] = (
    _transport, _dispersion, _media, _volumes, _transparency, _environment, _emissive_meshes, _textures,
    _depth_of_field, _bounces,
)  # fmt: skip
