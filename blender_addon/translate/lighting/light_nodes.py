# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of a lamp from its color, temperature, spectrum and nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Color, Computed, Falloff, Paint, Photometry
from spectral_core.scene.lights import EVEN
from spectral_core.spectra.catalogue import PLANCK, blackbody
from spectral_core.spectra.observer import sum_of_lights
from spectral_core.spectra.spectrum import Spectrum

from ... import compat
from .. import spectra
from ..shading.fields import Value, color_of_spectrum, value_of
from ..shading.nodes.colors import KELVIN
from ..shading.reader import Reader
from ..shading.tree import Input, Output, input_of, linked, surface_output
from ..shading.walks.shaders import folded, is_sum
from .lamp_reader import LampReader
from .light_inputs import BROKEN, FALLOFF_POWERS, color_of_own_spectrum, luminaire_of

WHITE, BLACK = Color(np.ones(3)), Color(np.zeros(3))


@dataclass(frozen=True)
class Shine:
    """Color of a lamp's light, the factor on its power, and its distribution."""

    color: Paint
    factor: float = 1.0
    falloff: Falloff = EVEN
    photometry: Photometry | None = None
    is_planckian: bool = False
    pattern: Computed | None = None

    @property
    def is_shaped(self) -> bool:
        """True if it has a falloff or a luminaire's distribution."""
        return self.falloff != EVEN or self.photometry is not None


def shine_of(reader: LampReader) -> Shine:
    """Light of a lamp from its color, temperature, spectrum and nodes, without its power."""
    translation, lamp = reader.translation, reader.lamp
    tint = translation.linear_rgb(lamp.color)
    nodes = _of_nodes(reader)
    spectrum = spectra.spectrum_of(translation, lamp)
    is_own = isinstance(nodes.color, Spectrum) and not nodes.is_planckian
    if spectrum is not None and not is_own:  # a node's spectrum has precedence over its lamp's
        return replace(nodes, color=spectrum, factor=nodes.factor * spectra.strength_of(translation, lamp))
    kelvin = compat.light_temperature_k(lamp)
    if kelvin is not None:
        tint = tint * translation.linear_rgb(lamp.temperature_color)
        if np.ptp(lamp.color[:]) < 1e-6 and isinstance(nodes.color, Color) and np.all(nodes.color.linear_rgb == 1):
            # Blender's temperature keeps the luminance of white, as a normalized illuminant does
            low, high = KELVIN
            if kelvin > high:
                ending = f"Blender's table of temperatures ends at {high:g} K, which is used as in Cycles"
                translation.note(lamp.name, f"its temperature is {kelvin:g} K; {ending}")
            light = blackbody(min(max(kelvin, low), high))
            return replace(nodes, color=light, factor=nodes.factor * float(lamp.color[0]), is_planckian=True)
    if isinstance(nodes.color, Color):
        return replace(nodes, color=Color(tint * nodes.color.linear_rgb))
    if not np.allclose(tint, tint[0]):
        if nodes.is_planckian and isinstance(nodes.color, Spectrum):  # times a temperature: a color, as in Cycles
            shown = np.maximum(color_of_spectrum(nodes.color), 0.0)
            return replace(nodes, color=Color(tint * shown), is_planckian=False)
        translation.note(lamp.name, "a lamp color times a spectrum in its nodes: the spectrum alone was used")
    return replace(nodes, factor=nodes.factor * float(tint.mean()))


def _of_nodes(reader: LampReader) -> Shine:
    """Light of a lamp's node tree: white of factor 1 without nodes."""
    inlined = compat.inlined(reader.lamp)
    tree = compat.node_tree(reader.lamp) if inlined is None else inlined.node_tree
    output = surface_output(tree, "OUTPUT_LIGHT") if tree is not None else None
    if output is None:
        return Shine(WHITE)
    source = linked(input_of(output, "Surface"))
    if source is None:
        return Shine(WHITE, 0.0)  # black, as in Cycles
    plain = _plain(reader, source)
    return _varying(reader, source) if plain is None else plain


def _plain(reader: LampReader, source: Output) -> Shine | None:
    """Emission of one color, with the usual falloffs and luminaires, or a mix of such; None if it varies otherwise."""

    def made(shader: Output, parts: list[Shine | None]) -> Shine | None:
        if shader.node.type == "EMISSION":
            return _emission(reader, shader)
        if not is_sum(shader):
            _note_dark(reader, shader)
            return Shine(BLACK)
        weights = [1.0, 1.0]
        if shader.node.type == "MIX_SHADER":
            share = reader.share(_factor(shader), 0.5).constant
            if share is None:
                return None
            weights = [1.0 - float(share[0]), float(share[0])]
        lit = []
        for weight, part in zip(weights, parts, strict=True):
            if part is None:
                return None
            if weight > 0 and not _is_dark(part):
                lit.append(replace(part, factor=weight * part.factor))
        return _sum(lit)

    dark: Shine | None = Shine(BLACK)
    return folded(source, made, dark)


def _note_dark(reader: Reader, source: Output) -> None:
    """Note a shader that is neither an emission nor a sum of some."""
    reader.note(f"its nodes hold {source.label!r}, which emits no light of a lamp; it counts as black")


def _is_dark(part: Shine) -> bool:
    return part.factor == 0 or (isinstance(part.color, Color) and not np.any(part.color.linear_rgb))


def _sum(parts: list[Shine]) -> Shine | None:
    """Several emissions as one: of colors or of spectra; None if they cannot be one."""
    if any(part.is_shaped for part in parts):
        return parts[0] if len(parts) == 1 else None
    colors = [part.factor * part.color.linear_rgb for part in parts if isinstance(part.color, Color)]
    if len(colors) == len(parts):
        return Shine(Color(np.sum(colors, axis=0) if colors else np.zeros(3)))
    if len(parts) == 1:
        return parts[0]
    spectral = [(part.factor, part.color) for part in parts if isinstance(part.color, Spectrum)]
    if len(spectral) < len(parts) or any(amount < 0 for amount, _ in spectral):
        return None
    light, factor = sum_of_lights(spectral)
    return Shine(light, factor, is_planckian=all(part.is_planckian for part in parts))


def _factor(source: Output) -> Input:
    place = source.input("Fac") or source.input("Factor")
    assert place is not None
    return place


def _emission(reader: LampReader, source: Output) -> Shine | None:
    """An Emission node of one color; None if it varies."""
    spectrum = spectra.spectrum_of(reader.translation, source.node)
    found = spectrum if spectrum is not None else _color(reader, source)
    color: Color | Spectrum | None
    if isinstance(found, Value):
        color = None if found.constant is None else Color(np.broadcast_to(found.constant, (3,)))
    else:
        color = found
    shine = None if color is None else _strength(reader, source.input("Strength"))
    if color is None or shine is None:
        return None
    planckian = spectrum is None and isinstance(color, Spectrum) and color.source == PLANCK
    factor = shine.factor * spectra.strength_of(reader.translation, source.node)
    return replace(shine, color=color, factor=factor, is_planckian=planckian)


def _color(reader: LampReader, source: Output) -> Spectrum | Value:
    """Color of an Emission node; a mix or a texture of spectra as its color."""
    place = source.input("Color")
    found = reader.literal(np.ones(3)) if place is None else reader.field(place)
    return found if isinstance(found, (Spectrum, Value)) else reader.as_value(found)


def _strength(reader: LampReader, place: Input | None) -> Shine | None:
    """A number, a Light Falloff or IES node, or one such node times numbers; None for any other strength."""
    shine = Shine(WHITE)
    while (source := linked(place)) is not None:
        node, inner = source.node, source.input("Strength")
        if node.type == "LIGHT_FALLOFF":
            smooth = _constant(reader, source.input("Smooth"))
            if shine.falloff != EVEN or smooth is None:
                return None
            if not reader.is_far:
                shine = replace(shine, falloff=Falloff(FALLOFF_POWERS.get(source.socket.name, 0), max(smooth, 0.0)))
        elif node.type == "TEX_IES" and reader.lamp.type in ("POINT", "SPOT"):
            is_turned = linked(source.input("Vector")) is not None or not _keeps_angles(reader.matrix)
            if shine.photometry is not None or is_turned:
                return None
            table = luminaire_of(reader, node)
            by = BROKEN if table is None else 1.0
            shine = replace(shine, factor=shine.factor * by, photometry=table)
        elif _constant(reader, place) is not None:
            break
        elif node.type == "MATH" and node.operation == "MULTIPLY" and not node.use_clamp:
            places = [Input(socket, source.groups) for socket in node.inputs[:2]]
            amounts = [_constant(reader, each) for each in places]
            known = [amount for amount in amounts if amount is not None]
            if len(known) != 1:
                return None
            shine, inner = replace(shine, factor=shine.factor * known[0]), places[amounts.index(None)]
        else:
            return None
        place = inner
    return replace(shine, factor=shine.factor * reader.number(place, 1.0))


def _constant(reader: LampReader, place: Input | None) -> float | None:
    """A socket as a number; None if it varies."""
    found = None if place is None else value_of(reader.field(place), reader.builder).as_number().constant
    return None if found is None else float(found[0])


def _keeps_angles(matrix: NDArray[np.float64]) -> bool:
    """True if a transform (4, 4) is a rotation and a scale that is equal along all axes."""
    axes = matrix[:3, :3]
    square = axes.T @ axes
    return bool(np.linalg.det(axes) > 0 and np.allclose(square, square[0, 0] * np.eye(3), atol=1e-4 * square[0, 0]))


def _varying(reader: LampReader, source: Output) -> Shine:
    """Emission that varies over the lamp, by direction or with distance, as a factor of white or of a spectrum."""
    if source.node.type == "EMISSION":
        spectrum = spectra.spectrum_of(reader.translation, source.node)
        color = spectrum if spectrum is not None else _color(reader, source)
        if isinstance(color, Spectrum):
            strength = reader.read(source, "Strength", 1.0)
            return Shine(color, spectra.strength_of(reader.translation, source.node), pattern=_computed(strength, 1))
    total = radiance_of(reader, source)
    constant = total.constant
    if constant is not None:
        return Shine(Color(np.broadcast_to(constant, (3,))))
    return Shine(WHITE, pattern=_computed(total, 3))


def _computed(value: Value, width: int) -> Computed:
    return Computed(value.program(width))


def radiance_of(reader: Reader, source: Output) -> Value:
    """Radiance of a tree of Emission nodes as a color; other shaders count as black, with a note."""
    black = reader.literal(np.zeros(3))

    def made(shader: Output, parts: list[Value]) -> Value:
        if shader.node.type == "EMISSION":
            own = color_of_own_spectrum(reader, shader)
            color = reader.read(shader, "Color", np.ones(3)) if own is None else reader.literal(own)
            strength = reader.read(shader, "Strength", 1.0).as_number()
            return reader.emit("vector_math", color, strength, 0.0, 0.0, settings=("MULTIPLY",))
        if shader.node.type == "ADD_SHADER":
            return reader.emit("vector_math", *parts, 0.0, 0.0, settings=("ADD",))
        if shader.node.type == "MIX_SHADER":
            return reader.emit("mix_vector", reader.share(_factor(shader), 0.5), *parts)
        _note_dark(reader, shader)
        return black

    return folded(source, made, black)
