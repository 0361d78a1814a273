# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading programs: node trees as named operations that are evaluated at a hit point."""

from spectral_core.scene.shading.program import (
    Builder,
    Computed,
    Instruction,
    OnRaised,
    Program,
    Raised,
    mean_of,
    run,
    step,
)
from spectral_core.scene.shading.registry import OPERATIONS, SENDS_RAYS, SMOOTH_NORMAL, UV_SIGN, UV_TANGENT

__all__ = [
    "OPERATIONS",
    "SENDS_RAYS",
    "SMOOTH_NORMAL",
    "UV_SIGN",
    "UV_TANGENT",
    "Builder",
    "Computed",
    "Instruction",
    "OnRaised",
    "Program",
    "Raised",
    "mean_of",
    "run",
    "step",
]
