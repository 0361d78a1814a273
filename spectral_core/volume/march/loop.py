# SPDX-License-Identifier: GPL-3.0-or-later
"""The march: one loop for one field or several, alone or in a scene, shaded or not, with any rule and quadrature.

Light that reaches the eye from a step of world length h, behind a transmittance T, is for material k

    T · j_k · ∫₀ʰ e^(-σs) ds  =  T · j_k · h · (1 - e^(-σh)) / (σh)

with the source j_k and the total extinction σ constant in the step. It is j_k·h without extinction (X-ray) and exact
for a homogeneous step. An iteration looks up, for each field, the brick at the ray's position. It then chooses one skip
and one step for all fields, and composites the light and the extinction of the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from spectral_core.volume.march.arithmetic import bounded, larger, mean_attenuation, mean_place, smaller, step_growth
from spectral_core.volume.march.path import FieldPath, Path
from spectral_core.volume.march.quadrature import Ahead, FieldMarch, Step, StepOptics, quadrature_of
from spectral_core.volume.march.turns import graded

# A way of up to 1.4 planned steps is one step, of up to 2.4 two. At these limits the error that one more step saves is
# worth its time; errors fall as the square of the number of steps.
_SHARED = 0.6


@dataclass(frozen=True)
class Shown:
    """Light of one step: ``source`` per material of all fields, its ``gain``, and the world distance."""

    source: list[Any]
    gain: Any
    distance: Any


Shade = Callable[[Any, Any, Shown], tuple[Any, Any]]
"""(light so far, sampler, light of the step) -> (light, sampler)."""


@dataclass
class MarchState:
    """State of the loop: each iteration reads it and returns the next one.

    Counts and light are None unless the caller requested them.
    """

    t: Any
    """Distance along the path, in the units of ``Path``."""
    transmittance: Any
    """Share of the light emitted at ``t`` that reaches the camera."""
    amounts: list[Any]
    """Per material, the light collected so far at color 1."""
    fields: list[Any]
    """Each field's own state, as its quadrature defines it."""
    samples: Any = None
    """Steps with a source above zero."""
    steps: Any = None
    """Iterations."""
    light: Any = None
    """Shaded light collected so far."""
    sampler: Any = None
    """Random numbers for the shading."""


@dataclass(frozen=True)
class Marched:
    """Result of a march: ``amounts`` per material, ``transmittance``, and the requested counts and light."""

    amounts: list[Any]
    transmittance: Any
    samples: Any = None
    steps: Any = None
    light: Any = None


def march(
    path: Path, *, counts: bool = False, shade: Shade | None = None, light: Any = None, sampler: Any = None
) -> Marched:
    """Composite along ``path``.

    Parameters
    ----------
    path
        Rays through one field or several.
    counts : bool
        Also count the steps of non-zero opacity or emission, and all iterations.
    shade
        Converts the light of each step at color 1 into shaded light.
    light
        Initial value of the light that ``shade`` adds to.
    sampler
        Source of random numbers for ``shade``.
    """
    import drjit as dr

    types = path.types
    # Made from the path, so that every variable of the loop has one lane per ray.
    zero = path.length * 0.0
    number = types.UInt32(zero) if counts else None
    marches = [quadrature_of(field, is_lit=shade is not None) for field in path.fields]
    materials = sum(field.data.materials for field in path.fields)
    start = MarchState(
        t=zero,
        transmittance=zero + 1.0,
        amounts=[zero + 0.0 for _ in range(materials)],
        fields=[each.begin(field) for each, field in zip(marches, path.fields, strict=True)],
        samples=number,
        # A copy, so that the two counts are two variables of the loop.
        steps=None if number is None else number + 0,
        light=light,
        sampler=sampler,
    )
    least = path.fields[0].data.least_transmittance

    def going(state: MarchState) -> Any:
        # Past the least transmittance nothing visible can be added, whatever lies ahead.
        return (state.t < path.length) & (state.transmittance > least)

    def iteration(state: MarchState) -> tuple[MarchState]:
        return (_iteration(path, marches, state, shade),)

    (end,) = dr.while_loop((start,), going, iteration)
    return Marched(end.amounts, end.transmittance, end.samples, end.steps, end.light)


def _iteration(path: Path, marches: list[FieldMarch], now: MarchState, shade: Shade | None) -> MarchState:
    import drjit as dr

    aheads = [_look_ahead(field, now.t, now.transmittance, path.phase) for field in path.fields]
    step = _agree(path, marches, aheads, now)
    optics = [
        each.evaluate(field, ahead, state, step)
        for each, field, ahead, state in zip(marches, path.fields, aheads, now.fields, strict=True)
    ]
    missed = _any_missed(optics)
    # A step that missed something is rejected: t is kept, and the next iteration tries a shorter step from there.
    end = step.end if missed is None else dr.select(missed, now.t, step.end)
    # The width that float32 really added: a step much shorter than t is rounded, and many steps in the same direction.
    width = step.end - step.begin if missed is None else dr.select(missed, 0.0, step.end - step.begin)
    length = width * path.world

    source = [each for part in optics for each in part.source]
    depth = sum((part.extinction for part in optics[1:]), optics[0].extinction) * length
    # Extinctions of fields that overlap add up; each field's light is attenuated by all of them.
    step_transmittance = dr.exp(-depth)
    gain = now.transmittance * length * mean_attenuation(depth, step_transmittance)
    after = MarchState(
        t=end,
        transmittance=now.transmittance * step_transmittance,
        amounts=[dr.fma(gain, each, amount) for each, amount in zip(source, now.amounts, strict=True)],
        fields=[
            each.settled(state, part, missed) for each, state, part in zip(marches, now.fields, optics, strict=True)
        ],
        light=now.light,
        sampler=now.sampler,
    )
    if now.steps is not None:
        types = path.types
        # Rejected steps and skips have length 0 and are not counted as samples.
        shows = (length > 0) & (sum(source[1:], source[0]) > 0)
        after.samples = now.samples + dr.select(shows, types.UInt32(1), types.UInt32(0))
        after.steps = now.steps + 1
    if shade is not None:
        place = step.begin + (step.end - step.begin) * _place(optics, depth, step_transmittance)
        after.light, after.sampler = shade(now.light, now.sampler, Shown(source, gain, path.distance(place)))
    return after


def _place(optics: list[StepOptics], depth: Any, transmittance: Any) -> Any:
    """Share of the step at which it is lit: where its light comes from in the mean.

    One place is exact to second order there, and to first order anywhere else: a thin surface at the end of a step
    would be lit beside itself, an opaque step far behind the place that is seen.
    """
    import drjit as dr

    places = [
        mean_place(depth, transmittance) if part.extent is None else part.extent.place(depth, transmittance)
        for part in optics
    ]
    if len(places) == 1:
        return places[0]
    weights = [sum(part.source[1:], part.source[0]) for part in optics]
    whole = sum(weights[1:], weights[0])
    mean = sum(weight * place for weight, place in zip(weights, places, strict=True))
    return dr.select(whole > 0.0, mean / larger(whole, 1e-30), 0.5)


def _look_ahead(field: FieldPath, t: Any, transmittance: Any, phase: Any) -> Ahead:
    """Read the brick at the ray's position: True if it is visible, the rule's step, and the distance to its end."""
    import drjit as dr

    data, local, inside = field.data, field.local(t), field.inside(t)
    found = field.rays.line.lookup(local, inside)
    word = found.word
    steps = word.shows & inside
    # The sign bit marks an empty brick, whose bits are no step; the first step after the skip stands in.
    planned = dr.select(steps, word.step, data.grid.first) * data.scale
    if data.adapts:
        # The light behind is attenuated by T, so the same error of the picture allows longer steps there.
        planned *= step_growth(data.volume.types, transmittance)
    planned = bounded(planned, data.shortest_step, data.grid.longest)
    if data.ends_at_faces:
        # The way to the next face is divided evenly: a full step and a short rest err more than two steps between.
        face = field.rays.until_face(local)
        planned = face / larger(dr.floor(face / planned + _SHARED), 1.0)
        if data.ends_at_turns:
            planned = graded(data.volume, field.rays, local, face, planned, data.shortest_step)
    elif phase is not None and data.quadrature == "midpoint":
        begins = ~steps | (local <= 0.0)
        planned = dr.select(begins, larger(planned * phase, data.shortest_step), planned)
    # If the rule has no first step, a skip ends the iteration; the least step would follow here otherwise.
    if data.grid.grid.first == 0.0:
        planned = dr.select(steps, planned, 0.0)
    skip = field.rays.line.skip(found)
    if field.begin is not None:
        # Before the entry there is no brick: the way to it is the skip.
        skip = dr.select(inside, skip, field.until_entry(t) / field.voxel)
    return Ahead(steps, planned, skip, word.pace if data.adapts else None)


def _agree(path: Path, marches: list[FieldMarch], aheads: list[Ahead], now: MarchState) -> Step:
    """The shortest of the fields' skips, then the shortest of their steps after it."""
    parts = list(zip(marches, path.fields, aheads, now.fields, strict=True))
    skips = [field.along(each.skip(ahead, state)) for each, field, ahead, state in parts]
    # The shortest skip of all: beyond it some field may show something.
    begin = smaller(now.t + _least(skips), path.length)
    # A single field always takes its whole skip, so no rest is left.
    rests = [(skip - (begin - now.t)) / field.voxel if path.is_shared else None
             for skip, field in zip(skips, path.fields, strict=True)]  # fmt: skip
    steps = [
        field.along(each.step(field, ahead, state, rest))
        for (each, field, ahead, state), rest in zip(parts, rests, strict=True)
    ]
    if path.is_shared:
        steps += [_until_border(field, begin) for field in path.fields]
    end = begin + smaller(_least(steps), path.length - begin)
    if path.is_shared:
        # A step below the resolution of float32 would leave t unchanged, and the loop would never end.
        end = larger(end, now.t * (1.0 + 3e-7))
    return Step(now.t, begin, end)


def _until_border(field: FieldPath, t: Any) -> Any:
    """Distance in t to the next entry or exit of the field: no step crosses either."""
    import drjit as dr

    left = field.along(field.rays.length - field.local(t))
    return dr.select(field.inside(t), left, field.until_entry(t))


def _any_missed(optics: list[StepOptics]) -> Any:
    missed = [part.missed for part in optics if part.missed is not None]
    if not missed:
        return None
    either = missed[0]
    for each in missed[1:]:
        either = either | each
    return either


def _least(lengths: list[Any]) -> Any:
    least = lengths[0]
    for length in lengths[1:]:
        least = smaller(length, least)
    return least
