# SPDX-License-Identifier: GPL-3.0-or-later
"""A second preset, or another change with a solve, while the first one is being solved."""

from __future__ import annotations

import threading

import pytest

pytest.importorskip("bpy")

from blender_addon.operators.palette.solve import Solving
from blender_addon.translate.palette import load
from spectral_core.errors import InvalidInputError, RenderCancelled
from spectral_core.palette import presets


class Preset(Solving):
    """The operator, without Blender."""

    bl_label = "Palette Preset"

    def __init__(self, name):
        self.name, self.reports, self.stopping = name, [], threading.Event()

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

        def __init__(self):
            self.stopping = threading.Event()

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


def test_a_search_that_is_stopped_keeps_the_earlier_recipe(blender):
    """The status bar said that nothing has changed, and the earlier recipe was gone, also from Undo."""
    from blender_addon.editing import recipe
    from blender_addon.editing.waiting import Waiting
    from blender_addon.operators.design.recipe import SPECTRAL_OT_recipe_find as Found

    class Find(Waiting):
        begin, failed, result_of, stopped_text = Found.begin, Found.failed, Found.result_of, Found.stopped_text

        def __init__(self):
            self.stopping, self.reports = threading.Event(), []

        def report(self, kind, text):
            self.reports.append(text)

    scene = blender.context.scene
    before = {"text": "blue 470 nm  12 %", "met": True, "found_kind": "LAMP", "spectrum": "{}"}
    recipe.put_back(scene, before)
    find = Find()
    find._begin(blender.context)
    assert scene.spectral.recipe.text == ""  # while it is searched
    find.stop()
    assert find._ended(scene, RenderCancelled(find.stopped_text)) == {"CANCELLED"}
    assert recipe.result_of(scene) == before and find.reports == ["stopped; nothing has changed"]
