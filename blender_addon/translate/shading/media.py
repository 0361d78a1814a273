# SPDX-License-Identifier: GPL-3.0-or-later
"""What is inside a closed mesh: the volume socket of a material, where it is the same everywhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import Color, Paint, ScatteringMedium, gray
from spectral_core.spectra.spectrum import Spectrum

from .fields import mean_color, paint_of
from .reader import Reader
from .tree import Input, Output, linked


def medium_of(reader: Reader, output: Any) -> ScatteringMedium | None:
    """Medium of a material's output node, None where its volume socket is free or not understood (with a Note)."""
    source = linked(Input(output.inputs["Volume"]))
    if source is None:
        return None
    read = MEDIA.get(source.node.type)
    if read is None:
        reader.note(f"the volume shader {source.label!r} is not understood; the inside was left empty")
        return None
    return read(reader, source)


def _scatter(reader: Reader, source: Output) -> ScatteringMedium:
    if getattr(source.node, "phase", "HENYEY_GREENSTEIN") != "HENYEY_GREENSTEIN":
        reader.note(f"{source.label!r}: its phase function is replaced by Henyey-Greenstein")
    return ScatteringMedium(
        density=max(reader.number(source.input("Density"), 1.0), 0.0),
        color=gray(1.0),  # Cycles scatters density · color and absorbs nothing
        extinction=_even(reader, source, reader.paint(source.input("Color"), gray(0.8))),
        anisotropy=_g(reader, source),
    )


def _absorption(reader: Reader, source: Output) -> ScatteringMedium:
    """Blender absorbs density · (1 - color), per wavelength here, and scatters nothing."""
    color = _even(reader, source, reader.paint(source.input("Color"), gray(0.8)))
    absorbed: Paint
    if isinstance(color, Spectrum):
        absorbed = Spectrum(f"1 - {color.name}", color.grid, np.maximum(1 - color.values, 0))
    else:
        absorbed = Color(np.maximum(1 - color.linear_rgb, 0))
    density = max(reader.number(source.input("Density"), 1.0), 0.0)
    return ScatteringMedium(density=density, color=gray(0.0), extinction=absorbed)


def _principled(reader: Reader, source: Output) -> ScatteringMedium:
    """Principled Volume without grids: scattering density · color, absorption density · (1 - color)."""
    strength = reader.number(source.input("Emission Strength"), 0.0)
    if str(source.value("Density Attribute", "")) not in ("", "density"):
        reader.note(f"{source.label!r}: its density attribute is not read")
    if reader.number(source.input("Blackbody Intensity"), 0.0) > 0:
        reader.note(f"{source.label!r}: blackbody emission is left out")
    absorption = source.input("Absorption Color")
    if absorption is not None and np.any(np.ravel(mean_color(paint_of(reader.field(absorption)))) != 0):
        reader.note(f"{source.label!r}: its absorption color is left out")
    glow: Paint = gray(1.0)
    if strength > 0:
        glow = reader.paint(source.input("Emission Color"), gray(1.0))
    return ScatteringMedium(
        density=max(reader.number(source.input("Density"), 1.0), 0.0),
        color=reader.paint(source.input("Color"), gray(0.5)),
        anisotropy=_g(reader, source),
        emission_color=glow,
        emission_strength=strength,
    )


def _g(reader: Reader, source: Output) -> float:
    return min(max(reader.number(source.input("Anisotropy"), 0.0), -0.99), 0.99)


def _even(reader: Reader, source: Output, paint: Paint) -> Color | Spectrum:
    """A color that is the same everywhere in the medium; of one that varies its mean, with a Note."""
    if isinstance(paint, (Color, Spectrum)):
        return paint
    reader.note(f"{source.label!r}: a color that varies inside a volume is shown with its mean")
    place = source.input("Color")
    assert place is not None
    return Color(np.broadcast_to(mean_color(reader.field(place)), (3,)))


MEDIA = {"VOLUME_SCATTER": _scatter, "VOLUME_ABSORPTION": _absorption, "PRINCIPLED_VOLUME": _principled}
