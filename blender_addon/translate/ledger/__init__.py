# SPDX-License-Identifier: GPL-3.0-or-later
"""The ledger: every setting of Blender is read, has no effect on a picture, or is named in a note.

One TOML file per category, a table per Blender type: ``read`` (names whose values are translated, or that the
translation itself names in a note), ``no_effect`` (names that change no picture), and ``noted``: name = text for the
user if the setting is not at its default. ``tests/blender/test_ledger.py`` walks Blender's own type information: a
setting that is in none of the three, such as one of a new Blender version, fails it.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ..context import Translation

FOLDER = Path(__file__).parent
MADE_WITH: dict[str, dict[str, Any]] = {
    "TexMapping": {"scale": (1.0,) * 3, "max": (1.0,) * 3, "mapping_x": "X", "mapping_y": "Y", "mapping_z": "Z"}
}
"""Initial values of a struct that differ from its type information."""


@dataclass(frozen=True)
class Entry:
    """Data on the settings of one Blender type.

    ``noted``: name to message. ``needs``: name to the path of a setting of the data-block without which it has no
    effect. ``harmless``: values other than the default that need no note. ``stand_in``: True for a node that is named
    as a whole. Inputs of nodes are ``input:IDENTIFIER`` with ``_`` for a space; ``*`` represents all
    names.
    """

    read: frozenset[str]
    no_effect: frozenset[str]
    noted: dict[str, str]
    needs: dict[str, str]
    harmless: dict[str, Any]
    stand_in: bool

    def accounts_for(self, name: str) -> bool:
        """True if a setting is read, has no effect, or is noted."""
        known = self.read | self.no_effect | frozenset(self.noted)
        return self.stand_in or "*" in known or name.replace(" ", "_") in known


@cache
def entries() -> dict[str, Entry]:
    """Entry by Blender type, of all categories."""
    found: dict[str, Entry] = {}
    for path in sorted(FOLDER.glob("*.toml")):
        for kind, table in tomllib.loads(path.read_text("utf-8")).items():
            found[kind] = Entry(
                read=frozenset(table.get("read", "").split()),
                no_effect=frozenset(table.get("no_effect", "").split()),
                noted=table.get("noted", {}),
                needs=table.get("needs", {}),
                harmless=table.get("harmless", {}),
                stand_in=table.get("stand_in", False),
            )
    return found


def note_changed(translation: Translation, subject: str, item: Any) -> None:
    """Add a note for every noted setting of a Blender item (or struct) that is not at its default; None is no item."""
    if item is None:
        return
    entry = entries().get(item.bl_rna.identifier)
    for name, message in (entry.noted if entry is not None else {}).items():
        if name not in item.bl_rna.properties or at_default(item, name):
            continue
        if entry is not None and name in entry.needs and not item.id_data.path_resolve(entry.needs[name]):
            continue
        if entry is None or entry.harmless.get(name, item) != getattr(item, name):
            translation.note(subject, message)


def at_default(item: Any, name: str) -> bool:
    """True if a setting has its initial value; for a struct if all its settings do."""
    declared = item.bl_rna.properties[name]
    value = getattr(item, name)
    if declared.type == "POINTER":
        if value is None or declared.is_readonly is False:
            return value is None
        return all(at_default(value, each.identifier) for each in _settings(value))
    if declared.type == "COLLECTION":
        return len(value) == 0
    if name in MADE_WITH.get(item.bl_rna.identifier, {}):
        return np.array_equal(np.ravel(value), np.ravel(MADE_WITH[item.bl_rna.identifier][name]))
    if declared.type == "ENUM":
        return value == (declared.default_flag if declared.is_enum_flag else declared.default)
    if getattr(declared, "is_array", False):
        return bool(np.allclose(np.ravel(value), declared.default_array[: np.size(value)], atol=1e-6))
    if declared.type == "FLOAT":
        return math.isclose(value, declared.default, rel_tol=1e-5, abs_tol=1e-7)  # np.isclose takes 50 times as long
    return bool(value == declared.default)


def _settings(item: Any) -> Iterator[Any]:
    return (each for each in item.bl_rna.properties if not each.is_readonly and each.type != "POINTER")


def note_nodes(translation: Translation, owner: str, tree: Any, seen: set[int] | None = None) -> None:
    """Add a note for the noted settings and inputs of every node of a tree, groups included, that are not at their
    defaults.
    """
    seen = set() if seen is None else seen
    if tree is None or tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        if node.mute:
            continue
        note_nodes(translation, owner, getattr(node, "node_tree", None), seen)
        entry = entries().get(node.bl_idname)
        for name, message in (entry.noted if entry is not None else {}).items():
            if name.startswith("input:"):
                changed = any(not _is_still(socket, node) for socket in node.inputs if _name(socket) == name)
            else:
                changed = name in node.bl_rna.properties and not at_default(node, name)
            if changed and any(socket.is_linked for socket in node.outputs):
                translation.note(owner, f"{node.label or node.bl_label!r}: {message}")


def _is_still(socket: Any, node: Any) -> bool:
    """True if an input is not linked and 0, so that a noted feature has no effect."""
    if socket.is_linked:
        return False
    value = getattr(socket, "default_value", 0.0)
    return not socket.enabled or bool(np.all(np.ravel(value) == 0)) if not isinstance(value, str) else True


def _name(socket: Any) -> str:
    """Name of an input in the ledger."""
    return f"input:{socket.identifier.replace(' ', '_')}"
