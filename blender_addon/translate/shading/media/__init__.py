# SPDX-License-Identifier: GPL-3.0-or-later
"""Media in a closed mesh, or in all of space: the volume socket of a material or a world.

Values that vary with position are replaced by their means, with a note.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from spectral_core.scene import Color, Paint, ScatteringMedium, gray
from spectral_core.spectra.catalogue import blackbody
from spectral_core.spectra.spectrum import Spectrum

from ..fields import color_of_spectrum, mean_color, paint_of
from ..reader import Reader
from ..tree import Input, Output, linked
from .phases import Lobes, lobes_of

Rgb = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True)
class Fill:
    """Scattering, absorption and emission of a volume shader per unit of length, linear RGB each, and its phase
    functions.
    """

    scatters: Rgb
    absorbs: Rgb
    emits: Rgb
    lobes: Lobes = ()

    def times(self, factor: float) -> Fill:
        """The same medium, multiplied by a factor."""
        return replace(self, scatters=self.scatters * factor, absorbs=self.absorbs * factor, emits=self.emits * factor)


NOTHING = Fill(np.zeros(3), np.zeros(3), np.zeros(3))


def medium_of(reader: Reader, output: Any) -> ScatteringMedium | None:
    """Medium of an output node, None if its volume socket is unlinked or unsupported (with a Note)."""
    source = linked(Input(output.inputs["Volume"]))
    if source is None:
        return None
    spectral = SPECTRAL.get(source.node.type)
    made = None if spectral is None else spectral(reader, source)
    if made is not None:
        return made
    fill = _fill(reader, source)
    extinction = fill.scatters + fill.absorbs
    strength = float(fill.emits.max())
    if not (np.any(extinction > 0) or strength > 0):
        return None
    albedo = np.divide(fill.scatters, extinction, out=np.zeros(3), where=extinction > 0)
    return ScatteringMedium(
        density=1.0,
        color=Color(albedo),
        extinction=Color(extinction),
        emission_color=Color(fill.emits / strength) if strength > 0 else gray(1.0),
        emission_strength=strength,
        lobes=fill.lobes,
    )


def _fill(reader: Reader, source: Output | None) -> Fill:
    if source is None:
        return NOTHING
    read = FILLS.get(source.node.type)
    if read is None:
        reader.note(f"the volume shader {source.label!r} is not supported; it is left out")
        return NOTHING
    return read(reader, source)


def _rgb(reader: Reader, source: Output, name: str, fallback: float) -> Rgb:
    place = source.input(name)
    if place is None:
        return np.full(3, fallback)
    value = reader.field(place)
    paint = paint_of(value)
    if not isinstance(paint, (Color, Spectrum)):
        reader.note(f"{source.label!r}: {name} varies inside a volume; its mean is used")
    return np.maximum(np.broadcast_to(np.asarray(mean_color(value), dtype=np.float64), (3,)), 0.0)


def _number(reader: Reader, source: Output, name: str, fallback: float) -> float:
    return max(reader.number(source.input(name), fallback), 0.0)


def _scatter(reader: Reader, source: Output) -> Fill:
    # Cycles scatters density · color and absorbs nothing
    scattered = _number(reader, source, "Density", 1.0) * _rgb(reader, source, "Color", 0.8)
    return Fill(scattered, np.zeros(3), np.zeros(3), lobes_of(reader, source))


def _absorption(reader: Reader, source: Output) -> Fill:
    """Blender absorbs density · (1 - color) and scatters nothing."""
    kept = _rgb(reader, source, "Color", 0.8)
    return Fill(np.zeros(3), _number(reader, source, "Density", 1.0) * np.maximum(1 - kept, 0.0), np.zeros(3))


def _coefficients(reader: Reader, source: Output) -> Fill:
    vector = lambda name: np.maximum(reader.vector(source.input(name), 1.0), 0.0)  # noqa: E731
    scatters, absorbs, emits = (vector(f"{name} Coefficients") for name in ("Scatter", "Absorption", "Emission"))
    return Fill(scatters, absorbs, emits, lobes_of(reader, source))


def _emission(reader: Reader, source: Output) -> Fill:
    glow = _rgb(reader, source, "Color", 1.0) * _number(reader, source, "Strength", 1.0)
    return Fill(np.zeros(3), np.zeros(3), glow)


BLACKBODY_SCALE = 5.670373e-8 * 1e-6 / np.pi
"""Emission of Principled Volume's blackbody over the fourth power of its temperature, as in Cycles."""


def _principled(reader: Reader, source: Output) -> Fill:
    """Scattering density · color; absorption density · (1 - color) · (1 - √absorption color)."""
    for name in ("Density Attribute", "Color Attribute", "Temperature Attribute"):
        if str(source.value(name, "")) not in ("", "density", "temperature"):
            reader.note(f"{source.label!r}: its {name.lower()} is not read")
    density, color = _number(reader, source, "Density", 1.0), _rgb(reader, source, "Color", 0.5)
    absorbing = np.maximum(1 - np.sqrt(_rgb(reader, source, "Absorption Color", 0.0)), 0.0)
    glow = _rgb(reader, source, "Emission Color", 1.0) * _number(reader, source, "Emission Strength", 0.0)
    amount = _number(reader, source, "Blackbody Intensity", 0.0)
    temperature = _number(reader, source, "Temperature", 1000.0)
    if amount > 0 and temperature > 0:
        # at full intensity it has its physical brightness
        brightness = BLACKBODY_SCALE * ((temperature**4 - 1) * amount + 1)
        tint = _rgb(reader, source, "Blackbody Tint", 1.0)
        glow = glow + brightness * tint * _planckian(temperature)
    return Fill(density * color, density * np.maximum(1 - color, 0.0) * absorbing, glow, lobes_of(reader, source))


def _planckian(temperature: float) -> Rgb:
    """Linear sRGB of a blackbody, of luminance 1."""
    lamp = blackbody(min(max(temperature, 800.0), 12000.0))  # the range of Blender's own table ends here
    return np.maximum(color_of_spectrum(lamp), 0.0)


def _add(reader: Reader, source: Output) -> Fill:
    places = [Input(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER"]
    return _sum([_fill(reader, linked(place)) for place in places])


def _mix(reader: Reader, source: Output) -> Fill:
    share = min(max(reader.number(source.input("Fac") or source.input("Factor"), 0.5), 0.0), 1.0)
    places = [Input(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER"][:2]
    parts = [_fill(reader, linked(place)) for place in places]
    return _sum([part.times(weight) for part, weight in zip(parts, (1 - share, share), strict=True)])


def _sum(parts: list[Fill]) -> Fill:
    """Media in the same space; each scatters its share."""
    lobes = [(weight * float(part.scatters.mean()), g, alpha) for part in parts for weight, g, alpha in part.lobes]
    kept = tuple(lobe for lobe in lobes if lobe[0] > 0)
    scatters, absorbs, emits = (sum(getattr(p, name) for p in parts) for name in ("scatters", "absorbs", "emits"))
    return Fill(np.asarray(scatters), np.asarray(absorbs), np.asarray(emits), kept)


# with a spectrum as their color, which RGB cannot represent


def _spectrum(reader: Reader, source: Output) -> Spectrum | None:
    place = source.input("Color")
    paint: Paint | None = None if place is None else paint_of(reader.field(place))
    return paint if isinstance(paint, Spectrum) else None


def _spectral_scatter(reader: Reader, source: Output) -> ScatteringMedium | None:
    color = _spectrum(reader, source)
    if color is None:
        return None
    density = _number(reader, source, "Density", 1.0)
    return ScatteringMedium(density, gray(1.0), color, lobes=lobes_of(reader, source))


def _spectral_absorption(reader: Reader, source: Output) -> ScatteringMedium | None:
    color = _spectrum(reader, source)
    if color is None:
        return None
    absorbed = Spectrum(f"1 - {color.name}", color.grid, np.maximum(1 - color.values, 0))
    return ScatteringMedium(density=_number(reader, source, "Density", 1.0), color=gray(0.0), extinction=absorbed)


def _spectral_principled(reader: Reader, source: Output) -> ScatteringMedium | None:
    color = _spectrum(reader, source)
    if color is None:
        return None
    for name in ("Emission Strength", "Blackbody Intensity"):
        if reader.number(source.input(name), 0.0) > 0:
            reader.note(f"{source.label!r}: {name} is left out beside a spectrum")
    density = _number(reader, source, "Density", 1.0)
    return ScatteringMedium(density, color, lobes=lobes_of(reader, source))


SPECTRAL: dict[str, Callable[[Reader, Output], ScatteringMedium | None]] = {
    "VOLUME_SCATTER": _spectral_scatter,
    "VOLUME_ABSORPTION": _spectral_absorption,
    "PRINCIPLED_VOLUME": _spectral_principled,
}
FILLS: dict[str, Callable[[Reader, Output], Fill]] = {
    "VOLUME_SCATTER": _scatter,
    "VOLUME_ABSORPTION": _absorption,
    "VOLUME_COEFFICIENTS": _coefficients,
    "PRINCIPLED_VOLUME": _principled,
    "EMISSION": _emission,
    "ADD_SHADER": _add,
    "MIX_SHADER": _mix,
}
