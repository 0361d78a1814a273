# SPDX-License-Identifier: GPL-3.0-or-later
"""A recording under a look that shows no light names the look."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


def lit_alone(stage, kind):
    """Make "Key" the only light of a palette's light and of a light group, and look under one of these."""
    column = stage.spectral.palette.lights.add()
    column.name, column.light = "Street", bpy.data.lights["Key"]
    bpy.context.view_layer.lightgroups.add(name="Rim")
    bpy.data.objects["Key"].lightgroup = "Rim"
    look = stage.spectral.viewport.look
    look.kind, look.column, look.group = kind, "Street", "Rim"


@pytest.mark.parametrize(
    ("kind", "named"), [("COLUMN", "the palette's light 'Street'"), ("GROUP", "the light group 'Rim'")]
)
@pytest.mark.parametrize("dark", [True, False])
def test_a_look_at_a_dark_lamp_is_named(stage, kind, named, dark):
    """The message was to add a light, in a scene of four."""
    lit_alone(stage, kind)
    if not dark:
        bpy.ops.spectral.dial_record()
        assert len(stage.spectral.dial.bulbs) == 1
        return
    bpy.data.lights["Key"].energy = 0
    with pytest.raises(RuntimeError, match=f"Look Under shows {named} alone, which gives no light.*choose As It Is"):
        bpy.ops.spectral.dial_record()


def test_a_scene_without_light_is_told_to_get_one(stage):
    for name in ("Key", "Fill", "Ball"):
        bpy.data.objects.remove(bpy.data.objects[name])
    stage.world = None
    with pytest.raises(RuntimeError, match="the scene has no light.*add one"):
        bpy.ops.spectral.dial_record()
