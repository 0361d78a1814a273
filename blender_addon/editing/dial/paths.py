# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of a scene's recording: a chosen one, or one beside the .blend, which a save under another name copies.

A path that begins with // is beside the .blend, too.
"""

from __future__ import annotations

import shutil
import threading
from collections.abc import Collection
from functools import partial
from pathlib import Path

import bpy
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.guarded import is_file, is_there
from spectral_core.files.whole import make_folder, whole_file

from ..deferred import RENDER_SECONDS

ENDING = ".transport.exr"
POLL_S = 0.2


def transport_path(dial: PropertyGroup) -> Path:
    """File of a dial's transport: the chosen one, or one beside the .blend; a temporary one if that was never saved."""
    if is_temporary(dial) and dial.filepath:
        return Path(bpy.app.tempdir or ".") / dial.filepath[2:]
    if dial.filepath:
        return Path(bpy.path.abspath(dial.filepath, library=dial.id_data.library))
    stem = Path(bpy.data.filepath) if bpy.data.filepath else Path(bpy.app.tempdir or ".") / "light_dial"
    return stem.with_suffix(dial.own_ending + ENDING)


def is_temporary(dial: PropertyGroup) -> bool:
    """True if the file of a dial's transport is deleted with the session."""
    return not bpy.data.filepath and _is_beside(dial) and dial.id_data.library is None


def _is_beside(dial: PropertyGroup) -> bool:
    return not dial.filepath or dial.filepath.startswith("//")


def path_for_recording(scene: Scene, under_way: Collection[int] = ()) -> Path:
    """File for a new recording of a scene; a file of its own where another scene of the .blend has a recording.

    ``under_way``: session numbers of the scenes that are recorded at present, which will have one.

    Raises InvalidInputError if the chosen file does not end in .exr, or has the recording of another scene.
    """
    dial = scene.spectral.dial
    require_ending(transport_path(dial))
    taken = {
        transport_path(each.spectral.dial): each.name
        for each in bpy.data.scenes
        if each != scene and (each.spectral.dial.scene_hash or each.session_uid in under_way)
    }
    if dial.filepath and transport_path(dial) in taken:
        raise InvalidInputError(
            f"{transport_path(dial)} has the recording of the scene {taken[transport_path(dial)]!r}; choose another "
            "File for this scene, or empty that field"
        )
    number = 0
    while not dial.filepath and transport_path(dial) in taken:
        number += 1
        dial.own_ending = "." + bpy.path.clean_name(scene.name) + (f"_{number}" if number > 1 else "")
    return transport_path(dial)


def require_ending(path: Path) -> Path:
    """``path``. Raises InvalidInputError if it does not end in .exr, as a recording does."""
    if path.suffix.lower() != ".exr":
        raise InvalidInputError(f"{path.name} does not end in .exr, which a recording is; choose another File")
    return path


_before_save: dict[int, tuple[Path, str]] = {}
"""By scene the file of its recording beside the .blend that is about to be saved, and its ``own_ending``."""


@bpy.app.handlers.persistent
def note_paths(blend: object = "", *_: object) -> None:
    """Called before a save to the file ``blend``, which may give the .blend another name."""
    _before_save.clear()
    endings: dict[Path, str] = {}
    for scene in bpy.data.scenes:
        dial = scene.spectral.dial
        if not dial.scene_hash or not _is_beside(dial):
            continue
        old = transport_path(dial)
        _before_save[scene.session_uid] = old, dial.own_ending
        if isinstance(blend, str) and blend and scene.library is None and not dial.filepath:
            dial.own_ending = endings.setdefault(old, _free_ending(dial.own_ending, old, Path(blend)))


def _free_ending(ending: str, old: Path, blend: Path) -> str:
    """``ending``, or a longer one if the .blend that a save replaces has another recording there."""
    number, free = 1, ending
    while _is_another(blend.with_suffix(free + ENDING), old):
        number += 1
        free = f"{ending}.{number}"
    return free


def _is_another(new: Path, old: Path) -> bool:
    """True if there is a recording at ``new`` other than that at ``old``. Compressed files differ in their sizes."""
    if new == old or not is_there(new):
        return False
    return not is_file(old) or new.stat().st_size != old.stat().st_size


@bpy.app.handlers.persistent
def follow_save(blend: object = "", *_: object) -> None:
    """Called after a save to the file ``blend``: copy each recording beside a new .blend, which would not find it.

    Called after a failed save, too, and after that of a copy: the open file has its earlier name then.
    """
    for scene in bpy.data.scenes:
        dial = scene.spectral.dial
        old, ending = _before_save.pop(scene.session_uid, (None, ""))
        if old is None:
            continue
        if isinstance(blend, str) and blend and blend != bpy.data.filepath:
            dial.own_ending = ending
            continue
        new = transport_path(dial)
        if old != new and not is_there(new):
            _copy_beside(scene, old, new)
        elif _is_another(new, old):
            dial.message = (
                f"the recording {old} was not copied: {new} is another file; choose another one by Save Transport"
            )


def follow_recording(scene: Scene, written: Path) -> None:
    """Copy a recording that was just written, if a save has given the .blend another name since it was begun."""
    if written != transport_path(scene.spectral.dial):
        _copy_beside(scene, written, transport_path(scene.spectral.dial))


def _copy_beside(scene: Scene, old: Path, new: Path) -> None:
    """Copy a file on a thread."""
    if not is_file(old):
        return
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
        make_folder(new.parent)
        with whole_file(new) as unfinished:
            shutil.copyfile(old, unfinished)
    except (FileWriteError, OSError) as error:
        errors.append(f"the recording {old} could not be copied to {new}: {error}; write it there with Save Transport")


def _report(scene_uid: int, thread: threading.Thread, errors: list[str]) -> float | None:
    """Tell the error of a copy in the panel. Blender's timer calls it until the copy ends."""
    if thread.is_alive():
        return POLL_S
    if bpy.app.is_job_running("RENDER"):
        return RENDER_SECONDS  # nothing is written while a render reads
    for scene in bpy.data.scenes:
        if scene.session_uid == scene_uid and errors:
            scene.spectral.dial.message = errors[0]
    return None
