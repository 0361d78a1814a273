# SPDX-License-Identifier: GPL-3.0-or-later
"""Attribute ``velocity`` of geometry, by which Cycles blurs fluids, caches and points whose number changes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.scene import Mesh

NAME = "velocity"
READ = "velocity"
"""Name of the attribute in a ``Mesh``; in units of the object per second. No shading program reads it: for those Cycles
keeps the attribute's name for the grids of a volume.
"""


def velocity_read(found: Any, data: Any) -> frozenset[str]:
    """The inputs of a mesh that its motion needs: its velocity, in renders with motion blur."""
    if found.kept is not None or not found.translation.scene.render.use_motion_blur:
        return frozenset()
    stored = data.attributes.get(NAME)
    fits = stored is not None and (stored.domain, stored.data_type) == ("POINT", "FLOAT_VECTOR")
    return frozenset({READ}) if fits else frozenset()


def flown(mesh: Mesh, seconds: float) -> Mesh | None:
    """The mesh a time after the middle of the shutter's open time; None without velocities."""
    speed = next((attribute.values for attribute in mesh.attributes if attribute.name == READ), None)
    return None if speed is None else replace(mesh, positions=(mesh.positions + speed * seconds).astype("float32"))
