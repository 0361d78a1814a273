# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights with Blender's falloffs: ``blender_spot``, ``blender_ball`` and ``blender_area``."""

from __future__ import annotations

from functools import partial
from typing import Any

from spectral_core.render.plugins import opaque_number


def register(mi: Any, dr: Any) -> None:
    """Define and register the emitters for the active variant."""
    number = partial(opaque_number, mi, dr)

    class Cone:
        """Where a spot shines: Cycles' spot_light_attenuation, a smooth step in the cosine from the edge inwards."""

        def __init__(self, properties: Any) -> None:
            cosine = properties["cosine"]
            self.cosine = number(cosine)
            self.softness = number(max(1e-6, (1.0 - cosine) * properties["blend"]))
            self.axis = [number(value) for value in properties["axis"]]

        def __call__(self, toward_receiver: Any) -> Any:
            cosine = dr.dot(toward_receiver, mi.Vector3f(*self.axis))
            step = dr.clip((cosine - self.cosine) / self.softness, 0.0, 1.0)
            return step * step * (3.0 - 2.0 * step)

    class BlenderSpot(mi.Emitter):
        """A point behind a cone with a soft edge: ``intensity``, ``center``, ``axis``, ``cosine``, ``blend``."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.DeltaPosition
            self.m_needs_sample_3 = False
            self.intensity, self.cone = properties["intensity"], Cone(properties)
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
            return self.intensity.eval(si, active) * self.cone(-ds.d) / (ds.dist * ds.dist)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(*self.place))

        def traverse(self, callback: Any) -> None:
            callback.put("intensity", self.intensity, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderSpot"

    class BlenderBall(mi.Emitter):
        """A glowing ball: ``radiance``, optionally within a cone, optionally with Blender's soft falloff.

        Soft falloff (``softening``: the radius, else 0): Cycles then lights as a disk of the ball's radius that faces
        the receiver at its center, which is less than the ball does by d² / (d² + r²).
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Surface
            self.m_needs_sample_3 = False
            self.radiance = properties["radiance"]
            self.center = [number(value) for value in properties["center"]]
            self.softening = number(properties["softening"])
            self.cone = Cone(properties) if "cosine" in properties else None

        def strength(self, receiver: Any, direction: Any) -> Any:
            """What a receiver gets of the radiance along ``direction``, towards the ball."""
            squared = dr.squared_norm(mi.Point3f(*self.center) - receiver)
            softened = squared / (squared + self.softening * self.softening)
            return softened if self.cone is None else softened * self.cone(-direction)

        def eval(self, si: Any, active: Any = True) -> Any:
            toward = si.to_world(si.wi)
            amount = self.strength(si.p + toward * si.t, -toward)
            return self.radiance.eval(si, active) * dr.select(mi.Frame3f.cos_theta(si.wi) > 0.0, amount, 0.0)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds = self.get_shape().sample_direction(it, sample, active)
            usable = active & (ds.pdf > 0.0) & (dr.dot(ds.d, ds.n) < 0.0)
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            ds.emitter = mi.EmitterPtr(self)
            value = self.radiance.eval(si, usable) * self.strength(it.p, ds.d) / ds.pdf
            return ds, dr.select(usable, value, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            value = self.get_shape().pdf_direction(it, ds, active)
            return dr.select(dr.dot(ds.d, ds.n) < 0.0, value, 0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = mi.SurfaceInteraction3f(ds, it.wavelengths)
            facing = dr.dot(ds.d, ds.n) < 0.0
            return self.radiance.eval(si, active) * dr.select(facing, self.strength(it.p, ds.d), 0.0)

        def bbox(self) -> Any:
            return self.get_shape().bbox()

        def traverse(self, callback: Any) -> None:
            callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderBall"

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
    mi.register_emitter("blender_ball", lambda properties: BlenderBall(properties))
    mi.register_emitter("blender_area", lambda properties: BlenderArea(properties))
