# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials, lights and worlds in the table, and their renaming or deletion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import bpy
from bpy.types import ID, PropertyGroup

from spectral_core.errors import InvalidInputError

from ... import compat
from ...translate.spectra.stored import library_of
from ..saved_paths import keep_places

POINTERS = {"material": "materials", "light": "lights", "world": "worlds"}
"""Property of a row or column, and the collection of ``bpy.data`` with such data-blocks."""


@dataclass(frozen=True)
class Fault:
    """A row or column whose data-block was renamed, deleted or linked after it was chosen."""

    entry: PropertyGroup
    pointer: str
    kind: Literal["deleted", "renamed", "linked", "unused"]
    text: str


def bound(palette: PropertyGroup) -> Iterator[tuple[PropertyGroup, str, ID | None]]:
    """Every row and column, with the name of each of its pointers and the data-block of that name."""
    for entry in (*palette.lights, *palette.materials):
        for pointer in POINTERS:
            if hasattr(entry, pointer):
                yield entry, pointer, getattr(entry, pointer)


def shared(palette: PropertyGroup) -> list[str]:
    """A sentence for each material, light or world that several rows or columns name; Apply gives it the last one's."""
    names: dict[ID, list[str]] = {}
    for entry, _, block in bound(palette):
        if block is not None:
            names.setdefault(block, []).append(entry.name)
    return [
        f"{block.name!r} is chosen for {' and '.join(each)}, and has the spectrum of {each[-1]}"
        for block, each in names.items() if len(each) > 1
    ]  # fmt: skip


def faults(palette: PropertyGroup) -> list[Fault]:
    """Problems to report to the artist before Apply."""
    found = []
    for entry, pointer, block in bound(palette):
        known = getattr(entry, f"{pointer}_name")
        if block is None:
            if known:
                found.append(Fault(entry, pointer, "deleted", f"{entry.name}: {pointer} {known!r} was deleted"))
        elif not compat.is_editable(block):
            text = f"{entry.name}: {pointer} {block.name!r} is linked from another file"
            found.append(Fault(entry, pointer, "linked", text))
        elif _is_unused(palette, block):  # also one that was renamed before
            text = f"{entry.name}: nothing in the scene uses {pointer} {block.name!r}"
            found.append(Fault(entry, pointer, "unused", text))
        elif known and block.name != known:
            text = f"{entry.name}: {pointer} {known!r} is now named {block.name!r}"
            found.append(Fault(entry, pointer, "renamed", text))
    return found


def _is_unused(palette: PropertyGroup, block: ID) -> bool:
    """True if only tables use a data-block: a deleted object leaves its light behind."""
    tables = [palette, *(each.spectral.palette for each in bpy.data.scenes if each != palette.id_data)]
    own = sum(each == block for table in tables for _, _, each in bound(table))
    return block.users - bool(block.use_fake_user) <= own and not isinstance(block, bpy.types.Material)


def mend(palette: PropertyGroup) -> tuple[list[str], list[str]]:
    """Update names, find data-blocks by their old names, and clear the rest.

    Returns a sentence for each change, and one for each linked data-block that stays linked.
    """
    done, left = [], []
    for fault in faults(palette):
        entry, pointer = fault.entry, fault.pointer
        known, block = getattr(entry, f"{pointer}_name"), getattr(entry, pointer)
        if fault.kind == "renamed":
            if entry.name == known:
                entry.name = block.name
            setattr(entry, f"{pointer}_name", block.name)
            done.append(f"{known} is now {block.name}")
        elif fault.kind in ("deleted", "unused"):
            again = getattr(bpy.data, POINTERS[pointer]).get(known) if fault.kind == "deleted" else None
            setattr(entry, pointer, again)
            done.append(f"{entry.name} has its {pointer} again" if again else f"{entry.name} has no {pointer} any more")
        elif fault.kind == "linked":
            try:
                done.append(make_local(entry, pointer))
            except InvalidInputError as error:
                left.append(str(error))
    return done, left


def make_local(entry: PropertyGroup, pointer: str) -> str:
    """Make the linked data-block of a row or column local; local objects use the local one instead.

    Returns a sentence. Raises InvalidInputError if only linked objects use it, which would keep the linked one.
    """
    block = getattr(entry, pointer)
    require_reached(block)
    name, file = block.name, bpy.path.basename(library_of(block).filepath)
    stays = any(each.library for each in bpy.data.user_map(subset=[block])[block])
    library = block.library.filepath if block.library else ""
    setattr(entry, pointer, block.make_local(clear_liboverride=True))
    if library:
        keep_places(getattr(entry, pointer), library)
    return f"{name} is local now" + (f"; objects that are linked from {file} keep the linked one" if stays else "")


def require_reached(block: ID) -> None:
    """Raise InvalidInputError for a linked data-block of which no local object would use a local copy."""
    tables = () if isinstance(block, bpy.types.World) else bpy.types.Scene  # a scene uses its world, too
    users = [each for each in bpy.data.user_map(subset=[block])[block] if not isinstance(each, tables)]
    if users and all(each.library for each in users):
        file = bpy.path.basename(library_of(block).filepath)
        raise InvalidInputError(
            f"{block.bl_rna.name.lower()} {block.name!r} is used by objects that are linked from {file}; a local copy "
            f"would not change them. Make the objects local first, with their data and materials (Object ▸ Relations ▸ "
            f"Make Local), or open {file}"
        )
