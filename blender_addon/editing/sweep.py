# SPDX-License-Identifier: GPL-3.0-or-later
"""The sweep of the open file: its document, its run in a separate process, its page, its points set in the scene."""

from __future__ import annotations

import json
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import bpy
from bpy.types import PropertyGroup, Scene

from spectral_core import child
from spectral_core.errors import InvalidInputError, RenderError, SpectralError
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.page.serve import PageServer
from spectral_core.explore.sweep.ledger import Row
from spectral_core.explore.sweep.parameters import Parameter
from spectral_core.explore.sweep.store import Store, cdb_folder
from spectral_core.files.whole import make_folder, write_text

from .sweep_points import set_point
from .sweep_run import Run
from .sweep_settings import column_name, setting_at

POLL_S = 0.5
_run: Run | None = None
_server: PageServer | None = None


def running() -> Run | None:
    """The present run."""
    return _run


def add(scene: Scene, path: str) -> PropertyGroup:
    """Sweep another setting of the file: a number over its slider's range, a switch or list over all its values.

    Raises InvalidInputError if there is none.
    """
    setting = setting_at(path)
    sweep = scene.spectral.sweep
    if path in sweep.parameters:
        raise InvalidInputError(f"{path} is swept already")
    taken = [each.label for each in sweep.parameters]
    entry = sweep.parameters.add()
    entry.name, entry.label = path, column_name(setting, taken)
    entry.choices, entry.whole = ", ".join(setting.choices), setting.is_whole
    if not setting.choices:
        entry.low, entry.high = setting.place.range()
    sweep.active = len(sweep.parameters) - 1
    return entry


def parameters_of(sweep: PropertyGroup) -> list[Parameter]:
    """The core's parameters. Raises InvalidInputError for an invalid range or name, or without parameters."""
    if not len(sweep.parameters):
        raise InvalidInputError("nothing is swept; right-click a setting and choose Add to Sweep")
    made = []
    for entry in sweep.parameters:
        setting = setting_at(entry.name)
        if setting.choices:
            choices = tuple(word.strip() for word in entry.choices.split(",") if word.strip())
            for choice in choices:
                setting.checked(choice)
            made.append(Parameter(entry.label, kind="choice", choices=choices, path=entry.name))
            continue
        kind: Any = "integer" if entry.whole else "real"
        made.append(Parameter(entry.label, entry.low, entry.high, scale=entry.scale, kind=kind, path=entry.name))
    return made


def folder_of(sweep: PropertyGroup) -> Path:
    """Folder of the sweep: beside the file, or a temporary folder for a file that was never saved."""
    if sweep.folder.startswith("//") and not bpy.data.filepath:
        return Path(bpy.app.tempdir or tempfile.gettempdir()) / "sweep.cdb"
    return cdb_folder(Path(bpy.path.abspath(sweep.folder).rstrip("/\\")))


def write_documents(scene: Scene) -> tuple[Path, Path]:
    """Write a copy of the file and the sweep's document beside the folder; returns document and folder."""
    sweep = scene.spectral.sweep
    parameters = parameters_of(sweep)
    folder = folder_of(sweep)
    make_folder(folder.parent)
    blend = folder.with_suffix(".sweep.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True, check_existing=False)
    lines = [
        'format = "spectral-scene sweep"', "version = 1", "", "[compute]", 'kind = "blend"',
        f"blend = {json.dumps(blend.name)}", f"percentage = {sweep.percentage}", f"samples = {sweep.samples}", "",
        "[design]", f"kind = {json.dumps(sweep.design)}", f"budget = {sweep.budget}",
    ]  # fmt: skip
    for parameter in parameters:
        lines += ["", "[[parameters]]", *(f"{key} = {json.dumps(value)}" for key, value in parameter.to_dict().items())]
    document = folder.with_suffix(".sweep.toml")
    write_text(document, "\n".join(lines) + "\n")
    return document, folder


def command_line(document: Path, folder: Path, workers: int, *more: str) -> list[str]:
    """The command that runs a sweep in the present Blender; ``more``: further options."""
    words = ["sweep", str(document), "--out", str(folder), "--workers", str(workers), *more]
    package = __package__.rpartition(".")[0]
    if not bpy.app.binary_path:
        # not with this process's module path: a loaded bpy adds a folder to it that hides bpy itself
        return [sys.executable, *child.ISOLATED, "-m", package, *words]
    # in the new process the extension may be disabled, or not installed if it runs from its sources
    code = (
        "import importlib, os, sys; "
        f"sys.path[:] = {child.trusted_path()!r}; import bpy; "
        f"importlib.import_module({package!r}).register_once(); "
        f"status = importlib.import_module({package + '.commands'!r}).main({words!r}); sys.stdout.flush(); "
        "os._exit(status)"
    )
    return [bpy.app.binary_path, "-b", "--python-exit-code", "1", "--python-expr", code]


def start(scene: Scene) -> Run:
    """Start the sweep in a separate process."""
    global _run
    if _run is not None and _run.process.poll() is None:
        raise InvalidInputError("a sweep is running; wait for it or cancel it")
    sweep = scene.spectral.sweep
    document, folder = write_documents(scene)
    _run = Run(command_line(document, folder, sweep.workers), folder, sweep.budget)
    sweep.status, sweep.done, sweep.total = "starting", 0, sweep.budget
    return _run


def resume(scene: Scene) -> None:
    """Render the points that the page added, from the copy of the file of the sweep."""
    global _run
    if _run is not None and _run.process.poll() is None:
        raise InvalidInputError("a sweep is running; wait for it or cancel it")
    sweep, folder = scene.spectral.sweep, folder_of(scene.spectral.sweep)
    with Store.open(folder) as store:
        total = len(store.ledger.rows())
    command = command_line(folder.with_suffix(".sweep.toml"), folder, sweep.workers, "--pending")
    _run = Run(command, folder, total)
    sweep.status, sweep.total = "starting", total


def look(scene: Scene) -> bool:
    """Update the run's progress; True while it runs."""
    global _run
    if _run is None:
        return False
    sweep, run = scene.spectral.sweep, _run
    code = run.process.poll()
    sweep.done = run.done()
    if code is None:
        seconds = time.monotonic() - run.started
        left = (run.total - sweep.done) * seconds / sweep.done if sweep.done else None
        sweep.status = f"{sweep.done} of {run.total}" + ("" if left is None else f", about {left:.0f} s left")
        return True
    lines = run.lines()
    aside = [line for line in lines if "set aside" in line]
    if code == 0:
        sweep.status = f"{sweep.done} points done"
    else:
        last = lines[-1] if lines else f"status {code}"
        sweep.status = aside[0] if aside else last.strip()
    run.log.close()
    _run = None
    return False


def wait(scene: Scene) -> None:
    """Wait for the run, without a window. Raises RenderError if it failed."""
    run = _run
    while look(scene):
        time.sleep(0.1)
    if run is not None and run.process.returncode:
        raise RenderError(scene.spectral.sweep.status)


def cancel() -> None:
    """End the run."""
    if _run is None:
        raise InvalidInputError("no sweep is running")
    _run.end()


def estimate(scene: Scene) -> str:
    """Text on the time of the sweep: from finished rows, else from one render of the settings."""
    sweep = scene.spectral.sweep
    parameters_of(sweep)
    folder = folder_of(sweep)
    times: list[float] = []
    if (folder / "project.json").is_file():
        with Store.open(folder) as store:
            times = [row.seconds for row in store.ledger.rows("done") if row.seconds is not None]
    if not times:
        render = scene.render
        share = sweep.percentage / 100
        paths = render.resolution_x * render.resolution_y * share * share * sweep.samples
        return f"{sweep.budget} renders of {paths / 1e6:.2g} million light paths each; the first one tells the time"
    each = sum(times) / len(times)
    left = max(0, sweep.budget - len(times))
    return f"{each:.2f} s each; {left} new renders take about {each * left / sweep.workers:.0f} s"


def rows(scene: Scene) -> list[Row]:
    """Finished rows of the sweep, in the order of the table."""
    folder = folder_of(scene.spectral.sweep)
    if not (folder / "project.json").is_file():
        raise InvalidInputError(f"there is no sweep in {folder}; run it first")
    with Store.open(folder) as store:
        return store.ledger.rows("done")


def serve(scene: Scene) -> str:
    """Serve the page of the sweep; returns its address. Points are applied on the main thread."""
    global _server
    stop_serving()
    folder = folder_of(scene.spectral.sweep)
    rows(scene)
    name = scene.name

    def apply(values: Mapping[str, Any]) -> None:
        given = dict(values)

        def set_scene(target: Scene) -> None:
            set_point(target, given)
            bpy.ops.ed.undo_push(message="Apply Sweep Point")

        _on_main_thread(name, set_scene)

    def render() -> str:
        _on_main_thread(name, lambda _scene: bpy.ops.spectral.sweep_run(pending=True))
        return "Blender renders the points in the background; reload the page to see them"

    # only the main thread may change the file, and a render opens one: both run there
    _server = PageServer(LiveSweep(Store.open(folder), apply=apply, render=render))
    threading.Thread(target=_server.serve_forever, daemon=True).start()
    return _server.address


def _on_main_thread(name: str, work: Callable[[Scene], Any]) -> None:
    """Execute a page's work on a scene when Blender is idle; the panel shows errors."""

    def run() -> None:
        scene = bpy.data.scenes.get(name)
        if scene is None:
            return
        try:
            work(scene)
        except (SpectralError, RuntimeError) as error:
            scene.spectral.sweep.status = str(error).strip()

    bpy.app.timers.register(run)


def stop_serving() -> None:
    """End the server of the page."""
    global _server
    if _server is not None:
        _server.shutdown()
        _server.server_close()
        _server.live.store.close()
        _server = None


def register() -> None:
    """Adds nothing; the module holds the run and the server."""


def unregister() -> None:
    """End the run and the server."""
    global _run
    if _run is not None:
        _run.end()
        _run.log.close()
        _run = None
    stop_serving()
