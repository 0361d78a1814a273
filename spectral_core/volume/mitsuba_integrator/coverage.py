# SPDX-License-Identifier: GPL-3.0-or-later
"""A render loop whose alpha is an opacity.

Mitsuba's sampling integrators report to the film for each ray only if something was hit. Every pixel with a trace of a
volume would be opaque, and a picture composited by that alpha would have black fringes. Here alpha is 1 - T.
"""

from __future__ import annotations

from typing import Any

_MOST_RAYS = 1 << 31  # of one pass; Dr.Jit counts the lanes of a kernel in 32 bits


def render_with_coverage(
    integrator: Any, scene: Any, sensor: Any, *, seed: Any, spp: int, develop: bool, evaluate: bool
) -> Any:
    """Render ``scene`` as ``mi.SamplingIntegrator.render`` does, with the integrator's coverage as alpha.

    Parameters
    ----------
    integrator
        Has ``sample_coverage(scene, sampler, ray)`` → (light, alpha, channels) and ``aov_names()``.
    scene, sensor
        Mitsuba's.
    seed, spp, develop, evaluate
        As in ``mi.render``: first random seed, samples per pixel (0: the sampler's own), and whether the film is
        developed into a tensor, and evaluated, at once.
    """
    import drjit as dr
    import mitsuba as mi

    tools = mi.ad.integrators.common.ADIntegrator
    film, own = sensor.film(), sensor.sampler()
    size = film.crop_size()
    if film.sample_border():
        size = size + 2 * film.rfilter().border_size()
    pixels = int(dr.prod(size))
    wanted = int(spp) or own.sample_count()
    film.prepare(integrator.aov_names())
    block = film.create_block()
    block.set_coalesce(block.coalesce() and wanted >= 4)
    done = 0
    while done < wanted:
        sampler = own.clone()
        sampler.set_sample_count(min(wanted - done, max(1, _MOST_RAYS // pixels)))
        count = sampler.sample_count()
        sampler.set_samples_per_wavefront(count)
        sampler.seed(mi.UInt32(seed) + done, pixels * count)
        ray, weight, position = tools.sample_rays(integrator, scene, sensor, sampler)
        light, alpha, channels = integrator.sample_coverage(scene, sampler, ray)
        tools._splat_to_block(
            block, film, position, value=light * weight, weight=1.0, alpha=alpha, aovs=channels,
            wavelengths=ray.wavelengths,
        )  # fmt: skip
        done += count
    film.put_block(block)
    if not develop:
        if evaluate:
            film.schedule_storage()
            dr.eval()
        return mi.TensorXf()
    picture = film.develop()
    if evaluate:
        dr.eval(picture)
    return picture
