# SPDX-License-Identifier: GPL-3.0-or-later
"""No setting of a palette is keyframed or driven: Blender tells nobody of such a change, and the table would show the
solution of other targets.
"""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

from blender_addon import compat
from blender_addon.properties.palette import answers as palette_answers
from blender_addon.properties.palette import cell as palette_cell
from blender_addon.properties.palette import table as palette

GROUPS = (*palette.CLASSES, *palette_cell.CLASSES, *palette_answers.CLASSES)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.__name__)
def test_no_setting_of_a_table_can_be_animated(registered, group) -> None:
    own = [each for each in group.bl_rna.properties if each.identifier in group.__annotations__]
    assert own
    assert [each.identifier for each in own if each.is_animatable and each.type not in ("POINTER", "COLLECTION")] == []


def test_a_keyframe_and_a_driver_of_a_cell_are_refused(blender) -> None:
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    cell = blender.context.scene.spectral.palette.materials[0].cells[1]
    with pytest.raises(TypeError, match="not animatable"):
        cell.keyframe_insert("target", frame=1)
    with pytest.raises(TypeError, match="not animatable"):
        cell.driver_add("weight")


def test_keyframes_of_an_earlier_version_change_nothing(blender) -> None:
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    scene = blender.context.scene
    table = scene.spectral.palette
    scene.keyframe_insert("audio_volume", frame=1)
    curves = compat.curves_of(scene.animation_data)[0]
    points = curves.new("spectral.palette.brightness").keyframe_points
    points.insert(1, 2.0)
    points.insert(10, 20.0)
    before = table.brightness
    scene.frame_set(7)
    assert table.brightness == before and not table.is_stale
