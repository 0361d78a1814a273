# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_sun``: light of one direction, as Mitsuba's ``directional``, for a scene that may grow."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from spectral_core.render.plugins.numbers import opaque_number


class Reach:
    """The sphere beyond which shadow rays end; ``number``: makes numbers that kernels read from memory.

    Mitsuba's ``directional`` has it as constants of the kernels, so that a recorded launch keeps the old one.
    """

    def __init__(self, number: Any) -> None:
        self._number = number
        self.center, self.radius = [number(0.0)] * 3, number(1.0)

    def enclose(self, center: Any, radius: float) -> None:
        """Take another sphere, the scene's."""
        self.center = [self._number(value) for value in center]
        self.radius = self._number(radius)

    def can_take(self, _other: Reach) -> bool:
        """True: an edit of the light leaves the size of the scene as it is."""
        return True

    def take(self, _other: Reach) -> None:
        """Keep the own sphere: that of a lamp that was made for its numbers knows no scene."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the emitter for the active variant."""
    number = partial(opaque_number, mi, dr)

    class BlenderSun(mi.Emitter):
        """``direction``: in which its light travels, of length 1; ``irradiance``: on a surface at right angles."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.m_flags = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection
            self.m_needs_sample_3 = False
            self.irradiance, self.reach = properties["irradiance"], Reach(number)
            self.direction = [number(value) for value in properties["direction"]]

        def set_scene(self, scene: Any) -> None:
            box = scene.bbox()
            if box.valid():
                low, high = (np.array(corner, dtype=np.float64).reshape(3) for corner in (box.min, box.max))
                self.reach.enclose((low + high) / 2, float(np.linalg.norm(high - low)) / 2)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            travels, center = mi.Vector3f(*self.direction), mi.Point3f(*self.reach.center)
            ds = dr.zeros(mi.DirectionSample3f)
            ds.dist = 2.0 * dr.maximum(self.reach.radius, dr.norm(it.p - center))
            ds.p, ds.d, ds.n = it.p - travels * ds.dist, -travels, mi.Normal3f(travels)
            ds.time, ds.pdf, ds.delta = it.time, mi.Float(1.0), mi.Bool(True)
            ds.emitter = mi.EmitterPtr(self)
            return ds, self.eval_direction(it, ds, active)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wavelengths, si.time = it.wavelengths, it.time
            return dr.select(active, self.irradiance.eval(si, active), 0.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f()

        def traverse(self, callback: Any) -> None:
            callback.put("irradiance", self.irradiance, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "BlenderSun"

    mi.register_emitter("blender_sun", lambda properties: BlenderSun(properties))
