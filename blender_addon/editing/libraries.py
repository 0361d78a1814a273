# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked libraries of the open file that were not found, or that lack what is linked from them."""

from __future__ import annotations

from typing import Any

import bpy

from spectral_core.errors import first_of
from spectral_core.files.guarded import is_file

MOST_LOST = 8
"""Missing data of a library that a note names."""


def library_notes() -> list[str]:
    """Notes on linked libraries that were not found, and on data that a library no longer has: the picture lacks them.

    A library that is packed into the file, or whose data are, has no file where its path leads.
    """
    notes: list[str] = []
    lost: dict[Any, list[str]] = {library: [] for library in bpy.data.libraries}
    for block in bpy.data.user_map():
        if block.library is not None and block.is_missing:  # an empty one of Blender's is in its place
            lost[block.library].append(f"{block.bl_rna.name.lower()} {block.name!r}")
    for library, names in lost.items():
        if library.is_missing:
            is_there = is_file(bpy.path.abspath(library.filepath))
            why = "cannot be read" if is_there else "was not found"
            notes.append(f"{library.name}: the linked library {library.filepath} {why}; its contents are missing")
        elif names:
            shown = first_of(sorted(names), len(names), MOST_LOST)
            notes.append(f"{library.name}: the linked library {library.filepath} does not have {shown}")
    return notes
