# SPDX-License-Identifier: GPL-3.0-or-later
"""Files and notes of an export while it is made; nothing is written yet."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.scene import Note, scene_hash
from spectral_core.spectra.spectrum import Spectrum

LABELS = {
    "terminator_cosine": "Shadow Terminator: Geometry Offset", "terminator_shift": "Shadow Terminator: Shading Offset",
}  # fmt: skip
"""Blender's labels of fields whose own names an artist would not know."""


@dataclass
class Draft:
    """An export in progress.

    ``files``: writers by relative path. ``white``: spectrum that emitted colors tint, None for D65. ``brightness``:
    factor on all emission, for the exposure of the film.
    """

    files: dict[str, Callable[[Path], None]] = field(default_factory=dict)
    notes: list[Note] = field(default_factory=list)
    white: Spectrum | None = None
    brightness: float = 1.0
    has_clear_surfaces: bool = False
    """True if light crosses surfaces without refraction, which only Mitsuba's volumetric integrators trace."""
    kept: dict[Any, Any] = field(default_factory=dict)
    """Files by the identity of their content, with that content, so that each is written once."""
    _taken: set[str] = field(default_factory=set)

    def note(self, subject: str, message: str) -> None:
        """Add a note, once."""
        if not any(note.subject == subject and note.message == message for note in self.notes):
            self.notes.append(Note(subject, message))

    def file(self, folder: str, name: str, ending: str, write: Callable[[Path], None], content: Any = None) -> str:
        """Enter a file and return its path; equal ``content`` (the same object and use) is entered once."""
        key = None if content is None else (folder, *(id(part) if not _is_plain(part) else part for part in content))
        if key is not None and key in self.kept:
            return str(self.kept[key][0])
        path = f"{folder}/{self.name(name, folder)}{ending}"
        self.files[path] = write
        if key is not None:
            self.kept[key] = (path, content)
        return path

    def name(self, wanted: str, kind: str) -> str:
        """A name of letters, digits, ``-`` and ``_`` that no other object of its kind has."""
        plain = re.sub(r"[^A-Za-z0-9_-]+", "_", wanted).strip("_")[:60] or "unnamed"
        made, count = plain, 1
        while f"{kind}/{made}".lower() in self._taken:
            count += 1
            made = f"{plain}_{count}"
        self._taken.add(f"{kind}/{made}".lower())
        return made

    def leftover(self, subject: str, item: Any, used: Collection[str]) -> None:
        """A note on all fields of a dataclass that are not ``used`` and differ from their defaults."""
        left = []
        for entry in fields(item):
            if entry.name in used:
                continue
            default = entry.default if entry.default_factory is MISSING else entry.default_factory()
            if default is MISSING or not _is_equal(getattr(item, entry.name), default):
                left.append(LABELS.get(entry.name) or re.sub(r"_(rad|w)$", "", entry.name).replace("_", " "))
        if left:
            kind = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(item).__name__).lower()
            whose = "" if kind == subject.lower() else f" of the {kind}"
            self.note(subject, f"no counterpart in Mitsuba, left out{whose}: {', '.join(left)}")


def _is_equal(value: Any, default: Any) -> bool:
    """Whether a field has its default; numbers of Blender are in single precision."""
    if isinstance(value, float) and isinstance(default, float):
        return np.float32(value) == np.float32(default)
    return scene_hash(value) == scene_hash(default)


def _is_plain(part: Any) -> bool:
    return isinstance(part, (str, bytes, int, float, bool))
