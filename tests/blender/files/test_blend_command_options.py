# SPDX-License-Identifier: GPL-3.0-or-later
"""Each option of the commands on .blend files reaches Blender's settings, the plan, the recording or the figure."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.commands import _blend, main
from spectral_core.errors import InvalidInputError, RenderCancelled
from spectral_core.scene import Note

SCENE_OPTIONS: dict[str, tuple[list[str], dict[str, Any]]] = {
    "samples": (["--samples", "9"], {"samples": 9}),
    "seed": (["--seed", "4"], {"seed": 4}),
    "percentage": (["--percentage", "50"], {"percentage": 50}),
    "transport": (["--transport", "spectral"], {"transport": "SPECTRAL"}),
    "overrides": (["--set", "bounces=3"], {"overrides": {"bounces": "3"}}),
    "variant": (["--variant", "cuda"], {"variant": "cuda"}),
    "target_error": (["--target-error", "0.5"], {"target_error": 0.5, "goal": "ERROR"}),
    "time_budget": (["--time-budget", "7"], {"time_budget": 7.0, "goal": "TIME"}),
}
"""For each option: words of a command line, and what they change."""


@pytest.fixture
def saved(build, tmp_path):
    """Path of a saved small scene with two lamps."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 20, 12
    build.plane(size=20, material=build.material("Paper"))
    build.light("SUN", 3.0).name = "Sun"
    build.light("POINT", 100.0).name = "Lamp"
    build.camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser()
    _blend.add_scene_arguments(made)
    _blend.add_accuracy_arguments(made)
    return made


def state(saved: Any, words: list[str]) -> dict[str, Any]:
    """What an opened file and its arguments say."""
    arguments = parser().parse_args([str(saved), *words])
    scene = _blend.open_scene(arguments)
    settings = scene.spectral.render
    names = ("samples", "seed", "transport", "goal", "target_error", "time_budget")
    return {name: getattr(settings, name) for name in names} | {
        "percentage": scene.render.resolution_percentage,
        "overrides": {each.name: each.value for each in settings.overrides},
        "variant": arguments.variant,
    }


def test_every_option_of_a_scene_has_a_case() -> None:
    assert set(SCENE_OPTIONS) == set(vars(parser().parse_args(["scene.blend"]))) - {"scene"}


def test_every_option_of_a_scene_changes_its_own_setting_alone(saved) -> None:
    plain = state(saved, [])
    for words, changed in SCENE_OPTIONS.values():
        found = state(saved, words)
        assert {name: value for name, value in found.items() if value != plain[name]} == changed


@pytest.mark.parametrize("goal", ["ERROR", "TIME"])
def test_samples_count_whatever_ends_the_renders_of_the_file(saved, goal) -> None:
    """They had no effect on a file whose renders end at an error or a time, and a transport could not be recorded."""
    bpy.context.scene.spectral.render.goal = goal
    bpy.ops.wm.save_mainfile()
    assert state(saved, [])["goal"] == goal
    assert (state(saved, ["--samples", "9"])["goal"], state(saved, ["--samples", "9"])["samples"]) == ("SAMPLES", 9)
    for option in ("--target-error", "--time-budget"):
        with pytest.raises(InvalidInputError, match=f"--samples has no effect with {option}"):
            state(saved, ["--samples", "9", option, "2"])


def test_two_values_for_one_effect_are_refused(saved) -> None:
    """The last one counted, without a word."""
    assert state(saved, ["--set", "bounces=3", "--set", "bounces=3"])["overrides"] == {"bounces": "3"}
    with pytest.raises(InvalidInputError, match="--set gives bounces the values 3 and 4; give one of them"):
        state(saved, ["--set", "bounces=3", "--set", "bounces=4"])


def call(capfd: Any, *arguments: Any) -> tuple[int, str]:
    status = main([str(argument) for argument in arguments])
    return status, capfd.readouterr().out


def traced(monkeypatch: Any) -> list[Any]:
    """Scenes that plans are asked of; no light path is traced."""
    import spectral_core.render as render

    asked: list[Any] = []
    monkeypatch.setattr(render, "RenderProcess", lambda: pytest.fail("a process was started"))
    monkeypatch.setattr(render, "plan_from_data", lambda scene, tolerance: asked.append((scene, tolerance)) or _stop())
    return asked


def _stop() -> Any:
    raise RenderCancelled("enough")


@pytest.mark.parametrize(("words", "tolerance"), [(["--tolerance", "3"], 3.0), ([], None)])
def test_a_plan_gets_its_tolerance_and_variant_and_traces_nothing_on_request(
    saved, capfd, monkeypatch, words, tolerance
):
    asked = traced(monkeypatch)
    call(capfd, "plan", saved, "--no-pilot", "--variant", "cuda", *words)
    assert [(scene.settings.variant, given) for scene, given in asked] == [("cuda", tolerance)]


class Process:
    """A render process that records its calls."""

    def __init__(self, calls: list[Any], **answers: Any) -> None:
        self._calls, self._answers = calls, answers

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def __getattr__(self, name: str) -> Any:
        return lambda *given: (self._calls.append((name, *given[1:])), self._answers[name])[1]


@dataclass(frozen=True)
class Point:
    """A point of a cost curve."""

    error: float


def test_a_plan_is_asked_of_a_process_with_its_tolerance(saved, capfd, monkeypatch):
    import spectral_core.render as render
    from spectral_core.render import plan_from_data

    calls: list[Any] = []

    class Planned(Process):
        def plan(self, scene: Any, tolerance: float | None) -> Any:
            calls.append(tolerance)
            return plan_from_data(scene, tolerance)

    monkeypatch.setattr(render, "RenderProcess", lambda: Planned([]))
    status, text = call(capfd, "plan", saved, "--tolerance", "2.5", "--json")
    assert status == 0 and calls == [2.5]
    assert json.loads(text.splitlines()[-1])["tolerance"] == 2.5


def test_a_cost_is_drawn_over_the_axis_of_the_command_line(saved, capfd, monkeypatch, tmp_path):
    import spectral_core.render as render
    from spectral_core.render.cost import curve as curves
    from spectral_core.render.cost import figure

    curve = SimpleNamespace(points=[Point(2.0)], now=Point(1.0), at_error=Point(0.5), probe_pixels=64, seconds=0.25)
    drawn: list[Any] = []
    monkeypatch.setattr(render, "RenderProcess", lambda: Process([], cost_curve=curve))
    monkeypatch.setattr(curves, "table", lambda _: "a table")
    monkeypatch.setattr(figure, "write_figure", lambda *given: drawn.append(given))
    out = tmp_path / "cost.png"
    status, text = call(capfd, "cost", saved, "--plot", out, "--axis", "bounces", "--json")
    assert status == 0 and drawn == [(out, curve, "bounces", "scene")]
    assert f"{out}: error over time" in text
    assert json.loads(text.splitlines()[-1]) == {
        "points": [{"error": 2.0}], "now": {"error": 1.0}, "at_error_1": {"error": 0.5}, "probe_pixels": 64,
        "seconds": 0.25, "notes": [],
    }  # fmt: skip
    drawn.clear()
    status, _ = call(capfd, "cost", saved)
    assert status == 0 and drawn == []


def test_a_transport_states_the_memory_of_its_storage_and_its_groups(saved, capfd):
    def stated(*words: str) -> dict[str, Any]:
        status, text = call(capfd, "transport", saved, "--estimate", "--json", *words)
        assert status == 0
        return json.loads(text.splitlines()[-1])

    plain, apart, bands = stated(), stated("--one-per-light"), stated("--storage", "bands31")
    assert len(plain["groups"]) == 1 and {"Sun", "Lamp"} <= set(apart["groups"])
    assert apart["bytes"] > plain["bytes"] and bands["bytes"] > plain["bytes"]
    assert {name for name in plain if plain[name] != bands[name]} == {"bytes", "peak_bytes", "stated"}
    assert "file" not in plain


def test_a_transport_is_recorded_with_its_options_into_its_file(saved, capfd, monkeypatch, tmp_path):
    import spectral_core.render as render
    from spectral_core.render.relight import transport, transport_file

    made: list[Any] = []
    recorded = SimpleNamespace(groups=["all"], notes=(Note("paint", "its dyes mix wavelengths"),))

    def record(scene: Any, storage: Any, **options: Any) -> Any:
        options["on_progress"](SimpleNamespace(samples=1, total=3))
        made.append((type(storage), options))
        return recorded

    monkeypatch.setattr(render, "RenderProcess", lambda: Process([], render=None))
    monkeypatch.setattr(transport, "record_transport", record)
    monkeypatch.setattr(transport_file, "write_transport", lambda path, found: made.append((path, found)))
    out = tmp_path / "mine.exr"
    assert call(capfd, "transport", saved, "--out", out, "--storage", "exact", "--one-per-light")[0] == 0
    (exact, options), written = made
    assert options["one_per_light"] is True and written == (out, recorded)
    made.clear()
    monkeypatch.chdir(tmp_path)
    status, text = call(capfd, "transport", saved)
    assert status == 0 and "--one-per-light keeps lights apart" in text
    assert "note: paint: its dyes mix wavelengths\n" in text
    (dial, options), written = made
    assert dial != exact and options["one_per_light"] is False and str(written[0]) == "scene.transport.exr"


def test_the_folder_of_a_transport_is_made_and_tried_before_it_is_recorded(saved, capfd, monkeypatch, tmp_path):
    import spectral_core.render as render
    from spectral_core.render.relight import transport, transport_file

    made: list[Any] = []

    def record(*_: Any, **__: Any) -> Any:
        made.append((tmp_path / "new" / "folder").is_dir())
        return SimpleNamespace(groups=["all"], notes=())

    monkeypatch.setattr(render, "RenderProcess", lambda: Process([], render=None))
    monkeypatch.setattr(transport, "record_transport", record)
    monkeypatch.setattr(transport_file, "write_transport", lambda *_: None)
    out = tmp_path / "new" / "folder" / "s.exr"
    assert call(capfd, "transport", saved, "--out", out, "--estimate")[0] == 1
    assert not (tmp_path / "new").exists()
    assert call(capfd, "transport", saved, "--out", out)[0] == 0
    assert made == [True]
    assert call(capfd, "transport", saved, "--out", saved / "s.exr")[0] == 1
    assert made == [True]  # nothing was recorded for a folder that cannot be made


def test_a_frame_is_set_before_a_scene_is_written_for_mitsuba(saved, capfd, monkeypatch, tmp_path):
    from spectral_core.render import mitsuba_export

    frames = []
    made = SimpleNamespace(scene=tmp_path / "scene.xml", files=("scene.xml",), notes=())
    monkeypatch.setattr(
        mitsuba_export, "write_mitsuba", lambda *_: (frames.append(bpy.context.scene.frame_current), made)[1]
    )
    for words in (["--frame", "7"], []):
        assert call(capfd, "render", saved, "--write-mitsuba", tmp_path, *words)[0] == 0
    assert frames == [7, 1]


def test_a_transport_and_a_cost_name_what_their_pictures_lack(saved, capfd, monkeypatch):
    """Objects of a library that was not found were missing in a recording without a note."""
    import spectral_core.render as render
    from spectral_core.render.cost import curve

    monkeypatch.setattr(_blend, "missing_files", lambda: ["library.blend: was not found"])
    status, text = call(capfd, "transport", saved, "--estimate", "--json")
    assert status == 0 and "note: library.blend: was not found\n" in text
    assert json.loads(text.splitlines()[-1])["notes"] == ["library.blend: was not found"]
    measured = SimpleNamespace(points=(), now=Point(1.0), at_error=Point(1.0), probe_pixels=3, seconds=1.0)
    monkeypatch.setattr(render, "RenderProcess", lambda: Process([], cost_curve=measured))
    monkeypatch.setattr(curve, "table", lambda _: "a table")
    status, text = call(capfd, "cost", saved, "--json")
    assert status == 0 and "note: library.blend: was not found\n" in text
    assert "library.blend: was not found" in json.loads(text.splitlines()[-1])["notes"]
