# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoising data: albedo, normal and depth of the first rough surfaces, as in Cycles.

A denoiser keeps the edges of these pictures. Mirrors and clear glass show edges too, so rays follow these to the first
rough surface. The albedo contains emission and the environment where the camera sees them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.passes.lobe_colors import LobeColors
from spectral_core.render.plugins.closures.strands.fiber import FIBER
from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.plugins.numbers import channel_mean
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.media import flight as flights
from spectral_core.render.trace.media.starts import at_start
from spectral_core.scene import Rays
from spectral_core.scene.camera import space_from_camera
from spectral_core.scene.passes import DATA_PASSES, DENOISING
from spectral_core.spectra.color import RGB_FROM_XYZ

Array = NDArray[np.float32]

MOST_SAMPLES = 32
"""Most camera rays per pixel, at most as many as the picture has."""
MOST_SURFACES = 16
"""Most mirrors and transparent surfaces on a ray."""
DRAWS = 4
"""Pairs of directions that are drawn at a surface, one in each quarter of its lobes."""
SHARPEST = 0.075
"""Alpha of microfacets up to which Cycles counts a lobe as a mirror or clear glass."""
BENDING = 0.38
"""Angle by which glass of IOR 1.5 bends light per angle of its facet, on the way in and out on average."""
ROUGH_SHARE = 3
"""A surface with less than one part in this number of rough draws is followed; Cycles follows below a quarter."""


@dataclass
class _Lobes:
    """Albedo of a surface's rough lobes, of its mirrors and clear glass, and of its transparency; share of the draws
    that are not transparent; whether the surface counts as rough; a direction of a lobe that is not rough, whether it
    is straight, and whether it leads straight or through smooth glass.
    """

    rough: Any
    sharp: Any
    clear: Any
    opaque: Any
    is_rough: Any
    onward: Any
    onward_is_straight: Any
    onward_is_clear: Any


class DenoisingData(LobeColors):
    """Traces the denoising data of one loaded scene.

    ``integrator``: tells emission that the camera sees. ``unit``: the renderer's units per unit of the scene.
    ``shows_background``: True if the albedo holds the environment behind a transparent film, too.
    """

    def __init__(
        self,
        mitsuba: Any,
        view: tuple[Any, Any],
        wavelengths: Any,
        wanted: tuple[str, ...],
        integrator: Any,
        unit: float,
        *,
        shows_background: bool,
    ) -> None:
        super().__init__(mitsuba, *view, wavelengths, keep=False)
        self._wanted, self._unit, self._shows_background = wanted, unit, shows_background
        self._integrator, self._sampled = integrator, integrator.sampled
        self._load_white()

    def trace(self, first_hit: FirstHit) -> dict[str, Array]:
        """The requested pictures (height, width, channels), row 0 at the bottom."""
        mi, dr = self._mi, self._dr
        width, height = self.film.size
        pixel = dr.arange(mi.UInt32, width * height)
        corner, sampler = self._lanes(pixel)
        samples = min(self.film.samples, MOST_SAMPLES)
        total = dr.opaque(mi.UInt32, samples)
        zeros = [dr.opaque(mi.Float, 0.0, width * height) for _ in range(7)]

        def body(index: Any, albedo: Any, normal: Any, depth: Any) -> Any:
            sampler.begin(index)
            ray, drawn = self._ray(corner, sampler)
            self._measured = lambda light: self._measure(light, drawn)
            found = self._follow_sharp(first_hit, ray, sampler)
            albedo, normal, depth = (before + more for before, more in zip((albedo, normal, depth), found, strict=True))
            return index + 1, albedo, normal, depth

        start = (mi.UInt32(0), mi.Color3f(*zeros[:3]), mi.Vector3f(*zeros[3:6]), zeros[6])
        labels = ("index", "albedo", "normal", "depth")
        _, albedo, normal, depth = dr.while_loop(start, lambda index, *_: index < total, body, labels=labels)
        dr.eval(albedo, normal, depth)
        self._measured = None
        means = [np.array(each, np.float64).reshape(-1, height, width) / samples for each in (albedo, normal, depth)]
        return self._pictures(*(np.moveaxis(mean, 0, -1) for mean in means))

    def _pictures(self, albedo: Any, normal: Any, depth: Any) -> dict[str, Array]:
        """The means in linear sRGB, in the axes of the camera, and in units of the scene."""
        if self.plan is not None:
            albedo = albedo @ RGB_FROM_XYZ.T
        own = np.stack([self.frame.right, self.frame.up, self.frame.back], axis=1)
        axes = own @ space_from_camera(self.frame.camera.panorama)[:3, :3].T
        found = {
            "Denoising Albedo": np.maximum(albedo, 0.0),
            "Denoising Normal": normal @ axes,
            "Denoising Depth": depth / self._unit,
        }
        assert set(found) == set(DENOISING), "each of the passes is made here"
        return {name: np.ascontiguousarray(found[name], np.float32) for name in DATA_PASSES if name in self._wanted}

    def _follow_sharp(self, first_hit: FirstHit, ray: Any, sampler: Any) -> tuple[Any, Any, Any]:
        """Albedo, normal and depth along one camera ray."""
        mi, dr = self._mi, self._dr
        picks, directions = sampler.next_2d(), sampler.next_2d()
        most = dr.opaque(mi.UInt32, MOST_SURFACES)
        rules = first_hit.rules
        assert rules is not None, "a scene without tables has no surfaces"
        fills = rules.media
        hides_world = first_hit.transparent and not self._shows_background
        passes_glass = hides_world and self.film.transparent_glass

        def body(place: Any, shares: Any, fog: Any, state: Any, sums: Any) -> Any:
            (origin, way, length), (clear, reach, before), (kind, through, layers, walking) = place, shares, state
            straight = kind == int(Rays.CAMERA)
            here = mi.Ray3f(ray)
            here.o, here.d, here.maxt = origin, way, length
            si, met, unseen, hole = first_hit.meet(here, origin, length, walking)
            if self._sampled is not None:
                left = self._sampled.seen_through(origin, way, dr.select(si.is_valid(), si.t, length), walking)
                clear, reach = clear * left, reach * left
            if fills is not None:
                unscattered = flights.clear(fills, fog, dr.select(si.is_valid(), si.t, dr.inf), here, walking)
                clear, reach = clear * unscattered, reach * channel_mean(dr, unscattered)
            unseen, hole = unseen & straight, hole & straight
            bsdf, seen = first_hit.surface(si), met & ~unseen & ~hole
            passed = dr.select(seen, bsdf.eval_null_transmission(si, seen), 1.0)
            hole |= seen & (self._held_out(first_hit, si, bsdf, (passed, hole), seen) > 1.0 - 1e-5)
            seen &= ~hole
            # other numbers at each surface
            surface = self._lobes(bsdf, si, (picks, directions, mi.Float(layers) * 0.618034), seen)
            shows = seen & surface.is_rough
            facing = mi.Vector3f(dr.select(dr.dot(si.sh_frame.n, way) > 0.0, -si.sh_frame.n, si.sh_frame.n))
            facing = dr.select(shows & dr.all(dr.isfinite(facing)), facing * (reach * surface.opaque), 0.0)
            albedo = dr.select(shows, self._measured(clear * self._white_at(si) * surface.rough), 0.0)
            albedo += self._seen_light(si, here, (clear, kind), walking & ~unseen, through & hides_world)
            # the way to a surface that the camera does not see counts with that to the next one
            distance = dr.select(met & ~hole & ~unseen, channel_mean(dr, clear) * (before + si.t), 0.0)
            before = dr.select(met & unseen, before + si.t, 0.0)
            sums = tuple(sum_ + more for sum_, more in zip(sums, (albedo, facing, distance), strict=True))
            # behind a rough surface only what it lets through straight is left
            clear = dr.select(seen, clear * (surface.clear + dr.select(shows, 0.0, surface.sharp)), clear)
            reach = dr.select(shows, reach * (1.0 - surface.opaque), reach)
            turned = seen & ~shows & ~surface.onward_is_straight
            through &= ~turned | (surface.onward_is_clear & passes_glass)
            bent = dr.select(surface.onward.z * si.wi.z < 0.0, mi.UInt32(int(Rays.TRANSMISSION)), int(Rays.GLOSSY))
            kind = dr.select(turned, bent, kind)
            out = dr.select(turned, si.to_world(surface.onward), way)
            onward = met & ~hole & (dr.max(clear) > 1e-4) & (layers + 1 < most)
            if fills is not None:
                fog = fills.crossed(fog, rules.shape_number(si), si, (way, out), met & ~unseen)
            place = (
                dr.select(onward, si.spawn_ray(out).o, origin),
                dr.select(onward, out, way),
                dr.select(turned, dr.inf, length - si.t),
            )
            return place, (clear, reach, before), fog, (kind, through, layers + 1, onward), sums

        fog = at_start(rules, first_hit.scene, ray, ray.maxt > 0.0)
        start = (
            (mi.Point3f(ray.o), mi.Vector3f(ray.d), mi.Float(ray.maxt)),
            (mi.Spectrum(1.0), mi.Float(1.0), mi.Float(0.0)),
            fog,
            (mi.UInt32(int(Rays.CAMERA)), mi.Bool(True), mi.UInt32(0), ray.maxt > 0.0),
            (mi.Color3f(0.0), mi.Vector3f(0.0), mi.Float(0.0)),
        )
        return tuple(dr.while_loop(start, lambda *parts: parts[3][3], body)[-1])

    def _seen_light(self, si: Any, ray: Any, shares: tuple[Any, Any], active: Any, hides_world: Any) -> Any:
        """Color of lamps, emission and the environment along a ray. ``shares``: what is left of it, and its type."""
        dr, integrator, (clear, kind) = self._dr, self._integrator, shares
        path = integrator.begin(ray, active)
        path.kind, path.clear = kind, type(active)(False)  # ``hides_world`` removes what a transparent film omits
        path.depth = dr.select(kind == int(Rays.CAMERA), type(kind)(0), 1)  # mirrors show lamps that a camera does not
        light = integrator.arrived(si, path, active)
        light -= dr.select(hides_world, integrator.met.world, 0.0)
        integrator.met = integrator.seen_world = None
        shown = clear * dr.select(dr.isfinite(light), light, 0.0)
        return dr.select(active, self._measured(shown), 0.0)

    def _lobes(self, bsdf: Any, si: Any, numbers: tuple[Any, Any, Any], active: Any) -> _Lobes:
        """The lobes of a surface, by pairs of directions that are drawn around the middle of a lobe."""
        mi, dr = self._mi, self._dr
        picks, directions, turn = numbers
        first, choice = _fraction(dr, picks.x + turn), _fraction(dr, picks.y + turn)

        def body(
            k: Any, rough: Any, sharp: Any, clear: Any, counts: Any, way: Any, kept: Any, choice: Any
        ) -> tuple[Any, ...]:
            pick = dr.minimum((mi.Float(k) + first) / DRAWS, 1.0 - 1e-6)
            shift = mi.Float(k) * 0.754878, mi.Float(k) * 0.569840
            place = mi.Point2f(
                _fraction(dr, directions.x + turn + shift[0]), _fraction(dr, directions.y + turn + shift[1])
            )
            pair = [bsdf.sample(mi.BSDFContext(), si, pick, at, active) for at in (place, 1.0 - place)]
            weight = mi.Spectrum(0.0)
            for bs, value in pair:
                value = dr.select((bs.sampled_type & DIVES) != 0, value * bs.pdf, value)
                weight += dr.select(active & dr.all(dr.isfinite(value)), value * 0.5, 0.0)
            drawn = active & (dr.max(weight) > 0.0)
            passes = drawn & mi.has_flag(pair[0][0].sampled_type, mi.BSDFFlags.Null)
            mirrors = drawn & ~passes & self._is_sharp(si, pair[0][0], pair[1][0], place)
            rest = drawn & ~passes & ~mirrors
            rough += dr.select(rest, weight / DRAWS, 0.0)
            sharp += dr.select(mirrors, weight / DRAWS, 0.0)
            clear += dr.select(passes, weight / DRAWS, 0.0)
            counts += mi.Vector3f(*(dr.select(each, mi.Float(1.0), 0.0) for each in (rest, mirrors, passes)))
            number = dr.maximum(counts.y + counts.z, 1.0)
            takes = (mirrors | passes) & (choice * number < 1.0)
            # what is left of the number is even over [0, 1) again
            scaled = dr.select(takes, choice * number, (choice * number - 1.0) / dr.maximum(number - 1.0, 1.0))
            choice = dr.select(mirrors | passes, dr.clip(scaled, 0.0, 1.0), choice)
            way = dr.select(takes, pair[0][0].wo, way)
            kinds = passes, passes | mi.has_flag(pair[0][0].sampled_type, mi.BSDFFlags.DeltaTransmission)
            kept = tuple(dr.select(takes, kind, before) for kind, before in zip(kinds, kept, strict=True))
            return k + 1, rough, sharp, clear, counts, way, kept, choice

        black = mi.Spectrum(0.0)
        straight = mi.Bool(True), mi.Bool(True)
        start = (
            mi.UInt32(0), black, mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Vector3f(0.0), -si.wi, straight, choice,
        )  # fmt: skip
        last = dr.opaque(mi.UInt32, DRAWS)
        _, rough, sharp, clear, counts, way, kept, _ = dr.while_loop(start, lambda k, *_: k < last, body)
        opaque = counts.x + counts.y
        share = opaque / dr.maximum(opaque + counts.z, 1.0)
        return _Lobes(rough, sharp, clear, share, counts.x * ROUGH_SHARE > opaque, way, *kept)

    def _is_sharp(self, si: Any, one: Any, other: Any, place: Any) -> Any:
        """True if two directions, drawn at ``place`` and opposite to it, belong to a mirror or clear glass.

        The facets of the two are as far apart as the lobe is wide, whatever normal it has: for GGX the tangent of
        half the angle is alpha times r / sqrt(1 - r²) at the radius r in the disk of numbers.
        """
        mi, dr = self._mi, self._dr
        smooth = mi.has_flag(one.sampled_type, mi.BSDFFlags.Delta)
        lobe = one.sampled_type & (int(mi.BSDFFlags.Diffuse) | DIVES | FIBER)
        through = si.wi.z * one.wo.z < 0.0
        axes = [dr.select(through, bs.wo, dr.normalize(si.wi + bs.wo)) for bs in (one, other)]
        tangent = dr.norm(axes[0] - axes[1]) / dr.maximum(dr.norm(axes[0] + axes[1]), 1e-6)
        tangent *= dr.select(through, 1.0 / BENDING, 1.0)
        radius = dr.clip(dr.maximum(dr.abs(2.0 * place.x - 1.0), dr.abs(2.0 * place.y - 1.0)), 0.05, 0.999)
        alpha = tangent * dr.sqrt(1.0 - radius * radius) / radius
        return smooth | ((lobe == 0) & (alpha < SHARPEST))


def _fraction(dr: Any, value: Any) -> Any:
    return value - dr.floor(value)
