# SPDX-License-Identifier: GPL-3.0-or-later
"""The march through a scene: several fields at once, ended by surfaces, and with the scene's lights if asked for.

Rays are in world space. Each turn goes as far as the most careful of the fields allows; where fields overlap, their
extinctions add. One field alone without shading takes the fast march of ``march.py`` instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from spectral_core.volume.march.arithmetic import bounded, larger, smaller, step_growth
from spectral_core.volume.march.loop import mean_attenuation
from spectral_core.volume.march.march_input import USUAL, MarchInput, Rays, clip_to_box
from spectral_core.volume.march.rules import EMPTY, SHORTEST_STEP

_FAR = 1e30
Gather = Callable[[Any, list[Any], Any, Any, Any], tuple[Any, Any]]
"""(light so far, sources per material, gain, world distance, sampler) -> (light, sampler)."""


@dataclass(frozen=True)
class WorldRay:
    """Ray through the scene: ``origin`` and unit ``direction`` (lists of three), ended by a surface at ``end``."""

    origin: list[Any]
    direction: list[Any]
    end: Any

    def at(self, distance: Any) -> list[Any]:
        import drjit as dr

        return [dr.fma(self.direction[a], distance, self.origin[a]) for a in range(3)]


@dataclass(frozen=True)
class Placed:
    """A field ready to march with its world-to-index matrix: nine and three device numbers."""

    data: MarchInput
    linear: list[list[Any]]
    offset: list[Any]

    def rays(self, ray: WorldRay) -> tuple[Rays, Any]:
        """(the ray inside this field, world distance at which that begins)."""
        import drjit as dr

        def turned(v: list[Any]) -> list[Any]:
            return [sum((self.linear[a][b] * v[b] for b in range(3)), 0.0) for a in range(3)]

        point = [p + o for p, o in zip(turned(ray.origin), self.offset, strict=True)]
        along = turned(ray.direction)
        speed = dr.sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2])
        along = [a / speed for a in along]
        world = dr.rcp(speed)
        inside = clip_to_box(self.data.grid, point, along, world, 0.0 * world)
        offset = [(inside.origin[a] - point[a]) * along[a] for a in range(3)]
        begin = (offset[0] + offset[1] + offset[2]) * world
        length = dr.clip((ray.end - begin) * speed, 0.0, inside.length)
        return Rays(inside.origin, inside.direction, length, world, inside.line), begin


def march_scene(
    volumes: list[Placed], ray: WorldRay, gather: Gather | None = None, light: Any = None, sampler: Any = None
) -> tuple[list[Any], Any, Any]:
    """(amounts of all fields' materials, transmittance, light) along ``ray``.

    ``gather`` turns each step's sources into light (shading); its state travels in ``light``, None without it.
    """
    import drjit as dr

    parts = [volume.rays(ray) for volume in volumes]
    types = volumes[0].data.volume.types
    zero = ray.end * 0.0
    first = types.Float(_FAR) + zero
    last = zero
    for rays, begin in parts:
        filled = rays.length > 0
        first = smaller(first, dr.select(filled, begin, _FAR))
        last = larger(last, dr.select(filled, begin + rays.length * rays.world, 0.0))
    materials = sum(volume.data.materials for volume in volumes)
    state = (first, zero + 1.0, [zero + 0.0 for _ in range(materials)], light, sampler)

    def going(t: Any, seen: Any, *_: Any) -> Any:
        return (t < last) & (seen > USUAL.least_transmittance)

    def turn(t: Any, seen: Any, amounts: list[Any], light: Any, sampler: Any) -> tuple[Any, ...]:
        after, source, extinction = _advance(volumes, parts, t, seen, last)
        width = after - t
        depth = extinction * width
        passed = dr.exp(-depth)
        gain = seen * width * mean_attenuation(depth, passed)
        amounts = [dr.fma(gain, source[k], amounts[k]) for k in range(materials)]
        if gather is not None:
            light, sampler = gather(light, source, gain, 0.5 * (t + after), sampler)
        return after, seen * passed, amounts, light, sampler

    _, seen, amounts, light, _ = dr.while_loop(state, going, turn)
    return amounts, seen, light


def transmittance(volumes: list[Placed], ray: WorldRay) -> Any:
    """Share of light that all fields let pass between the ray's origin and its end."""
    return march_scene(volumes, ray)[1]


def _advance(
    volumes: list[Placed], parts: list[tuple[Rays, Any]], t: Any, seen: Any, last: Any
) -> tuple[Any, list[Any], Any]:
    """(world distance after this turn, sources of all materials, extinction) with the nearest field deciding."""
    import drjit as dr

    looks = [_look(volume.data, rays, begin, t, seen) for volume, (rays, begin) in zip(volumes, parts, strict=True)]
    step = last - t
    for ahead, _ in looks:
        step = smaller(step, ahead)
    # A step too short for float32 to show would never end.
    after = larger(t + step, t * (1.0 + 3e-7))
    source: list[Any] = []
    extinction = step * 0.0
    for volume, (rays, begin), (_, shows) in zip(volumes, parts, looks, strict=True):
        local = (0.5 * (t + after) - begin) / rays.world
        inside = shows & (local >= 0) & (local <= rays.length)
        own, taken = volume.data.optics_at(rays.at(local), inside)
        source += [dr.select(inside, value, 0.0) for value in own]
        extinction += dr.select(inside, taken, 0.0)
    return after, source, extinction


def _look(data: MarchInput, rays: Rays, begin: Any, t: Any, seen: Any) -> tuple[Any, Any]:
    """(how far one field lets the ray go in world units, whether it shows something here)."""
    import drjit as dr

    local = (t - begin) / rays.world
    # What is left of a field below 1e-4 of a voxel may vanish in float32's rounding of t, and is left out.
    inside = (local > -1e-3) & (local < rays.length - 1e-4)
    place = rays.line.look(local, inside)
    shows = inside & (place.word < int(EMPTY))
    step = data.grid.relative_step(place.word) * data.scale
    if data.grid.grid.adapts:
        step *= step_growth(data.volume.types, seen)
    step = smaller(bounded(step, SHORTEST_STEP, data.grid.longest), rays.length - local)
    ahead = dr.select(shows, step, rays.line.leap(place)) * rays.world
    waiting = dr.select((local <= -1e-3) & (rays.length > 0), begin - t, _FAR)
    return dr.select(inside, ahead, waiting), shows
