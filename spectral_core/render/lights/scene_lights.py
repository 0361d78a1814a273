# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene for the path integrator: draws a light for a surface, and returns the emission that a ray hits
with the density of drawing it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lights.balls import Balls, Drawn
from spectral_core.render.lights.bodies import Bodies
from spectral_core.render.lights.choice import Choice, Chosen, Receiver, receiver_of
from spectral_core.render.lights.emission import Emission
from spectral_core.render.lights.emissive_meshes import EmissiveMeshes
from spectral_core.render.lights.hierarchy import build
from spectral_core.render.lights.items import far_rows, near_rows, rules_by_source, usual_lamp
from spectral_core.render.lights.listing import BALL, PANEL, SUN, TRIANGLE, WORLD, LightList
from spectral_core.render.lights.met_lamps import met_body, met_suns, pattern_factor
from spectral_core.render.lights.panels import Panels, Suns
from spectral_core.render.lights.results import LightSample, Met, Rule, either
from spectral_core.render.plugins.lamps.patterns import Patterns
from spectral_core.render.plugins.numbers import table
from spectral_core.render.plugins.vertex_normals import with_shading


class SceneLights:
    """Tables of every light. ``reach``: a distance larger than the scene; ``rules``: ``RayRules`` of the scene."""

    asked_along_ways = True

    def __init__(self, mitsuba: Any, lights: LightList, reach: float, emission: Emission, rules: Any = None) -> None:
        import drjit

        mi = self._mi = mitsuba
        self.emission = emission
        triangles = sum(len(mesh.corners) for mesh in lights.emissive)
        counts = (len(lights.balls), len(lights.panels), triangles, len(lights.suns), int(lights.world is not None))
        self._starts = np.concatenate([[0], np.cumsum(counts)]).astype(int)
        self.kinds = [kind for kind, count in enumerate(counts) if count]
        # numbers that kernels read: another lamp needs no new kernel
        self.first = [drjit.opaque(mi.UInt32, int(start)) for start in self._starts]
        self.balls: Any = Balls(mi, lights.balls) if lights.balls else None
        self.panels: Any = Panels(mi, lights.panels) if lights.panels else None
        self.emissive: Any = (
            EmissiveMeshes(mi, lights.emissive, int(self._starts[TRIANGLE])) if lights.emissive else None
        )
        self.suns: Any = Suns(mi, lights.suns) if lights.suns else None
        self.world: Any = None if lights.world is None else lights.sources[lights.world[0]].emitter
        self.even_world = lights.world[0] + 1 if lights.world is not None and lights.world_is_constant else 0
        """Number of an environment that is equally bright everywhere; 0 for none."""
        self.varied_world = lights.world[0] + 1 if lights.world is not None and not self.even_world else 0
        """Number of any other environment."""
        self._world_source = None if lights.world is None else drjit.opaque(mi.UInt32, lights.world[0])
        self.is_empty = not self.kinds
        self._kinds_by_number = np.zeros(len(lights.sources) + 1, np.uint32)
        self._kinds_by_number[[mesh.source + 1 for mesh in lights.emissive]] = 2
        if lights.world is not None:
            self._kinds_by_number[lights.world[0] + 1] = 1
        has_bodies = bool(lights.panels) or any(ball.radius > 0 for ball in lights.balls)
        self.bodies = Bodies(mi, lights) if has_bodies else None
        self.any_visible = any(s.camera_visible for s in lights.sources)
        self._visible = table(mi.UInt32, [int(s.camera_visible) for s in lights.sources] or [0])
        self._reach = drjit.opaque(mi.Float, float(reach))
        if self.is_empty:
            return
        sources = [item.source for group in (lights.balls, lights.panels) for item in group]
        sources += [mesh.source for mesh in lights.emissive for _ in range(len(mesh.corners))]
        sources += [sun.source for sun in lights.suns] + ([] if lights.world is None else [lights.world[0]])
        self.sources = table(mi.UInt32, sources)
        self.patterns = Patterns(mi, [source.pattern for source in lights.sources])
        self._varied = None
        emitters = [source.emitter for source in lights.sources]
        if any(mesh.source is not None and emitters[mesh.source] is not None for mesh in lights.emissive):
            varied = [None if index == (lights.world or (-1,))[0] else e for index, e in enumerate(emitters)]
            self._varied = mi.EmitterPtr(varied)
            # for an emission that varies over a surface: the shape of each source and its first triangle
            shapes: list[Any] = [None] * len(emitters)
            firsts, first = np.zeros(len(emitters), np.uint32), 0
            for mesh in lights.emissive:
                shapes[mesh.source], firsts[mesh.source] = mesh.shape, first
                first += len(mesh.corners)
            self._shapes, self._first_triangles = mi.ShapePtr(shapes), table(mi.UInt32, firsts)
        by_item = None if rules is None else rules_by_source(rules, len(lights.sources))[np.array(sources)]
        self.choice = Choice(mi, build(near_rows(lights), far_rows(lights)), by_item, usual_lamp(lights))

    def kinds_by_number(self) -> NDArray[np.uint32]:
        """By number of a light: 1 for the environment, 2 for an emissive surface, 0 for a lamp."""
        return self._kinds_by_number

    def choose(self, to: Receiver, sampler: Any, active: Any) -> Chosen:
        """An item for a receiver."""
        import drjit as dr

        pick = sampler.next_1d() if self.choice.count > 1 else self._mi.Float(0.0)
        item, probability, _ = self.choice.draw(to, pick, active)
        if to.stretch is None:
            return Chosen(item, probability)
        center, radius = self.choice.place(item, active)
        return Chosen(item, probability, center, dr.maximum(radius, 0.0), radius < 0.0)

    def draw(self, si: Any, to: Receiver, chosen: Chosen, sampler: Any, tables: Any, active: Any) -> LightSample:
        """A direction to a chosen item from a place (``si``), and its light."""
        import drjit as dr

        mi = self._mi
        uv, item, probability = sampler.next_2d(), chosen.item, chosen.probability
        active = active & (probability > 0.0)
        source = dr.gather(mi.UInt32, self.sources, item, active)
        drawn, value = self._drawn(si, (item, source), uv, tables, active)
        told = probability
        if to.stretch is not None:
            # the weight of a ray that hits the light uses the probability at its point, so this one does, too
            there = Receiver(si.p, si.n, to.both_sides, to.floats, kinds=to.kinds, unlit=to.unlit)
            here = self.choice.probability(item, there, active & to.floats)
            told = dr.select(to.floats, here, told)
        pdf = dr.select(drawn.delta, 1.0, drawn.pdf * told)
        value = dr.select(active & (drawn.pdf > 0.0), value / dr.maximum(probability, 1e-37), 0.0)
        far = dr.minimum(drawn.distance, self._reach)
        return LightSample(drawn.direction, si.p + drawn.direction * far, value, pdf, drawn.delta, source + 1)

    def _drawn(self, si: Any, which: tuple[Any, Any], uv: Any, tables: Any, active: Any) -> tuple[Drawn, Any]:
        """A direction to an item, and its light over the density; ``which``: the item and its source."""
        import drjit as dr

        mi, (item, source) = self._mi, which
        result: Any = None
        value = mi.Spectrum(0.0)
        for kind in self.kinds:
            alone = len(self.kinds) == 1
            start, end = self.first[kind], self.first[kind + 1]
            of_kind = active if alone else active & (item >= start) & (item < end)
            slot = item - start
            if kind == WORLD:
                ds, weight = self.world.sample_direction(si, uv, of_kind)
                drawn = Drawn(ds.d, mi.Float(dr.inf), mi.Float(1.0), ds.pdf, mi.Bool(False), ds.n, ds.uv)
                light = mi.Spectrum(weight) * self.emission.gain(source, of_kind)
            else:
                draws = {BALL: self.balls, PANEL: self.panels, TRIANGLE: self.emissive, SUN: self.suns}[kind]
                drawn = draws.draw(slot, si.p, uv, of_kind)
                light = self._emitted(si, drawn, (source, slot, tables.meshes), of_kind, kind) * drawn.factor
            if alone:
                return drawn, light
            value = dr.select(of_kind, light, value)
            result = drawn if result is None else either(of_kind, drawn, result)
        return result, value

    def _emitted(self, si: Any, drawn: Drawn, which: tuple[Any, Any, Any], active: Any, kind: int) -> Any:
        """Emission at a drawn point; ``which``: the source, the item's number among those of its type, the meshes."""
        import drjit as dr

        mi = self._mi
        source, slot, meshes = which
        light = self.emission.of(source, si.wavelengths, active)
        if kind != TRIANGLE:
            bounces = si.dn_dv.y + 1.0 if hasattr(si, "dn_dv") else mi.Float(1.0)
            way = (si.p, drawn.direction, drawn.distance)
            return light * pattern_factor(self, source, (way, drawn.normal), (si, bounces), active)
        if self._varied is None:
            return light
        emitter = dr.gather(mi.EmitterPtr, self._varied, source, active)
        varied = active & (emitter != None)  # noqa: E711 (an array of pointers)
        place = dr.zeros(mi.SurfaceInteraction3f)
        place.p, place.n, place.uv = si.p + drawn.direction * drawn.distance, drawn.normal, drawn.uv
        place.sh_frame, place.t, place.time = mi.Frame3f(drawn.normal), drawn.distance, si.time
        place.wi, place.wavelengths = place.sh_frame.to_local(-drawn.direction), si.wavelengths
        place.shape = dr.gather(mi.ShapePtr, self._shapes, source, varied)
        place.prim_index = slot - dr.gather(mi.UInt32, self._first_triangles, source, varied)
        shown = emitter.eval(with_shading(meshes, place, varied), varied) * self.emission.gain(source, varied)
        return dr.select(varied, shown, light)

    # hits by rays

    def met(self, si: Any, path: Any, rule: Rule, tables: Any, active: Any, shows_world: Any) -> Met:
        """Emission along a ray: from lamps on its way, from its hit, and from the environment."""
        import drjit as dr

        mi = self._mi
        total = Met(mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Spectrum(0.0))
        to = receiver_of(path, tables)
        may_meet = self._may_meet(path, active)
        if self.emissive is not None:
            total.emissive = self._met_emissive(si, to, path, rule, tables, active & si.is_valid())
        # in media ``met_in_fog`` counts them
        in_fog = mi.Bool(False) if tables.media is None else path.medium != 0
        total.lamps += self._met_bodies(si, path, rule, to, may_meet & ~in_fog)
        missed = active & ~si.is_valid() & shows_world
        if self.suns is not None and self.suns.have_size:
            total.lamps += met_suns(self, (to, path, rule), may_meet & ~si.is_valid())
        if self.world is not None:
            source = mi.UInt32(self._world_source)
            ds = dr.zeros(mi.DirectionSample3f)
            ds.d, ds.emitter, ds.dist, ds.p = path.ray.d, mi.EmitterPtr(self.world), self._reach, si.p
            wanted = missed & ~path.before_delta
            pdf = self.world.pdf_direction(path.before, ds, wanted)
            pdf *= self.choice.probability(self.first[WORLD], to, wanted)
            shown = mi.Spectrum(self.world.eval(si, missed)) * self.emission.gain(source, missed)
            total.world = shown * rule(source + 1, pdf, missed)
        return total

    def met_in_fog(self, si: Any, path: Any, rule: Rule, tables: Any, active: Any, clear: Any) -> Any:
        """Light of lamps with an extent on a ray's way through media, attenuated up to each lamp by ``clear``, a
        function of the distance and a mask.
        """
        to = receiver_of(path, tables)
        return self._met_bodies(si, path, rule, to, self._may_meet(path, active), clear)

    def _may_meet(self, path: Any, active: Any) -> Any:
        return active & (self._mi.Bool(True) if self.any_visible else path.depth > 0)

    def _met_bodies(self, si: Any, path: Any, rule: Rule, to: Receiver, active: Any, clear: Any = None) -> Any:
        """Light of the lamps with an extent that a ray meets before its hit."""
        import drjit as dr

        if self.bodies is None:
            return self._mi.Spectrum(0.0)
        length = dr.minimum(si.t, path.ray.maxt)
        met = (length, to, path, rule, clear)
        return self.bodies.each(path.ray, length, active, lambda item, on: met_body(self, item, met, on))

    def seen(self, source: Any, path: Any, active: Any) -> Any:
        """Lamps that this ray hits; for camera rays only lamps that are visible to the camera."""
        import drjit as dr

        if not self.any_visible:
            return active
        visible = dr.gather(self._mi.UInt32, self._visible, source, active) != 0
        return active & (visible | (path.depth > 0))

    def _met_emissive(self, si: Any, to: Receiver, path: Any, rule: Rule, tables: Any, active: Any) -> Any:
        import drjit as dr

        mi = self._mi
        item, number = self.emissive.met(tables, si, active)
        emissive = active & (number > 0)
        source = dr.select(emissive, number, 1) - 1
        light = self.emission.of(source, path.ray.wavelengths, emissive)
        if self._varied is not None:
            emitter = dr.gather(mi.EmitterPtr, self._varied, source, emissive)
            varied = emissive & (emitter != None)  # noqa: E711 (an array of pointers)
            light = dr.select(varied, emitter.eval(si, varied) * self.emission.gain(source, varied), light)
        wanted = emissive & ~path.before_delta
        away = si.p - to.place
        distance = dr.norm(away)
        pdf = self.emissive.pdf(item - self.first[TRIANGLE], path.ray.d, distance, wanted)
        pdf *= self.choice.probability(item, to, wanted)
        return dr.select(emissive, light * rule(number, pdf, emissive), 0.0)
