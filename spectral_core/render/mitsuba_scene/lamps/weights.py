# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of Mitsuba's emitters in a scene that is edited: by them a live view chooses among lights."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.render.lights.hierarchy import Hierarchy, Rows, build
from spectral_core.render.lights.items import far_row, far_rows, near_rows, whole_row, world_strength
from spectral_core.render.lights.listing import LightList, Source
from spectral_core.render.lights.mitsuba_lights import ChosenEmitters
from spectral_core.render.lights.varying import LEAST
from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.emission import emitting
from spectral_core.render.mitsuba_scene.lamps.rows import add_lamp, weight_of, world_weight
from spectral_core.render.same import equal
from spectral_core.scene import Color, Computed, ImageTexture, Light, MixedPaint, Paint, Scene, SunLight, Surface
from spectral_core.spectra.spectrum import Spectrum

EXACT = 32
"""Emitters of a view up to which every weight is computed: the first picture after a change must come soon."""
SIDE = 64
"""Pixels of an image, along each side, of which its mean is taken."""


class Weights:
    """Weights of Mitsuba's emitters in a scene that is edited: of the lamps that ``lit`` names, of the meshes that
    ``emissive`` lists (material, and row for a brightness of 1), and of the world.
    """

    def __init__(self, context: Context, lit: frozenset[str], emissive: list[tuple[str, Rows]], world: Any) -> None:
        self._context, self._lit, self._emissive, self._world = context, lit, emissive, world
        self._kept: dict[tuple[str, str], tuple[Any, Any]] = {}
        """What the weights of the last scene were made of, and these: an edit changes few of them."""

    def hierarchy(self, scene: Scene) -> Hierarchy:
        """Weights of lamps, meshes, suns and the world, in this order."""
        lamps = [lamp for lamp in scene.lights if lamp.name in self._lit]
        near, far = (
            [self._row(lamp) for lamp in lamps if isinstance(lamp, SunLight) is is_far] for is_far in (False, True)
        )
        surfaces = {item.name: item.surface for item in scene.materials}
        for name, row in self._emissive:
            bright = self._of("material", name, surfaces[name], lambda it: mean_emission(it, self._brightness))
            near.append(replace(row, strengths=row.strengths * bright))
        if self._world is not None:
            irradiance = abs(scene.world.strength) * self._of("world", "", scene.world.color, world_weight)
            is_constant = self._world.class_name() == "ConstantBackgroundEmitter"
            far.append(far_row(world_strength(irradiance, constant=is_constant, alone=False)))
        return build(_joined(near), _joined(far), EXACT)

    def _of(self, kind: str, name: str, item: Any, make: Callable[[Any], Any]) -> Any:
        """What ``make`` returns for an item, which is kept until the item changes."""
        before = self._kept.get((kind, name))
        if before is None or not (before[0] is item or equal(before[0], item)):
            before = self._kept[kind, name] = (item, make(item))
        return before[1]

    def _row(self, lamp: Light) -> Rows:
        """The row of a lamp."""

        def make(light: Light) -> Rows:
            own = LightList(only_weighs=True)
            found = add_lamp(self._context, own, light)
            return far_row(0.0) if found is None else Rows.joined([near_rows(own), far_rows(own)])

        made: Rows = self._of("lamp", lamp.name, lamp, make)
        return made

    def _brightness(self, color: Any) -> float:
        if isinstance(color, (Color, Spectrum)):
            return Source(weight_of(color, 1.0), "").brightness
        return mean_brightness(color)


def chosen_emitters(context: Context, loaded: Any, scene: Scene, parts: Any, rules: Any) -> ChosenEmitters | None:
    """Mitsuba's emitters of a loaded scene (its ``SceneParts`` and ``RayRules``), chosen by their light; None for one
    emitter or none.
    """
    lamps = {name: made[0].emitter for name, made in parts.lights.items() if made}
    emissive = [
        (parts.shapes.material_name(scene.instances[number], index), part, shape.emitter())
        for number, shapes in parts.shapes.geometry.placed.items()
        for index, part, shape in shapes
        if shape.emitter() is not None
    ]
    suns = [lamp.name for lamp in scene.lights if isinstance(lamp, SunLight) and lamp.name in lamps]
    emitters = [emitter for name, emitter in lamps.items() if name not in suns]
    emitters += [emitter for _, _, emitter in emissive] + [lamps[name] for name in suns]
    emitters += [] if parts.world is None else [parts.world]
    if len(emitters) < 2 or len(emitters) != len(loaded.emitters()):
        return None
    rows = [(name, whole_row(part.positions[part.triangles].astype(np.float64))) for name, part, _ in emissive]
    weights = Weights(context, frozenset(lamps), rows, parts.world)
    return ChosenEmitters(context.mitsuba, loaded, emitters, weights.hierarchy, (scene, rules))


def _joined(rows: list[Rows]) -> Rows:
    return Rows.joined(rows) if rows else far_row(0.0).take(np.zeros(0, np.intp))


def mean_emission(surface: Surface | None, brightness_of: Callable[[Paint], float]) -> float:
    """Rough mean of a surface's radiance, which steers the choice of lights; ``brightness_of``: that of a color."""
    total = 0.0
    for weight, _, (color, strength) in emitting(surface):
        varies = bool(weight.varying) or not isinstance(strength, (int, float))
        shares = [paint.typical_number(thinned(value)) for value, _ in weight.varying]
        shares = [1 - s if is_complement else s for s, (_, is_complement) in zip(shares, weight.varying, strict=True)]
        share = float(np.prod(shares)) * abs(paint.typical_number(thinned(strength)))
        share = max(share, LEAST) if varies else share
        total += weight.constant * share * brightness_of(color)
    return total


def mean_brightness(color: Paint) -> float:
    """Rough mean magnitude of an emitted color that varies."""
    if isinstance(color, MixedPaint):
        return (mean_brightness(color.first) + mean_brightness(color.second)) / 2
    if isinstance(color, ImageTexture):
        return max(float(np.abs(paint.color_pixels(thinned(color))).mean()), LEAST)
    if isinstance(color, Computed):
        return max(float(np.abs(color.typical).mean()), LEAST)
    return float(np.abs(color.linear_rgb).mean()) if isinstance(color, Color) else 1.0


def thinned(value: Any) -> Any:
    """An image with few of its pixels, whose mean takes no time; any other value itself."""
    if not isinstance(value, ImageTexture):
        return value
    steps = (max(1, size // SIDE) for size in value.pixels.shape[:2])
    rows, columns = (slice(step // 2, None, step) for step in steps)
    return ImageTexture(value.name, value.pixels[rows, columns], value.color_space)
