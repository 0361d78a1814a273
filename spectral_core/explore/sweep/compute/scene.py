# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene without Blender as a compute node: a function that builds it, and the paths of its swept properties."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.compute.function import load_function
from spectral_core.explore.sweep.compute.paths import parse_path, place_of, require_set_once, set_path
from spectral_core.explore.sweep.compute.rendering import (
    Relighter,
    not_linear,
    recording_mark,
    rendered,
    swept_lights_only,
)
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.explore.sweep.parameters import Space, Value
from spectral_core.scene import Scene, scene_hash

SEED_PATH = "film.seed"
"""The seed of the sweep replaces this one, unless the sweep sets it."""


@dataclass(frozen=True)
class SceneNode:
    """Renders the scene of a function with some of its properties set.

    ``scene``: address of a function that returns a ``Scene``. ``paths``: property path by parameter. ``settings``:
    values by path that hold for every point. ``per_light``: also measure each light group by itself.
    """

    scene: str
    paths: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, Value], ...] = ()
    per_light: bool = False
    relight: bool = True
    fingerprint: str = ""
    _kept: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def of(
        cls,
        scene: str,
        space: Space,
        folder: Path | None = None,
        *,
        settings: Mapping[str, Value] | None = None,
        per_light: bool = False,
        relight: bool = True,
    ) -> SceneNode:
        """The node of a scene's function; checks every path on the scene.

        Parameters
        ----------
        scene : ``file.py:function`` or ``module:function``.
        space : the parameters; their targets are the paths.
        folder : where a relative file is sought.
        settings : values by path for every point.
        per_light : measure each light group too.
        relight : re-light from one recording where only powers of lights are swept.
        """
        place, _, name = scene.rpartition(":")
        address = f"{((folder or Path()) / place).resolve()}:{name}" if place.endswith(".py") else scene
        paths = tuple((parameter.name, parameter.target) for parameter in space.parameters)
        fixed = tuple(sorted((settings or {}).items()))
        node = cls(address, paths, fixed, per_light, relight)
        base = node._base()
        for parameter in space.parameters:
            set_path(base, parameter.target, parameter.value(0.5))
        require_set_once(
            [(f"the setting {path}", place_of(base, path)) for path, _ in fixed]
            + [(f"the parameter {name}", place_of(base, path)) for name, path in paths]
        )
        said: list[Any] = [scene_hash(base), [list(pair) for pair in paths], per_light, node.relights]
        if node.relights and recording_mark(base):
            said.append(recording_mark(base))
        return replace(node, fingerprint=hashlib.sha256(json_text(said).encode()).hexdigest())

    @property
    def relights(self) -> bool:
        """True if points are re-lit instead of rendered."""
        lights_only = self.relight and not self.per_light and swept_lights_only(dict(self.paths))
        return lights_only and not not_linear(self._base())

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        base: Scene = self._base()
        scene = base
        for name, path in self.paths:
            scene = set_path(scene, path, parameters[name])
        if not self._sets(SEED_PATH):
            scene = replace(scene, film=replace(scene.film, seed=seed))
        if self.relights:
            relighter: Relighter = self._kept.setdefault("relighter", Relighter())
            return relighter.picture(scene)
        return rendered(scene, per_light=self.per_light)

    def _sets(self, path: str) -> bool:
        """True if a property is swept or has a setting."""
        return any(parse_path(each) == parse_path(path) for each in (*dict(self.paths).values(), *dict(self.settings)))

    def _base(self) -> Scene:
        if "base" not in self._kept:
            made = load_function(self.scene)()
            if not isinstance(made, Scene):
                raise InvalidInputError(f"{self.scene} returned a {type(made).__name__}; expected a Scene")
            for path, value in self.settings:
                made = set_path(made, path, value)
            self._kept["base"] = made
        return self._kept["base"]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}}

    def describe(self) -> list[str]:
        """Sentences for the plan of a run."""
        lines = ["renders in workers that keep the scene loaded"]
        if self.relights:
            lines.append("only powers of lights are swept: a worker records them once and re-lights each point")
        elif swept_lights_only(dict(self.paths)):
            why = "each light is measured by itself" if self.per_light else not_linear(self._base())
            lines.append(f"every point is rendered: {why if self.relight else 'relight is false'}")
        elif any(path.startswith("lights[") for _, path in self.paths):
            lines.append(
                "lights are swept together with other properties, so every point is rendered; re-lighting needs a "
                "recording that several points share"
            )
        return lines
