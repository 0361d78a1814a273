# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of a .blend file by the text of Blender's "Copy Full Data Path"; the text is never evaluated."""

from __future__ import annotations

import ast
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
from bpy.types import ID

from spectral_core.errors import InvalidInputError

_QUOTED = r"""(?:"((?:[^"\\]|\\.)*)"|'((?:[^'\\]|\\.)*)')"""
_FULL = re.compile(rf"bpy\.data\.(\w+)\[{_QUOTED}(?:,\s*{_QUOTED})?\](.*)", re.S)
"""Collection, name, library of linked data, and the rest, with two groups for each text in quotes."""
_TEXT = re.compile(_QUOTED)
_INDEXED = re.compile(r"(.*)\[(\d+)\]", re.S)
_CUSTOM = re.compile(r'(.*)\["((?:[^"\\]|\\.)*)"\]', re.S)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "a": "\a", "b": "\b", "f": "\f"}
"""Letters that stand for others after a backslash, in names that a script has given."""
WIDEST = 1e4
"""A soft limit from this on is no range for a fader: Blender gives 10,000 to numbers of nodes without limits."""


@dataclass(frozen=True)
class Number:
    """One number: attribute ``name`` of ``owner`` (a key where ``is_custom``), element ``index`` of it if not None."""

    owner: Any
    name: str
    index: int | None
    is_custom: bool

    def read(self) -> float:
        """Its present value."""
        value = self.owner[self.name] if self.is_custom else getattr(self.owner, self.name)
        return float(value if self.index is None else value[self.index])

    def write(self, value: float) -> None:
        """Set it, like its slider; an integer is rounded. Raises InvalidInputError if Blender refuses the value."""
        whole = isinstance(self.element(), int)
        given: Any = round(value) if whole else value
        try:
            self._set(given)
        except (ValueError, OverflowError, TypeError, AttributeError, RuntimeError) as error:
            raise InvalidInputError(
                f"{self.name!r} cannot be set to {value:g} ({error}); choose values that Blender accepts"
            ) from error
        self.tag()

    def _set(self, given: Any) -> None:
        if self.index is not None:
            values = self.owner[self.name] if self.is_custom else getattr(self.owner, self.name)
            values[self.index] = given
        elif self.is_custom:
            self.owner[self.name] = given
        else:
            setattr(self.owner, self.name, given)

    def tag(self) -> None:
        """Notify Blender of a new value in a custom property, which it does not watch."""
        if self.is_custom:
            self.owner.id_data.update_tag()

    def element(self) -> Any:
        """The value at the path."""
        value = self.owner[self.name] if self.is_custom else getattr(self.owner, self.name)
        return value if self.index is None else value[self.index]

    def range(self) -> tuple[float, float]:
        """Range of its slider; twice its value if the slider is unbounded."""
        present = self.read()
        least, most = self._soft_limits()
        low = least if abs(least) < WIDEST else min(0.0, 2 * present)
        high = most if abs(most) < WIDEST else max(1.0, 2 * abs(present))
        return (low, high) if high > low else (low, low + 1.0)

    def ui(self) -> dict[str, Any]:
        """What Blender knows of a custom property: its limits, its subtype, the items of its list."""
        known: dict[str, Any] = self.owner.id_properties_ui(self.name).as_dict()
        return known

    def _soft_limits(self) -> tuple[float, float]:
        if not self.is_custom:
            known = self.owner.bl_rna.properties[self.name]
            return _own_limits(self.owner, self.name) or (float(known.soft_min), float(known.soft_max))
        known = self.ui()
        return float(known.get("soft_min", -math.inf)), float(known.get("soft_max", math.inf))


def _own_limits(owner: Any, name: str) -> tuple[float, float] | None:
    """Limits that a slider has from its data, not from its type: those of a shape key, and of an input of a group."""
    if isinstance(owner, bpy.types.ShapeKey) and name == "value":
        return float(owner.slider_min), float(owner.slider_max)
    if not isinstance(owner, bpy.types.NodeSocket) or name != "default_value":
        return None
    group = getattr(owner.node, "node_tree", None)
    items = () if group is None or owner.is_output else group.interface.items_tree
    found = next((item for item in items if getattr(item, "identifier", None) == owner.identifier), None)
    low, high = getattr(found, "min_value", None), getattr(found, "max_value", None)
    return None if low is None or high is None else (float(low), float(high))


def number_at(path: str) -> Number:
    """The number at a full data path. Raises InvalidInputError if the path leads nowhere or to no number."""
    block, rest = block_at(path)
    found = place_in(block, rest)
    element = None if found is None else found.element()
    if found is None or not isinstance(element, (int, float)) or isinstance(element, bool):
        raise InvalidInputError(f"{path!r} is not a number that a fader can move")
    return found


def block_at(path: str) -> tuple[ID, str]:
    """The data-block at the start of a full data path, and the rest of it. Raises InvalidInputError if none is."""
    full = _FULL.fullmatch(path.strip())
    blocks = getattr(bpy.data, full[1], None) if full else None
    if full is None or blocks is None or not hasattr(blocks, "get"):
        raise InvalidInputError(
            f'{path!r} is no data path; expected one as Copy Full Data Path gives it: bpy.data.lights["Key"].energy'
        )
    name, library = (_plain(full[2] or full[3] or ""), _plain(full[4] or full[5] or ""))
    block = (blocks.get((name, library)) or _linked(blocks, name, library)) if library else blocks.get(name)
    if block is None:
        linked = f", linked from {library}" if library else ""
        raise InvalidInputError(f"{path!r}: this file has no {full[1]} named {name!r}{linked}")
    return block, _TEXT.sub(_in_double_quotes, full[6])


def _linked(blocks: Any, name: str, library: str) -> ID | None:
    """The data-block from a library whose path is written in another way."""
    wanted = _whole(library)
    return next(
        (each for each in blocks if each.name == name and each.library and _whole(each.library.filepath) == wanted),
        None,
    )


def _whole(path: str) -> str:
    return os.path.normcase(os.path.normpath(bpy.path.abspath(path)))


def in_copy(path: str, folder: Path) -> str:
    """The full data path of the same setting in a copy of the open file in a folder: Blender keeps the relative paths
    of libraries relative to the file.
    """
    full = _FULL.fullmatch(path.strip())
    library = _plain(full[4] or full[5] or "") if full is not None else ""
    if full is None or not library.startswith("//"):
        return path
    there = bpy.path.relpath(os.path.normpath(bpy.path.abspath(library)), start=str(folder)).replace("\\", "/")
    if _whole(bpy.path.abspath(there)) == _whole(library):  # beside the file: as it is written
        return path
    names = ", ".join(_quoted(name) for name in (_plain(full[2] or full[3] or ""), there))
    return f"bpy.data.{full[1]}[{names}]{full[6]}"


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _in_double_quotes(text: re.Match[str]) -> str:
    """A text of a path in double quotes, the only ones that Blender reads; scripts often have single ones."""
    if text[2] is None:
        return text[0]
    letters = {"\\'": "'", '"': '\\"'}
    inner = re.sub(r'\\.|"', lambda letter: letters.get(letter[0], letter[0]), text[2], flags=re.S)
    return f'"{inner}"'


def place_in(block: ID, rest: str) -> Number | None:
    """The property of a data-block at the rest of a full data path, of any type; None if nothing can be set."""
    rest = rest.removeprefix(".")
    indexed = _INDEXED.fullmatch(rest)
    place, index = (indexed[1], int(indexed[2])) if indexed else (rest, None)
    custom = _CUSTOM.fullmatch(place)
    owner_path, _, name = (custom[1], "", _plain(custom[2])) if custom else place.rpartition(".")
    try:
        owner = block.path_resolve(owner_path) if owner_path else block
        number = Number(owner, name, index, custom is not None)
        number.element()
        fixed = not custom and owner.bl_rna.properties[name].is_readonly
    except (ValueError, KeyError, AttributeError, IndexError, TypeError):
        return None
    return None if fixed else number


def _plain(quoted: str) -> str:
    """The text between the quotes of a path, as Blender reads it."""
    return re.sub(r"\\(.)", lambda letter: _ESCAPED.get(letter[1], letter[1]), quoted, flags=re.S)


def full_path(block: ID, data_path: str, index: int = -1) -> str:
    """The text for a property of a data-block, as Copy Full Data Path gives it."""
    dot = "" if data_path.startswith("[") else "."  # a custom property
    return f"{block_path(block)}{dot}{data_path}" + (f"[{index}]" if index >= 0 else "")


def block_path(block: ID) -> str:
    """The text for a data-block by its present name; an embedded node tree is reached through its owner."""
    text = repr(block)  # Python's own quotes, which differ with the name
    node = ast.parse(text, mode="eval").body
    while isinstance(node, ast.Attribute):
        node = node.value
    key = node.slice if isinstance(node, ast.Subscript) else None
    key = key.elts[0] if isinstance(key, ast.Tuple) else key  # with its library
    if not isinstance(node, ast.Subscript) or not isinstance(key, ast.Constant):
        raise InvalidInputError(f"{text} has no data path for a fader")
    names = [str(key.value), *([block.library.filepath] if block.library else [])]
    quoted = ", ".join(map(_quoted, names))
    rest = text.encode()[node.end_col_offset :].decode()
    return f"{text.partition('[')[0]}[{quoted}]{rest}"


def renamed(path: str, block: ID) -> str:
    """``path`` with the present name of its data-block."""
    full = _FULL.fullmatch(path.strip())
    return path if full is None else f"{block_path(block)}{full[6]}"
