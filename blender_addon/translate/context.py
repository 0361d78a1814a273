# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of every part of a translation: notes to the user, the color space of numbers, images read once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.scene import ImageTexture, Note
from spectral_core.spectra.spectrum import Spectrum

from .. import compat

Question = Callable[["Translation"], Any]
"""A question about data outside of the item that reads them; see ``translate.questions``."""


@dataclass
class Heard:
    """Notes of a part of a translation, True if it has read data of other items, its questions and their answers."""

    notes: tuple[Note, ...] = ()
    reads_elsewhere: bool = False
    answers: dict[Question, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class ReadImage:
    """An image that was read, None without pixels; the notes on it; the state of the file that Blender loaded for it,
    None if that is not known.
    """

    texture: ImageTexture | None
    notes: tuple[Note, ...]
    source: Any = None


@dataclass
class Translation:
    """One run from a depsgraph to a Scene.

    ``rgb_from_working``: (3, 3), Blender's scene-linear colors to linear sRGB. ``images``: those that were read; each
    key begins with what it is, the session number of Blender's image, and its state. ``designed``: spectra that replace
    those of materials, lights and worlds, with a factor on the power of a light, by session number.
    ``reads_elsewhere``: True if data of other items than the present material, lamp or world were read.
    """

    depsgraph: Any
    rgb_from_working: NDArray[np.float64]
    images: dict[Any, ReadImage] = field(default_factory=dict)
    designed: Mapping[int, tuple[Spectrum, float]] = field(default_factory=dict)
    reads_elsewhere: bool = False
    output: Any = None
    """The settings of the running render, None for those of the scene; see ``render``."""
    _notes: dict[tuple[str, str], Note] = field(default_factory=dict)
    _asked: dict[Question, Any] = field(default_factory=dict)
    """The questions of the present part."""
    _answers: dict[Question, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, depsgraph: Any, data: Any) -> Translation:
        """Start a translation of ``depsgraph`` with the color space of ``data`` (``bpy.data``)."""
        return cls(depsgraph, compat.rec709_from_working(compat.working_space(data)))

    @property
    def scene(self) -> Any:
        """The evaluated Blender scene."""
        return self.depsgraph.scene_eval

    @property
    def render(self) -> Any:
        """The render settings that state the size and the border of the picture.

        They are not the scene's if the compositor of another scene shows it: both pictures are then of one size.
        """
        return self.scene.render if self.output is None else self.output

    def note(self, subject: str, message: str) -> None:
        """Add a note for the user, once."""
        self._notes.setdefault((subject, message), Note(subject, message))

    def image(self, key: Any, read: Callable[[], ImageTexture | None], source: Any = None) -> ImageTexture | None:
        """The image of a key, read once per picture and use, so that materials share it by identity. ``source``: as in
        ``ReadImage``, for one that is read now.
        """
        found = self.images.get(key)
        if found is None:
            for old in [old for old in self.images if old[:2] == key[:2] and old[2] != key[2]]:
                del self.images[old]  # of an earlier state of Blender's image
            with self.listening() as heard:
                texture = read()
            self.images[key] = ReadImage(texture, heard.notes, source)
            return texture
        for note in found.notes:
            self.note(note.subject, note.message)
        return found.texture

    def answer(self, question: Question) -> Any:
        """The answer to a question, found once."""
        if question not in self._answers:
            self._answers[question] = question(self)
        return self._answers[question]

    def ask(self, question: Question) -> Any:
        """The answer to a question. A view makes the present part again when the answer is another."""
        self._asked[question] = answer = self.answer(question)
        return answer

    @contextmanager
    def listening(self) -> Iterator[Heard]:
        """Collect the notes, reads and questions within it; the user receives the notes as always."""
        notes, elsewhere, asked, heard = self._notes, self.reads_elsewhere, self._asked, Heard()
        self._notes, self.reads_elsewhere, self._asked = {}, False, {}
        try:
            yield heard
        finally:
            heard.notes, heard.reads_elsewhere, heard.answers = self.notes, self.reads_elsewhere, self._asked
            self._notes = notes | {k: v for k, v in self._notes.items() if k not in notes}
            self.reads_elsewhere, self._asked = elsewhere or self.reads_elsewhere, asked | self._asked

    @property
    def notes(self) -> tuple[Note, ...]:
        """All notes in order."""
        return tuple(self._notes.values())

    @property
    def converts_colors(self) -> bool:
        """True if the file's working space is another one than linear sRGB."""
        return not np.array_equal(self.rgb_from_working, np.eye(3))

    def linear_rgb(self, working_rgb: ArrayLike) -> NDArray[np.float64]:
        """Linear sRGB (..., 3) of colors in Blender's scene-linear space (the first three channels are read)."""
        return np.asarray(working_rgb, dtype=np.float64)[..., :3] @ self.rgb_from_working.T


def finite(holder: Any, name: str, whose: str) -> float:
    """A number of a panel. Raises InvalidInputError with its label if it is none: a script may store NaN."""
    return float(finite_numbers(holder, name, whose))


def finite_numbers(holder: Any, name: str, whose: str) -> NDArray[np.float64]:
    """As ``finite``, for the numbers of a color."""
    numbers = np.array(getattr(holder, name), dtype=np.float64)
    if not np.isfinite(numbers).all():
        label, given = holder.bl_rna.properties[name].name, ", ".join(map(str, numbers.ravel()))
        raise InvalidInputError(f"{label} {whose} is {given}; expected {'numbers' if numbers.ndim else 'a number'}")
    return numbers


def overridden(depsgraph: Any, name: str) -> Any:
    """The view layer's override of all items of a type (``"material_override"``, …), None without one."""
    return getattr(depsgraph.view_layer_eval, name, None)


def stated(block: Any, depsgraph: Any) -> Any:
    """The copy of an evaluated data-block whose properties are those of now.

    The frames of a rendered animation are evaluated apart, and Blender writes no animated or driven value back to the
    original. In a view it does, and does not notify the evaluated copy of a script's change.
    """
    return block if depsgraph.mode == "RENDER" else block.original


def whole(obj: Any, depsgraph: Any) -> Any:
    """The evaluated object of which Blender shows a part.

    For each part of the result of a curve, text, metaball or geometry node, Blender makes an object that exists for a
    moment. Settings of Cycles are read from the whole object: reading them creates them, and Blender never frees those
    of a part.
    """
    return obj.original.evaluated_get(depsgraph)


def makers_of(obj: Any, instance: Any) -> frozenset[int]:
    """Session numbers of the data that the geometry of an instance of the depsgraph is made from."""
    source = obj.original
    blocks = [source, getattr(source, "data", None), instance.parent.original if instance.parent else None]
    return frozenset(block.session_uid for block in blocks if block is not None)
