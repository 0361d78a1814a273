# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors and numbers of a node tree: each socket becomes instructions of the material's program, node by node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from spectral_core.scene import LARGEST, Color, ImageTexture, MixedPaint, Paint, Scalar, SpectralImage
from spectral_core.scene.shading import Builder
from spectral_core.scene.skies.atmosphere import Atmosphere
from spectral_core.spectra.spectrum import Spectrum

from ... import compat
from .. import spectra
from ..context import Translation
from .attributes import UNDISPLACED
from .fields import Field, Mixed, Value, daylight_picture, depends_on_space, mean_color, paint_of, scalar_of, value_of
from .tree import Input, Output
from .walks.deep import Results

NEUTRAL = 0.5
"""Gray in place of a missing picture or pattern."""

NUMBERS = ("VALUE", "INT", "BOOLEAN")
"""Types of sockets that hold one number."""
UNKNOWN_TO_CYCLES = ("SQUEEZE", "SHADERTORGB", "UVALONGSTROKE")
"""Nodes of other engines: a link from them has no effect in Cycles."""
OTHER_SPACE = "computes in linear sRGB, Cycles in the file's working space: colors may differ unless it is Rec.709"


@dataclass
class Reader:
    """Reads the sockets of one material, light or world.

    ``on_surface``: True if values may vary with position; a lamp gets means, with a Note. ``shift``: position of Bump's
    height samples, see ``vector_input``.
    """

    translation: Translation
    owner: str
    on_surface: bool = False
    builder: Builder = field(default_factory=Builder)
    shift: int = 0
    material_index: int = 0
    raised: Value | None = None
    """The normal of a displaced surface; None without displacement."""
    undisplaced: bool = False
    """True while positions are those before the displacement, which a moved mesh has as an attribute."""
    is_far: bool = False
    """True for what is infinitely far: suns and worlds."""
    in_world: bool = False
    _results: Results[Field] = field(default_factory=Results)
    skies: dict[int, tuple[ImageTexture, Atmosphere, float, float]] = field(default_factory=dict)
    """Pictures of skies by their ``id``, with their settings, the angle of the sun's disk (0: none), its intensity."""

    def note(self, message: str) -> None:
        """Add a note about the owner for the user."""
        self.translation.note(self.owner, message)

    # interface for surfaces, lamps and worlds

    def paint(self, place: Input | None, fallback: Paint) -> Paint:
        """A socket as a color."""
        return fallback if place is None else self._settled(paint_of(self.field(place)), place)

    def scalar(self, place: Input | None, fallback: float) -> Scalar:
        """A socket as a number, which may vary over the surface."""
        if place is None:
            return fallback
        value = scalar_of(self.field(place))
        if isinstance(value, float):
            return self._finite(value, place)
        return value if self.on_surface else self.number(place, fallback)

    def number(self, place: Input | None, fallback: float) -> float:
        """A socket as one number: the mean of a varying one, with a Note."""
        if place is None:
            return fallback
        value = scalar_of(self.field(place))
        if isinstance(value, float):
            return self._finite(value, place)
        self.note(f"{place.node.name}: {place.socket.name} supports one number only; its mean was used")
        return self._finite(float(mean_color(value)[0]), place)

    def _finite(self, value: float, place: Input) -> float:
        """A number for a closure; 0 with a Note for one that is not finite."""
        if abs(value) <= LARGEST:
            return value
        what = f"{place.node.name}: {place.socket.name} is {value:g}"
        self.note(f"{what}, which is not a finite number; 0 was used")
        return 0.0

    def factor(self, place: Input | None, fallback: float) -> Scalar:
        """Factor of a mix, clipped to [0, 1] as in Blender."""
        return scalar_of(self.share(place, fallback))

    def share(self, place: Input | None, fallback: float) -> Value:
        """``factor`` as a result of the program."""
        value = self.literal(fallback) if place is None else self.as_value(self.field(place)).as_number()
        return self.emit("clamp", value, 0.0, 1.0, settings=("MINMAX",))

    def vector(self, place: Input | None, fallback: float) -> np.ndarray:
        """A vector socket (3,) that does not vary."""
        value: Any = fallback if place is None else self.field(place)
        if isinstance(value, Value) and value.constant is None:
            assert place is not None
            self.note(f"{place.node.name}: {place.socket.name} supports one vector only; its mean was used")
        return np.broadcast_to(mean_color(value), (3,))

    def _settled(self, paint: Paint, place: Input) -> Paint:
        """A color in a form that its owner supports."""
        if self.on_surface or isinstance(paint, (Color, Spectrum)):
            return paint
        if isinstance(paint, MixedPaint):
            return paint
        self.note(f"{place.node.name}: a color that varies from place to place is shown with its mean")
        return Color(np.broadcast_to(mean_color(paint), (3,)))

    # interface for the nodes' evaluators

    def field(self, place: Input) -> Field:
        """Value of a socket: a number where the socket is one."""
        source, kinds = place.path()
        found = self._field(place, source)
        if isinstance(found, Value):
            for kind in kinds if compat.converts_in_groups() else ():
                found = self._converted(found, kind)
            return found.as_number() if place.socket.type in NUMBERS else found
        return found

    def _converted(self, value: Value, kind: str) -> Value:
        """A value that passes a socket of a type."""
        if kind in NUMBERS:
            return self.emit("math", value, 0.0, 0.0, settings=("TRUNC",)) if kind == "INT" else value.as_number()
        return replace(value, register=value.as_width(3), kind=kind) if kind in ("VECTOR", "RGBA") else value

    def _field(self, place: Input, source: Input | Output) -> Field:
        """What ``source`` gives to ``place``."""
        if isinstance(source, Input):
            return self.constant(source)
        spectrum = spectra.spectrum_of(self.translation, source.node)
        if spectrum is not None:
            return spectrum
        if source.node.type in UNKNOWN_TO_CYCLES:
            self.note(f"Cycles ignores the node {source.label!r}; as in Cycles, the linked socket keeps its own value")
            return self.constant(place)
        if self.translation.converts_colors and depends_on_space(place, source):
            self.note(f"the node {source.label!r} {OTHER_SPACE}")
        key = (source.socket.as_pointer(), tuple(group.as_pointer() for group in source.groups), self.shift,
               self.undisplaced, self.raised is None)  # fmt: skip
        return self._results.of(
            key, partial(self._read, source, self.shift, self.undisplaced), partial(self._in_circle, source)
        )

    def _read(self, source: Output, shift: int, undisplaced: bool) -> Field:
        """What an output gives at a step along the surface, of positions before or after the displacement."""
        read = EVALUATORS.get(source.node.type or source.node.bl_idname)  # newer nodes have no type
        with self.shifted(shift), self.before_displacement(undisplaced):
            return self.unknown(source) if read is None else self.as_field(read(self, source), source.socket.type)

    def _in_circle(self, source: Output) -> Field:
        """In place of a node that reads itself."""
        self.note(f"the node {source.label!r} reads itself; 0 was used")
        return self.literal(0.0)

    def as_field(self, found: Any, kind: str) -> Field:
        """Result of an evaluator as a field; plain numbers and colors become constants."""
        if isinstance(found, Value):
            return replace(found, kind=kind) if kind in ("VALUE", "RGBA", "VECTOR") else found
        if isinstance(found, (Spectrum, SpectralImage, Mixed)):
            return found
        return Value(self.builder, self.builder.number(found), kind)

    def constant(self, place: Input) -> Value:
        """The value that an unlinked socket holds: colors become linear sRGB."""
        value, kind = place.default, place.socket.type
        if value is None or isinstance(value, (str, bool)):
            return self.literal(float(value) if isinstance(value, bool) else 0.0)
        if isinstance(value, (int, float)):
            return self.literal(self._finite(float(value), place))
        array = np.asarray(value[:], dtype=np.float64)
        if not np.isfinite(array).all():
            self.note(f"{place.node.name}: {place.socket.name} is not a finite number; 0 was used")
            array = np.zeros(3)
        # vectors have 2 to 4 numbers
        color = self.translation.linear_rgb(array) if kind == "RGBA" else np.resize((*array, 0.0), 3)
        return Value(self.builder, self.builder.number(color), kind)

    def literal(self, value: Any) -> Value:
        """A constant of the program."""
        register = self.builder.number(value)
        return Value(self.builder, register, "VALUE" if np.size(value) == 1 else "VECTOR")

    def as_value(self, found: Any) -> Value:
        """A field or plain constant as a result of the program; a spectrum is replaced by its color, with a Note."""
        if isinstance(found, (float, int, tuple, np.ndarray)):
            return self.literal(found)
        if isinstance(found, (Spectrum, SpectralImage)) or (isinstance(found, Mixed) and _holds_spectrum(found)):
            self.note("a spectrum is the input of a math or color node: the node used its color instead")
        if isinstance(found, SpectralImage):
            return self.emit("image_color", self.point("uv"), settings=(False,), data=daylight_picture(found))
        return value_of(found, self.builder)

    def read(self, output: Output, name: str, fallback: Any = 0.0) -> Value:
        """An input of a node, by identifier or name; ``fallback`` if this Blender's node has no such input."""
        place = output.input(name)
        return self.as_value(fallback if place is None else self.field(place))

    def emit(self, operation: str, *inputs: Any, settings: tuple[Any, ...] = (), data: Any = None) -> Value:
        """Result of an operation on values or plain constants."""
        from spectral_core.scene.shading import OPERATIONS

        known = OPERATIONS[operation]
        registers = tuple(self.as_value(i).as_width(w) for i, w in zip(inputs, known.widths, strict=True))
        register = self.builder.add(operation, registers, *settings, data=data)
        return Value(self.builder, register, "VALUE" if known.result == 1 else "RGBA")

    def point(self, name: str, width: int = 3) -> Value:
        """A quantity of the shaded point."""
        if name == "normal" and self.raised is not None:
            return self.raised
        if name == "position" and self.undisplaced:
            place = Value(self.builder, self.builder.add("vector_input", (), UNDISPLACED, self.shift), "VECTOR")
            return self.emit("transformed", place, settings=("POINT", "OBJECT", "WORLD"))
        operation = "vector_input" if width == 3 else "number_input"
        return Value(
            self.builder, self.builder.add(operation, (), name, self.shift), "VECTOR" if width == 3 else "VALUE"
        )

    def smooth_normal(self) -> Value:
        """The surface's normal before a displacement bends it."""
        return Value(self.builder, self.builder.add("vector_input", (), "normal", self.shift), "VECTOR")

    @contextmanager
    def shifted(self, shift: int) -> Iterator[None]:
        """The same reader at a small step along the surface."""
        before, self.shift = self.shift, shift
        try:
            yield
        finally:
            self.shift = before

    @contextmanager
    def before_displacement(self, applies: bool) -> Iterator[None]:
        """The same reader with the positions before the displacement, if it ``applies``."""
        kept, self.undisplaced = self.undisplaced, applies
        try:
            yield
        finally:
            self.undisplaced = kept

    def unknown(self, output: Output) -> Field:
        """Substitute for an unsupported node: its first color, else a neutral gray."""
        self.note(f"the node {output.label!r} is not supported; a plain substitute was used")
        for socket in output.node.inputs:
            if socket.type == "RGBA":
                return self.field(Input(socket, output.groups))
        return self.literal(np.full(3, NEUTRAL))

    def mix(self, factor: Value, first: Field, second: Field) -> Field:
        """A mix of two fields: kept separate if one is a spectrum, else computed."""
        if first is second:
            return first
        amount = self.builder.constant(factor.as_width(1))
        if amount is not None and amount[0] in (0.0, 1.0):
            return second if amount[0] else first
        if any(isinstance(part, (Spectrum, SpectralImage, Mixed)) for part in (first, second)):
            return Mixed(factor, first, second)
        return self.emit("blend", factor, first, second, settings=("MIX",))


def _holds_spectrum(field: Field) -> bool:
    if isinstance(field, Mixed):
        return _holds_spectrum(field.first) or _holds_spectrum(field.second)
    return isinstance(field, (Spectrum, SpectralImage))


EVALUATORS: dict[str, Callable[[Reader, Output], Any]] = {}
"""Evaluator by Blender's node type, filled by the modules of the nodes."""


def evaluator(*kinds: str) -> Callable[[Callable[[Reader, Output], Any]], Callable[[Reader, Output], Any]]:
    """Register a function in EVALUATORS."""

    def enter(function: Callable[[Reader, Output], Any]) -> Callable[[Reader, Output], Any]:
        for kind in kinds:
            EVALUATORS[kind] = function
        return function

    return enter
