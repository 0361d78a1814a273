# SPDX-License-Identifier: GPL-3.0-or-later
"""A second preset, or another change with a solve, while the first one is being solved."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

from blender_addon.operators.palette_solve import Solving
from blender_addon.translate.palette import load
from spectral_core.errors import InvalidInputError
from spectral_core.palette import presets


class Preset(Solving):
    """The operator, without Blender."""

    bl_label = "Palette Preset"

    def __init__(self, name):
        self.name, self.reports = name, []

    def change(self, context):
        if self.name == "none":
            raise InvalidInputError("no such preset")
        load.store_problem(context.scene.spectral.palette, getattr(presets, self.name)())

    def report(self, kind, text):
        self.reports.append((kind, text))


@pytest.mark.parametrize("first_ends", ["before", "after"])
def test_a_solve_that_another_one_overtakes_reports_nothing_and_leaves_no_undo_step(blender, first_ends):
    """It reported "the table has changed since; press Solve again", also after the second one had solved the table."""
    first, second = Preset("metamer_pair"), Preset("hidden_mark")
    context = blender.context
    work = first._begin(context)
    later = second._begin(context)
    if first_ends == "before":
        assert first._ended(context.scene, work()) == {"CANCELLED"}
    assert second._ended(context.scene, later()) == {"FINISHED"}
    if first_ends == "after":
        assert first._ended(context.scene, work()) == {"CANCELLED"}
    assert first.reports == second.reports == []
    palette = context.scene.spectral.palette
    assert [row.name for row in palette.materials] == ["mark", "ground"]
    assert palette.status and not palette.is_stale and not palette.message


def test_a_solve_is_not_overtaken_by_one_that_could_not_begin(blender):
    first, wrong = Preset("metamer_pair"), Preset("none")
    work = first._begin(blender.context)
    with pytest.raises(InvalidInputError, match="no such preset"):
        wrong._begin(blender.context)
    assert wrong.refused(InvalidInputError("no such preset")) == {"CANCELLED"}
    assert wrong.reports == [({"ERROR"}, "no such preset")]
    assert first._ended(blender.context.scene, work()) == {"FINISHED"}


def test_a_table_that_is_edited_during_a_solve_is_still_reported(blender):
    first = Preset("metamer_pair")
    work = first._begin(blender.context)
    blender.ops.spectral.palette_remove(side="MATERIAL", index=0)
    first._ended(blender.context.scene, work())
    assert first.reports == [({"ERROR"}, "the table has changed since; press Solve again")]


def test_the_recipe_of_earlier_settings_does_not_replace_a_later_one(blender):
    """A slow search of an earlier press replaced the recipe: that of other settings than the panel showed."""
    from blender_addon.editing.waiting import Waiting
    from blender_addon.operators.design.recipe import SPECTRAL_OT_recipe_find as Found

    class Find(Waiting):
        begin, end, result_of, bl_label = Found.begin, Found.end, Found.result_of, Found.bl_label

        def report(self, kind, text):
            raise AssertionError(text)

    settings = blender.context.scene.spectral.recipe
    first, second = Find(), Find()
    settings.cct = 2700
    slow = first._begin(blender.context)
    settings.cct = 6500
    fast = second._begin(blender.context)
    answer = fast()
    assert second._ended(blender.context.scene, answer) == {"FINISHED"}
    assert first._ended(blender.context.scene, slow()) == {"CANCELLED"}
    assert settings.text == answer.text
