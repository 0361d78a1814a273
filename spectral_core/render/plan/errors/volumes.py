# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on the color error of omitting media and sampled volumes: what they absorb, and the light that they add."""

from __future__ import annotations

from functools import cache

import numpy as np

from spectral_core.render.plan.bounds import (
    error_of_light,
    error_of_medium,
    error_of_share,
    optical_depth,
    sources_in_view,
)
from spectral_core.render.plan.light.reflections import reflected_radiance, ways_of_light
from spectral_core.render.plan.light.sizes import largest_light, largest_size
from spectral_core.scene import Material, Scene
from spectral_core.scene.geometry import VolumeObject, index_box, placed, unit_box
from spectral_core.volume.transfer import interpolate

DENSEST = 0.2
"""Optical depth beyond which a volume is not bounded."""
MOST_VOXELS = 1 << 21
"""Most voxels that are searched for the least and largest value; more would delay an edit of the scene."""


def error_of_media(
    scene: Scene,
    materials: list[Material],
    carriers: list[Material],
    *,
    lights_vary: bool = False,
    most: float = np.inf,
) -> float:
    """ΔE2000 of omitting the media of ``carriers``, with the light that ``materials``, all that a ray may hit, reflect
    to them: walls far from a lamp may send more of it into haze than the lamp itself does. ``most``: an error above it
    may be that of some of the media.
    """
    if not carriers:
        return 0.0
    ways = ways_of_light(materials)
    walls = reflected_radiance(scene, materials, lights_vary=lights_vary)
    error, sources = 0.0, cache(lambda: sources_in_view(scene))
    for material in carriers:
        if material.medium is not None and error <= most:
            scattered = optical_depth(scene, material) * largest_size(material.medium.color)
            error += error_of_medium(scene, material, ways, sources) + error_of_light(scattered * walls)
    return error


def error_of_volumes(
    scene: Scene, materials: list[Material], *, among_media: bool = False, lights_vary: bool = False
) -> float:
    """ΔE2000 of omitting all sampled volumes; infinite where one is dense. ``materials``: all that a ray may hit.
    ``among_media``: volumes are media then, which the light that surfaces reflect reaches, too.
    """
    ways = ways_of_light(materials)
    walls = reflected_radiance(scene, materials, lights_vary=lights_vary) if among_media else 0.0
    share, light, sources = 0.0, 0.0, cache(lambda: sources_in_view(scene))
    for volume in scene.volumes:
        box = placed(unit_box().positions, volume.world_from_index @ index_box(volume.data.shape))
        length = float(np.linalg.norm(np.ptp(box, axis=0)))
        depth, own, lit = (length * rate for rate in _rates(volume))
        if not depth <= DENSEST:
            return float("inf")
        share += ways * depth
        light += (ways - 1.0) * own
        if lit == 0.0:
            continue
        light += lit / length * sources().along(box, length) + lit * walls
        light += (
            lit
            * np.pi
            * abs(scene.world.strength)
            * (0.0 if scene.world.is_black else largest_light(scene.world.color))
        )
    return error_of_share(share) + error_of_light(light * scene.film.exposure)


def _rates(volume: VolumeObject) -> tuple[float, float, float]:
    """Largest extinction, light of its own, and light that it reflects of an irradiance of 1, all per world unit."""
    few = np.size(volume.data) <= MOST_VOXELS
    low, high = (float(np.min(volume.data)), float(np.max(volume.data))) if few else (-np.inf, np.inf)
    taken, own, lit = 0.0, 0.0, 0.0
    for material in volume.transfer.materials:
        inside = (material.values >= low) & (material.values <= high)
        emission = np.zeros_like(material.extinction) if material.emission is None else material.emission
        # linear between knots: the largest value is at one of them, or at an end of the data
        extinction, shining = (
            max([*curve[inside], *interpolate(np.array([low, high]), material.values, curve)])
            for curve in (material.extinction, emission)
        )
        source = extinction + shining
        raised = 1.0 if material.gradient_weights is None else float(material.gradient_weights.max())
        color = float(np.abs(material.color).max())
        taken += raised * extinction
        if material.lit and volume.lighting != "even":
            lit += raised * source * color
        else:
            own += raised * source * color
    return taken, own, lit
