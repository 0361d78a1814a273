# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of every part of a translation: notes to the user, the color space of numbers, images read once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.scene import ImageTexture, Note
from spectral_core.spectra.spectrum import Spectrum

from .. import compat


@dataclass
class Heard:
    """Notes of a part of a translation, and True if it has read data of other items."""

    notes: tuple[Note, ...] = ()
    reads_elsewhere: bool = False


@dataclass
class Translation:
    """One run from a depsgraph to a Scene.

    ``rgb_from_working``: (3, 3), Blender's scene-linear colors to linear sRGB. ``images``: read once per picture and
    use, so that materials share them by identity. ``designed``: spectra that replace those of materials, lights and
    worlds, with a factor on the power of a light, by session number. ``reads_elsewhere``: True if data of other items
    than the present material, lamp or world were read.
    """

    depsgraph: Any
    rgb_from_working: NDArray[np.float64]
    images: dict[Any, ImageTexture | None] = field(default_factory=dict)
    designed: Mapping[int, tuple[Spectrum, float]] = field(default_factory=dict)
    reads_elsewhere: bool = False
    _notes: dict[tuple[str, str], Note] = field(default_factory=dict)

    @classmethod
    def of(cls, depsgraph: Any, data: Any) -> Translation:
        """Start a translation of ``depsgraph`` with the color space of ``data`` (``bpy.data``)."""
        name = compat.working_space(data)
        matrix = compat.rec709_from_working(name)
        translation = cls(depsgraph, np.eye(3) if matrix is None else matrix)
        if matrix is None:
            translation.note("Color space", f"the working space {name!r} is not known; colors are read as Rec.709")
        return translation

    @property
    def scene(self) -> Any:
        """The evaluated Blender scene."""
        return self.depsgraph.scene_eval

    def note(self, subject: str, message: str) -> None:
        """Add a note for the user, once."""
        self._notes.setdefault((subject, message), Note(subject, message))

    @contextmanager
    def listening(self) -> Iterator[Heard]:
        """Collect the notes and reads within it; the user receives the notes as always."""
        notes, elsewhere, heard = self._notes, self.reads_elsewhere, Heard()
        self._notes, self.reads_elsewhere = {}, False
        try:
            yield heard
        finally:
            heard.notes, heard.reads_elsewhere = self.notes, self.reads_elsewhere
            self._notes, self.reads_elsewhere = (
                notes | {k: v for k, v in self._notes.items() if k not in notes},
                (elsewhere or self.reads_elsewhere),
            )

    @property
    def notes(self) -> tuple[Note, ...]:
        """All notes in order."""
        return tuple(self._notes.values())

    def linear_rgb(self, working_rgb: ArrayLike) -> NDArray[np.float64]:
        """Linear sRGB (..., 3) of colors in Blender's scene-linear space (the first three channels are read)."""
        return np.asarray(working_rgb, dtype=np.float64)[..., :3] @ self.rgb_from_working.T


def overridden(depsgraph: Any, name: str) -> Any:
    """The view layer's override of all items of a type (``"material_override"``, …), None without one."""
    return getattr(depsgraph.view_layer_eval, name, None)


def makers_of(obj: Any, instance: Any) -> frozenset[int]:
    """Session numbers of the data that the geometry of an instance of the depsgraph is made from."""
    source = obj.original
    blocks = [source, getattr(source, "data", None), instance.parent.original if instance.parent else None]
    return frozenset(block.session_uid for block in blocks if block is not None)
