# SPDX-License-Identifier: GPL-3.0-or-later
"""Finished palettes and possible colors are computed in a process without Blender, which may end at any time."""

from __future__ import annotations

import os
import signal
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.editing import apart
from spectral_core.errors import InvalidInputError, RenderError
from spectral_core.palette import PaletteProblem, solve_palette
from spectral_core.palette.possible import possible_answer, possible_colors
from spectral_core.palette.presets import metamer_pair
from spectral_core.render.process import interpreter

COLOR = (0.3, 0.5, 0.1)


@pytest.fixture
def windowed(monkeypatch):
    """A session with a window."""
    monkeypatch.setattr(apart, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    made = apart.Apart()
    yield made
    made.end()


@pytest.fixture(scope="module")
def problem() -> PaletteProblem:
    return metamer_pair()


def test_answers_are_those_of_this_process_and_a_killed_process_costs_none(windowed, problem) -> None:
    ask = partial(possible_answer, problem, (0, 0), COLOR, size=16)
    there, here = windowed.call(ask), ask()
    (pid,) = windowed.process_ids()
    assert pid != os.getpid()
    np.testing.assert_allclose(there.nearest.color, here.nearest.color, atol=1e-9)
    np.testing.assert_array_equal(there.inside, here.inside)
    assert (there.open, there.lightness) == (here.open, here.lightness)
    solved = windowed.call(partial(solve_palette, problem))
    assert windowed.process_ids() == [pid] and solved.status == solve_palette(problem).status
    with pytest.raises(InvalidInputError, match="outside the table"):
        windowed.call(partial(possible_answer, problem, (7, 7), COLOR))
    os.kill(pid, signal.SIGKILL)
    assert windowed.call(ask).alone == pytest.approx(here.alone)


def test_without_a_window_there_is_no_process(problem) -> None:
    made = apart.Apart()
    assert made.call(partial(int, "7")) == 7 and made.process_ids() == []


def test_without_an_interpreter_this_process_does_the_work(windowed, monkeypatch, capsys) -> None:
    def missing() -> str:
        raise RenderError("no Python was found")

    monkeypatch.setattr(interpreter, "find_python", missing)
    assert [windowed.call(partial(int, "7")) for _ in range(2)] == [7, 7]
    assert capsys.readouterr().out.count("no Python was found") == 1


def test_where_the_process_does_not_start_this_one_does_the_work(windowed, monkeypatch) -> None:
    monkeypatch.setattr(interpreter, "find_python", lambda: "/no/such/python")
    assert windowed.call(partial(int, "7")) == 7 and windowed.process_ids() == []


def test_an_answer_holds_what_its_parts_say(problem) -> None:
    answer, colors = possible_answer(problem, (0, 0), COLOR, size=16), possible_colors(problem, (0, 0))
    nearest = colors.nearest(COLOR)
    np.testing.assert_allclose(answer.nearest.color, nearest.color)
    assert not nearest.reachable and answer.alone == pytest.approx(colors.alone(COLOR))
    excluding = [cell for cell, _ in colors.in_the_way(nearest)[:2]]
    assert [cell for cell, _ in answer.conflicts] == excluding
    assert [left for _, left in answer.conflicts] == [pytest.approx(colors.without(cell, COLOR)) for cell in excluding]
    np.testing.assert_array_equal(answer.inside, colors.section(answer.lightness, 16))
    assert possible_answer(problem, (0, 0), nearest.color, size=16).conflicts == ()
