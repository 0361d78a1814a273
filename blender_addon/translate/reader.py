# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors and numbers of a node tree: each socket is evaluated to a field, node type by node type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spectral_core.scene import ImageTexture, Paint, Scalar
from spectral_core.spectra.spectrum import Spectrum

from . import spectra
from .context import Translation
from .fields import Field, Mixed, combine, gray_of, mean_color, needs_mean, paint_of, scalar_of
from .nodes import Input, Output

NEUTRAL = 0.5
"""Gray that stands in for a picture or pattern that cannot be had."""


@dataclass
class Reader:
    """Reads the sockets of one material, light or world, and remembers which UV maps its images lie on."""

    translation: Translation
    owner: str
    uv_maps: list[str] = field(default_factory=list)

    def note(self, message: str) -> None:
        """Tell the user something about the owner."""
        self.translation.note(self.owner, message)

    def paint(self, place: Input | None, fallback: Paint) -> Paint:
        """A socket as a color."""
        return fallback if place is None else paint_of(self.field(place))

    def scalar(self, place: Input | None, fallback: float) -> Scalar:
        """A socket as a number, which may vary over the surface."""
        return fallback if place is None else scalar_of(self.field(place))

    def number(self, place: Input | None, fallback: float) -> float:
        """A socket as one number: of an image its mean, with a Note."""
        value = self.scalar(place, fallback)
        if isinstance(value, ImageTexture):
            assert place is not None
            self.note(f"{place.node.name}: {place.socket.name} takes one number here, the image's mean was used")
            return float(mean_color(value)[0])
        return float(value)

    def field(self, place: Input) -> Field:
        """What a socket evaluates to."""
        source = place.source()
        if isinstance(source, Input):
            return self.constant(source)
        spectrum = spectra.spectrum_of(self.translation, source.node)
        if spectrum is not None:
            return spectrum
        read = EVALUATORS.get(source.node.type)
        if read is None:
            return self.unknown(source)
        return read(self, source)

    def constant(self, place: Input) -> Field:
        """The value that an unlinked socket holds: colors become linear sRGB."""
        value = place.default
        if value is None or isinstance(value, (str, bool)):
            return 0.0 if not isinstance(value, bool) else float(value)
        if isinstance(value, (int, float)):
            return float(value)
        array = np.asarray(value[:], dtype=np.float64)
        if not np.isfinite(array).all():
            self.note(f"{place.node.name}: {place.socket.name} is not a finite number; 0 was used")
            array = np.zeros(3)
        return self.translation.linear_rgb(array) if place.socket.type == "RGBA" else array[:3]

    def unknown(self, output: Output) -> Field:
        """Closest thing to a node that is not understood: its own first color, else a neutral gray."""
        self.note(f"the node {output.label!r} is not understood; a plain stand-in was used for it")
        for socket in output.node.inputs:
            if socket.type == "RGBA":
                return self.field(Input(socket, output.groups))
        return np.full(3, NEUTRAL)

    def apply(self, function: Callable[..., Any], fields: list[Field]) -> Field:
        """Arithmetic on fields, with a Note where a picture or spectrum loses by it."""
        if any(isinstance(item, Spectrum) for item in fields):
            self.note("a spectrum goes through a math or color node: the node worked on its color instead")
        if needs_mean(fields):
            self.note("two images of different size or mapping are combined: the second took part with its mean color")
        return combine(function, fields)

    def fields(self, output: Output, *names: str, missing: float = 0.0) -> list[Field]:
        """Fields of several inputs of a node, by identifier or name; a socket for numbers makes colors gray."""
        found: list[Field] = []
        for place in (output.input(name) for name in names):
            value = missing if place is None else self.field(place)
            found.append(gray_of(value) if place is not None and place.socket.type == "VALUE" else value)
        return found

    def mix(self, factor: Field, first: Field, second: Field) -> Field:
        """Two fields mixed: kept apart where one is a spectrum or the factor a picture, else computed."""
        amount = scalar_of(factor)
        if isinstance(amount, float):
            if amount <= 0:
                return first
            if amount >= 1:
                return second
        parts = [amount, first, second]
        keeps = isinstance(amount, ImageTexture) or any(isinstance(part, (Spectrum, Mixed)) for part in parts)
        if keeps or needs_mean(parts):
            return Mixed(amount, first, second)
        return combine(lambda f, a, b: (1 - f) * a + f * b, parts)

    def factor(self, place: Input | None, fallback: float) -> Scalar:
        """Factor of a mix, held within [0, 1] as Blender does."""
        value = self.scalar(place, fallback)
        if isinstance(value, float):
            return min(max(value, 0.0), 1.0)
        pixels = value.pixels
        if pixels.dtype != np.uint8 and (pixels.min() < 0 or pixels.max() > 1):
            return scalar_of(combine(lambda f: np.clip(f, 0, 1), [value]))
        return value

    def vector(self, place: Input | None, fallback: float) -> np.ndarray:
        """A vector socket (3,) that does not vary."""
        value = fallback if place is None else self.field(place)
        if isinstance(value, (ImageTexture, Mixed, Spectrum)):
            self.note("a texture mapping that itself varies is not understood; its mean was used")
            value = mean_color(value)
        return np.broadcast_to(np.asarray(value, dtype=np.float64), (3,))


EVALUATORS: dict[str, Callable[[Reader, Output], Field]] = {}
"""Node type of Blender to what evaluates it; filled by the modules that know the nodes."""


def evaluator(*kinds: str) -> Callable[[Callable[[Reader, Output], Field]], Callable[[Reader, Output], Field]]:
    """Enter a function in EVALUATORS."""

    def enter(function: Callable[[Reader, Output], Field]) -> Callable[[Reader, Output], Field]:
        for kind in kinds:
            EVALUATORS[kind] = function
        return function

    return enter
