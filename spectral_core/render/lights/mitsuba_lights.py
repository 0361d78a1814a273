# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba's own emitters: each with equal probability with sampled volumes, and as a reference for tests of
``Choice``; in a live view chosen by their light, whose amounts an edit changes in place.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.render.lights.choice import Choice, Chosen, Receiver, receiver_of
from spectral_core.render.lights.hierarchy import Hierarchy
from spectral_core.render.lights.items import rules_by_source
from spectral_core.render.lights.results import LightSample, Met, Rule
from spectral_core.render.plugins.numbers import Rows, table
from spectral_core.render.same import equal


class MitsubaLights:
    """The emitters of a Mitsuba scene, with the interface of ``SceneLights``."""

    is_empty = False
    asked_along_ways = False
    bodies = None
    """Lamps that a ray meets on its way; those of Mitsuba are hit as surfaces are."""

    def __init__(self, mitsuba: Any, scene: Any) -> None:
        self._mi, self._scene = mitsuba, scene
        world = scene.environment()
        self.even_world = self.varied_world = 0
        """Number of an environment that is equally bright everywhere, and of any other; 0 for none."""
        if world is not None:
            import drjit as dr

            number = int(dr.reinterpret_array(mitsuba.UInt32, mitsuba.EmitterPtr(world))[0])
            is_even = world.class_name() == "ConstantBackgroundEmitter"
            self.even_world, self.varied_world = (number, 0) if is_even else (0, number)

    def choose(self, to: Receiver, sampler: Any, active: Any) -> Chosen:
        """No item: Mitsuba chooses when it draws."""
        return Chosen(None, None)

    def draw(self, si: Any, to: Receiver, chosen: Chosen, sampler: Any, tables: Any, active: Any) -> LightSample:
        """A light for a receiver."""
        ds, light = self._scene.sample_emitter_direction(si, sampler.next_2d(), False, active)
        return LightSample(ds.d, ds.p, light, ds.pdf, ds.delta, tables.number(ds.emitter))

    def met(self, si: Any, path: Any, rule: Rule, tables: Any, active: Any, shows_world: Any) -> Met:
        """Emission along a ray, from its hit or from the environment."""
        import drjit as dr

        mi = self._mi
        active = active & (si.is_valid() | shows_world)
        emitter = si.emitter(self._scene)
        ds = mi.DirectionSample3f(self._scene, si, path.before)
        ds.n = dr.select(si.is_valid(), si.n, ds.n)  # the density belongs to the geometry, not to the shading
        pdf = self._density(emitter, ds, path, tables, active & ~path.before_delta)
        light = emitter.eval(si, active) * rule(tables.number(emitter), pdf, active)
        hit = si.is_valid()
        # a lamp's body is transparent, an emissive surface is not
        body = hit & mi.has_flag(tables.surface(si).flags(), mi.BSDFFlags.Null)
        return Met(dr.select(body, light, 0.0), dr.select(hit & ~body, light, 0.0), dr.select(hit, 0.0, light))

    def _density(self, emitter: Any, ds: Any, path: Any, tables: Any, active: Any) -> Any:
        """Density per solid angle with which the light that a ray hits would have been drawn."""
        return self._scene.pdf_emitter_direction(path.before, ds, active)


class ChosenEmitters(MitsubaLights):
    """Two or more emitters of a Mitsuba scene, chosen by the light that each sends to the receiver.

    ``emitters``: Mitsuba's emitters in the order of the items of ``hierarchy_of``, which returns their weights in a
    scene; ``of``: the present scene and its ``RayRules``.
    """

    def __init__(
        self, mitsuba: Any, loaded: Any, emitters: list[Any], hierarchy_of: Callable[[Any], Hierarchy], of: Any
    ) -> None:
        import drjit as dr

        super().__init__(mitsuba, loaded)
        mi = mitsuba
        self._emitters = mi.EmitterPtr(emitters)
        numbers = np.array(dr.reinterpret_array(mi.UInt32, self._emitters))
        items = np.zeros(numbers.max() + 1, np.uint32)
        items[numbers] = np.arange(len(emitters))
        self._item_of_number = Rows.of(table(mi.UInt32, items))
        scene, rules = of
        self._hierarchy_of = hierarchy_of
        number_of = lambda emitter: int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(emitter))[0])  # noqa: E731
        self._rules = rules_by_source(rules, int(numbers.max()), number_of)[numbers - 1]
        self._hierarchy: Hierarchy | None = None
        self._weighed: tuple[Any, ...] = ()
        self.weigh(scene)

    def weigh(self, scene: Any) -> None:
        """Choose by the light of the emitters in ``scene``, which has as many of them."""
        parts = scene.lights, scene.materials, scene.world
        if len(self._weighed) == 3 and all(map(operator.is_, parts, self._weighed)):
            return
        self._weighed, hierarchy = parts, self._hierarchy_of(scene)
        if self._hierarchy is None or not equal(self._hierarchy, hierarchy):
            self._hierarchy = hierarchy
            self.choice = Choice(self._mi, hierarchy, self._rules, has_axes=True)

    def choose(self, to: Receiver, sampler: Any, active: Any) -> Chosen:
        """An emitter for a receiver."""
        sample = sampler.next_2d()
        item, probability, sample.x = self.choice.draw(replace(to, stretch=None), sample.x, active)
        return Chosen(item, probability, sample=sample)

    def draw(self, si: Any, to: Receiver, chosen: Chosen, sampler: Any, tables: Any, active: Any) -> LightSample:
        """A direction to the chosen emitter, and its light."""
        import drjit as dr

        mi, probability = self._mi, chosen.probability
        active = active & (probability > 0.0)
        emitter = dr.gather(mi.EmitterPtr, self._emitters, chosen.item, active)
        ds, light = emitter.sample_direction(si, chosen.sample, active)
        light = dr.select(active, light / dr.maximum(probability, 1e-37), 0.0)
        pdf = dr.select(active, ds.pdf * probability, 0.0)
        return LightSample(ds.d, ds.p, light, pdf, ds.delta, tables.number(emitter))

    def _density(self, emitter: Any, ds: Any, path: Any, tables: Any, active: Any) -> Any:
        active &= emitter != None  # noqa: E711 (an array of pointers)
        item = self._item_of_number.look_up(tables.number(emitter), active=active)
        to = receiver_of(path, tables)
        return emitter.pdf_direction(path.before, ds, active) * self.choice.probability(item, to, active)
