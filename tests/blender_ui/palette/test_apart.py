# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes, possible colors and recipes are computed in processes without Blender, which may end at any time."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.editing import apart, recipe
from blender_addon.editing.palette import alternatives
from blender_addon.editing.palette.solve import button_solve
from blender_addon.translate.palette import load
from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, RenderCancelled, RenderError
from spectral_core.palette import PaletteProblem, solve_palette
from spectral_core.palette.presets import metamer_pair
from spectral_core.palette.reach.possible import possible_answer, possible_colors
from spectral_core.render.process import interpreter

COLOR = (0.3, 0.5, 0.1)


def ending(kind, monkeypatch):
    """Processes of one kind in a session with a window, which end after the test."""
    monkeypatch.setattr(apart, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    made = kind()
    yield made
    made.end()


@pytest.fixture
def windowed(monkeypatch):
    """The process of edits."""
    yield from ending(apart.Apart, monkeypatch)


@pytest.fixture
def stoppable(monkeypatch):
    """The processes of buttons."""
    yield from ending(apart.Stoppable, monkeypatch)


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


def _wait_until(is_true) -> None:
    end = time.monotonic() + 60.0
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.01)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_esc_ends_the_process_that_computes_and_no_other(stoppable) -> None:
    """A thread computed on after Esc, for up to two minutes in a large palette, and took Python from Blender."""
    first, second = threading.Event(), threading.Event()
    with ThreadPoolExecutor(2) as threads:
        long = threads.submit(stoppable.call, partial(time.sleep, 600), first)
        _wait_until(lambda: len(stoppable.process_ids()) == 1)
        (pid,) = stoppable.process_ids()
        assert threads.submit(stoppable.call, partial(os.getpid), second).result() not in (pid, os.getpid())
        first.set()
        with pytest.raises(RenderCancelled):
            long.result(timeout=20)
        _wait_until(lambda: not _is_alive(pid))
        (kept,) = stoppable.process_ids()
        assert threads.submit(stoppable.call, partial(os.getpid), second).result() == kept  # libraries stay loaded
        with pytest.raises(InvalidInputError, match="count is 1"):
            threads.submit(stoppable.call, partial(require_whole, "count", 1, 2, 12), second).result()
    assert stoppable.call(partial(os.getpid), second) == os.getpid()  # a script's call waits on the main thread


def test_the_end_of_the_extension_ends_what_buttons_compute(stoppable) -> None:
    stopping = threading.Event()
    with ThreadPoolExecutor(1) as threads:
        answer = threads.submit(stoppable.call, partial(time.sleep, 600), stopping)
        _wait_until(stoppable.process_ids)
        (pid,) = stoppable.process_ids()
        stopping.set()  # as `waiting.end_all` does
        stoppable.end()
        with pytest.raises(RenderCancelled):
            answer.result(timeout=20)
    _wait_until(lambda: not _is_alive(pid))
    assert stoppable.process_ids() == []


class Sent(Exception):
    """Ends a search that is slow, as soon as its work was sent."""


@pytest.mark.parametrize("kind", ["plain", "tints", "dyes", "alternatives", "recipe"])
def test_what_buttons_compute_can_be_sent_to_a_process(blender, kind) -> None:
    """The work is a partial call of the core whose arguments, and whose answer, can be pickled."""
    scene, sent = blender.context.scene, []
    palette = scene.spectral.palette
    load.store_problem(palette, metamer_pair())
    palette.use_tints = kind == "tints"
    if kind == "dyes":
        dye = palette.materials[0].dyes.add()
        dye.excitation_nm, dye.emission_nm = 450.0, 560.0

    def call(work):
        sent.append(work.func.__module__)
        received = pickle.loads(pickle.dumps(work))
        if kind not in ("plain", "dyes"):
            raise Sent
        return pickle.loads(pickle.dumps(received()))

    with contextlib.suppress(Sent):
        if kind in ("alternatives", "recipe"):
            (recipe.search(scene, call) if kind == "recipe" else alternatives.search(scene, 0, call))()
        else:
            solve = button_solve(scene, call)
            assert not isinstance(solve.compute(), str)
    assert sent and all(module.startswith("spectral_core.") for module in sent)
