# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside a real Blender: solve a palette and render Blender's startup scene."""

import tempfile
from pathlib import Path

import bpy

from spectral_core.palette import presets, solve_palette

print("STATUS", solve_palette(presets.hidden_mark()).status)
scene = bpy.context.scene
scene.render.engine = "SPECTRAL"
scene.render.resolution_x, scene.render.resolution_y = 64, 48
scene.spectral.render.samples = 4
with tempfile.TemporaryDirectory() as folder:
    scene.render.filepath = str(Path(folder) / "picture.png")
    print("RENDERED", bpy.ops.render.render(write_still=True))
