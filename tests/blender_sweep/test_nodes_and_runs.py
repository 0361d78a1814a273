# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting of a sweep of a .blend reaches its scene, and the panel shows a run as it is; nothing is rendered."""

from __future__ import annotations

import contextlib
import pickle
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from blender_addon.editing.background import BackgroundCommand
from blender_addon.editing.sweep import live as sweeps
from blender_addon.editing.sweep import node as sweep_node
from blender_addon.editing.sweep import run as sweep_run
from blender_addon.editing.sweep.documents import parameters_of
from blender_addon.editing.sweep.node import BlendNode, blend_node
from blender_addon.editing.sweep.run import estimate
from spectral_core.errors import InvalidInputError, RenderError
from spectral_core.explore.sweep.ledger import Row
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.explore.sweep.parameters import Parameter, Space
from tests.blender_sweep.test_sweep_in_blender import HEIGHT, KEY, scene  # noqa: F401 - a fixture

WATTS, HIGH = Parameter("watts", 10.0, 500.0, path=KEY), Parameter("high", 2.0, 4.0, path=HEIGHT)


def node_of(folder: Path, *parameters: Parameter, **entries: Any) -> BlendNode:
    return blend_node({"blend": "scene.blend", **entries}, Space(parameters), folder)


def test_the_scene_of_a_point_has_its_value_its_seed_and_the_entries(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    node = node_of(tmp_path, HIGH, samples=7, percentage=50)
    for height, seed in ((2.5, 3), (3.5, 4)):
        film = (made := node.scene({"high": height}, seed)).film
        assert (film.samples, film.seed, film.width, film.height) == (7, seed, 16, 12)
        assert made.camera.world_from_camera[2, 3] == pytest.approx(height)
    plain = node_of(tmp_path, HIGH).scene({"high": 2.5}, 0).film
    assert (plain.samples, plain.width) == (bpy.context.scene.spectral.render.samples, 32)
    assert pickle.loads(pickle.dumps(node))._kept == {} != node._kept


def test_energies_alone_are_re_lit_and_all_else_is_rendered(scene: Any, tmp_path: Path, monkeypatch: Any) -> None:  # noqa: F811
    seen: list[Any] = []
    picture = np.full((2, 2, 4), 0.25, np.float32)

    def outcome(kind: str, made: Any) -> Outcome:
        seen.append((kind, made.film.seed))
        return Outcome({}, {"": picture})

    monkeypatch.setattr(sweep_node, "Relighter", lambda: SimpleNamespace(picture=lambda made: outcome("re-lit", made)))
    monkeypatch.setattr(sweep_node, "rendered", lambda made: outcome("rendered", made))
    assert node_of(tmp_path, WATTS)({"watts": 20.0}, 5).pictures[""] is picture
    assert node_of(tmp_path, WATTS, HIGH)({"watts": 20.0, "high": 3.0}, 6).pictures[""] is picture
    assert seen == [("re-lit", 5), ("rendered", 6)]
    assert any("re-lights each point" in line for line in node_of(tmp_path, WATTS).describe())
    assert any("every point is rendered" in line for line in node_of(tmp_path, WATTS, HIGH).describe())


def test_a_picture_is_shown_through_the_files_view_transform(scene: Any, tmp_path: Path, monkeypatch: Any) -> None:  # noqa: F811
    picture = np.full((2, 2, 4), 0.25, np.float32)
    monkeypatch.setattr(sweep_node, "rendered", lambda _: Outcome({}, {"": picture}))
    shown = {}
    for view in ("Standard", "Filmic"):
        bpy.context.scene.view_settings.view_transform = view
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
        shown[view] = node_of(tmp_path, HIGH)({"high": 3.0}, 0).shown
    assert not shown["Standard"] and shown["Filmic"][""].startswith(b"\x89PNG")


def test_each_entry_of_the_document_changes_the_fingerprint_of_the_node(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    nodes = [
        node_of(tmp_path, *parameters, **entries)
        for parameters, entries in (
            ((HIGH,), {}), ((WATTS,), {}), ((HIGH,), {"samples": 9}), ((HIGH,), {"percentage": 50}),
        )
    ]  # fmt: skip
    assert len({node.fingerprint for node in nodes}) == len(nodes)


@pytest.mark.parametrize("goal", ["ERROR", "TIME"])
def test_the_samples_of_a_sweep_count_whatever_ends_the_renders_of_the_file(
    scene: Any, tmp_path: Path, goal: str  # noqa: F811
) -> None:  # fmt: skip
    """They had no effect, and a sweep of lamps failed at every point: no recording ends at an error or a time."""
    bpy.context.scene.spectral.render.goal = goal
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    made = node_of(tmp_path, WATTS, samples=7).scene({"watts": 20.0}, 0)
    assert (made.film.samples, made.settings.target_error, made.settings.time_budget_s) == (7, None, None)
    swept = Parameter("wanted", 0.5, 2.0, path='bpy.data.scenes["Scene"].spectral.render.target_error')
    left = node_of(tmp_path, swept, samples=7).scene({"wanted": 1.5}, 0).settings
    assert (left.target_error, left.time_budget_s) == ((1.5, None) if goal == "ERROR" else (None, pytest.approx(60.0)))


class Ran(BackgroundCommand):
    """A run whose process answers what a test says."""

    def __init__(self, code: int | None, done: int, lines: list[str]) -> None:
        self.process = SimpleNamespace(poll=lambda: code, returncode=code)
        self.done, self.lines, self.total = lambda: done, lambda: lines, 8
        self.seconds_left = lambda done: 15.0 * done or None
        self.log = SimpleNamespace(close=lambda: None)
        self.folder = Path("/sweeps/heights.cdb")


@pytest.mark.parametrize(
    ("code", "done", "lines", "status"),
    [
        (None, 0, [], "0 of 8"),
        (None, 2, [], "2 of 8, about 30 s left"),
        (0, 8, ["ready"], "8 points done"),
        (0, 8, ["note: no picture changes", "table: x"], "8 points done; note: no picture changes"),
        (0, 8, ["note: x"] * 6, "8 points done; note: x; note: x; note: x; note: x; and 2 more notes"),
        (1, 5, ["4 of 8, 1 set aside", "3 set aside: no lamp", "bye"], "3 set aside: no lamp"),
        (1, 5, ["first", " the lamp is gone "], "the lamp is gone"),
        (1, 5, ["first", "spectral-scene sweep: the disk is full"], "the disk is full"),
        (1, 5, ["the disk is full", "Error: script failed, exiting", "Blender quit"], "the disk is full"),
        (9, 0, [], "status 9"),
    ],
)
def test_the_panel_shows_how_far_a_run_is_and_how_it_ended(
    scene: Any, monkeypatch: Any, code: Any, done: int, lines: list[str], status: str  # noqa: F811
) -> None:  # fmt: skip
    settings = scene.spectral.sweep
    settings.done = 99
    monkeypatch.setattr(sweeps, "_run", Ran(code, done, lines))
    monkeypatch.setattr(sweeps, "time", SimpleNamespace(sleep=lambda _: None))
    assert sweeps.look(scene) == (code is None)
    assert (settings.done, settings.status) == (done, status)
    assert (sweeps._run is None) == (code is not None)
    if code:
        sweeps._run = Ran(code, done, lines)
        with pytest.raises(RenderError, match=status):
            sweeps.wait(scene)


def test_a_run_tells_that_its_folder_is_temporary(scene: Any, monkeypatch: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep import documents as sweep_documents

    bpy.ops.wm.read_factory_settings(use_empty=True)
    opened = bpy.context.scene
    run = Ran(0, 8, ["ready"])
    run.folder = sweep_documents.folder_of(opened.spectral.sweep)
    monkeypatch.setattr(sweeps, "_run", run)
    sweeps.look(opened)
    assert opened.spectral.sweep.status.startswith("8 points done; ")
    assert "sweep.cdb is deleted at the end of the session" in opened.spectral.sweep.status


@pytest.fixture
def rows(scene: Any, monkeypatch: Any) -> list[Row]:  # noqa: F811
    """Finished rows of a sweep of the camera's height, without a store."""
    bpy.ops.spectral.sweep_add(target=HEIGHT)
    entry = scene.spectral.sweep.parameters[0]
    found = [Row("k", 0, {entry.label: height}, "done", {}, {}, 2.0, None) for height in (2.25, 2.5, 3.75)]
    ledger = SimpleNamespace(rows=lambda *_: found, states=lambda: dict.fromkeys(range(len(found)), "done"))
    project = SimpleNamespace(space=SimpleNamespace(parameters=()))
    store = contextlib.nullcontext(SimpleNamespace(ledger=ledger, close=lambda: None, project=project))
    for module in (sweeps, sweep_run):
        monkeypatch.setattr(module, "Store", SimpleNamespace(open=lambda _: store))
    folder = sweeps.folder_of(scene.spectral.sweep)
    folder.mkdir(parents=True)
    (folder / "project.json").write_text("{}")
    return found


def test_a_row_of_the_table_is_applied_by_its_number_or_by_the_panels(scene: Any, rows: list[Row]) -> None:  # noqa: F811
    camera = bpy.data.objects["Camera"]
    bpy.ops.spectral.sweep_apply(row=3)
    assert camera.location[2] == pytest.approx(3.75)
    scene.spectral.sweep.point = 2
    bpy.ops.spectral.sweep_apply()
    assert camera.location[2] == pytest.approx(2.5)
    with pytest.raises(RuntimeError, match="there is no row 4; the table has 3"):
        bpy.ops.spectral.sweep_apply(row=4)


def test_the_estimate_of_finished_rows_counts_budget_and_workers(scene: Any, rows: list[Row]) -> None:  # noqa: F811
    settings = scene.spectral.sweep
    for budget, workers, seconds in ((8, 1, 10), (13, 1, 20), (13, 4, 5), (2, 1, 0)):
        settings.budget, settings.workers = budget, workers
        assert estimate(scene) == (f"2.00 s each; {max(0, budget - 3)} new renders take about {seconds} s")
    bpy.ops.spectral.sweep_estimate()
    assert settings.status == estimate(scene)


def test_points_of_earlier_runs_say_nothing_on_the_time_left(monkeypatch: Any) -> None:
    """They counted as points of this run: a continued sweep had 0 s left for minutes."""
    seconds = iter([4.0, 6.0, 10.0])
    monkeypatch.setattr(sweep_run, "DoneCount", lambda _: SimpleNamespace(read=lambda: 100))
    monkeypatch.setattr(sweep_run, "time", SimpleNamespace(monotonic=lambda: next(seconds)))
    monkeypatch.setattr(BackgroundCommand, "__init__", lambda self, _: setattr(self, "started", 0.0))
    run = sweep_run.Run([], Path("sweep.cdb"), 128, 1)
    assert [run.seconds_left(done) for done in (100, 101, 105)] == [None, 27 * 6.0, 23 * 1.0]


def test_points_that_the_page_added_are_computed_with_the_panels_workers(
    scene: Any, rows: list[Row], monkeypatch: Any  # noqa: F811
) -> None:  # fmt: skip
    calls: list[Any] = []
    monkeypatch.setattr(sweeps, "_run", None)
    monkeypatch.setattr(sweeps, "Run", lambda command, folder, total, *_: calls.append((command, folder, total)))
    scene.spectral.sweep.workers = 3
    sweeps.resume(scene)
    ((command, folder, total),) = calls
    words = " ".join(command)
    assert folder == sweeps.folder_of(scene.spectral.sweep) and total == 3 == scene.spectral.sweep.total
    assert "--pending" in words and words.split("--workers")[1].split()[0].strip("',") == "3"


@pytest.fixture
def page(scene: Any, rows: list[Row], monkeypatch: Any) -> Any:  # noqa: F811
    """The actions of the page of the scene, without a server; ``closed`` has an entry once its store is closed."""
    served: list[Any] = []
    closed: list[Any] = []

    class Server:
        address = "http://127.0.0.1/"

        def __init__(self, live: Any) -> None:
            self.live = live
            served.append(self)

        def serve_forever(self) -> None:
            pass

        shutdown = server_close = serve_forever

    monkeypatch.setattr(sweeps, "PageServer", Server)
    monkeypatch.setattr(sweeps, "LiveSweep", lambda store, **given: SimpleNamespace(store=SimpleNamespace(
        close=lambda: closed.append(1)), closed=closed, **given))  # fmt: skip
    assert sweeps.serve(scene) == Server.address
    yield served[0].live
    sweeps.stop_serving()


def test_the_page_applies_points_and_starts_renders_on_the_main_thread(
    scene: Any, rows: list[Row], page: Any, monkeypatch: Any  # noqa: F811
) -> None:  # fmt: skip
    later: list[Any] = []
    resumed: list[Any] = []
    monkeypatch.setattr(sweeps, "_on_main_thread", lambda uid, work: later.append((uid, work)))
    monkeypatch.setattr(sweeps, "resume", resumed.append)
    monkeypatch.setattr(sweeps, "wait", lambda _: None)
    page.apply(rows[2].parameters)
    assert "background" in page.render()
    (uid, work), (again, run_pending) = later
    assert uid == again == scene.session_uid
    with contextlib.suppress(RuntimeError):  # without a window there is no undo
        work(scene)
    assert bpy.data.objects["Camera"].location[2] == pytest.approx(3.75)
    other = bpy.data.scenes.new("Other")  # the window may show another scene than the one of the page
    run_pending(other)
    assert resumed == [other]
    sweeps.stop_serving()
    assert page.closed and sweeps._server is None


def test_the_page_of_a_file_that_is_no_longer_open_reports_it(scene: Any, rows: list[Row], page: Any) -> None:  # noqa: F811
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    for action in (page.render, lambda: page.apply(rows[2].parameters)):
        with pytest.raises(InvalidInputError, match="the scene of this page is no longer open"):
            action()


def test_an_added_setting_is_the_active_one(scene: Any) -> None:  # noqa: F811
    settings = scene.spectral.sweep
    for number, path in enumerate((HEIGHT, KEY)):
        settings.active = 7
        bpy.ops.spectral.sweep_add(target=path)
        assert settings.active == number
    entry = settings.parameters[HEIGHT]
    low, high = sweeps.setting_at(HEIGHT).place.range()
    assert (entry.low, entry.high) == (pytest.approx(low), pytest.approx(high)) and entry.choices == ""
    assert [each.path for each in parameters_of(settings)] == [HEIGHT, KEY]
