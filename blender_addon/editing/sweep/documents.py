# SPDX-License-Identifier: GPL-3.0-or-later
"""What a sweep of the open file runs with: its parameters, its folder, its document, its command line."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
from bpy.types import PropertyGroup, Scene

from spectral_core import child
from spectral_core.documents import write_document
from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.explore.sweep.document import FORMAT, VERSION
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.store import Store, cdb_folder
from spectral_core.explore.sweep.sweep import difference, meanings
from spectral_core.files.guarded import is_file
from spectral_core.files.whole import make_folder

from ..background import temporary
from ..board.paths import in_copy
from .settings import follow_names, setting_at, swept_setting


def parameters_of(sweep: PropertyGroup) -> list[Parameter]:
    """The core's parameters. Raises InvalidInputError for an invalid range or name, or without parameters."""
    if not len(sweep.parameters):
        raise InvalidInputError("nothing is swept; right-click a setting and choose Add to Sweep")
    made, folder = [], folder_of(sweep).parent
    for entry in sweep.parameters:
        setting = swept_setting(entry)
        path = in_copy(entry.name, folder)
        if setting.choices:
            choices = _chosen(entry.choices, setting.choices)
            for choice in choices:
                setting.checked(choice)
            made.append(Parameter(entry.label, kind="choice", choices=choices, path=path))
            continue
        kind: Any = "integer" if entry.whole else "real"
        unit = "rad" if setting.is_angle else ""
        made.append(Parameter(entry.label, entry.low, entry.high, unit, entry.scale, kind, path=path))
    return made


def _chosen(text: str, offered: Sequence[str]) -> tuple[str, ...]:
    """The values in the panel's field, separated by commas, which may stand in the names of values, too."""
    words, found = text.split(","), []
    while words:
        names = (",".join(words[:count]).strip() for count in range(len(words), 0, -1))
        known = (one for name in names for one in offered if one.strip() == name)
        value = next(known, words[0].strip())
        found.append(value)
        del words[: value.count(",") + 1]
    return tuple(filter(None, found))


def folder_of(sweep: PropertyGroup) -> Path:
    """Folder of the sweep: beside the file of its scene, or a temporary one if that was never saved."""
    library = sweep.id_data.library
    if sweep.folder.startswith("//") and not bpy.data.filepath and library is None:
        return temporary("sweep.cdb")
    return cdb_folder(Path(bpy.path.abspath(sweep.folder, library=library).rstrip("/\\")))


def require_own_table(scene: Scene, folder: Path, space: Space) -> None:
    """Raise InvalidInputError if a table is of another setting than the one that the scene sweeps by that name."""
    follow_names(scene.spectral.sweep)
    swept = {entry.label: entry.name for entry in scene.spectral.sweep.parameters}
    for parameter in space.parameters:
        own = swept.get(parameter.name, parameter.target)
        if own != parameter.target and _is_setting(parameter.target):
            raise InvalidInputError(
                f"the column {parameter.name!r} in {folder} is of {parameter.target}, and the scene sweeps {own} by "
                "this name; choose another folder for this sweep"
            )


def _is_setting(path: str) -> bool:
    try:
        setting_at(path)
    except InvalidInputError:  # renamed or deleted since
        return False
    return True


def _require_own_folder(scene: Scene, folder: Path, parameters: list[Parameter]) -> None:
    """Raise InvalidInputError before a sweep of other parameters or of another scene is continued in the folder."""
    if not is_file(folder / "project.json"):
        return
    others = [
        other
        for other in bpy.data.scenes
        if other != scene and len(other.spectral.sweep.parameters) and folder_of(other.spectral.sweep) == folder
    ]
    owner = next((other.name for other in others if _has_run(other)), None)
    space, stored = Space(tuple(parameters)), Store.project_of(folder).space
    if meanings(space) != meanings(stored):
        also = f" (the scene {others[0].name!r} has this folder, too)" if others else ""
        what = f"another sweep: its parameters differ{also}: {difference(space, stored)}"
    elif owner is not None and not _has_run(scene):
        what = f"the sweep of the scene {owner!r}"
    else:
        return
    raise InvalidInputError(f"{folder} holds {what}. Choose another folder for this sweep")


def _has_run(scene: Scene) -> bool:
    """True if the sweep of this scene was started; a copy of the scene has another name, and its folder is not its own
    yet.
    """
    return bool(scene.spectral.sweep.swept_as == scene.name)


class Documents:
    """The document of a sweep and the copy of its file, beside its folder.

    Those of an earlier run stay aside until the new run has accepted the folder: it refuses one that holds another
    sweep, and the points that the page adds are rendered from these files. If the run began no sweep, its own files are
    deleted: the copy is as large as the artist's file.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.blend, self.document = (folder.with_suffix(ending) for ending in (".sweep.blend", ".sweep.toml"))
        self._earlier = {each: each.with_name(f"{each.name}.earlier") for each in (self.blend, self.document)}
        self._before = self._stamp()
        if self._before is None or not all(each.is_file() for each in self._earlier):
            self._earlier = {}
        for each, aside in self._earlier.items():
            each.replace(aside)

    def _stamp(self) -> tuple[int, int] | None:
        """A value that changes when a run writes the sweep's project; None without one."""
        try:
            facts = (self.folder / "project.json").stat()
        except OSError:
            return None
        return facts.st_ino, facts.st_mtime_ns

    def look(self) -> None:
        """Delete the earlier files once the run has accepted the folder: it then writes the project."""
        if self._earlier and self._stamp() != self._before:
            for aside in self._earlier.values():
                aside.unlink(missing_ok=True)
            self._earlier = {}

    def settle(self) -> None:
        """The run has ended: put the earlier files back if it has refused the folder."""
        self.look()
        if self._before is None and self._stamp() is None:
            for each in (self.blend, self.document):
                with contextlib.suppress(OSError):
                    each.unlink(missing_ok=True)
        for each, aside in self._earlier.items():
            aside.replace(each)
        self._earlier = {}


def write_documents(scene: Scene) -> Documents:
    """Write a copy of the file and the sweep's document beside the folder."""
    sweep = scene.spectral.sweep
    parameters = parameters_of(sweep)
    folder = folder_of(sweep)
    _require_own_folder(scene, folder, parameters)
    make_folder(folder.parent)
    documents = Documents(folder)
    try:
        _write(sweep, documents, parameters)
    except BaseException:
        documents.settle()
        raise
    sweep.swept_as = scene.name
    return documents


def _write(sweep: PropertyGroup, documents: Documents, parameters: list[Parameter]) -> None:
    blend = documents.blend
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True, check_existing=False)
    except RuntimeError as error:  # Blender's
        raise FileWriteError(
            f"the copy of the file for the sweep could not be written: {str(error).strip().removeprefix('Error: ')}; "
            "choose another folder for the sweep"
        ) from error
    compute = {
        "kind": "blend", "blend": blend.name, "scene": sweep.id_data.name,
        "percentage": sweep.percentage, "samples": sweep.samples,
    }  # fmt: skip
    contents = {
        "format": FORMAT, "version": VERSION, "compute": compute,
        "design": {"kind": sweep.design, "budget": sweep.budget},
        "parameters": [parameter.to_dict() for parameter in parameters],
    }  # fmt: skip
    write_document(documents.document, contents, comment="Made by the panel Sweep in Blender.")


def command_line(document: Path, folder: Path, workers: int, *more: str) -> list[str]:
    """The command that runs a sweep in the present Blender; ``more``: further options."""
    words = ["sweep", str(document), "--out", str(folder), "--workers", str(workers), *more]
    package = __package__.rsplit(".", 2)[0]
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
