# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as rows of weights: upper bound of strength, extent around the center, and directions of emission."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lights.emissive_meshes import geometry
from spectral_core.render.lights.hierarchy import FAR_SUN, FAR_WORLD, Rows, clusters
from spectral_core.render.lights.listing import Ball, EmissiveMesh, LightList, Panel

STEEPEST = 1e3
"""Largest slope of a beam's edge in the cosine: steeper edges behave the same, and 32 bits represent it."""
FLAT = 0.999
"""Cosine between the normals of a mesh from which it counts as flat."""
WIDE_SUN = 0.15
"""Half angle (radian) from which a sun's weight has no cosine: it lights surfaces that face away from its center."""


def rules_by_source(rules: Any, count: int, number_of: Callable[[Any], int] = int) -> NDArray[np.uint32]:
    """(sources, 2): the types of rays that a source does not illuminate, and its bit among the linked lights.

    ``rules``: the scene's ``RayRules``; ``number_of``: number of one of its lights, from 1.
    """
    found = np.zeros((count, 2), np.uint32)
    for light, bits in rules.lights:
        found[number_of(light) - 1, 0] |= bits
    for light, place in rules.links:
        found[number_of(light) - 1, 1] |= np.uint32(1 << place)
    return found


def near_rows(lights: LightList) -> Rows:
    """Lamps and triangles, in the order of items."""
    bright = lights.strengths()
    parts = [_ball(ball, bright[ball.source]) for ball in lights.balls]
    parts += [_panel(panel, bright[panel.source] / (panel.area if lights.even else 1.0)) for panel in lights.panels]
    parts += [_emissive(mesh, bright[mesh.source], even=lights.even) for mesh in lights.emissive]
    return Rows.joined(parts) if parts else _rows([], [], [])


def far_rows(lights: LightList) -> Rows:
    """Suns and the environment, by irradiance; equal ones for an even choice."""
    bright, centers, radii, strengths = lights.strengths(), [], [], []
    for sun in lights.suns:
        size = np.pi * np.sin(sun.half_angle) ** 2 if sun.half_angle > 0 else 1.0
        centers.append(sun.direction)
        radii.append(FAR_WORLD if sun.half_angle > WIDE_SUN else FAR_SUN)
        strengths.append(1.0 if lights.even else bright[sun.source] * size)
    if lights.world is not None:
        centers.append(np.zeros(3))
        radii.append(FAR_WORLD)
        others = lights.balls or lights.panels or lights.emissive or lights.suns
        strength = world_strength(lights.world[1], constant=lights.world_is_constant, alone=not others)
        strengths.append(1.0 if lights.even else strength)
    return _rows(centers, radii, strengths)


def world_strength(irradiance: float, *, constant: bool, alone: bool) -> float:
    """Strength of the environment: a constant one is hit by every direction that a surface draws, so that sampling it
    separately gains nothing beside other lights.
    """
    return irradiance if alone or not constant else 0.0


def far_row(irradiance: float) -> Rows:
    """The row of an environment."""
    return _rows([np.zeros(3)], [FAR_WORLD], [irradiance])


def usual_lamp(lights: LightList) -> NDArray[np.float64] | None:
    """Center and half of the extent (4,) of all lamps, whose distance suns and the environment get in an even choice;
    None where their distance does not count.
    """
    places = [ball.center for ball in lights.balls] + [panel.center for panel in lights.panels]
    places += [mesh.corners.mean(axis=(0, 1)) for mesh in lights.emissive]
    if not lights.even or not places:
        return None
    return np.append(np.mean(places, axis=0), float(np.linalg.norm(np.ptp(places, axis=0))) / 2)


def _rows(centers: list, radii: list, strengths: list) -> Rows:
    count = len(centers)
    return Rows(
        np.array(centers, dtype=np.float64).reshape(count, 3),
        np.array(radii, dtype=np.float64),
        np.array(strengths, dtype=np.float64),
        np.zeros((count, 3)),
        np.ones(count),
        np.zeros(count),
        np.zeros(count, bool),
    )


def _beamed(rows: Rows, axis: np.ndarray, cosine: float, steep: float) -> Rows:
    """The same row for light around an axis only: zero below ``cosine``, rising to full strength within 1 /
    ``steep``.
    """
    steep = min(steep, STEEPEST)
    # slightly wider than the beam, for rounding errors
    offset = np.array([-(cosine - 1e-3) * steep])
    return Rows(rows.centers, rows.radii, rows.strengths, axis[None] * steep, offset, rows.least, rows.two_sided)


def _ball(ball: Ball, intensity: float) -> Rows:
    beam = ball.beam
    peak = 1.0 if beam.photometry is None else float(np.abs(beam.photometry.strength).max())
    rows = _rows([ball.center], [max(ball.radius, 0.0)], [intensity * peak])
    lengths = np.linalg.norm(beam.axes, axis=1)
    if beam.cosine < -1 or np.ptp(lengths) > 1e-6 * lengths.max():  # stretched cones count as lamps without a cone
        return rows
    return _beamed(rows, beam.axes[2] / lengths[2], beam.cosine, 1 / beam.softness)


def _panel(panel: Panel, radiance: float) -> Rows:
    tangent, gain = panel.spread
    reach = np.linalg.norm(panel.half_axes[:, 0] + panel.half_axes[:, 1] * np.array([[1.0], [-1.0]]), axis=1).max()
    rows = _rows([panel.center], [reach], [radiance * panel.area * gain])
    if tangent <= 0:
        return _beamed(rows, panel.normal, 1e-3, 1.0)
    cosine = 1 / np.hypot(1, tangent)
    return _beamed(rows, panel.normal, cosine, 1 / (1 - cosine))


def _emissive(mesh: EmissiveMesh, radiance: float, *, even: bool) -> Rows:
    normals, areas = geometry(mesh.corners)
    strengths = areas * radiance * mesh.brightness
    if even:  # the whole object counts as one lamp
        strengths = areas * mesh.brightness / max(float((areas * mesh.brightness).sum()), 1e-300)
    centers = mesh.corners.mean(axis=1)
    reach = np.linalg.norm(mesh.corners - centers[:, None], axis=2).max(axis=1)
    count = len(areas)
    return Rows(
        centers,
        reach,
        strengths,
        normals,
        np.zeros(count),
        np.full(count, 0.01),
        np.ones(count, bool),
    )


def whole_row(corners: NDArray[np.float64]) -> Rows:
    """One row for an emissive mesh with triangles (t, 3, 3), for a brightness of 1."""
    triangles = _emissive(EmissiveMesh(0, corners, None, None, np.ones(len(corners))), 1.0, even=False)
    row = clusters(triangles, np.array([0]), np.array([len(corners)]))
    normal = triangles.axes[np.argmax(triangles.strengths)]
    if np.abs(triangles.axes @ normal).min() < FLAT:
        return row
    return replace(row, axes=normal[None], offsets=np.zeros(1), two_sided=np.ones(1, bool))
