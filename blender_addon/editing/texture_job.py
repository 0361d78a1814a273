# SPDX-License-Identifier: GPL-3.0-or-later
"""Design of a spectral texture in a separate process; Blender stays responsive and shows the progress."""

from __future__ import annotations

import json
import time
from pathlib import Path

import bpy
from bpy.types import Image, PropertyGroup, Scene

from spectral_core import child
from spectral_core.documents import write_document
from spectral_core.errors import InvalidInputError, RenderError
from spectral_core.files.whole import make_folder
from spectral_core.palette.texture.project import document_of
from spectral_core.render.process.interpreter import find_python
from spectral_core.spectra.color import display_rgb_from_linear

from ..translate.texture.project import project_of, report_lines
from .background import DISABLED_MEANWHILE, SAVED_MEANWHILE, BackgroundCommand, settle, temporary, told_if_temporary
from .deferred import RENDER_SECONDS, open_scene, redraw

POLL_S = 0.25
DOCUMENT = "texture.toml"
_job: Job | None = None


class Job(BackgroundCommand):
    """The design, and the scene that waits for it."""

    def __init__(self, scene: Scene, document: Path, folder: Path) -> None:
        self.folder = folder
        self._scene_uid = scene.session_uid  # it does not change when the scene is renamed
        words = ("texture", str(document), "--out", str(folder), "--progress")
        super().__init__(child.command(find_python(), "spectral_core.cli", *words))

    @property
    def scene(self) -> Scene | None:
        """The scene, None if it was deleted or its file is not open any more."""
        return open_scene(self._scene_uid)


def running() -> bool:
    """True while a texture is being designed."""
    return _job is not None and _job.process.poll() is None


def scene_of_job() -> Scene | None:
    """The scene of the present design, None if nothing is designed or the scene was deleted."""
    return _job.scene if _job is not None and running() else None


def _forget() -> None:
    """End the design."""
    global _job
    if _job is not None:
        job, _job = _job, None
        job.end()
        job.log.close()


def folder_of(design: PropertyGroup) -> Path:
    """Folder of the files: beside the .blend of its scene, or a temporary one if that was never saved."""
    library = design.id_data.library
    if design.folder.startswith("//") and not bpy.data.filepath and library is None:
        return temporary("spectral_texture")
    return Path(bpy.path.abspath(design.folder, library=library))


def _require_own(folder: Path, scene: Scene) -> None:
    """Raise InvalidInputError if the folder has the texture of another scene, whose files have the same names."""
    for other in bpy.data.scenes:
        design = other.spectral.texture
        is_own = design.texture_file and design.designed_as == other.name  # not that of the scene that it is a copy of
        if other != scene and is_own and folder_of(design).absolute() == folder.absolute():
            raise InvalidInputError(
                f"the folder {folder} has the texture of the scene {other.name!r}, which would be lost; choose another "
                "folder for this one"
            )


def start(scene: Scene) -> None:
    """Start a design. Raises InvalidInputError if something is missing, or if a design is running."""
    global _job
    if running():
        raise InvalidInputError("a texture is being designed; wait for it or cancel it")
    design = scene.spectral.texture
    folder = folder_of(design)
    _require_own(folder, scene)
    make_folder(folder)
    project = project_of(design, folder)
    document = folder / DOCUMENT
    write_document(document, document_of(project), comment="Made by the panel Spectral Texture in Blender.")
    _forget()
    _job = Job(scene, document, folder)
    design.status, design.progress, design.failed, design.is_under_way = "starting", 0.0, False, True


def look() -> bool:
    """Update the design's progress; True while it runs."""
    global _job
    if _job is None:
        return False
    job = _job
    code, scene = job.process.poll(), job.scene
    if scene is None:
        _forget()
        return False
    design, words = scene.spectral.texture, job.lines()
    steps = [line.split(maxsplit=2) for line in words if line.startswith("progress ")]
    if steps and len(steps[-1]) == 3:  # the last line may not be complete yet
        design.progress, design.status = float(steps[-1][1]), steps[-1][2]
    design.is_under_way = code is None
    if code is None:
        return True
    _job, message = None, job.message()
    job.log.close()
    design.failed = code != 0
    if code:
        design.status = (message or f"it ended with status {code}").removeprefix("spectral-scene texture: ")
    else:
        try:
            _take_over(design, job.folder)
        except (OSError, ValueError, KeyError, RuntimeError) as error:  # its files were deleted or changed
            design.failed = True
            design.status = f"the files of the design in {job.folder} cannot be read ({error}); design it again"
    return False


def _take_over(design: PropertyGroup, folder: Path) -> None:
    figures = json.loads((folder / "report.json").read_text("utf-8"))
    design.texture_file, design.designed_as = str(folder / "texture.exr"), design.id_data.name
    design.report = "\n".join(report_lines(figures))
    design.status = told_if_temporary(folder)
    for number in (1, 2):
        path = folder / f"lost_{number}.png"
        has = number <= len(figures["pictures"])
        setattr(design, f"lost_{number}", _loaded(path, f"Lost {number}") if has else None)
    for wanted, outcome in zip(design.wanted_colors, figures.get("wanted_colors", ()), strict=False):
        wanted.reached = display_rgb_from_linear([min(max(value, 0.0), 1.0) for value in outcome["color"]])
        wanted.outcome = f"ΔE {outcome['delta_e']:.1f}" + ("" if outcome["reachable"] else ", nearest")


def _loaded(path: Path, name: str) -> Image:
    image = bpy.data.images.load(str(path), check_existing=True)
    image.reload()
    image.name = name
    image.preview_ensure()
    return image


def watch() -> None:
    """Update the progress by a timer until the design ends."""
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=POLL_S, persistent=True)


def tick() -> float | None:
    """Update the progress. Blender's timer calls this."""
    if bpy.app.is_job_running("RENDER"):
        return RENDER_SECONDS  # nothing is written while a render reads
    was_open, is_running = _job is not None, look()
    _settle_others()
    redraw("VIEW_3D")
    if is_running:
        return POLL_S
    if was_open:  # else the next undo of something else would take the outcome away, too
        bpy.ops.ed.undo_push(message="Design Texture")
    return None


def wait() -> None:
    """Wait for the design, without a window. Raises RenderError if it failed."""
    scene = _job.scene if _job is not None else None
    while look():
        time.sleep(0.05)
    if scene is not None and scene.spectral.texture.failed:
        raise RenderError(scene.spectral.texture.status)


def cancel() -> None:
    """End the design. Raises InvalidInputError if none is running."""
    if _job is None or not running():
        raise InvalidInputError("no texture is being designed")
    scene = _job.scene
    _forget()
    if scene is not None:
        scene.spectral.texture.status, scene.spectral.texture.is_under_way = "cancelled", False


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    """Another file is open: end the design of the earlier one, which nothing can take over."""
    settle((scene.spectral.texture for scene in bpy.data.scenes), SAVED_MEANWHILE.format(button="Design Texture"))
    if _job is not None:
        _forget()
        for scene in bpy.data.scenes:
            scene.spectral.texture.status = "the design of the earlier file was ended; press Design Texture there again"


@bpy.app.handlers.persistent
def _settle_others(*_: object) -> None:
    """An undo step or a copy of the scene, made during a design, says that it goes on; Blender reports no copy."""
    settle((scene.spectral.texture for scene in bpy.data.scenes if scene != scene_of_job()), "")


HANDLERS = {"load_post": _after_load, "undo_post": _settle_others, "redo_post": _settle_others}


def register() -> None:
    """Start listening to files that are opened, and to undo."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """End the job."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    _forget()
    settle((scene.spectral.texture for scene in bpy.data.scenes), DISABLED_MEANWHILE.format(button="Design Texture"))
