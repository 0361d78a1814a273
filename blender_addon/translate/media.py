# SPDX-License-Identifier: GPL-3.0-or-later
"""What is inside a closed mesh: the volume socket of a material, where it is the same everywhere."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import Paint, ScatteringMedium, gray

from .fields import mean_color
from .nodes import Input, Output, linked
from .reader import Reader


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
        color=reader.paint(source.input("Color"), gray(0.8)),
        anisotropy=_g(reader, source),
    )


def _absorption(reader: Reader, source: Output) -> ScatteringMedium:
    """Blender absorbs density · (1 - color) and scatters nothing: the brightest channel's color counts as clear."""
    color = _three(reader, source, "Color", 0.8)
    extinction = max(reader.number(source.input("Density"), 1.0), 0.0) * np.maximum(1 - color, 0)
    if np.ptp(extinction) > 1e-6:
        reader.note(f"{source.label!r}: absorption that depends on color is shown with its mean")
    return ScatteringMedium(density=float(extinction.mean()), color=gray(0.0))


def _principled(reader: Reader, source: Output) -> ScatteringMedium:
    """Principled Volume without grids: scattering density · color, absorption density · (1 - color)."""
    strength = reader.number(source.input("Emission Strength"), 0.0)
    if str(source.value("Density Attribute", "")) not in ("", "density"):
        reader.note(f"{source.label!r}: its density attribute is not read")
    if reader.number(source.input("Blackbody Intensity"), 0.0) > 0:
        reader.note(f"{source.label!r}: blackbody emission is left out")
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


def _three(reader: Reader, source: Output, name: str, fallback: float) -> np.ndarray:
    place = source.input(name)
    value = np.full(3, fallback) if place is None else mean_color(reader.field(place))
    return np.broadcast_to(value, (3,))


MEDIA = {"VOLUME_SCATTER": _scatter, "VOLUME_ABSORPTION": _absorption, "PRINCIPLED_VOLUME": _principled}
