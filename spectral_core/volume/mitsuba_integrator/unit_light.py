# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that pilot rays see: of each group of emitters by itself, at one strength and one spectrum.

A scene's picture is the sum of its emitters' pictures, and a dial changes their strengths after the steps are chosen.
So steps depend on where emitters are and on how they shine, but not on how much: each channel of each group is judged
by its own error, and a sum of pictures is hardly worse than the worst of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.loop import Shade, Shown
from spectral_core.volume.march.path import Placed, WorldRay
from spectral_core.volume.mitsuba_integrator.scene_light import Surface, transmittance, way_to

MOST_GROUPS = 4  # emitters that are judged by themselves; more share these groups
_MOST_DRAWS = 32  # of emitters per ray: under a sky their mean light errs by hardly more than that of the whole sky
_MOST_SHADOWS = 3  # lamps to which each step of a pilot ray marches; more, or a sky, would take minutes
_WAVELENGTHS = 450.0, 530.0, 590.0, 640.0  # at which colors of materials differ most
_TURN = 0.6180339887498949  # of which no few multiples are near each other, modulo 1
_LARGEST = 1.0 - 2.0**-24  # below 1, as random numbers are
_SPECTRA = ("intensity", "radiance", "irradiance")  # attributes of emitters that are written in Python
# Emitters of Mitsuba whose light follows from the place that is drawn on them. The light of others is their own.
_PLAIN = ("PointLight", "DirectionalEmitter", "AreaLight")


def sees_shadows(scene: Any) -> bool:
    """True if pilot rays can afford shadows: under a few lamps, without a sky."""
    emitters = scene.emitters()
    return len(emitters) <= _MOST_SHADOWS and not any(each.is_environment() for each in emitters)


@dataclass(frozen=True)
class EmitterGroup:
    """Emitters of a scene by ``numbers``, how many ``draws`` of them a ray sees, and what their light is divided by."""

    numbers: list[int]
    draws: int
    levels: list[float]

    def drawn(self, number: Any, first: tuple[Any, Any]) -> tuple[Any, Any, Any]:
        """Emitter, a pair of random numbers for it, and its level, of a draw with the ``first`` pair of its ray."""
        import drjit as dr
        import mitsuba as mi

        share, count = mi.Float(number), len(self.numbers)
        across, other = (
            dr.minimum(each - dr.floor(each), _LARGEST)
            for each in (first[0] + share * (1.0 / self.draws), first[1] + share * _TURN)
        )
        place = dr.minimum(mi.UInt32(across * count), count - 1)
        pair = mi.Point2f(dr.clip(across * count - mi.Float(place), 0.0, _LARGEST), other)
        return (
            dr.gather(mi.UInt32, mi.UInt32(self.numbers), place),
            pair,
            dr.gather(mi.Float, mi.Float(self.levels), place),
        )


def emitter_groups(scene: Any, volume: ScalarVolume, *, shadows: bool) -> list[EmitterGroup]:
    """The groups of a scene's emitters. One that has no extent is drawn once, as are all with ``shadows``."""
    import mitsuba as mi

    emitters = scene.emitters()
    once = [shadows or mi.has_flag(each.flags(), mi.EmitterFlags.Delta) for each in emitters]
    members = [list(range(len(emitters)))[start::MOST_GROUPS] for start in range(min(len(emitters), MOST_GROUPS))]
    narrow = [all(once[each] for each in numbers) for numbers in members]
    draws = [min(len(numbers), _MOST_DRAWS // len(members)) for numbers in members]
    left = _MOST_DRAWS - sum(count for count, each in zip(draws, narrow, strict=True) if each)
    wide = max(narrow.count(False), 1)
    draws = [count if each else left // wide for count, each in zip(draws, narrow, strict=True)]
    levels = _levels(scene, volume) if len(emitters) > MOST_GROUPS else [1.0] * len(emitters)
    return [
        EmitterGroup(numbers, count, [levels[each] for each in numbers])
        for numbers, count in zip(members, draws, strict=True)
    ]


def _levels(scene: Any, volume: ScalarVolume) -> list[float]:
    """Usual light of each emitter in a field, so that those of one group count alike."""
    import drjit as dr
    import mitsuba as mi

    corners = volume.corners_world
    places = np.concatenate([corners, corners.mean(axis=0, keepdims=True)])
    draws = (np.arange(16) + 0.5) / 16, (np.arange(16) * _TURN) % 1.0
    x, y, z = (np.repeat(places[:, axis], 16) for axis in range(3))
    place, count = dr.zeros(mi.Interaction3f, 16 * len(places)), len(places)
    place.p = mi.Point3f(mi.Float(x), mi.Float(y), mi.Float(z))
    place.wavelengths = pilot_wavelengths()
    pair = mi.Point2f(*(mi.Float(np.tile(each, count)) for each in draws))
    usual = []
    with flat_spectra(scene):
        for number in range(len(scene.emitters())):
            _, light = unit_light(scene, mi.UInt32(number), place, pair, mi.Bool(True))
            mean = np.array(light).reshape(-1, 16).mean(axis=1) if dr.width(light) > 1 else np.array(light)
            level = float(np.median(mean))
            usual.append(level if np.isfinite(level) and level > 0 else 1.0)
    return usual


def pilot_wavelengths() -> Any:
    """Wavelengths of every ray, in nm; none if the variant has no spectra."""
    import mitsuba as mi

    return mi.Spectrum(*_WAVELENGTHS) if mi.is_spectral else []


def unit_light(scene: Any, number: Any, place: Any, pair: Any, active: Any) -> tuple[Any, Any]:
    """(where it comes from, amount) of an emitter's light at one strength; the emitter is given by its ``number``.

    It must be called within ``flat_spectra``.
    """
    import drjit as dr
    import mitsuba as mi

    emitters = scene.emitters()
    found, own = dr.gather(mi.EmitterPtr, scene.emitters_dr(), number, active).sample_direction(place, pair, active)
    # A direction is drawn from a sky in proportion to its light, so that each stands for as much.
    is_sky = dr.gather(mi.Bool, mi.Bool([each.is_environment() for each in emitters]), number)
    is_plain = dr.gather(mi.Bool, mi.Bool([each.class_name() in _PLAIN for each in emitters]), number)
    is_far = mi.has_flag(found.emitter.flags(), mi.EmitterFlags.Infinite)
    from_point = dr.select(is_far, 1.0, dr.rcp(dr.maximum(dr.square(found.dist), 1e-30)))
    from_face = dr.select(dr.dot(found.d, found.n) < 0.0, dr.rcp(dr.maximum(found.pdf, 1e-30)), 0.0)
    light = dr.select(found.delta, from_point, from_face)
    light = dr.select(is_sky, 1.0, dr.select(is_plain, light, dr.mean(own)))
    return found, dr.select(active & (found.pdf > 0.0), light, 0.0)


@contextmanager
def flat_spectra(scene: Any) -> Iterator[None]:
    """Emitters that are written in Python have strength 1 at all wavelengths, and still their cones and patterns."""
    import mitsuba as mi

    flat = mi.load_dict({"type": "uniform", "value": 1.0})
    kept = [
        (each, name, vars(each)[name])
        for each in scene.emitters()
        for name in _SPECTRA
        if name in getattr(each, "__dict__", {})
    ]
    try:
        for emitter, name, _ in kept:
            setattr(emitter, name, flat)
        yield
    finally:
        for emitter, name, spectrum in kept:
            setattr(emitter, name, spectrum)


@dataclass(frozen=True)
class UnitLit:
    """Shading as that of ``Lit``, of each group of emitters by itself; the first light is that of materials that
    emit light, if there are any.

    ``first``: two random numbers of each ray. A ray sees the same places of the same emitters in every step and every
    march, so that a march differs from its reference by its steps alone.
    """

    scene: Any
    groups: list[EmitterGroup]
    occluders: list[Placed]
    lit: list[bool]
    shadows: bool

    @property
    def count(self) -> int:
        """Number of lights."""
        return len(self.groups) + (not all(self.lit))

    def shade(self, line: WorldRay, ray: Any, field: Placed, colors: list[Any], first: tuple[Any, Any]) -> Shade:
        """The function that the march of one ``field`` calls in each step, with the ``colors`` of its materials."""
        import drjit as dr
        import mitsuba as mi

        def shade(light: list[Any], sampler: Any, shown: Shown) -> tuple[list[Any], Any]:
            point = line.at(shown.distance)
            place = dr.zeros(mi.Interaction3f)
            place.t, place.time, place.wavelengths = shown.distance, ray.time, ray.wavelengths
            place.p = mi.Point3f(point)
            active = shown.gain * sum(shown.source[1:], shown.source[0]) > 0
            surface = Surface.at(field, point)
            parts = [
                dr.select(active, shown.gain * source, 0.0) * color
                for source, color in zip(shown.source, colors, strict=True)
            ]
            none = mi.Spectrum(place.t * 0.0)
            reflected = sum((part for part, lit in zip(parts, self.lit, strict=True) if lit), none)
            own = [sum((part for part, lit in zip(parts, self.lit, strict=True) if not lit), none)]
            arriving = [self._arriving(group, place, surface, active, first) for group in self.groups]
            gained = own[: self.count - len(self.groups)] + [reflected * each for each in arriving]
            return [whole + each for whole, each in zip(light, gained, strict=True)], sampler

        return shade

    def _arriving(self, group: EmitterGroup, place: Any, surface: Surface, active: Any, first: tuple[Any, Any]) -> Any:
        """Mean light of the draws of a group on a ``surface`` at a ``place``."""
        import drjit as dr
        import mitsuba as mi

        def one(number: Any) -> Any:
            emitter, pair, level = group.drawn(number, first)
            found, light = unit_light(self.scene, emitter, place, pair, active)
            if self.shadows:
                light = dr.select(self.scene.ray_test(place.spawn_ray_to(found.p), active & (light > 0)), 0.0, light)
                light *= transmittance(
                    self.occluders, WorldRay(place.p, found.d, dr.select(light > 0.0, way_to(found), 0.0))
                )
            return surface.facing(found.d) * light / level

        if group.draws == 1:
            return one(mi.UInt32(place.t * 0.0))
        _, whole = dr.while_loop(
            (mi.UInt32(place.t * 0.0), place.t * 0.0),
            lambda number, _: active & (number < group.draws),
            lambda number, whole: (number + 1, whole + one(number)),
        )
        return whole / group.draws
