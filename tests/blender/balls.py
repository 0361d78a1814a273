# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls of several materials in one picture, rendered by Cycles and by this renderer: one compilation for all."""

from __future__ import annotations

import pytest

from tests.blender import cycles

bpy = pytest.importorskip("bpy")

CELL, APART = 24, 3.25
INNER = slice(6, 18)
"""Pixels of each ball, and the distance between two; rows and columns of a ball's own pixels."""


def emptied():
    """A new empty file, as the fixture ``blender`` makes it for each test."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


def means(picture):
    """Mean color (3,) of each ball."""
    cells = picture[INNER].reshape(INNER.stop - INNER.start, -1, CELL, 3)
    return cells[:, :, INNER].mean((0, 2))


def shown(materials, builders, folder, samples):
    """Colors of the balls by the name of their material, of Cycles and of this renderer, and the notes.

    The balls stand in a row under the sun and a colored sky; none is in the shadow of another.
    """
    from blender_addon import compat

    cycles.settings(samples, CELL)
    bpy.context.scene.render.resolution_x = CELL * len(materials)
    for number, material in enumerate(materials.values()):
        x = APART * (number - (len(materials) - 1) / 2)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=1, location=(x, 0, 0))
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material)
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    background = next(node for node in compat.use_nodes(world).nodes if node.type == "BACKGROUND")
    background.inputs[0].default_value, background.inputs[1].default_value = (0.4, 0.5, 0.7, 1), 0.7
    sun = builders.light("SUN", energy=1.0, location=(2.5, -2.5, 3.5), angle=0.9)
    sun.rotation_euler = (-sun.location).to_track_quat("-Z", "Y").to_euler()
    camera = builders.camera((0, -6, 2), type="ORTHO", ortho_scale=APART * len(materials))
    camera.rotation_euler = (-camera.location).to_track_quat("-Z", "Y").to_euler()
    theirs, (ours, notes) = cycles.cycles(folder), cycles.ours(samples)
    return dict(zip(materials, zip(means(theirs), means(ours), strict=True), strict=True)), notes
