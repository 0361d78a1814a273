# SPDX-License-Identifier: GPL-3.0-or-later
"""Albedo and normals of the first visible surfaces, the guides of a denoiser. No light is traced."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.denoise import Guides
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.scene import Camera, Film

GUIDE_SAMPLES = 16
"""Camera rays per pixel: enough for smooth edges, fewer than in any picture that needs a denoiser."""
MOST_PASSED = 16
"""Most transparent surfaces that a ray of the guides may pass."""
RED_GREEN_BLUE_NM = (610.0, 545.0, 450.0)
"""Wavelengths of the albedo in spectral transport: it distinguishes surfaces and need not be their exact color."""


class GuidePass(Accumulator):
    """Traces the guides of one loaded scene; transparent surfaces are passed at random, as by light."""

    def __init__(self, mitsuba: Any, camera: Camera, film: Film, *, spectral: bool) -> None:
        super().__init__(mitsuba, camera, film, None, keep=False)
        self._spectral = spectral

    def trace(self, first_hit: FirstHit, samples: int = GUIDE_SAMPLES) -> Guides:
        """Albedo and normals of the whole picture; zeros where a ray hits nothing."""
        mi, dr = self._mi, self._dr
        width, height = self.film.size
        pixel = dr.arange(mi.UInt32, width * height)
        corner, sampler = self._lanes(pixel)
        total, most = dr.opaque(mi.UInt32, samples), dr.opaque(mi.UInt32, MOST_PASSED)
        count = width * height
        zeros = lambda: dr.opaque(mi.Float, 0.0, count)  # noqa: E731

        def body(index: Any, albedo: Any, normal: Any) -> Any:
            sampler.begin(index)
            ray, _ = self._ray(corner, sampler)
            color, direction = first_seen(first_hit, ray, sampler, most)
            return index + 1, albedo + color, normal + direction

        _, albedo, normal = dr.while_loop(
            (mi.UInt32(0), mi.Color3f(zeros(), zeros(), zeros()), mi.Vector3f(zeros(), zeros(), zeros())),
            lambda index, *_: index < total,
            body,
            labels=("index", "albedo", "normal"),
        )
        dr.eval(albedo, normal)
        shape = (height, width, 3)
        mean = [np.array(each, dtype=np.float32).T.reshape(shape) / np.float32(samples) for each in (albedo, normal)]
        return Guides(np.clip(mean[0], 0.0, 1.0), np.clip(mean[1], -1.0, 1.0))

    def _draw_wavelengths(self, ray: Any, sampler: Any) -> None:
        if self._spectral:
            ray.wavelengths = guide_wavelengths(self._mi)


def guide_wavelengths(mi: Any) -> Any:
    """The wavelengths of a ray of the guides in spectral transport."""
    return mi.Spectrum(*RED_GREEN_BLUE_NM, RED_GREEN_BLUE_NM[1])


def first_seen(first_hit: FirstHit, ray: Any, sampler: Any, most: Any) -> tuple[Any, Any]:
    """Albedo of the first surface that a ray sees through at most ``most`` transparent ones, and its normal toward the
    viewer; zeros where it hits nothing. ``most`` lies in memory: recorded launches make no number.
    """
    import drjit as dr
    import mitsuba as mi

    # one number for all surfaces of a ray: half of the rays pass a surface that transmits half of the light
    pick, direction = sampler.next_1d(), sampler.next_2d()

    def body(origin: Any, length: Any, albedo: Any, normal: Any, layers: Any, walking: Any) -> Any:
        si, met, unseen, hole = first_hit.meet(ray, origin, length, walking)
        seen = met & ~unseen & ~hole
        bs, weight = first_hit.surface(si).sample(mi.BSDFContext(), si, pick, direction, seen)
        straight = unseen | (seen & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null))
        shown = seen & ~straight
        share = mi.Color3f(weight[0], weight[1], weight[2])
        share = dr.select(dr.isfinite(share), dr.clip(share, 0.0, 1.0), 0.0)
        facing = dr.select(dr.dot(si.sh_frame.n, ray.d) > 0.0, -si.sh_frame.n, si.sh_frame.n)
        facing = dr.select(dr.all(dr.isfinite(facing)), facing, 0.0)
        onward = straight & (layers + 1 < most)
        return (
            dr.select(onward, si.spawn_ray(ray.d).o, origin),
            dr.select(onward, length - si.t, length),
            dr.select(shown, share, albedo),
            dr.select(shown, facing, normal),
            layers + 1,
            onward,
        )

    start = (
        mi.Point3f(ray.o), mi.Float(ray.maxt), mi.Color3f(0.0), mi.Vector3f(0.0), mi.UInt32(0), mi.Bool(True),
    )  # fmt: skip
    _, _, albedo, normal, _, _ = dr.while_loop(start, lambda *state: state[-1], body)
    return albedo, normal
