# SPDX-License-Identifier: GPL-3.0-or-later
"""The button Possible? of a selected cell, and the use of the nearest color."""

from __future__ import annotations

import re
from concurrent.futures import wait
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.editing.palette import live
from blender_addon.editing.palette.possible import picture_of
from spectral_core.errors import InvalidInputError


@pytest.fixture
def palette(blender):
    blender.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    return blender.context.scene.spectral.palette


def test_an_impossible_color_is_reported_drawn_and_replaced_by_the_nearest(blender, palette) -> None:
    palette.active_row, palette.active_column = 0, 1
    cell = palette.materials[0].cells[1]
    palette.materials[0].cells[0].mode = "FIXED"
    palette.materials[0].cells[0].exact = True
    cell.mode, cell.target = "FIXED", (0.0, 1.0, 0.0)
    blender.ops.spectral.palette_possible()
    answer = palette.possible
    assert not answer.reachable
    assert "Not possible; the color that is nearest in CIELAB" in answer.words
    assert "Conflict: the exact color under" in answer.words
    picture = picture_of(blender.context.scene)
    assert picture.shape[2] == 4
    assert np.isfinite(picture).all()
    blender.ops.spectral.palette_take_nearest()
    blender.ops.spectral.palette_possible()
    assert palette.possible.words.startswith("Possible.")
    assert palette.possible.reachable
    with pytest.raises(RuntimeError, match="no cell is selected"):
        blender.ops.spectral.palette_clear()
        blender.ops.spectral.palette_possible()


def test_a_conflict_is_not_said_to_end_at_a_greater_distance(blender) -> None:
    """The color that is nearest in CIELAB may be farther away in ΔE2000 after a cell is released."""
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    cell = selected(palette, 0, 0)
    cell.mode, cell.target = "FIXED", (0.1, 0.7, 0.15)
    blender.ops.spectral.palette_possible()
    first, *others = palette.possible.words.splitlines()
    now = float(re.search(r"ΔE2000 (\d+\.\d) away", first)[1])
    for line in others:
        remaining = re.search(r"ΔE2000 (\d+\.\d) would remain", line)
        assert remaining is None or float(remaining[1]) < now, line
    assert any("ΔE2000 does not fall" in line for line in others), palette.possible.words


def test_a_cell_of_another_material_that_must_match_is_named_with_it(blender) -> None:
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    rows, lights = palette.materials, [light.name for light in palette.lights]
    rows[0].cells[0].exact = True  # and the second material has its color under the other light
    selected(palette, 1, 0).target = (0.1, 0.9, 0.1)
    rows[0].cells[1].use_box = False
    blender.ops.spectral.palette_possible()
    first, *others = palette.possible.words.splitlines()
    assert first.startswith("Not possible")
    named = [line for line in others if line.startswith("Conflict")]
    assert any(f"under {lights[1]}" in line for line in named), named
    own = [line for line in named if f"of {rows[0].name} under" in line]
    assert own == [line for line in named if f"under {lights[0]}" in line], named


def test_undo_brings_the_reasons_back_and_asks_again(blender, monkeypatch) -> None:
    """In a window a step is stored before the conflicts are searched, and before the question is answered."""
    asked = []
    monkeypatch.setattr(live.possible, "follow", asked.append)
    blender.ops.spectral.palette_preset(preset="METAMER_PAIR")
    palette = blender.context.scene.spectral.palette
    cell = selected(palette, 0, 0)
    cell.mode, cell.target = "FIXED", (0.1, 0.7, 0.15)
    reasons = [each.text for each in palette.conflicts]
    assert reasons
    palette.conflicts.clear()
    palette.is_unfinished = True
    blender.ops.ed.undo_push(message="green")
    cell.target = (0.8, 0.5, 0.1)
    blender.ops.ed.undo_push(message="orange")
    asked.clear()
    blender.ops.ed.undo()
    scene = blender.context.scene
    assert [each.text for each in scene.spectral.palette.conflicts] == reasons
    assert asked == [scene]


def selected(palette, row, column):
    palette.active_row, palette.active_column = row, column
    return palette.materials[row].cells[column]


@pytest.mark.parametrize("mode", ["BLACK", "SAME"])
def test_the_question_is_about_the_color_that_the_cell_asks_for(blender, palette, mode) -> None:
    """Not about the color that it has, which is always possible."""
    first = selected(palette, 0, 0)
    first.mode, first.target, first.exact = "FIXED", (0.9, 0.2, 0.1), True
    second = palette.materials[1].cells[0]
    second.mode, second.target, second.exact = "FIXED", (0.1, 0.7, 0.4), True
    asking = selected(palette, 0, 1)
    asking.mode, asking.weight = mode, 0.01
    blender.ops.spectral.palette_solve()
    assert asking.delta_e > 15
    blender.ops.spectral.palette_possible()
    assert not palette.possible.reachable
    assert "Conflict: the exact color under" in palette.possible.words
    wanted = (0, 0, 0) if mode == "BLACK" else tuple(asking.wanted)
    np.testing.assert_allclose(palette.possible.asked, wanted, atol=1e-5)


def test_the_color_that_a_free_cell_has_is_possible_outside_the_gamut_too(blender, palette) -> None:
    first = selected(palette, 0, 0)
    first.mode, first.target, first.exact = "FIXED", (0.1, 0.6, 0.1), True
    free = selected(palette, 0, 1)
    free.mode = "FREE"
    blender.ops.spectral.palette_solve()
    assert min(free.actual_linear) < -0.001
    blender.ops.spectral.palette_possible()
    assert palette.possible.words.startswith("Possible.")


def test_the_nearest_color_is_met_outside_the_gamut_too(blender, palette) -> None:
    first = selected(palette, 0, 0)
    first.mode, first.target, first.exact = "FIXED", (0.2, 0.6, 0.2), True
    cell = selected(palette, 0, 1)
    cell.mode, cell.target = "FIXED", (1.0, 0.6, 0.0)
    blender.ops.spectral.palette_possible()
    assert min(palette.possible.nearest_linear) < -0.001
    blender.ops.spectral.palette_take_nearest()
    cell.exact = True
    blender.ops.spectral.palette_solve()
    assert cell.delta_e < 0.5


def test_no_nearest_color_is_reported(blender, palette) -> None:
    with pytest.raises(RuntimeError, match="there is no question yet"):
        blender.ops.spectral.palette_take_nearest()


def test_an_answer_is_computed_in_a_thread(blender, palette, monkeypatch) -> None:
    from blender_addon.editing import behind
    from blender_addon.editing.palette import possible

    scene = blender.context.scene
    blender.ops.spectral.palette_possible()
    first = palette.possible.light_uid
    palette.active_column = 1
    is_rendering = [True]
    app = SimpleNamespace(background=False, timers=Timers(), is_job_running=lambda _job: is_rendering[0])
    for module in (possible, behind):
        monkeypatch.setattr(module, "bpy", SimpleNamespace(app=app, data=blender.data))
    monkeypatch.setattr(possible, "redraw", lambda *_: None)
    palette.possible_follows = False
    possible.follow(scene)
    assert possible.ANSWERS.running == {}  # no question was started
    palette.possible_follows = True
    possible.follow(scene)
    wait([each.answer for each in possible.ANSWERS.running.values()], 60)
    possible.ANSWERS.collect()
    assert palette.possible.light_uid == first  # a render reads the scene
    is_rendering[0] = False
    assert possible.ANSWERS.collect() is None
    possible.ANSWERS.stop()
    assert palette.possible.light_uid == palette.lights[1].uid != first


class Timers:
    """A replacement for Blender's timers, which are never called without a window."""

    def register(self, *_: object, **__: object) -> None:
        """Ignore the timer: it is never called."""

    def is_registered(self, _timer: object) -> bool:
        """No timer is registered."""
        return False


@pytest.mark.parametrize("edit", ["target", "lamp", "solve", "ignore", "alternative"])
def test_no_answer_of_an_earlier_table_stays(blender, palette, edit) -> None:
    """Without Keep Answering the panel kept it, and Take Nearest made its color the target."""
    palette.possible_follows = False
    cell = selected(palette, 0, 1)
    cell.mode, cell.target = "FIXED", (0.0, 1.0, 0.0)
    blender.ops.spectral.palette_alternatives()
    blender.ops.spectral.palette_possible()
    assert palette.possible.words
    if edit == "target":
        cell.target = (0.5, 0.5, 0.1)
    elif edit == "lamp":
        palette.lights[1].spectral.catalogue_name = "A"
    elif edit == "solve":
        blender.ops.spectral.palette_solve()
    elif edit == "ignore":
        blender.ops.spectral.palette_relieve(row=0, column=0)
    else:
        blender.ops.spectral.palette_alternative_take(index=0)
    assert not palette.possible.words
    with pytest.raises(RuntimeError, match="press Possible"):
        blender.ops.spectral.palette_take_nearest()


def test_an_edit_is_answered_also_where_the_table_is_not_live(blender, palette, monkeypatch) -> None:
    from blender_addon.editing.palette import possible

    asked = []
    monkeypatch.setattr(possible, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    monkeypatch.setattr(live, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    monkeypatch.setattr(possible, "follow", asked.append)
    palette.live = False
    palette.materials[0].cells[1].target = (0.5, 0.5, 0.1)
    assert asked == [blender.context.scene]


@pytest.mark.parametrize("is_live", [True, False])
def test_a_table_that_cannot_be_solved_keeps_no_answer_of_the_one_before(
    blender, palette, monkeypatch, is_live
) -> None:
    from blender_addon.editing.palette import possible

    cell = selected(palette, 0, 1)
    cell.mode, cell.target = "FIXED", (0.0, 1.0, 0.0)
    blender.ops.spectral.palette_possible()
    assert palette.possible.words
    for module in (live, possible):
        in_a_window = SimpleNamespace(app=SimpleNamespace(background=False), data=blender.data)
        monkeypatch.setattr(module, "bpy", in_a_window)
    monkeypatch.setattr(possible, "redraw", lambda *_: None)
    palette.possible_follows, palette.live = True, is_live
    palette.lights[1].spectral.source = "FILE"  # no file is chosen
    with pytest.raises(InvalidInputError):
        possible.question_of(palette)
    assert not palette.possible.words
