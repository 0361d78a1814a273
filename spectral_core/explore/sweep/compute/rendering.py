# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering the points of a sweep in a worker that keeps the scene; re-lighting them if only lights are swept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import RenderError
from spectral_core.explore.features.images import image_features
from spectral_core.explore.sweep.cinema import is_file_column
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.scene import Scene, SunLight, scene_hash
from spectral_core.scene.look import shown

LIGHT_PROPERTIES = ("power_w", "irradiance")


def rendered(scene: Scene, *, per_light: bool = False) -> Outcome:
    """The outcome of a scene: its picture and features; ``per_light``: also those of each light group by itself."""
    from spectral_core.render import render_scene

    result = render_scene(scene, groups=per_light)
    if result.status != "done":
        raise RenderError("the render was stopped")
    values: dict[str, float | int | str] = dict(_features(result.pixels))
    values["samples"] = int(result.samples)
    if per_light:
        for group, word in identifiers(result.group_pixels).items():
            values |= _features(result.group_pixels[group], f"{word}_")
    return Outcome(values, {"": top_down(result.pixels)})


def under_look(outcome: Outcome, picture_matrix: NDArray[np.float64]) -> Outcome:
    """The outcome of a scene as a look displays it, by its ``picture_matrix`` (3, 3), with features of that picture."""
    pixels = outcome.pictures[""]
    seen = shown(picture_matrix, pixels)
    if seen is pixels:
        return outcome
    features = image_features(np.nan_to_num(seen[..., :3]))
    return replace(outcome, values={**outcome.values, **features}, pictures={**outcome.pictures, "": seen})


def _features(pixels: Any, prefix: str = "") -> dict[str, float]:
    return image_features(np.nan_to_num(top_down(pixels)[..., :3]), prefix)


def top_down(pixels: Any) -> Any:
    """A render's pixels with row 0 on top."""
    return np.ascontiguousarray(np.asarray(pixels)[::-1])


def identifiers(groups: Iterable[str]) -> dict[str, str]:
    """Beginning of the column names of each light group; groups that differ in signs alone get numbers."""
    found: dict[str, str] = {}
    for group in sorted(groups):
        word = _identifier(group)
        numbered = (f"{word}_{number}" for number in count(2))
        found[group] = word if word not in found.values() else next(n for n in numbered if n not in found.values())
    return found


def _identifier(name: str) -> str:
    word = "".join(letter if letter.isalnum() else "_" for letter in name) or "unnamed"
    return word if word[0].isalpha() and not is_file_column(word) else f"light_{word}"


def not_linear(scene: Scene) -> str:
    """Why points under other powers of the lights must be rendered; "" if they are sums of one recording's shares."""
    from spectral_core.render.cost.asked import is_asked

    if is_asked(scene.settings):  # a recording traces equal samples everywhere
        return "the scene asks for an error or a time"
    if scene.settings.light_paths.clamps:  # what they remove depends on the powers
        return "samples are clamped"
    if any(item.is_shadow_catcher for item in scene.instances):  # a shadow is a ratio of two pictures
        return "the scene has shadow catchers"
    return ""


class Relighter:
    """Pictures of one scene under other powers of its lights, from one recording of each light's share.

    Radiance is linear in the power of every light, so a point costs a weighted sum instead of a render. The recording
    is recorded again if anything else in the scene changed.
    """

    def __init__(self) -> None:
        self._hash: str | None = None
        self._mix: Any = None
        self._base: dict[str, float] = {}

    def picture(self, scene: Scene) -> Outcome:
        """The outcome of the scene. One of ``not_linear`` is rendered, as is one without light: it has no recording."""
        from spectral_core.render.light_groups import light_groups

        if not_linear(scene) or not light_groups(scene):
            return rendered(scene)
        neutral = with_unit_lights(scene)
        found = scene_hash(neutral)
        if found != self._hash:
            self._record(neutral)
            self._hash = found
        weights = [light_amount(scene, group) for group in self._mix.transport.groups]
        pixels = self._mix.picture(weights, signed=True)
        values: dict[str, float | int | str] = dict(_features(pixels))
        values["samples"] = int(self._mix.transport.samples)
        return Outcome(values, {"": top_down(pixels)})

    def _record(self, scene: Scene) -> None:
        from spectral_core.render.relight.mix import LiveMix
        from spectral_core.render.relight.storage import MixtureStorage
        from spectral_core.render.relight.transport import record_transport

        self._mix = LiveMix(record_transport(scene, MixtureStorage(), one_per_light=True))


def recording_mark(scene: Scene) -> str:
    """Part of the fingerprint of a sweep that is re-lit: recordings of earlier versions had the limits on a sample's
    light that the scene has, and their points would not fit to those of one without limits.
    """
    paths = scene.settings.light_paths
    return "without clamps" if paths.clamp_direct > 0 or paths.clamp_indirect > 0 else ""


def with_unit_lights(scene: Scene) -> Scene:
    """The scene with every light at power (or irradiance) 1, and without limits on a sample's light.

    The sun of the world's sky is in the group of the world, which has no power.
    """

    def unit(light: Any) -> Any:
        if not isinstance(light, SunLight):
            return replace(light, power_w=1.0)
        return light if light.is_of_world else replace(light, irradiance=1.0)

    lights = map(unit, scene.lights)
    paths = replace(scene.settings.light_paths, clamp_direct=0.0, clamp_indirect=0.0)
    return replace(scene, lights=tuple(lights), settings=replace(scene.settings, light_paths=paths))


def light_amount(scene: Scene, group: str) -> float:
    """Power of the light that a group is named after; 1 for the environment and emissive objects."""
    for light in scene.lights:
        if light.name == group:
            return float(light.irradiance if isinstance(light, SunLight) else light.power_w)
    return 1.0


def swept_lights_only(paths: Mapping[str, str]) -> bool:
    """True if every swept path is the power of a light."""
    return all(path.startswith("lights[") and path.rpartition(".")[2] in LIGHT_PROPERTIES for path in paths.values())
