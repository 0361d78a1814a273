# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds on the color error of omitting an effect, from a scene's data alone.

Errors are ΔE2000 relative to a white of radiance 1 (after the film's exposure), for the worst color.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lens.aperture import width_of_lens
from spectral_core.render.lens.in_view import pixels_per_unit, points_in_view
from spectral_core.render.plan.light.sizes import largest_light, largest_size
from spectral_core.render.plan.light.sources import AT_ONCE, Sources, lamps_of, least_distances, sources_of
from spectral_core.scene import Instance, Material, PointLight, ScatteringMedium, Scene, SpotLight, leaves
from spectral_core.scene.geometry import box_of, placed, placed_boxes
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

_GRAYS = np.geomspace(1e-3, 1.0, 25)
EDGE_CURVATURE = 6.2
"""ΔE2000 at the sharpest edge for a blur of c pixels, over c²: an edge from black to white under the pixel filter
(standard deviation 0.35 pixels) changes by half the blur's variance, c²/16, times its largest second derivative."""
_EVERYTHING = 100.0
BLURRED = 1e4
"""Pixels of a blur that is as large as any."""


def error_of_share(share: float) -> float:
    """ΔE2000 of losing a share of the light, at the gray with the largest error."""
    share = min(max(share, 0.0), 1.0)
    return _largest(_GRAYS, _GRAYS * (1 - share))


def error_of_light(radiance: float) -> float:
    """ΔE2000 of losing some radiance, at the gray with the largest error: without any other light."""
    radiance = min(max(radiance, 0.0), 1e6)
    base = np.concatenate([[0.0], _GRAYS])
    return _largest(base, base + radiance)


def _largest(first: Array, second: Array) -> float:
    lab = [lab_from_linear_rgb(np.repeat(levels[:, None], 3, axis=1)) for levels in (first, second)]
    return float(delta_e_2000(*lab).max())


def error_of_blur(pixels: float) -> float:
    """ΔE2000 of omitting a blur of a diameter in pixels, at the sharpest possible edge."""
    return min(EDGE_CURVATURE * pixels * pixels, _EVERYTHING)


def _shrinks(scene: Scene) -> bool:
    """True if what is farther is smaller in the picture."""
    return scene.camera.kind != "orthographic"


def corners(scene: Scene, instance: Instance) -> Array:
    """(8, 3) corners of the box around a placed mesh; (0, 3) for one without vertices."""
    mesh = next(mesh for mesh in scene.meshes if mesh.name == instance.mesh)
    return placed(box_of(mesh), instance.world_from_object)


def seen_points(scene: Scene) -> Array:
    """(n, 3) corners of the boxes of all objects, as far as the camera sees them: what it sees lies between them."""
    return points_in_view(scene.camera, scene.film, placed_boxes(scene.meshes, scene.instances))


def depths(scene: Scene, points: Array) -> Array:
    """Distances of points along the camera's axis, only of those in front of it; of a panorama in any direction."""
    view = scene.camera.world_from_camera
    if scene.camera.kind == "panoramic":
        away = np.linalg.norm(points - view[:3, 3], axis=1)
        return np.asarray(away[away > scene.camera.near])
    back = view[:3, 2] / np.linalg.norm(view[:3, 2])
    along = -(points - view[:3, 3]) @ back
    return np.asarray(along[along > scene.camera.near])


def blur_of_lens(scene: Scene, points: Array, *, further: bool = False) -> float:
    """Largest circle of confusion, in pixels, at any of the points that the camera sees; ``further``: it also sees
    what lies at any distance behind them, in mirrors, through glass or through portals.
    """
    camera = scene.camera
    along = depths(scene, points)
    if camera.aperture_radius <= 0 or not len(along):
        return 0.0
    if further or not scene.world.is_black or scene.world.camera_view is not None:  # a sharp detail may be far away
        along = np.append(along, 1e9)
    spread = width_of_lens(camera) * np.abs(along / camera.focus_distance - 1)
    spread = spread / along if _shrinks(scene) else spread
    return float(pixels_per_unit(scene.camera, scene.film) * spread.max())


def blur_of_lamps(scene: Scene, lamps: Sequence[PointLight | SpotLight], points: Array, boxes: list[Array]) -> float:
    """Largest penumbra of ball lamps, in pixels, with the occluder (of ``placed_boxes``) at its nearest position.

    From ``BLURRED`` pixels on no further lamp is looked at.
    """
    along = depths(scene, points)
    placed = np.concatenate(boxes) if boxes else np.zeros((0, 3))
    if not len(placed) or not len(along):
        return 0.0
    scale = pixels_per_unit(scene.camera, scene.film) / (float(along.min()) if _shrinks(scene) else 1.0)
    centers, radii = (
        np.array([each.world_from_light[:3, 3] for each in lamps]),
        np.array([each.radius for each in lamps]),
    )
    blur, step = 0.0, max(1, AT_ONCE // len(placed))
    for first in range(0, len(lamps), step):
        some, radius = centers[first : first + step], radii[first : first + step]
        nearest = least_distances(some, boxes)
        reach = np.linalg.norm(some[:, None] - placed, axis=2).max(axis=1)
        width = np.where(nearest <= 2 * radius, np.inf, 2 * radius * reach / np.maximum(nearest, 1e-150))
        blur = max(blur, float(scale * width.max()))
        if blur >= BLURRED:
            break
    return blur


def spread_of_dispersion(scene: Scene, materials: list[Material], points: Array) -> float:
    """Distance in pixels between the ends of the spectrum after dispersive glass, at moderate angles."""
    change = 0.0
    for material in materials:
        for leaf in leaves(material.surface):
            index = getattr(leaf, "ior", None)
            if isinstance(index, Spectrum):
                knots = index.grid.wavelengths_nm
                visible = index.at(np.clip(np.linspace(420, 680, 53), knots[0], knots[-1]))
                change = max(change, float(np.ptp(visible)))
    along = depths(scene, points)
    if change == 0.0 or not len(along):
        return 0.0
    size = float(np.linalg.norm(np.ptp(np.concatenate(placed_boxes(scene.meshes, scene.instances)), axis=0)))
    scale = pixels_per_unit(scene.camera, scene.film)
    # two surfaces, each deflecting light by the change of index times the tangent of the angle, 2 at 63 degrees
    reach = max(1.0, size / float(along.min())) if _shrinks(scene) else size
    return 2 * 2 * change * scale * reach


def optical_depth(scene: Scene, material: Material) -> float:
    """Largest optical depth of a material's medium: a path may pass all of its boxes, each from corner to corner."""
    boxes = (corners(scene, item) for item in scene.instances if material.name in item.materials)
    return _extinction(material) * sum(float(np.linalg.norm(np.ptp(box, axis=0))) for box in boxes if len(box))


def _extinction(material: Material) -> float:
    """Largest extinction of a material's medium, per unit of length."""
    medium = material.medium
    if medium is None:
        return 0.0
    return max(medium.density, 0.0) * (1.0 if medium.extinction is None else largest_size(medium.extinction))


def sources_in_view(scene: Scene) -> Sources:
    """The sources of a scene, with the size of the camera's pixels at each lamp."""
    away = np.linalg.norm(lamps_of(scene.lights).centers - scene.camera.world_from_camera[:3, 3], axis=1)
    sizes = away if _shrinks(scene) else np.ones(len(away))
    return sources_of(scene, sizes / pixels_per_unit(scene.camera, scene.film) / 2)


def error_of_medium(
    scene: Scene, material: Material, ways: float = 2.0, sources: Callable[[], Sources] | None = None
) -> float:
    """ΔE2000 of omitting a medium: the light that it absorbs, and the light that it scatters to the camera.

    At most the optical depth is lost on each straight way of a path (``ways``). The light that is scattered toward the
    camera is the integral of lamp irradiance over the path: π · intensity over the least distance between a ray and a
    lamp inside the box; irradiance at the nearest corner times the length for a lamp outside. ``sources``: those of
    ``sources_in_view``, which several media of a scene share.
    """
    medium = material.medium
    if medium is None:
        return 0.0
    depth = optical_depth(scene, material)
    if depth > 0.2:
        return _EVERYTHING
    phase = _forward(medium)
    scattering = _extinction(material) * largest_size(medium.color)
    shining = sources() if sources is not None else sources_in_view(scene)
    added = 0.0
    for item in scene.instances:
        if material.name not in item.materials or not len(box := corners(scene, item)):
            continue
        length = float(np.linalg.norm(np.ptp(box, axis=0)))
        added += (ways - 1.0) * medium.emission_strength * largest_light(medium.emission_color) * length
        added += scattering * phase * shining.along(box, length)
        added += (
            0.0
            if scene.world.is_black
            else scattering * length * abs(scene.world.strength) * largest_light(scene.world.color)
        )
    return error_of_share(ways * depth) + error_of_light(1.5 * added * scene.film.exposure)


def _forward(medium: ScatteringMedium) -> float:
    """Largest value of a medium's phase function, per sr."""

    def largest(g: float, alpha: float) -> float:
        g = min(abs(g), 0.99)
        return (1 + g) / (1 - g) ** 2 / (4 * np.pi) * (1 + alpha) / (1 + alpha * (1 + 2 * g * g) / 3)

    if medium.lobes:
        return sum(weight * largest(g, alpha) for weight, g, alpha in medium.lobes)
    return largest(medium.anisotropy, 0.0)
