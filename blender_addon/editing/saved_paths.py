# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that settings of the extension name relative to the .blend keep their places when it is saved elsewhere, and
when data-blocks are appended to another one.

Blender changes its own relative paths then, but not those of an extension: textures would be missing.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy

from spectral_core.files.guarded import is_there

from ..properties import hooks
from ..properties.hooks import Topic
from ..translate.shading.texture import NODE, shader_nodes_of

BESIDE = {("SpectralLightDial", "filepath")}
"""Class and name of paths that always mean a file beside the .blend: a save copies recordings (``dial.paths``)."""
OWNERS = ("scenes", "materials", "lights", "worlds", "volumes", "node_groups")
HAS_NODES = (bpy.types.Material, bpy.types.Light, bpy.types.World, bpy.types.NodeTree)
HAS_SETTINGS = (bpy.types.Scene, bpy.types.Material, bpy.types.Light, bpy.types.World, bpy.types.Volume)
APPENDED = ("MAKE_LOCAL", "COPY_LOCAL")
"""What Blender does with a data-block that is new in this file; others stay linked, or were appended before."""
CLIPBOARD = "copybuffer"
"""How the files begin that Blender copies objects and materials to."""
TOPICS = (Topic.SPECTRAL_TEXTURE, Topic.SPECTRUM_CHOICE)
"""Listeners that would read the files again, which are the same."""

Place = tuple[Any, str]
"""A property group or node, and the name of a path in it."""

_before_save: list[tuple[Place, str]] = []
"""The paths that a save under way has changed, as they were."""


@bpy.app.handlers.persistent
def point_from(blend: object = "", *_: object) -> None:
    """Called before a save to the file ``blend``: let relative paths count from its folder."""
    _before_save.clear()
    if not (isinstance(blend, str) and blend and bpy.data.filepath):
        return
    old, new = Path(bpy.data.filepath).parent, Path(blend).parent
    if old == new:
        return
    for place in _relative_paths():
        text = getattr(*place)
        _before_save.append((place, text))
        _set(place, _moved(text, old, new))


@bpy.app.handlers.persistent
def take_back(blend: object = "", *_: object) -> None:
    """Called after a save to the file ``blend``, a failed one too: a copy leaves the open file where it is."""
    if blend != bpy.data.filepath:
        for place, text in _before_save:
            _set(place, text)
    _before_save.clear()


@bpy.app.handlers.persistent
def point_from_here(imported: Any, *_: object) -> None:
    """Called after data-blocks were linked or appended: let relative paths of appended ones count from this file."""
    for item in imported.import_items:
        source = item.source_library
        if item.id is not None and source is not None and item.append_action in APPENDED:
            keep_places(item.id, source.filepath)


def keep_places(block: Any, library: str) -> None:
    """Let the relative paths of a data-block that has become local count from this file; they are as in ``library``.

    Those of the clipboard stay: they count from the file that was copied from, mostly this one.
    """
    source = Path(bpy.path.abspath(library))
    if block.library is not None or source.name.startswith(CLIPBOARD):
        return
    here = Path(bpy.data.filepath).parent if bpy.data.filepath else None
    for place in list(_relative_paths_of(block)):
        text = getattr(*place)
        _set(place, _moved(text, source.parent, here) if here else os.path.normpath(source.parent / text[2:]))


def _moved(text: str, old: Path, new: Path) -> str:
    """The path ``text`` of a file in ``old``, for a file in ``new``."""
    joined = old / text[2:]
    path = os.path.normpath(joined)
    if not is_there(path) and is_there(joined):  # ".." behind a link to a folder leaves the folder it points to
        path = os.path.realpath(joined)
    moved = _relative(path, new)
    is_lost = moved.startswith("//") and is_there(path) and not is_there(new / moved[2:])
    return path if is_lost else moved  # no relative path leads out of a link to a folder as its name suggests


def _relative(path: str, folder: Path) -> str:
    """A path as Blender writes it relative to a file in ``folder``."""
    try:
        return "//" + os.path.relpath(path, folder).replace("\\", "/")
    except ValueError:  # on another drive of Windows
        return path


def _set(place: Place, text: str) -> None:
    with hooks.silenced(TOPICS[0]), hooks.silenced(TOPICS[1]):
        setattr(*place, text)


def _relative_paths() -> Iterator[Place]:
    """Each path of this file, not of its libraries, that is relative to it."""
    for block in (each for name in OWNERS for each in getattr(bpy.data, name)):
        if block.library is None:
            yield from _relative_paths_of(block)


def _relative_paths_of(block: Any) -> Iterator[Place]:
    if isinstance(block, HAS_NODES):
        for node in shader_nodes_of(block):
            if node.bl_idname == NODE and node.filepath.startswith("//"):
                yield node, "filepath"
            if node.is_property_set("spectral"):  # to read it would make one in each node
                yield from _paths_in(node.spectral)
    if isinstance(block, HAS_SETTINGS):
        yield from _paths_in(block.spectral)


def _paths_in(group: Any) -> Iterator[Place]:
    kind: Any = type(group)
    names, inner = _declared(kind)
    for name in names:
        if getattr(group, name).startswith("//"):
            yield group, name
    for name, is_list in inner:
        value = getattr(group, name)
        for each in value if is_list else (value,):
            yield from _paths_in(each)


@lru_cache(maxsize=64)
def _declared(kind: Any) -> tuple[tuple[str, ...], tuple[tuple[str, bool], ...]]:
    """Names of the paths of a property group, and those of groups and lists of groups in it that have paths, each with
    True if it is a list.
    """
    names: list[str] = []
    inner: list[tuple[str, bool]] = []
    for each in kind.bl_rna.properties:
        if each.type == "STRING" and each.subtype == "FILE_PATH" and (kind.__name__, each.identifier) not in BESIDE:
            names.append(each.identifier)
        if each.type not in ("POINTER", "COLLECTION"):
            continue
        held = bpy.types.PropertyGroup.bl_rna_get_subclass_py(each.fixed_type.identifier)
        if held is not None and any(_declared(held)):
            inner.append((each.identifier, each.type == "COLLECTION"))
    return tuple(names), tuple(inner)


HANDLERS = {
    "save_pre": point_from,
    "save_post": take_back,
    "save_post_fail": take_back,
    "blend_import_post": point_from_here,
}


def register() -> None:
    """Start listening to saves and imports."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    _before_save.clear()
    _declared.cache_clear()
