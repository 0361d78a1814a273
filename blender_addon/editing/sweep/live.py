# SPDX-License-Identifier: GPL-3.0-or-later
"""The sweep of the open file: its run in a separate process, its page, its points set in the scene."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import bpy
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError, RenderError, SpectralError, counted
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.page.serve import PageServer
from spectral_core.explore.sweep.ledger import Row
from spectral_core.explore.sweep.store import Store
from spectral_core.files.guarded import is_file

from ..background import DISABLED_MEANWHILE, SAVED_MEANWHILE, settle, told_if_temporary
from ..board.paths import block_at
from ..deferred import RENDER_SECONDS, open_scene, redraw
from .documents import Documents, command_line, folder_of, require_own_table, write_documents
from .points import set_point
from .run import Run
from .settings import column_name, follow_names, setting_at

POLL_S = 0.5
MOST_NOTES = 4
"""Notes of a run that the panel shows; its room is narrow."""
ASIDE = re.compile(r"\d+ set aside: ")
"""Start of the line of a run with the reason of its failed points."""
_run: Run | None = None
_server: PageServer | None = None
_scene_uid = _served_uid = 0
"""``session_uid`` of the scene of the run and of the page: it does not change when a scene is renamed. 0: none."""


def running() -> Run | None:
    """The present run, None once its process has ended."""
    return _run if _run is not None and _run.process.poll() is None else None


def scene_of_run() -> Scene | None:
    """The scene of the present run, None if nothing runs or the scene was deleted."""
    return None if running() is None else open_scene(_scene_uid)


def _forget() -> None:
    """End the run; computed points stay."""
    global _run
    if _run is not None:
        run, _run = _run, None
        run.end()


def _begin(scene: Scene, command: list[str], folder: Path, total: int, documents: Documents | None = None) -> Run:
    """Start the process of a run. ``documents``: those that were written for it."""
    global _run, _scene_uid
    _forget()
    sweep = scene.spectral.sweep
    _run, _scene_uid = Run(command, folder, total, sweep.workers, documents), scene.session_uid
    sweep.status, sweep.total, sweep.is_under_way = "starting", total, True
    return _run


def _require_no_run() -> None:
    if running() is not None:
        raise InvalidInputError("a sweep is running; wait for it or cancel it")


def add(scene: Scene, path: str) -> PropertyGroup:
    """Sweep another setting of the file: a number over its slider's range, a switch or list over all its values.

    Raises InvalidInputError if there is none.
    """
    setting = setting_at(path)
    sweep = scene.spectral.sweep
    follow_names(sweep)
    if path in sweep.parameters:
        raise InvalidInputError(f"{path} is swept already")
    taken = [each.label for each in sweep.parameters]
    entry = sweep.parameters.add()
    entry.name, entry.label = path, column_name(setting, taken)
    entry.block = block_at(path)[0]
    entry.choices, entry.whole, entry.is_angle = ", ".join(setting.choices), setting.is_whole, setting.is_angle
    if not setting.choices:
        entry.low, entry.high = setting.place.range()
    sweep.active = len(sweep.parameters) - 1
    return entry


def start(scene: Scene) -> Run:
    """Start the sweep in a separate process; points that failed before are tried again."""
    _require_no_run()
    sweep = scene.spectral.sweep
    documents = write_documents(scene)
    sweep.done, folder = 0, documents.folder
    command = command_line(documents.document, folder, sweep.workers, "--retry")
    return _begin(scene, command, folder, sweep.budget, documents)


def resume(scene: Scene) -> None:
    """Render the points that the page added, from the copy of the file of the sweep."""
    _require_no_run()
    sweep, folder = scene.spectral.sweep, folder_of(scene.spectral.sweep)
    with Store.open(folder) as store:
        total = len(store.ledger.states())
    _begin(scene, command_line(folder.with_suffix(".sweep.toml"), folder, sweep.workers, "--pending"), folder, total)


def look(scene: Scene) -> bool:
    """Update the run's progress; True while it runs."""
    if _run is None:
        return False
    sweep, run = scene.spectral.sweep, _run
    code = run.process.poll()
    sweep.done = run.done()
    sweep.is_under_way = code is None
    if code is None:
        left = run.seconds_left(sweep.done)
        sweep.status = f"{sweep.done} of {run.total}" + ("" if left is None else f", about {left:.0f} s left")
        return True
    lines = run.lines()
    aside = [line for line in lines if ASIDE.match(line)]
    if code == 0:
        notes = [line for line in lines if line.startswith("note: ")]
        more = f"and {counted(len(notes) - MOST_NOTES, 'more note')}" if len(notes) > MOST_NOTES else ""
        said = (f"{counted(sweep.done, 'point')} done", told_if_temporary(run.folder), *notes[:MOST_NOTES], more)
        sweep.status = "; ".join(filter(None, said))
    else:
        last = run.message() or f"status {code}"
        sweep.status = aside[0] if aside else last.strip().removeprefix("spectral-scene sweep: ")
    _forget()
    return False


def watch() -> None:
    """Update the progress by a timer until the run ends."""
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=POLL_S, persistent=True)


def tick() -> float | None:
    """Update the progress. Blender's timer calls this."""
    if bpy.app.is_job_running("RENDER"):
        return RENDER_SECONDS  # nothing is written while a render reads
    scene = open_scene(_scene_uid)
    if scene is None:
        _forget()  # the scene was deleted
    is_running = scene is not None and look(scene)
    _settle_others()
    redraw("VIEW_3D")
    return POLL_S if is_running else None


def wait(scene: Scene) -> None:
    """Wait for the run, without a window. Raises RenderError if it failed."""
    run = _run
    while look(scene):
        time.sleep(0.1)
    if run is not None and run.process.returncode:
        raise RenderError(scene.spectral.sweep.status)


def cancel() -> None:
    """End the run; computed points stay."""
    run, scene = running(), open_scene(_scene_uid)
    if run is None:
        raise InvalidInputError("no sweep is running")
    _forget()
    if scene is not None:
        sweep = scene.spectral.sweep
        sweep.done, sweep.is_under_way = run.done(), False
        sweep.status = f"cancelled; {sweep.done} of {run.total} points stay, and the next run continues"


def rows(scene: Scene) -> list[Row]:
    """Finished rows of the sweep, in the order of the table. Raises InvalidInputError for a table of other settings."""
    folder = folder_of(scene.spectral.sweep)
    if not is_file(folder / "project.json"):
        raise InvalidInputError(f"there is no sweep in {folder}; run it first")
    with Store.open(folder) as store:
        require_own_table(scene, folder, store.project.space)
        return store.ledger.rows("done")


def serve(scene: Scene) -> str:
    """Serve the page of the sweep; returns its address. Points are applied on the main thread."""
    global _server, _served_uid
    stop_serving()
    folder = folder_of(scene.spectral.sweep)
    rows(scene)
    uid = _served_uid = scene.session_uid

    def apply(values: Mapping[str, Any]) -> None:
        given = dict(values)

        def set_scene(target: Scene) -> None:
            refused = set_point(target, given)
            if refused:
                target.spectral.sweep.status = "; ".join(refused)
            bpy.ops.ed.undo_push(message="Apply Sweep Point")

        _on_main_thread(uid, set_scene)

    def run_pending(target: Scene) -> None:
        with bpy.context.temp_override(scene=target):
            bpy.ops.spectral.sweep_run(pending=True)

    def render() -> str:
        _on_main_thread(uid, run_pending)
        return "Blender renders the points in the background; reload the page to see them"

    # only the main thread may change the file, and a render opens one: both run there
    store = Store.open(folder)
    try:
        _server = PageServer(LiveSweep(store, apply=apply, render=render))
    except BaseException:
        store.close()
        raise
    threading.Thread(target=_server.serve_forever, daemon=True).start()
    return _server.address


def _on_main_thread(uid: int, work: Callable[[Scene], Any]) -> None:
    """Execute a page's work on its scene when Blender is idle; the panel shows errors."""
    if uid != _served_uid:
        raise InvalidInputError("the scene of this page is no longer open in Blender; open its file and press Explore")

    def run() -> float | None:
        global _served_uid
        if bpy.app.is_job_running("RENDER"):
            return RENDER_SECONDS  # a render would show a part of the change
        scene = open_scene(uid)
        if scene is None:
            _served_uid = 0  # the scene was deleted: the page reports it from now on
            return None
        try:
            work(scene)
        except (SpectralError, RuntimeError) as error:
            scene.spectral.sweep.status = str(error).strip()
        return None

    bpy.app.timers.register(run)


def stop_serving() -> None:
    """End the server of the page."""
    global _server
    if _server is not None:
        _server.shutdown()
        _server.server_close()
        _server.live.store.close()
        _server = None


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    """Another file is open: end the run of the earlier one, which no panel shows any more."""
    global _served_uid
    _served_uid = 0
    settle((scene.spectral.sweep for scene in bpy.data.scenes), SAVED_MEANWHILE.format(button="Run Sweep"))
    for each in bpy.data.scenes:
        follow_names(each.spectral.sweep)  # files of earlier versions keep no data-blocks, which a full copy needs
    if _run is not None:
        _forget()
        for scene in bpy.data.scenes:
            scene.spectral.sweep.status = "the sweep of the earlier file was ended; its points stay, run it again there"


@bpy.app.handlers.persistent
def _settle_others(*_: object) -> None:
    """An undo step or a copy of the scene, made during a run, says that it goes on; Blender reports no copy."""
    settle((scene.spectral.sweep for scene in bpy.data.scenes if scene != scene_of_run()), "")


HANDLERS = {"load_post": _after_load, "undo_post": _settle_others, "redo_post": _settle_others}


def register() -> None:
    """Start listening to files that are opened, and to undo."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """End the run and the server."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    _forget()
    settle((scene.spectral.sweep for scene in bpy.data.scenes), DISABLED_MEANWHILE.format(button="Run Sweep"))
    stop_serving()
