# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes on the paths of a scene: what a ray gains and loses in them before its next hit, and what they take
from the light of lamps.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from spectral_core.render.plugins.paints.ray_marks import is_diffuse, shadow_marks
from spectral_core.scene import Rays
from spectral_core.volume.march.loop import march
from spectral_core.volume.march.path import WorldRay, path_through
from spectral_core.volume.mitsuba_integrator.scene_fields import SceneFields
from spectral_core.volume.mitsuba_integrator.scene_light import Lit, transmittance

FARTHEST = 1e30
LEAST_SEEN = 1e-5
"""Transmittance from which nothing behind volumes is visible, where a march ends."""
SCATTERED = Rays.DIFFUSE | Rays.GLOSSY | Rays.TRANSMISSION
NEVER_PASSED = int(Rays.CAMERA | SCATTERED)
"""Rays that meet volumes on their way; a shadow ray only loses light."""


class SampledVolumes:
    """The volumes of a scene with chosen steps (``fields``), and for each the bits of ``Rays`` that it is hidden from.

    ``phase``: share of a step that the first one of each ray has, from ``begin`` to ``release``. Each path has its own,
    so that the samples of a pixel average the errors of its steps.
    """

    def __init__(self, fields: SceneFields, hidden_from: list[Rays]) -> None:
        self.fields, self.hidden_from = fields, [int(hidden) for hidden in hidden_from]
        self.phase: Any = None

    def begin(self, sampler: Any) -> None:
        """Draw the phase of a path: its light and its coverage then have the same steps."""
        self.phase = 1.0 - sampler.next_1d()

    def release(self) -> None:
        """Forget the path: a recorded launch reads every member after it."""
        self.phase = None

    def _seen_by(self, kinds: int) -> list[int]:
        """Numbers of the volumes that some rays of these types meet."""
        return [number for number, hidden in enumerate(self.hidden_from) if kinds & ~hidden]

    def _path(self, numbers: list[int], line: WorldRay, kind: Any) -> Any:
        """The path of rays of a type through volumes, some of which they pass."""
        placed = [self.fields.placed[number] for number in numbers]
        hidden = [self.hidden_from[number] & NEVER_PASSED for number in numbers]
        passed = [(kind & bits) != 0 for bits in hidden] if any(hidden) else None
        return path_through(placed, line, self.phase, passed)

    def cross(self, integrator: Any, scene: Any, si: Any, path: Any, sampler: Any) -> Any:
        """Light of the volumes before a hit; the throughput of the path loses what they absorb."""
        import drjit as dr
        import mitsuba as mi

        numbers = self._seen_by(NEVER_PASSED)
        if not numbers:
            return mi.Spectrum(0.0)
        # A ray that leaves a subsurface walk begins just below the surface that it hits next.
        active, ray = path.active & ~path.leaves, path.ray
        end = dr.select(si.is_valid(), si.t, dr.minimum(ray.maxt, FARTHEST))
        line = WorldRay(ray.o, ray.d, dr.select(active, end, 0.0))
        # As in Cycles, light that passes a surface diffusely counts as diffuse light.
        kind = path.kind | dr.select(is_diffuse(path.kind), mi.UInt32(int(Rays.DIFFUSE)), 0)
        way = self._path(numbers, line, kind)
        colors = [self.fields.colors[number].at(ray.wavelengths) for number in numbers]
        every = [color for of_volume in colors for color in of_volume]
        if self.fields.settings.shading:
            shade = self._lit(integrator, scene, numbers, every).of(si, path).shade(line, _start(ray))
            out = march(way, shade=shade, light=mi.Spectrum(0.0), sampler=sampler)
            light = out.light
        else:
            out = march(way)
            light = sum((a * c for a, c in zip(out.amounts, every, strict=True)), mi.Spectrum(0.0))
        # The light of a volume is attenuated by what lies before it alone, which the march knows.
        gained = dr.select(active, path.throughput * light, 0.0)
        seen = dr.select(out.transmittance > LEAST_SEEN, out.transmittance, 0.0)
        path.throughput = dr.select(active, path.throughput * seen, path.throughput)
        return gained

    def _lit(self, integrator: Any, scene: Any, numbers: list[int], colors: list[Any]) -> PathLit:
        fields = self.fields
        volumes = [fields.placed[number] for number in numbers]
        lit = [material.lit for number in numbers for material in fields.items[number].transfer.materials]
        occluders = [fields.placed[number] for number in self._seen_by(int(Rays.SHADOW))]
        return PathLit(scene, volumes, occluders, colors, lit, fields.settings, integrator)

    def clear(self, ray: Any, number: Any, active: Any) -> Any:
        """Transmittance of the volumes on a ray to a light with a ``number``."""
        import drjit as dr
        import mitsuba as mi

        occluders = [self.fields.placed[each] for each in self._seen_by(int(Rays.SHADOW))]
        if not occluders:
            return mi.Float(1.0)
        # Mitsuba samples sun and sky at the border of the scene's surfaces, among which volumes do not count.
        light = dr.reinterpret_array(mi.EmitterPtr, number)
        end = dr.select(mi.has_flag(light.flags(), mi.EmitterFlags.Infinite), FARTHEST, dr.minimum(ray.maxt, FARTHEST))
        return transmittance(occluders, WorldRay(ray.o, ray.d, dr.select(active, end, 0.0)))

    def seen_through(self, origin: Any, direction: Any, end: Any, active: Any) -> Any:
        """Transmittance of the volumes on a piece of a camera ray."""
        import drjit as dr
        import mitsuba as mi

        numbers = self._seen_by(int(Rays.CAMERA))
        if not numbers:
            return mi.Float(1.0)
        line = WorldRay(origin, direction, dr.select(active, dr.minimum(end, FARTHEST), 0.0))
        seen = march(self._path(numbers, line, mi.UInt32(int(Rays.CAMERA)))).transmittance
        return dr.select(seen > LEAST_SEEN, seen, 0.0)


def _start(ray: Any) -> Any:
    """A ray as the place where light arrives sees it: lengths count from there."""
    import mitsuba as mi

    return SimpleNamespace(time=mi.Float(0.0), wavelengths=ray.wavelengths)


@dataclass(frozen=True)
class PathLit(Lit):
    """Shading by the lights of a scene under the rules of its path integrator: transparent surfaces and lamps' bodies
    let light pass, and objects and lights may be hidden from some rays.
    """

    integrator: Any = None
    of_path: Any = None
    """The marks of shadow rays, the bounces so far, the surfaces passed straight, and the path's next hit."""

    def of(self, si: Any, path: Any) -> PathLit:
        """The shading along a path's ray to a hit."""
        import mitsuba as mi

        of_path = shadow_marks(mi, si.dn_dv), path.depth, path.passed, si
        return PathLit(
            self.scene, self.volumes, self.occluders, self.colors, self.lit, self.settings, self.integrator, of_path
        )

    def incoming(self, place: Any, draw: Any, active: Any) -> tuple[Any, Any]:
        import drjit as dr
        import mitsuba as mi

        tables, lights = self.integrator.tables, self.integrator.lights
        marks, depth, passed, si = self.of_path
        # Without a test for surfaces, which know nothing of transparency and of the visibility of objects.
        found, light = self.scene.sample_emitter_direction(place, draw, False, active)
        number, kind = tables.number(found.emitter), mi.UInt32(int(Rays.VOLUME))
        wanted = active & (found.pdf > 0.0) & tables.lights_it(number, kind, depth, mi.UInt32(0))
        light = dr.select(wanted, light, 0.0)
        # Only light that arrives is worth the way through surfaces and volumes.
        wanted &= dr.any(light != 0.0)
        if tables.shadowless is not None:
            wanted &= tables.look_up(tables.shadowless, number) == 0
        if self.settings.shadows:
            ray = place.spawn_ray_to(found.p)
            ray.time = mi.Float(0.0)  # its length counts from here
            # in Cycles scattered rays alone meet an even environment, and pass what they do not see
            kind = dr.select(number == lights.even_world, kind, int(Rays.SHADOW))
            # The way begins on no surface: as within a strand, whose wall is no place to start from.
            start = si, mi.UInt32(0), mi.Bool(True)
            way = ray, (mi.UInt32(0), mi.UInt32(0)), start
            clear = self.integrator.clear_way(self.scene, way, (number, passed, marks, kind), wanted)
            clear = clear * self.integrator.sampled.clear(ray, number, wanted & (dr.max(clear) > 0.0))
            light = dr.select(wanted, light * clear, light)
        return found.d, light
