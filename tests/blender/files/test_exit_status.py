# SPDX-License-Identifier: GPL-3.0-or-later
"""Exit status of a render from the command line: the events are those that Blender 4.3 and 5.2 fire in each case."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

ONE_FRAME = ("render_init", "render_pre", "render_complete")
STOPPED = ("render_init", "render_pre", "render_cancel")
NO_FRAME = ("render_init", "render_complete")


@pytest.fixture
def ended(blender, monkeypatch):
    """Status that the process of a command line ends with; None if it is Blender's own."""
    from blender_addon import exit_status, jobs

    def run(words, events, statuses, *, engine="SPECTRAL", of_file="SPECTRAL", overwrite=True):
        answers = []
        monkeypatch.setattr(exit_status.os, "_exit", answers.append)
        monkeypatch.setattr(exit_status.sys, "argv", ["blender", "-b", "scene.blend", *words])
        monkeypatch.setattr(exit_status, "_engine_asked", of_file)
        for name, empty in (("_begun", []), ("_stopped", []), ("_without_frame", set())):
            monkeypatch.setattr(exit_status, name, empty)
        monkeypatch.setattr(jobs, "records", [jobs.RenderRecord(1, "ViewLayer", status, "why") for status in statuses])
        scene = SimpleNamespace(name="Scene", render=SimpleNamespace(engine=engine, use_overwrite=overwrite))
        for event in events:
            if event in exit_status._HANDLERS:
                exit_status._HANDLERS[event](scene, None)
        exit_status._end()
        return answers[0] if answers else None

    return run


@pytest.mark.parametrize(
    ("words", "events", "statuses"),
    [
        (["-f", "1"], ONE_FRAME, ["done", "failed"]),
        (["-f", "1"], STOPPED, []),  # a scene without a camera
        (["-a"], STOPPED, ["done", "cancelled"]),  # Ctrl-C
        (["-s", "5", "-e", "2", "-a"], NO_FRAME, []),
        (["-f", "1"], (), []),
    ],
)
def test_a_failed_render_ends_blender_with_a_failure(ended, words, events, statuses):
    assert ended(words, events, statuses) == 1


def test_the_engine_of_the_command_line_counts(ended):
    assert ended(["-E", "SPECTRAL", "-a"], (), [], of_file="CYCLES") == 1
    assert ended(["-E", "CYCLES", "-a"], (), []) is None


def test_a_finished_render_keeps_the_status_of_blender(ended):
    assert ended(["-f", "1"], ONE_FRAME, ["done"]) is None


def test_frames_that_exist_and_are_not_overwritten_are_no_failure(ended):
    assert ended(["-a"], NO_FRAME, [], overwrite=False) is None


def test_strips_of_a_sequencer_are_no_failure(ended):
    """Blender renders them without a call of the engine."""
    assert ended(["-a"], ONE_FRAME, []) is None


def test_another_scene_of_the_file_with_another_engine_is_no_failure(ended):
    assert ended(["-S", "Other", "-f", "1"], ONE_FRAME, [], engine="CYCLES") is None
    assert ended(["-S", "Other", "-f", "1"], STOPPED, [], engine="CYCLES") is None


def test_another_scene_of_the_file_with_this_engine_fails_likewise(ended):
    assert ended(["-S", "Other", "-f", "1"], ONE_FRAME, ["failed"], of_file="CYCLES") == 1
    assert ended(["-S", "Other", "-f", "1"], STOPPED, [], of_file="CYCLES") == 1
