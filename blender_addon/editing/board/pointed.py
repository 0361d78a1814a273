# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths of the numbers of the control under the pointer, for entries in its context menu."""

from collections.abc import Iterable, Iterator

import bpy
from bpy.types import Context

from .paths import full_path


def paths_under_pointer(
    context: Context, kinds: frozenset[str] = frozenset({"FLOAT", "INT"})
) -> Iterator[tuple[str, str]]:
    """Each number of the control under the pointer: the suffix of its menu entry, and its full path.

    ``kinds``: the types of properties to include.
    """
    pointer, known = getattr(context, "button_pointer", None), getattr(context, "button_prop", None)
    if pointer is None or known is None or known.type not in kinds:
        return
    is_custom = known.identifier not in pointer.bl_rna.properties  # Blender calls each of these read-only
    if (known.is_readonly and not is_custom) or (known.type == "ENUM" and known.is_enum_flag):
        return
    block = pointer.id_data
    try:
        holder = "" if pointer == block else pointer.path_from_id()
    except ValueError:
        return  # Blender gives no path to it
    if is_custom:
        path = f'{holder}["{bpy.utils.escape_identifier(known.identifier)}"]'
    else:
        path = f"{holder}." * bool(holder) + known.identifier
    indices: Iterable[int] = (-1,)
    if getattr(known, "is_array", False):  # Blender does not know the length of a custom one
        indices = range(len(pointer[known.identifier]) if is_custom else known.array_length)
    for index in indices:
        yield "" if index < 0 else f" {index + 1}", full_path(block, path, index)
