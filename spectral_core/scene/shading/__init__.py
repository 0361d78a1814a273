# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading programs: node trees as named operations that run where light meets a surface."""

from spectral_core.scene.shading.program import Builder, Computed, Instruction, Program, mean_of, run, step
from spectral_core.scene.shading.registry import OPERATIONS

__all__ = ["OPERATIONS", "Builder", "Computed", "Instruction", "Program", "mean_of", "run", "step"]
