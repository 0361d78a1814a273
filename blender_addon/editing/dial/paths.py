# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of a scene's recording: a chosen one, or one beside the .blend, which a save under another name copies."""

from __future__ import annotations

import shutil
import threading
from functools import partial
from pathlib import Path

import bpy
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import FileWriteError
from spectral_core.files.whole import whole_file

ENDING = ".transport.exr"
POLL_S = 0.2


def transport_path(dial: PropertyGroup) -> Path:
    """File of a dial's transport."""
    if dial.filepath:
        return Path(bpy.path.abspath(dial.filepath, library=dial.id_data.library))
    stem = Path(bpy.data.filepath) if bpy.data.filepath else Path(bpy.app.tempdir or ".") / "light_dial"
    return stem.with_suffix(dial.own_ending + ENDING)


def path_for_recording(scene: Scene) -> Path:
    """File for a new recording of a scene; a file of its own where another scene of the .blend has a recording."""
    dial = scene.spectral.dial
    others = [each.spectral.dial for each in bpy.data.scenes if each != scene]
    taken = {transport_path(other) for other in others if other.scene_hash}
    number = 0
    while not dial.filepath and transport_path(dial) in taken:
        number += 1
        dial.own_ending = "." + bpy.path.clean_name(scene.name) + (f"_{number}" if number > 1 else "")
    return transport_path(dial)


_before_save: dict[int, Path] = {}
"""By scene the file of its recording beside the .blend that is about to be saved."""


@bpy.app.handlers.persistent
def note_paths(*_: object) -> None:
    """Called before a save, which may give the .blend another name."""
    _before_save.clear()
    for scene in bpy.data.scenes:
        dial = scene.spectral.dial
        if dial.scene_hash and not dial.filepath:
            _before_save[scene.session_uid] = transport_path(dial)


@bpy.app.handlers.persistent
def follow_save(*_: object) -> None:
    """Called after a save: copy each recording beside the new .blend, which would not find it otherwise."""
    for scene in bpy.data.scenes:
        dial = scene.spectral.dial
        old, new = _before_save.pop(scene.session_uid, None), transport_path(dial)
        if old is None or old == new or new.exists() or not old.is_file():
            continue
        errors: list[str] = []
        thread = threading.Thread(target=_copy, args=(old, new, errors))  # no daemon: Blender waits for it at its end
        thread.start()
        report = partial(_report, scene.session_uid, thread, errors)
        if bpy.app.background:
            thread.join()
            report()
        else:
            bpy.app.timers.register(report, first_interval=POLL_S, persistent=True)


def _copy(old: Path, new: Path, errors: list[str]) -> None:
    try:
        with whole_file(new) as unfinished:
            shutil.copyfile(old, unfinished)
    except (FileWriteError, OSError) as error:
        errors.append(f"the recording {old} could not be copied to {new}: {error}; write it there with Save Transport")


def _report(scene_uid: int, thread: threading.Thread, errors: list[str]) -> float | None:
    """Tell the error of a copy in the panel. Blender's timer calls it until the copy ends."""
    if thread.is_alive():
        return POLL_S
    for scene in bpy.data.scenes:
        if scene.session_uid == scene_uid and errors:
            scene.spectral.dial.message = errors[0]
    return None
