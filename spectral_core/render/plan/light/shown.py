# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera may see, however small it is in the picture: a mean over the picture, or a pilot's few rays, miss it.

A small emissive object, mirror or body of glass is lost as a whole without its effect: it is black.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.in_view import may_be_in_view, points_in_view
from spectral_core.render.plan import bounds
from spectral_core.render.plan.light.sources import emitted_by
from spectral_core.render.plan.pilot import Pilot
from spectral_core.scene import (
    Glass,
    Glossy,
    Material,
    Metal,
    Principled,
    Rays,
    Scene,
    SunLight,
    Transparent,
    leaves,
)
from spectral_core.scene.geometry import corners_of, index_box, placed, placed_boxes, unit_box
from spectral_core.spectra.color import luminance_from_linear_rgb

Array = NDArray[np.float64]

FAR = 1e9
"""Distance of a sun."""
MOST_LOST = 0.1
"""Largest part that may be lost of what mirrors, or bodies of glass, show."""
LEAST = {"glossy": 1, "transmission": 2}
"""Bounces of each type without which a mirror, or a body of glass, is black."""


def points_beside_surfaces(scene: Scene) -> Array:
    """(n, 3) points of the lamps and sampled volumes that the camera sees: they may be out of focus, too. None for a
    closed aperture, which has no focus.
    """
    if scene.camera.aperture_radius <= 0:
        return np.zeros((0, 3))
    eye = scene.camera.world_from_camera[:3, 3]
    found = [np.zeros((0, 3))]
    for light in scene.lights:
        matrix = light.world_from_light
        if light.camera_visible:
            place = eye + FAR * matrix[:3, 2] if isinstance(light, SunLight) else matrix[:3, 3]
            if may_be_in_view(scene.camera, scene.film, corners_of(place[None])):
                found.append(place[None])
    boxes = [placed(unit_box().positions, each.world_from_index @ index_box(each.data.shape)) for each in scene.volumes]
    return np.concatenate([*found, points_in_view(scene.camera, scene.film, boxes)])


def in_view(scene: Scene, names: Collection[str]) -> set[str]:
    """Those of the materials of ``names`` that an object which the camera may see has."""
    wanted = set(names)
    found: set[str] = set()
    shown = [each for each in scene.instances if not each.hidden_from & Rays.CAMERA and wanted & {*each.materials}]
    for item, box in zip(shown, placed_boxes(scene.meshes, shown), strict=True):
        own = wanted & {*item.materials}
        if not own <= found and may_be_in_view(scene.camera, scene.film, box):
            found |= own
    return found


def emission_in_view(scene: Scene, materials: list[Material]) -> float:
    """Largest radiance of the emissive surfaces that the camera may see: a small lamp of a device is lost as a whole,
    and too small for a mean of the picture.
    """
    emitted = {each.name: emitted_by(each) for each in materials}
    shown = in_view(scene, {name for name, radiance in emitted.items() if radiance > 0})
    return max((emitted[name] for name in shown), default=0.0)


def bodies_in_view(scene: Scene, materials: list[Material]) -> frozenset[str]:
    """Types of bounces (``LEAST``) without which a surface that the camera may see shows nothing."""
    kinds = {each.name: kind for each in materials if (kind := _shows_only(each))}
    return frozenset().union(*(kinds[name] for name in in_view(scene, kinds)))


def _shows_only(material: Material) -> frozenset[str]:
    """Types of the bounces by which a surface shows other things, none if it has a color of its own."""
    found: set[str] = set()
    for leaf in leaves(material.surface):
        if isinstance(leaf, (Glossy, Metal)) or (isinstance(leaf, Principled) and _is_most(leaf.metallic)):
            found.add("glossy")
        elif isinstance(leaf, Glass) or (isinstance(leaf, Principled) and _is_most(leaf.transmission)):
            found.add("transmission")
        elif not isinstance(leaf, Transparent):
            return frozenset()
    return frozenset(found)


def _is_most(share: object) -> bool:
    return not isinstance(share, (int, float)) or share > 0.5


def error_of_bodies(pilot: Pilot, kind: str, most: int) -> float:
    """ΔE2000 of the pixels of a mirror (``kind`` "glossy") or a body of glass ("transmission") after ``most`` bounces:
    of the part that is lost of all light after such bounces, if that is visible at all.
    """
    whole, lost = (float(luminance_from_linear_rgb(pilot.beyond(kind, each)[..., :3].sum(axis=(0, 1, 2))))
                   for each in (0, most))  # fmt: skip
    share = lost / whole if whole > 0 else float(most < LEAST[kind])
    return bounds.error_of_share(share) if share > MOST_LOST or most < LEAST[kind] else 0.0
