# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba's own emitters, each with equal probability: used with sampled volumes, and as a reference for tests of
``Choice``.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.lights.choice import Chosen, Receiver
from spectral_core.render.lights.results import LightSample, Met, Rule


class MitsubaLights:
    """The emitters of a Mitsuba scene, with the interface of ``SceneLights``."""

    is_empty = False
    asked_along_ways = False
    bodies = None
    """Lamps that a ray meets on its way; those of Mitsuba are hit as surfaces are."""

    def __init__(self, mitsuba: Any, scene: Any) -> None:
        self._mi, self._scene = mitsuba, scene
        world = scene.environment()
        self.even_world = 0
        """Number of an environment that is equally bright everywhere; 0 for none."""
        if world is not None and world.class_name() == "ConstantBackgroundEmitter":
            import drjit as dr

            self.even_world = int(dr.reinterpret_array(mitsuba.UInt32, mitsuba.EmitterPtr(world))[0])

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
        pdf = self._scene.pdf_emitter_direction(path.before, ds, active & ~path.before_delta)
        light = emitter.eval(si, active) * rule(tables.number(emitter), pdf, active)
        hit = si.is_valid()
        # a lamp's body is transparent, an emissive surface is not
        body = hit & mi.has_flag(tables.surface(si).flags(), mi.BSDFFlags.Null)
        return Met(dr.select(body, light, 0.0), dr.select(hit & ~body, light, 0.0), dr.select(hit, 0.0, light))
