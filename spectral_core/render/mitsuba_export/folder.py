# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the folder of an export: whole, or not at all, and never over files of another origin."""

from __future__ import annotations

import hashlib
import json
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.whole import make_folder, write_text
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.bodies import Bodies
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_export.lamps import environment, lamp
from spectral_core.render.mitsuba_export.media import medium, volume
from spectral_core.render.mitsuba_export.view import integrator, sensor
from spectral_core.render.mitsuba_scene.assemble import bounding_sphere
from spectral_core.render.mitsuba_scene.paint import unit_luminance
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import Note, Scene, require_scene

SCENE_FILE, LIST_FILE = "scene.xml", "export.json"
FORMAT = "spectral-scene, scene for Mitsuba 3"


@dataclass(frozen=True, slots=True)
class MitsubaExport:
    """A written export: ``scene``, the file for ``mitsuba.load_file``, all ``files`` relative to its folder, and the
    parts of the scene that Mitsuba has no counterpart for (``notes``).
    """

    scene: Path
    files: tuple[str, ...]
    notes: tuple[Note, ...]


def write_mitsuba(scene: Scene, folder: str | Path) -> MitsubaExport:
    """Write a scene as files that Mitsuba 3 loads without this package.

    ``scene.xml`` and, beside it, ``meshes/``, ``textures/``, ``spectra/``, ``volumes/`` and ``export.json``, which
    lists the files and the notes. An earlier export in the folder is replaced if none of its files was changed.

    Parameters
    ----------
    scene : the scene; of a moving one the first moment is written.
    folder : where to write; it is created.

    Returns
    -------
    MitsubaExport

    Raises
    ------
    InvalidInputError
        The folder contains files that are not of an export, or were changed since.
    FileWriteError
        The disk is full or the folder cannot be written; an earlier export is as it was.
    """
    require_scene(scene)
    target = Path(folder).expanduser().absolute()
    _require_own(target)
    draft, root = described(scene)
    texts = [{"subject": note.subject, "message": note.message} for note in draft.notes]
    with _new_folder(target) as unfinished:
        for path, write in draft.files.items():
            (unfinished / path).parent.mkdir(exist_ok=True)
            write(unfinished / path)
        write_text(unfinished / SCENE_FILE, xml.text_of(root))
        names = sorted((*draft.files, SCENE_FILE))
        listed = {"format": FORMAT, "notes": texts, "files": {name: _digest(unfinished / name) for name in names}}
        write_text(unfinished / LIST_FILE, json.dumps(listed, indent=1, ensure_ascii=False) + "\n")
    return MitsubaExport(target / SCENE_FILE, (*names, LIST_FILE), tuple(draft.notes))


def described(scene: Scene) -> tuple[Draft, Any]:
    """Files and notes of an export, and the root of its XML."""
    white = None if scene.settings.white is None else unit_luminance(scene.settings.white)
    draft = Draft(white=white, brightness=scene.film.exposure)
    for note in scene.notes:
        draft.note(note.subject, note.message)
    if scene.moments:
        draft.note("Motion", "one moment of the moving scene is written, without motion blur")
        scene = scene.at(scene.moments[0])
    if scene.film.exposure != 1.0:
        draft.note("Film", f"the exposure of {scene.film.exposure:g} is a factor on all lights")
    bounces = plan_from_data(scene).bounces
    fog = scene.world.medium
    filled = None if fog is None else medium(draft, fog, "World", "world_medium")
    around = [] if filled is None else [filled]
    bodies = Bodies(draft, scene, "world_medium" if around else "")
    shapes = bodies.shapes()
    sphere = bounding_sphere(scene)
    lights = [made for light in scene.lights for made in lamp(draft, light, sphere)]
    world = environment(draft, scene.world)
    volumes = [volume(draft, item) for item in scene.volumes]
    view = sensor(draft, scene, "world_medium" if around else "")
    first = integrator(draft, scene, bounces)
    parts = [first, *around, view, *bodies.defined, *shapes, *volumes, *lights, *([] if world is None else [world])]
    return draft, xml.scene(parts)


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _require_own(target: Path) -> None:
    """Raise InvalidInputError if a folder has any file that is not of an unchanged export."""
    if not target.exists() and not target.is_symlink():
        return
    if not target.is_dir() or target.is_symlink():
        raise InvalidInputError(f"{target} is no folder; name a folder to write the scene to")
    found = sorted(str(path.relative_to(target).as_posix()) for path in target.rglob("*") if not path.is_dir())
    if not found:
        return
    listed = _listed(target)
    for name in found:
        if name == LIST_FILE and listed:
            continue
        if name not in listed:
            raise InvalidInputError(
                f"{target} contains {name}, which is not of an export to Mitsuba, so nothing is replaced there; "
                "choose another folder"
            )
        if _digest(target / name) != listed[name]:
            raise InvalidInputError(
                f"{target / name} was changed after its export, so nothing is replaced there; choose another folder"
            )


def _listed(target: Path) -> dict[str, str]:
    """Files of an export with their digests; none without a list that can be read, or for a list of another program."""
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        content = json.loads((target / LIST_FILE).read_text("utf-8"))
        if content["format"] == FORMAT:
            return dict(content["files"])
    return {}


@contextmanager
def _new_folder(target: Path) -> Iterator[Path]:
    """A new folder beside ``target`` that replaces it when the block ends without an error."""
    unfinished = target.with_name(f".{target.name}-unfinished-{secrets.token_hex(8)}")
    try:
        make_folder(target.parent)
        unfinished.mkdir()
        yield unfinished
        _exchange(unfinished, target)
    except OSError as error:
        raise FileWriteError(f"{target} could not be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _exchange(new: Path, target: Path) -> None:
    if not target.exists():
        new.rename(target)
        return
    earlier = new.with_name(f"{new.name}-earlier")
    target.rename(earlier)
    try:
        new.rename(target)
    except OSError:
        earlier.rename(target)
        raise
    shutil.rmtree(earlier, ignore_errors=True)
