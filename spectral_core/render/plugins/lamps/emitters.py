# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights with Blender's falloffs: ``blender_point``, ``blender_ball`` and ``blender_area``."""

from __future__ import annotations

from functools import partial
from typing import Any

from spectral_core.render.plugins.lamps.ball_points import (
    ball_density,
    disk_density,
    draw_in_ball,
    draw_on_disk,
    meet_ball,
    meet_disk,
)
from spectral_core.render.plugins.lamps.shaping import Shaping
from spectral_core.render.plugins.numbers import opaque_number


def register(mi: Any, dr: Any) -> None:
    """Define and register the emitters for the active variant."""
    number = partial(opaque_number, mi, dr)

    class BlenderPoint(mi.Emitter):
        """A point: ``intensity``, ``center``; ``shaping`` is set after construction."""

        NOT_IN_KERNELS = ("place",)
        """Attributes that kernels do not read, so that a live view may change them."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.DeltaPosition
            self.m_needs_sample_3 = False
            self.intensity, self.shaping = properties["intensity"], Shaping()
            self.place = [float(value) for value in properties["center"]]
            self.center = [number(value) for value in self.place]

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds = dr.zeros(mi.DirectionSample3f)
            ds.p, ds.time = mi.Point3f(*self.center), it.time
            ds.d = ds.p - it.p
            ds.dist = dr.norm(ds.d)
            ds.d /= ds.dist
            ds.n = -ds.d
            ds.pdf, ds.delta = mi.Float(1.0), mi.Bool(True)
            ds.emitter = mi.EmitterPtr(self)
            return ds, dr.select(active, self.eval_direction(it, ds, active), 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths, si.p, si.time = it.wavelengths, ds.p, it.time
            tint = self.shaping.tint((ds.p, -ds.d), -ds.d, ds.dist, it, active)
            return self.intensity.eval(si, active) * tint * self.shaping(-ds.d, ds.dist) / (ds.dist * ds.dist)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(*self.place))

        def traverse(self, callback: Any) -> None:
            callback.put("intensity", self.intensity, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderPoint"

    class BlenderBall(mi.Emitter):
        """An emissive ball: ``radiance``, and ``faces_receiver`` for Blender's soft falloff (``lamps.ball_points``);
        ``shaping`` is set later.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Surface
            self.m_needs_sample_3 = False
            self.radiance, self.shaping = properties["radiance"], Shaping()
            self.center = [number(value) for value in properties["center"]]
            self.radius, self.faces_receiver = number(properties["radius"]), bool(properties["faces_receiver"])

        def emitted(self, it: Any, receiver: Any, direction: Any, distance: Any, active: Any) -> Any:
            """Radiance at a receiver along ``direction``, toward a point of the lamp."""
            point = receiver + direction * distance
            normal = -direction if self.faces_receiver else dr.normalize(point - mi.Point3f(*self.center))
            tint = self.shaping.tint((point, normal), -direction, distance, it, active)
            return self.radiance.eval(it, active) * tint * self.shaping(-direction, distance)

        def eval(self, si: Any, active: Any = True) -> Any:
            toward, center = si.to_world(si.wi), mi.Point3f(*self.center)
            distance = si.time + si.t  # from where the path has bounced, see ``ray_marks``
            receiver = si.p + toward * distance
            # a receiver within the lamp hits its wall from behind; any other counts it at the front. A ray that went
            # through the front starts again a little below it
            below = 1e-3 * (1.0 + dr.max(dr.abs(center)))
            within = dr.norm(receiver - center) < self.radius - below
            shown = active & ((mi.Frame3f.cos_theta(si.wi) > 0.0) != within)
            if self.faces_receiver:
                distance = meet_disk((receiver, -toward), receiver, center, self.radius)
                shown &= dr.isfinite(distance)
            return dr.select(shown, self.emitted(si, receiver, -toward, distance, shown), 0.0)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            center, ds = mi.Point3f(*self.center), dr.zeros(mi.DirectionSample3f)
            draw = draw_on_disk if self.faces_receiver else draw_in_ball
            ds.d, distance, ds.pdf = draw(it.p, center, self.radius, sample)
            # rays to the disk end where they enter the body
            ds.dist = dr.minimum(distance, meet_ball((it.p, ds.d), center, self.radius))
            ds.p, ds.time, ds.delta = it.p + ds.d * ds.dist, it.time, mi.Bool(False)
            ds.n = mi.Normal3f(-ds.d if self.faces_receiver else dr.normalize(ds.p - center))
            ds.emitter = mi.EmitterPtr(self)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            usable = active & (ds.pdf > 0.0)
            value = self.emitted(si, it.p, ds.d, distance, usable) * dr.rcp(dr.maximum(ds.pdf, 1e-30))
            return ds, dr.select(usable, value, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            center = mi.Point3f(*self.center)
            if self.faces_receiver:
                return disk_density(it.p, center, self.radius, ds.d)
            return ball_density(it.p, center, self.radius)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si, distance = mi.SurfaceInteraction3f(ds, it.wavelengths), ds.dist
            if self.faces_receiver:
                distance = meet_disk((it.p, ds.d), it.p, mi.Point3f(*self.center), self.radius)
            return self.emitted(si, it.p, ds.d, distance, active)

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def traverse(self, callback: Any) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderBall"

    class BlenderArea(mi.Emitter):
        """A surface that emits ``radiance`` to its front, to both sides, or within a spread.

        ``two_sided``; ``spread``: half angle (radian) at which the light ends, π/2 for none. This class,
        like Cycles, narrows the beam by a tent in the tangent and keeps its power. ``surface``, set later where
        Mitsuba's own way to draw a point of the shape does not serve, draws one instead.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying
            self.m_needs_sample_3 = False
            self.radiance, self.shaping = properties["radiance"], Shaping()
            self.two_sided = properties.get("two_sided", False)
            tangent = properties.get("spread_tangent", 0.0)
            self.is_spread = tangent > 0
            self.tangent, self.gain = number(tangent), number(properties.get("spread_gain", 1.0))
            self.surface: Any = None

        def profile(self, normal: Any, direction: Any) -> Any:
            """Relative radiance along a direction away from a surface with the ``normal``."""
            cosine = dr.dot(normal, direction)
            if self.two_sided:
                return mi.Float(1.0) + 0.0 * cosine
            if not self.is_spread:
                return dr.select(cosine > 0.0, 1.0, 0.0)
            tangent = dr.norm(dr.cross(normal, direction)) / dr.maximum(cosine, 1e-6)
            return dr.select(cosine > 0.0, dr.maximum(0.0, 1.0 - tangent / self.tangent) * self.gain, 0.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            toward, distance = si.to_world(si.wi), si.time + si.t
            amount = self.profile(mi.Vector3f(0.0, 0.0, 1.0), si.wi) * self.shaping(toward, distance)
            tint = self.shaping.tint((si.p, si.n), toward, distance, si, active)
            return self.radiance.eval(si, active) * amount * tint

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            own = self.get_shape() if self.surface is None else self.surface
            ds = own.sample_direction(it, sample, active)
            amount = self.profile(ds.n, -ds.d)
            usable = active & (ds.pdf > 0.0) & (amount > 0.0)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            si.wi, si.t = si.to_local(-ds.d), ds.dist  # data that the paint may read
            ds.emitter = mi.EmitterPtr(self)
            amount = amount * self.shaping(-ds.d, ds.dist)
            amount = amount * self.shaping.tint((ds.p, ds.n), -ds.d, ds.dist, it, usable)
            return ds, dr.select(usable, self.radiance.eval(si, usable) * amount / ds.pdf, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            own = self.get_shape() if self.surface is None else self.surface
            value = own.pdf_direction(it, ds, active)
            return dr.select(self.profile(ds.n, -ds.d) > 0.0, value, 0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            amount = self.profile(ds.n, -ds.d) * self.shaping(-ds.d, ds.dist)
            return self.radiance.eval(si, active) * amount * self.shaping.tint((ds.p, ds.n), -ds.d, ds.dist, it, active)

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def traverse(self, callback: Any) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderArea"

    mi.register_emitter("blender_point", lambda properties: BlenderPoint(properties))
    mi.register_emitter("blender_ball", lambda properties: BlenderBall(properties))
    mi.register_emitter("blender_area", lambda properties: BlenderArea(properties))
