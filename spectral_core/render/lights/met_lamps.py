# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of lamps that a ray meets on its way, and the factor by which a lamp's emission varies."""

from __future__ import annotations

from typing import Any

from spectral_core.render.lights.choice import Receiver
from spectral_core.render.lights.listing import BALL, PANEL, SUN
from spectral_core.render.lights.results import Rule
from spectral_core.render.plugins.lamps.patterns import lamp_place


def pattern_factor(lights: Any, source: Any, spot: tuple[Any, Any], by: tuple[Any, Any], active: Any) -> Any:
    """Factor of a lamp's emission at a point of it.

    ``spot``: place of the receiver with the direction and distance of the point, and the lamp's normal there; ``by``:
    an interaction with the wavelengths, and the bounces that are counted.
    """
    import drjit as dr
    import mitsuba as mi

    if lights.patterns.are_none:
        return mi.Float(1.0)
    (origin, direction, distance), normal = spot
    # Cycles puts the points of a sun at the direction that its light travels in
    is_far = ~dr.isfinite(distance)
    point = dr.select(is_far, -direction, origin + direction * dr.select(is_far, 0.0, distance))
    place = lamp_place(point, normal, (-direction, distance), *by)
    return lights.patterns.of(source, place, active)


def met_body(lights: Any, item: Any, met_by: tuple[Any, Receiver, Any, Rule, Any], active: Any) -> Any:
    """Light of a lamp with an extent that a ray may meet.

    ``met_by``: length of the ray, the place that it comes from, its path, the rule of weights, and the transmittance of
    media on its way, a function of the distance and a mask; None for none.
    """
    import drjit as dr
    import mitsuba as mi

    length, to, path, rule, clear = met_by
    source = dr.gather(mi.UInt32, lights.sources, item, active)
    active = lights.seen(source, path, active)
    ray = path.ray.o, path.ray.d, length
    amount, pdf, met, way = mi.Float(0.0), mi.Float(0.0), mi.Bool(False), mi.Float(0.0)
    far, normal = mi.Float(0.0), mi.Normal3f(-path.ray.d)
    for kind in (BALL, PANEL):
        lamps = lights.balls if kind == BALL else lights.panels
        if lamps is None:
            continue
        start = lights.first[kind]
        of_kind = active & (item >= start) & (item < lights.first[kind + 1])
        slot = item - start
        at = lamps.meet(slot, ray, to.place, of_kind) if kind == BALL else lamps.meet(slot, ray, of_kind)
        of_kind &= dr.isfinite(at)
        point = path.ray.o + path.ray.d * at
        distance = dr.norm(point - to.place)
        if kind == BALL:
            own = lamps.radiance(slot, to.place, path.ray.d, distance, of_kind)
            density = lamps.pdf(slot, to.place, path.ray.d, of_kind)
        else:
            own = lamps.radiance(slot, path.ray.d, distance, of_kind)
            density = lamps.pdf(slot, to.place, path.ray.d, distance, of_kind)
        amount, pdf = dr.select(of_kind, own, amount), dr.select(of_kind, density, pdf)
        met, way, far = met | of_kind, dr.select(of_kind, at, way), dr.select(of_kind, distance, far)
        if not lights.patterns.are_none:
            normal = dr.select(of_kind, lamps.normal(slot, point, path.ray.d, of_kind), normal)
    met &= amount > 0.0
    pdf *= lights.choice.probability(item, to, met & ~path.before_delta)
    light = lights.emission.of(source, path.ray.wavelengths, met) * amount
    spot = (to.place, path.ray.d, far), normal
    light = light * pattern_factor(lights, source, spot, (path.ray, mi.Float(path.depth)), met)
    if clear is not None:
        light = light * clear(way, met)
    return dr.select(met, light * rule(source + 1, pdf, met), 0.0)


def met_suns(lights: Any, met_by: tuple[Receiver, Any, Rule], active: Any) -> Any:
    """Light of the suns whose disk a ray hits; ``met_by``: the place that it comes from, its path, the rule."""
    import drjit as dr
    import mitsuba as mi

    to, path, rule = met_by
    start, end = lights.first[SUN], lights.first[SUN + 1]

    def body(item: Any, total: Any) -> Any:
        source = dr.gather(mi.UInt32, lights.sources, item, active)
        shown = lights.seen(source, path, active)
        met, pdf = lights.suns.meets(item - start, path.ray.d, shown)
        pdf *= lights.choice.probability(item, to, met & ~path.before_delta)
        light = lights.emission.of(source, path.ray.wavelengths, met)
        spot = (to.place, path.ray.d, mi.Float(dr.inf)), mi.Normal3f(-path.ray.d)
        light = light * pattern_factor(lights, source, spot, (path.ray, mi.Float(path.depth)), met)
        return item + 1, total + dr.select(met, light * rule(source + 1, pdf, met), 0.0)

    begin = (mi.UInt32(start), mi.Spectrum(0.0))
    return dr.while_loop(begin, lambda item, _t: active & (item < end), body, labels=("item", "total"))[1]
