# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are difficult for exporters: a separate process renders each, or prints one clear message."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

HERE = Path(__file__).resolve().parent
RENDERS = {
    "unknown_nodes": ["IES Texture"],
    "group_without_tree": [],
    "linked_library": [],
    "missing_library": ["gone.blend"],
    "missing_images": ["gone.png", "gone.mp4", "UDIM"],
    "image_of_nans": ["not finite"],
    "hair": ["Smoke"],
    "empty_meshes": [],
    "zero_size_lights": ["AREA"],
    "negative_scale": ["Gone"],
    "no_objects": [],
    "camera_is_no_camera": [],
    "wild_numbers": [],
    "everything_past_its_slot": [],
}
"""By file, the words that its notes must contain."""
FAILS = {
    "no_camera": "has no camera; add one",
    "no_blend_file": "no_blend_file.blend cannot be opened",
}


def run(*arguments):
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}
    return subprocess.run(
        [sys.executable, "-W", "ignore", str(HERE / "hard_files.py"), *map(str, arguments)],
        capture_output=True, text=True, env=environment, timeout=240,
    )  # fmt: skip


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """The outcome of each file. If a file ends its process, its outcome says so, and a new process continues."""
    folder = tmp_path_factory.mktemp("hard")
    left, found, action = [*RENDERS, *FAILS], {}, "build"
    while left:
        answer = run(action, folder, *left)
        assert (folder / "no_blend_file.blend").is_file(), answer.stderr[-2000:]  # the last that is built
        action = "render"
        lines = [json.loads(line) for line in answer.stdout.splitlines() if line.startswith("{")]
        current = None
        for line in lines:
            current = line.get("begin", current)
            found.setdefault(current, {}).update(line)
        if "status" not in found.get(current, {}):
            found[current] = {"crash": answer.returncode, "error": answer.stderr[-2000:]}
        left = [name for name in left if name not in found]
    return found


@pytest.mark.parametrize("name", RENDERS)
def test_renders_with_notes_on_missing_features(outcomes, name):
    outcome = outcomes[name]
    assert outcome.get("status") == 0, outcome
    assert outcome["size"] == [32, 24] and outcome["finite"]
    for word in RENDERS[name]:
        assert any(word in note for note in outcome["notes"]), (word, outcome["notes"])
    assert len(set(outcome["notes"])) == len(outcome["notes"])


@pytest.mark.parametrize("name", FAILS)
def test_prints_one_clear_message_and_exits_with_status_1(outcomes, name):
    assert outcomes[name].get("status") == 1 and FAILS[name] in outcomes[name]["error"]


def test_only_the_empty_scene_is_black(outcomes):
    assert outcomes["no_objects"]["mean"] == pytest.approx(0.25)  # black, alpha 1
    assert all(outcomes[name]["mean"] > 0.26 for name in ("unknown_nodes", "linked_library", "hair", "empty_meshes"))
