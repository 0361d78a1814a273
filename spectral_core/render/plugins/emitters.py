# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights with Blender's falloffs: ``blender_spot`` and ``blender_area``."""

from __future__ import annotations

from functools import partial
from typing import Any

from spectral_core.render.plugins import opaque_number


def register(mi: Any, dr: Any) -> None:
    """Define and register the emitters for the active variant."""
    number = partial(opaque_number, mi, dr)

    class BlenderSpot(mi.Emitter):
        """A point or a ball behind a cone with a soft edge, shining along local -Z.

        ``intensity``: radiant intensity on the axis; ``radius``; ``cosine``: of half the cone angle; ``blend``: the
        soft share. It has no surface that a path could hit, so sharp mirrors do not show it.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.DeltaPosition
            self.m_needs_sample_3 = False
            self.intensity = properties["intensity"]
            radius, cosine = properties.get("radius", 0.0), properties["cosine"]
            self.is_ball = radius > 0
            self.radius, self.cosine = number(radius), number(cosine)
            self.softness = number(max(1e-6, (1.0 - cosine) * properties["blend"]))
            to_world = properties["to_world"]
            matrix = to_world.matrix if hasattr(to_world, "matrix") else to_world
            self.place = [float(matrix[i, 3]) for i in range(3)]
            self.center = [number(value) for value in self.place]
            self.axis = [number(-float(matrix[i, 2])) for i in range(3)]

        def falloff(self, toward_receiver: Any) -> Any:
            """Cycles' spot_light_attenuation: a smooth step in the cosine, from the cone's edge inwards."""
            cosine = dr.dot(toward_receiver, mi.Vector3f(*self.axis))
            step = dr.clip((cosine - self.cosine) / self.softness, 0.0, 1.0)
            return step * step * (3.0 - 2.0 * step)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            center = mi.Point3f(*self.center)
            to_center = center - it.p
            distance_squared = dr.squared_norm(to_center)
            inv_distance = dr.rsqrt(distance_squared)
            to_center *= inv_distance
            # the ball covers a cone of directions: sine² of its half angle, kept below 1 inside of it
            sine_squared = dr.minimum(self.radius * self.radius / distance_squared, 0.999)
            cosine = dr.sqrt(1.0 - sine_squared)
            rise = dr.select(sine_squared < 1e-4, 0.5 * sine_squared, 1.0 - cosine)
            # uniform in the cone; where the ball is a point this is its center
            off_axis = rise * sample.x
            sine = dr.safe_sqrt(off_axis * (2.0 - off_axis))
            turn = 2.0 * dr.pi * sample.y
            local = mi.Vector3f(sine * dr.cos(turn), sine * dr.sin(turn), 1.0 - off_axis)
            direction = mi.Frame3f(to_center).to_world(local)
            reach = dr.rcp(inv_distance)
            depth = dr.safe_sqrt(self.radius * self.radius - distance_squared * sine * sine)
            ds = dr.zeros(mi.DirectionSample3f)
            ds.d, ds.dist = direction, dr.maximum(reach * local.z - depth, 0.0)
            ds.p, ds.n, ds.time = it.p + direction * ds.dist, -direction, it.time
            ds.pdf, ds.delta = mi.Float(1.0), mi.Bool(True)
            ds.emitter = mi.EmitterPtr(self)
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths, si.time, si.p = it.wavelengths, it.time, ds.p
            # radiance intensity / (π r²) times the cone's solid angle 2π · rise, or the inverse square of a point
            per_area = 2.0 * rise / (self.radius * self.radius) if self.is_ball else inv_distance * inv_distance
            weight = self.falloff(-direction) * per_area
            return ds, self.intensity.eval(si, active) * dr.select(active, weight, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths, si.p = it.wavelengths, ds.p
            return self.intensity.eval(si, active) * self.falloff(-ds.d) / (ds.dist * ds.dist)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(*self.place))

        def traverse(self, callback: Any) -> None:
            callback.put("intensity", self.intensity, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderSpot"

    class BlenderArea(mi.Emitter):
        """A surface that emits ``radiance`` to its front, to both sides, or within a spread.

        ``two_sided``; ``spread``: half angle (radian) at which the light ends, π/2 for none. Cycles narrows the beam
        by a tent in the tangent and keeps its power; so does this.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying
            self.m_needs_sample_3 = False
            self.radiance = properties["radiance"]
            self.two_sided = properties.get("two_sided", False)
            tangent = properties.get("spread_tangent", 0.0)
            self.is_spread = tangent > 0
            self.tangent, self.gain = number(tangent), number(properties.get("spread_gain", 1.0))

        def profile(self, cosine: Any) -> Any:
            """Relative radiance at the cosine between normal and direction."""
            if self.two_sided:
                return mi.Float(1.0) + 0.0 * cosine
            if not self.is_spread:
                return dr.select(cosine > 0.0, 1.0, 0.0)
            tangent = dr.safe_sqrt(1.0 - cosine * cosine) / dr.maximum(cosine, 1e-6)
            return dr.select(cosine > 0.0, dr.maximum(0.0, 1.0 - tangent / self.tangent) * self.gain, 0.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.radiance.eval(si, active) * self.profile(mi.Frame3f.cos_theta(si.wi))

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds = self.get_shape().sample_direction(it, sample, active)
            cosine = -dr.dot(ds.d, ds.n)
            usable = active & (ds.pdf > 0.0) & (self.profile(cosine) > 0.0)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            ds.emitter = mi.EmitterPtr(self)
            value = self.radiance.eval(si, usable) * self.profile(cosine) / ds.pdf
            return ds, dr.select(usable, value, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            value = self.get_shape().pdf_direction(it, ds, active)
            return dr.select(self.profile(-dr.dot(ds.d, ds.n)) > 0.0, value, 0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            return self.radiance.eval(si, active) * self.profile(-dr.dot(ds.d, ds.n))

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def traverse(self, callback: Any) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderArea"

    mi.register_emitter("blender_spot", lambda properties: BlenderSpot(properties))
    mi.register_emitter("blender_area", lambda properties: BlenderArea(properties))
