# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume shaders by Blender's node type: scattering, absorption and emission as values of a material's program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.scene import ScatteringMedium, gray
from spectral_core.scene.shading import Builder
from spectral_core.spectra.spectrum import Spectrum

from ... import spectra
from ..fields import Value, mean_color, paint_of
from ..nodes.colors import planckian
from ..reader import Reader
from ..tree import Output, linked
from ..walks.shaders import folded
from .filling import Filling
from .phases import Lobes, lobes_of

GRID = "volume_attribute:"
"""Names of the grids that Principled Volume reads by itself; a missing one counts as 1."""


@dataclass(frozen=True, eq=False)
class Fill:
    """Scattering, absorption and emission of a volume shader per unit of length, and its phase functions."""

    scatters: Value
    absorbs: Value
    emits: Value
    lobes: Lobes = ()

    def times(self, reader: Reader, factor: Value) -> Fill:
        """The same medium, multiplied by a factor."""
        scaled = [reader.emit("amount_of_color", factor, part) for part in (self.scatters, self.absorbs, self.emits)]
        return Fill(scaled[0], scaled[1], scaled[2], self.lobes)


def nothing(reader: Reader) -> Fill:
    """Empty space."""
    zero = reader.as_value(np.zeros(3))
    return Fill(zero, zero, zero)


def fill_of(reader: Reader, source: Output | None) -> Fill:
    """The medium of a volume shader; empty, with a note, for an unsupported one."""

    def made(shader: Output, parts: list[Fill]) -> Fill:
        if shader.node.type == "ADD_SHADER":
            return _sum(reader, parts)
        if shader.node.type == "MIX_SHADER":
            share = reader.share(shader.input("Fac") or shader.input("Factor"), 0.5)
            rest = reader.emit("math", 1.0, share, 0.0, settings=("SUBTRACT",))
            return _sum(reader, [part.times(reader, by) for part, by in zip(parts, (rest, share), strict=True)])
        read = FILLS.get(shader.node.type)
        if read is None:
            reader.note(f"the volume shader {shader.label!r} is not supported; it is left out")
            return nothing(reader)
        return read(reader, shader)

    return folded(source, made, nothing(reader))


def _scatter(reader: Reader, source: Output) -> Fill:
    # Cycles scatters density · color and absorbs nothing
    zero, color = reader.as_value(np.zeros(3)), _color(reader, source, 0.8)
    scatters = reader.emit("amount_of_color", reader.read(source, "Density", 1.0), color)
    return Fill(scatters, zero, zero, lobes_of(reader, source))


def _color(reader: Reader, source: Output, fallback: float) -> Value:
    """The color of a shader; of its own spectrum in a sum or a mix of shaders its color, with a note."""
    own = spectra.spectrum_of(reader.translation, source.node)
    if own is None:
        return reader.read(source, "Color", np.full(3, fallback))
    reader.note(f"the spectrum of {source.label!r} counts as its color; only a volume of one shader has a spectrum")
    return Value(reader.builder, reader.builder.number(mean_color(own)), "RGBA")


def _absorption(reader: Reader, source: Output) -> Fill:
    zero = reader.as_value(np.zeros(3))
    density, color = reader.read(source, "Density", 1.0), _color(reader, source, 0.8)
    return Fill(zero, reader.emit("absorbed_by_color", density, color), zero)


def _coefficients(reader: Reader, source: Output) -> Fill:
    names = (f"{name} Coefficients" for name in ("Scatter", "Absorption", "Emission"))
    parts = [reader.emit("amount_of_color", 1.0, reader.read(source, name, np.ones(3))) for name in names]
    return Fill(parts[0], parts[1], parts[2], lobes_of(reader, source))


def _emission(reader: Reader, source: Output) -> Fill:
    zero = reader.as_value(np.zeros(3))
    strength, color = reader.read(source, "Strength", 1.0), _color(reader, source, 1.0)
    return Fill(zero, zero, reader.emit("amount_of_color", strength, color))


def density_of(reader: Reader, source: Output) -> Value:
    """Density of a Principled Volume, with its grid."""
    return _times_grid(reader, source, "Density Attribute", "density", reader.read(source, "Density", 1.0))


def _times_grid(reader: Reader, source: Output, name: str, default: str, value: Value) -> Value:
    """A number times a grid of the object, whose name an input states."""
    grid = str(source.value(name, default) or "")
    if not grid:
        return value
    found = reader.point(f"{GRID}{grid}").as_number()  # of a vector the mean, as in Cycles
    found = reader.emit("math", found, 0.0, 0.0, settings=("MAXIMUM",))
    return reader.emit("math", value, found, 0.0, settings=("MULTIPLY",))


def _principled(reader: Reader, source: Output) -> Fill:
    density, color = density_of(reader, source), _color(reader, source, 0.5)
    tint = str(source.value("Color Attribute", "") or "")
    if tint:
        color = reader.emit("vector_math", color, reader.point(f"{GRID}{tint}"), 0.0, 0.0, settings=("MULTIPLY",))
    absorption = reader.read(source, "Absorption Color", np.zeros(3))
    emission = reader.emit(
        "amount_of_color",
        reader.read(source, "Emission Strength", 0.0),
        reader.read(source, "Emission Color", np.ones(3)),
    )
    intensity = reader.read(source, "Blackbody Intensity", 0.0)
    if intensity.constant is None or intensity.constant[0] > 0:
        kelvin = reader.read(source, "Temperature", 1000.0)
        kelvin = _times_grid(reader, source, "Temperature Attribute", "temperature", kelvin)
        tinted = reader.read(source, "Blackbody Tint", np.ones(3))
        body = reader.emit("blackbody_emission", kelvin, intensity, tinted, planckian(reader, kelvin))
        emission = reader.emit("vector_math", emission, body, 0.0, 0.0, settings=("ADD",))
    return Fill(
        reader.emit("amount_of_color", density, color),
        reader.emit("absorbed_by_principled", density, color, absorption),
        emission, lobes_of(reader, source),
    )  # fmt: skip


def _sum(reader: Reader, parts: list[Fill]) -> Fill:
    """Media in the same space; each scatters its share."""
    sizes = [float(np.mean(mean_color(part.scatters))) for part in parts]
    weights: dict[tuple[float, float], float] = {}
    for part, size in zip(parts, sizes, strict=True):
        whole = sum(weight for weight, _, _ in part.lobes)  # that of a sum is its size
        for weight, g, alpha in part.lobes:
            weights[g, alpha] = weights.get((g, alpha), 0.0) + weight * size / max(whole, 1e-30)
    lobes = tuple((weight, g, alpha) for (g, alpha), weight in weights.items() if weight > 0)
    phases = {tuple((g, alpha) for _, g, alpha in part.lobes) for part in parts if part.lobes}
    varies = any(part.scatters.constant is None for part in parts)
    if len(phases) > 1 and varies:
        reader.note("media of several phase functions vary in one mesh; their shares are the same everywhere")
    total = parts[0]
    for part in parts[1:]:
        pairs = zip(
            (total.scatters, total.absorbs, total.emits), (part.scatters, part.absorbs, part.emits), strict=True
        )
        added = [reader.emit("vector_math", a, b, 0.0, 0.0, settings=("ADD",)) for a, b in pairs]
        total = Fill(added[0], added[1], added[2])
    return Fill(total.scatters, total.absorbs, total.emits, lobes)


FILLS: dict[str, Callable[[Reader, Output], Fill]] = {
    "VOLUME_SCATTER": _scatter,
    "VOLUME_ABSORPTION": _absorption,
    "VOLUME_COEFFICIENTS": _coefficients,
    "PRINCIPLED_VOLUME": _principled,
    "EMISSION": _emission,
}


def default_filling() -> Filling:
    """The volume of an object without a material: Principled Volume with its defaults."""
    builder = Builder()
    grid = Value(builder, builder.add("vector_input", (), f"{GRID}density", 0), "VECTOR").as_width(1)
    gray_, black = builder.number((0.5, 0.5, 0.5)), builder.number((0.0, 0.0, 0.0))
    programs = (
        builder.program(builder.add("amount_of_color", (grid, gray_))),
        builder.program(builder.add("absorbed_by_principled", (grid, gray_, black))),
        builder.program(black),
    )
    return Filling(programs, ((1.0, 0.0, 0.0),))


# with a spectrum as their color, which RGB cannot represent


def spectral_filling(reader: Reader, source: Output, of_material: Spectrum | None = None) -> Filling | None:
    """The medium of a shader whose color is a spectrum; None for others.

    The node's own spectrum has precedence over one that is linked, and that over the spectrum ``of_material``.
    """
    if source.node.type not in SPECTRAL:
        return None
    place = source.input("Color")
    own = spectra.spectrum_of(reader.translation, source.node)
    paint: Any = own if own is not None or place is None else paint_of(reader.field(place))
    if not isinstance(paint, Spectrum):
        if of_material is not None and linked(place) is not None:
            reader.note("its spectrum replaces the texture on its main color; clear the spectrum to see the texture")
        paint = of_material
    if paint is None:
        return None
    medium, density = SPECTRAL[source.node.type](reader, source, paint)
    return Filling(spectral=medium, density=density.program(1))


def _spectral_scatter(reader: Reader, source: Output, color: Spectrum) -> tuple[ScatteringMedium, Value]:
    return ScatteringMedium(1.0, gray(1.0), color, lobes=lobes_of(reader, source)), reader.read(source, "Density", 1.0)


def _spectral_absorption(reader: Reader, source: Output, color: Spectrum) -> tuple[ScatteringMedium, Value]:
    absorbed = Spectrum(f"1 - {color.name}", color.grid, np.maximum(1 - color.values, 0))
    medium = ScatteringMedium(density=1.0, color=gray(0.0), extinction=absorbed)
    return medium, reader.read(source, "Density", 1.0)


def _spectral_principled(reader: Reader, source: Output, color: Spectrum) -> tuple[ScatteringMedium, Value]:
    for name in ("Emission Strength", "Blackbody Intensity"):
        if reader.number(source.input(name), 0.0) > 0:
            reader.note(f"{source.label!r}: {name} is left out beside a spectrum")
    absorbed = reader.read(source, "Absorption Color", np.zeros(3)).constant
    if absorbed is None or np.any(absorbed):
        reader.note(f"{source.label!r}: Absorption Color is left out beside a spectrum")
    if source.value("Color Attribute", ""):
        reader.note(f"{source.label!r}: Color Attribute is left out beside a spectrum")
    return ScatteringMedium(1.0, color, lobes=lobes_of(reader, source)), density_of(reader, source)


SPECTRAL: dict[str, Callable[[Reader, Output, Spectrum], tuple[ScatteringMedium, Value]]] = {
    "VOLUME_SCATTER": _spectral_scatter,
    "VOLUME_ABSORPTION": _spectral_absorption,
    "PRINCIPLED_VOLUME": _spectral_principled,
}
