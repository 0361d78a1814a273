# SPDX-License-Identifier: GPL-3.0-or-later
"""Value of a node tree's socket: a result of the material's program, a spectrum, or a mix of two."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, Computed, ImageTexture, MixedPaint, Paint, Scalar, SpectralImage
from spectral_core.scene.shading import Builder, Program
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Spectrum

from .images import linear_pixels
from .tree import Input, Output

Array = NDArray[Any]
SAME_IN_ALL_SPACES = {
    "RGB", "TEX_IMAGE", "TEX_ENVIRONMENT", "TEX_SKY", "TEX_CHECKER", "TEX_BRICK", "VALTORGB", "BLACKBODY", "WAVELENGTH",
    "ATTRIBUTE", "VERTEX_COLOR", "OBJECT_INFO", "INVERT", "BRIGHTCONTRAST", "CUSTOM",
}  # fmt: skip
"""Nodes that state colors or spectra, or add them in parts, which leads to the same colors in every color space."""


def depends_on_space(place: Input, source: Output) -> bool:
    """True if what ``source`` gives to ``place`` is computed with single channels of colors, or is a vector as a color.

    Such a color is another one in each color space.
    """
    node, kind = source.node, source.socket.type
    if {kind, place.socket.type} == {"RGBA", "VECTOR"} or node.type in ("SEPARATE_COLOR", "SEPRGB", "SEPHSV"):
        return True
    if node.type in ("MIX", "MIX_RGB"):
        return kind == "RGBA" and bool(node.blend_type != "MIX")
    return kind == "RGBA" and node.type not in SAME_IN_ALL_SPACES


@dataclass(frozen=True, eq=False)
class Value:
    """A result of a program under construction. ``kind``: type of the socket, ``"VALUE"``, ``"RGBA"`` or
    ``"VECTOR"``.
    """

    builder: Builder
    register: int
    kind: str

    @property
    def constant(self) -> Array | None:
        """(1,) or (3,) if it does not vary, else None."""
        return self.builder.constant(self.register)

    def as_width(self, width: int) -> int:
        """Its register with one or three components; of colors the luminance, of vectors the mean, as in Blender."""
        return self.builder.as_width(self.register, width, is_color=self.kind != "VECTOR")

    def as_number(self) -> Value:
        """It as one number."""
        return Value(self.builder, self.as_width(1), "VALUE")

    def program(self, width: int) -> Program:
        """The program that computes it."""
        return self.builder.program(self.as_width(width))


@dataclass(frozen=True, eq=False)
class Mixed:
    """Two fields mixed by a number that may vary; ``builder``: of the program that contains the number."""

    factor: Value
    first: Field
    second: Field


Field = Value | Spectrum | SpectralImage | Mixed


def paint_of(field: Field) -> Paint:
    """The field as a color."""
    if isinstance(field, Mixed):
        return MixedPaint(scalar_of(field.factor), paint_of(field.first), paint_of(field.second))
    if isinstance(field, (Spectrum, SpectralImage)):
        return field
    if field.constant is not None:
        return Color(np.broadcast_to(field.constant, (3,)))
    return Computed(field.program(3))


def scalar_of(field: Field) -> Scalar:
    """The field as a number."""
    value = value_of(field)
    constant = value.builder.constant(value.as_width(1))
    return Computed(value.program(1)) if constant is None else float(constant[0])


def value_of(field: Field, builder: Builder | None = None) -> Value:
    """The field as a result of a program; a spectrum is replaced by its color."""
    if isinstance(field, Value):
        return field
    if isinstance(field, (Spectrum, SpectralImage)):
        builder = builder or Builder()
        # without the negative parts of colors that a display lacks, as Cycles' Blackbody
        return Value(builder, builder.number(np.maximum(mean_color(field), 0.0)), "RGBA")
    builder = field.factor.builder
    first, second = (value_of(part, builder) for part in (field.first, field.second))
    factor = field.factor.as_width(1)
    register = builder.add("mix_vector", (factor, first.as_width(3), second.as_width(3)))
    return Value(builder, register, "RGBA")


def mean_color(field: Field | Paint | Scalar | Array) -> Array:
    """Mean color (3,) or number (1,), linear sRGB."""
    if isinstance(field, ImageTexture):
        return np.asarray(linear_pixels(field).mean(axis=(0, 1), dtype=np.float64))
    if isinstance(field, Spectrum):
        return color_of_spectrum(field)
    if isinstance(field, SpectralImage):
        return np.asarray(daylight_picture(field).pixels.mean(axis=(0, 1), dtype=np.float64))
    if isinstance(field, Color):
        return np.asarray(field.linear_rgb)
    if isinstance(field, Computed):
        return field.typical
    if isinstance(field, MixedPaint):
        share = mean_color(field.factor)
        return np.asarray((1 - share) * mean_color(field.first) + share * mean_color(field.second))
    if isinstance(field, (Value, Mixed)):
        value = value_of(field)
        constant = value.constant
        return constant if constant is not None else Computed(value.builder.program(value.register)).typical
    return np.atleast_1d(np.asarray(field, dtype=np.float64))


def daylight_picture(field: SpectralImage) -> ImageTexture:
    """The colors of a spectral texture under D65, for nodes that compute with colors."""
    daylight = normalized(illuminant("D65"))
    pixels = np.clip(field.linear_rgb(daylight), 0.0, 1.0)
    return ImageTexture(field.name, pixels, "linear", field.extension, field.interpolation, field.uv_from_mesh_uv)


def color_of_spectrum(spectrum: Spectrum) -> Array:
    """Linear sRGB (3,) of a reflectance under D65, or of an illuminant at the luminance of white."""
    light, surface = (spectrum, None) if isinstance(spectrum, Illuminant) else (illuminant("D65"), spectrum)
    white = xyz_of(light)[1]
    return np.asarray(linear_rgb_from_xyz(xyz_of(light, surface) / white)) if white > 0 else np.zeros(3)
