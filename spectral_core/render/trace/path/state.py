# SPDX-License-Identifier: GPL-3.0-or-later
"""State of a path between hits."""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.plugins.closures.lobe import ALONE, TURNED
from spectral_core.scene import Rays


def by_reflections(dr: Any, light: Any, reflections: Any) -> tuple[Any, Any]:
    """Light if two surfaces have reflected it diffusely, and if more have; else 0."""
    return dr.select(reflections == 2, light, 0.0), dr.select(reflections > 2, light, 0.0)


@cache
def path_state_class(variant: str) -> Any:
    """The class under ``variant``, which must be the active one."""
    import drjit as dr
    import mitsuba as mi

    class PathState:
        """State of a path between hits."""

        DRJIT_STRUCT = {
            "ray": mi.Ray3f,
            "active": mi.Bool,
            "light": mi.Spectrum,  # radiance so far
            # its parts after two diffuse reflections, and after more
            **({"second": mi.Spectrum, "later": mi.Spectrum} if mi.is_spectral else {}),
            "throughput": mi.Spectrum,  # throughput to the camera
            "eta": mi.Float,  # product of the indices of refraction on the path
            "seen": mi.Bool,  # True if anything was hit
            "last": mi.Bool,  # True if only emission counts any more
            "depth": mi.UInt32,  # bounces so far, in all and by kind
            "diffuse": mi.UInt32,
            "glossy": mi.UInt32,
            "transmission": mi.UInt32,
            "volume": mi.UInt32,
            "passed": mi.UInt32,  # surfaces passed straight
            "medium": mi.UInt32,  # the medium of the ray, and the one around that
            "outer": mi.UInt32,
            "clear": mi.Bool,  # whether the ray has met nothing but what is clear: straight on, or through smooth glass
            "through": mi.Float,  # share that reaches the environment in this way, after glass
            "leaves": mi.Bool,  # True if the ray comes from below the surface that it hits next
            "within": mi.UInt32,  # strands that the last hit lies within, beside the one that was hit
            "kind": mi.UInt32,  # Rays: type of ray that left the last surface
            # the last surface that scattered, from which a light that is hit now could have been sampled
            "before": mi.Interaction3f,
            "before_pdf": mi.Float,
            "before_delta": mi.Bool,
            "before_alone": mi.UInt32,  # ALONE or TURNED: what lights that are sampled lack in its direction
            "before_shape": mi.UInt32,
            "least_density": mi.Float,  # of the bounces so far, for Filter Glossy
            "before_both": mi.Bool,  # True if that surface transmits light as well
            "before_kinds": mi.UInt32,  # types of rays along which it scatters light
        }

        light: Any
        second: Any
        later: Any
        through: Any
        before: Any
        before_alone: Any
        before_shape: Any
        before_both: Any
        before_kinds: Any

        def __init__(self, ray: Any = None, active: Any = None) -> None:
            for name, kind in self.DRJIT_STRUCT.items():
                setattr(self, name, dr.zeros(kind))
            if ray is None:
                return
            self.ray, self.active, self.throughput = ray, active, mi.Spectrum(1.0)
            self.eta, self.before_pdf, self.before_delta = mi.Float(1.0), mi.Float(1.0), mi.Bool(True)
            self.clear, self.least_density = mi.Bool(True), mi.Float(dr.inf)
            self.kind = mi.UInt32(int(Rays.CAMERA))
            self.before.p = ray.o

        def go_on(self, si: Any, outward: Any, onward: Any, scatters: Any, counts_lengths: bool) -> None:
            """Continue behind a hit. A surface that is passed straight renews neither the length that is left to the
            ray (``maxt``) nor, if programs read it, the length from the last bounce (``time``).
            """
            rest, origin = self.ray.maxt - si.t, mi.Point3f(self.ray.o)
            self.ray = dr.select(onward, si.spawn_ray(dr.select(scatters, outward, self.ray.d)), self.ray)
            self.ray.maxt = dr.select(scatters, dr.largest(mi.Float), rest)
            if counts_lengths:
                # between the origins, because a ray starts beyond a surface by the rounding error of its position
                self.ray.time = dr.select(onward & ~scatters, si.time + dr.norm(self.ray.o - origin), 0.0)

        def remember(self, si: Any, bs: Any, shape: Any, scatters: Any, sides: tuple[Any, Any]) -> None:
            """Store the point where the path has scattered, and the density.

            ``sides``: True if light from behind counts there, and the types of rays along which it scatters light.
            """
            place = mi.Interaction3f(si)
            place.n = dr.select(dr.dot(si.n, self.ray.d) > 0.0, -si.n, si.n)
            self.before = dr.select(scatters, place, self.before)
            self.before_both = dr.select(scatters, sides[0], self.before_both)
            self.before_kinds = dr.select(scatters, sides[1], self.before_kinds)
            self.before_pdf = dr.select(scatters, bs.pdf, self.before_pdf)
            delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            self.before_delta = dr.select(scatters, delta, self.before_delta)
            alone = bs.sampled_type & (ALONE | TURNED)
            self.before_alone = dr.select(scatters, alone, self.before_alone)
            self.before_shape = dr.select(scatters, shape, self.before_shape)
            self.spread(bs.pdf, scatters & ~delta)

        def add(self, light: Any, reflections: Any) -> None:
            """Add light; ``reflections``: number of surfaces that have reflected it diffusely."""
            self.light += light
            if mi.is_spectral:
                second, later = by_reflections(dr, light, reflections)
                self.second += second
                self.later += later

        def extra(self, clear_glass: bool) -> list[Any]:
            """What is returned beside the light: the share behind glass, and in spectral transport both later parts."""
            parts = [*self.second, *self.later] if mi.is_spectral else []
            return [*([self.through] if clear_glass else []), *parts]

        def spread(self, density: Any, scatters: Any) -> None:
            """Store the least density of a bounce, by which Filter Glossy blurs lobes."""
            least = dr.minimum(self.least_density, density)
            self.least_density = dr.select(scatters, least, self.least_density)

    return PathState
