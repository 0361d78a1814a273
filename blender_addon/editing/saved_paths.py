# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that settings of the extension name relative to the .blend keep their places when it is saved elsewhere.

Blender changes its own relative paths in such a save, but not those of an extension: textures would be missing.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy

from ..properties import hooks
from ..properties.hooks import Topic
from ..translate.shading.texture import NODE, shader_nodes

BESIDE = {("SpectralLightDial", "filepath")}
"""Class and name of paths that always mean a file beside the .blend: a save copies recordings (``dial.paths``)."""
OWNERS = ("scenes", "materials", "lights", "worlds", "volumes")
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


def _moved(text: str, old: Path, new: Path) -> str:
    """The path ``text`` of a file in ``old``, for a file in ``new``."""
    joined = old / text[2:]
    path = os.path.normpath(joined)
    if not Path(path).exists() and joined.exists():  # ".." behind a link to a folder leaves the folder it points to
        path = os.path.realpath(joined)
    moved = _relative(path, new)
    is_lost = moved.startswith("//") and Path(path).exists() and not (new / moved[2:]).exists()
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
    for node in shader_nodes():
        if node.id_data.library is not None:
            continue
        if node.bl_idname == NODE and node.filepath.startswith("//"):
            yield node, "filepath"
        if node.is_property_set("spectral"):  # to read it would make one in each node
            yield from _paths_in(node.spectral)
    for owner in (block for name in OWNERS for block in getattr(bpy.data, name)):
        if owner.library is None:
            yield from _paths_in(owner.spectral)


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


HANDLERS = {"save_pre": point_from, "save_post": take_back, "save_post_fail": take_back}


def register() -> None:
    """Start listening to saves."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    _before_save.clear()
    _declared.cache_clear()
