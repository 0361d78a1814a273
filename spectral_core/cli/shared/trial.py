# SPDX-License-Identifier: GPL-3.0-or-later
"""Trials that ``doctor`` runs in a separate process: ``render`` a few pixels; ``bpy``: start Blender's module."""

from __future__ import annotations

import importlib
import sys

MARK = "TRIAL "
"""Prefix of the answer, because libraries print other lines."""


def _render() -> str:
    import numpy as np

    from spectral_core.render import render_scene
    from spectral_core.scene import Camera, Film, Scene, World, gray

    camera, film = Camera(world_from_camera=np.eye(4)), Film(2, 2, samples=1)
    result = render_scene(Scene(camera=camera, film=film, world=World(gray(1.0))))
    import drjit as dr
    import mitsuba as mi

    dr.eval(dr.maximum(dr.opaque(mi.Float, 1.0), 0.5))  # an LLVM that is too old cannot compile this
    return result.variant


def _bpy() -> str:
    bpy = importlib.import_module("bpy")  # by name: the core itself knows no Blender
    return str(bpy.app.version_string)


if __name__ == "__main__":
    print(MARK + {"render": _render, "bpy": _bpy}[sys.argv[1]]())
