# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks on a hit with the type of its ray, which shading programs read (Light Path).

Nothing here reads the derivatives of normals, so ``dn_dv`` holds three marks: the type of ray; the counts of bounces,
of diffuse and of glossy ones; surfaces passed straight and transmissions. A hit without marks comes from Mitsuba
itself, or from sampling a light: every output for it is 0.

As nothing moves while a ray is traced, the ``time`` of a ray and a hit holds a length: the way from the last bounce to
the ray's origin. It is 0 in scenes without a program that reads ``LENGTH``.
"""

from __future__ import annotations

from typing import Any

from spectral_core.scene.rays import Rays

SINGULAR = 64
"""Bit beside the types of rays: the last bounce was at a mirror or smooth glass."""
SHARP = 128
"""Another bit: the ray comes from the camera, from a mirror, or from a lobe that is narrower than the pixels of an
environment by little, so that details of the environment show.
"""
TRANSLUCENT = 1 << 10
"""Another bit, of a transmitted ray: it was transmitted diffusely. As in Cycles, lights and caustics count it as a
diffuse ray, objects as a transmitted one.
"""
SHARP_DENSITY = 1600.0
"""Density of the last bounce (1/sr) from which its lobe is that narrow: 16 pixels of an environment of 512 rows."""
LENGTH = "Ray Length"
"""Output that counts from the last bounce, past all surfaces that the ray has passed straight."""
COUNT, PASSED = 255, 1023
"""Largest counts that the marks represent."""


def is_diffuse(kind: Any) -> Any:
    """True for rays (``kind``: of a path) along which a surface scatters diffuse light, on either of its sides."""
    return (kind & (int(Rays.DIFFUSE) | TRANSLUCENT)) != 0


def ray_marks(mi: Any, dr: Any, path: Any) -> Any:
    """Marks of a path's ray."""

    def count(value: Any, most: int = COUNT) -> Any:
        return mi.Float(dr.minimum(value, most))

    sharp = path.before_delta & (path.depth > 0)
    kind = path.kind | dr.select(sharp, mi.UInt32(SINGULAR), 0)
    kind |= dr.select(path.before_delta | (path.before_pdf > SHARP_DENSITY), mi.UInt32(SHARP), 0)
    bounces = count(path.depth) + 256.0 * count(path.diffuse) + 65536.0 * count(path.glossy)
    return mi.Vector3f(mi.Float(kind), bounces, count(path.passed, PASSED) + 1024.0 * count(path.transmission))


def shadow_marks(mi: Any, marks: Any) -> Any:
    """Marks of a ray to a light, from a hit of a ray with ``marks``."""
    return mi.Vector3f(mi.Float(int(Rays.SHADOW)), marks.y + 1.0, marks.z)


def camera_marks(mi: Any) -> Any:
    """Marks of a ray from the camera."""
    return mi.Vector3f(float(int(Rays.CAMERA) | SHARP), 0.0, 0.0)


def is_sharp(mi: Any, si: Any) -> Any:
    """True if a ray shows the details of an environment."""
    return (mi.UInt32(si.dn_dv.x) & SHARP) != 0


def is_directed(mi: Any, si: Any) -> Any:
    """True if the last bounce of a ray was at a glossy or transmitting lobe."""
    marks = mi.UInt32(si.dn_dv.x)
    return ((marks & int(Rays.GLOSSY | Rays.TRANSMISSION)) != 0) & ~is_diffuse(marks)


KINDS = {
    "Is Camera Ray": Rays.CAMERA, "Is Shadow Ray": Rays.SHADOW, "Is Diffuse Ray": Rays.DIFFUSE | TRANSLUCENT,
    "Is Glossy Ray": Rays.GLOSSY | Rays.TRANSMISSION, "Is Singular Ray": SINGULAR,
    "Is Reflection Ray": Rays.DIFFUSE | Rays.GLOSSY, "Is Transmission Ray": Rays.TRANSMISSION,
    "Is Volume Scatter Ray": Rays.VOLUME,
}  # fmt: skip
COUNTS = {
    "Ray Depth": ("y", 0, COUNT), "Diffuse Depth": ("y", 8, COUNT), "Glossy Depth": ("y", 16, COUNT),
    "Transparent Depth": ("z", 0, PASSED), "Transmission Depth": ("z", 10, COUNT),
}  # fmt: skip


def read_mark(mi: Any, dr: Any, si: Any, name: str) -> Any:
    """Value of the Light Path node's output ``name`` at a hit."""
    if name == LENGTH:
        return dr.select(dr.isfinite(si.t), si.time + si.t, 0.0)
    if name in KINDS:
        marks = mi.UInt32(si.dn_dv.x)
        found = (marks & int(KINDS[name])) != 0
        if name == "Is Glossy Ray":
            found &= (marks & TRANSLUCENT) == 0
        return dr.select(found, mi.Float(1.0), 0.0)
    component, shift, most = COUNTS[name]
    return mi.Float((mi.UInt32(getattr(si.dn_dv, component)) >> shift) & most)
