# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of a lamp from its color, temperature, spectrum and nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Color, Falloff, ImageTexture, Paint, Photometry
from spectral_core.spectra.catalogue import blackbody
from spectral_core.spectra.luminaire import read_ies
from spectral_core.spectra.spectrum import Spectrum

from ... import compat
from .. import spectra
from ..context import Translation
from ..shading.fields import mean_color
from ..shading.reader import Reader
from ..shading.tree import Input, Output, linked, surface_output

FALLOFF_POWERS = {"Quadratic": 0, "Linear": 1, "Constant": 2}


EVEN = Falloff()
"""The physical falloff: the inverse square alone."""


@dataclass(frozen=True)
class Shine:
    """Color of a lamp's light, the factor on its power, and its distribution."""

    color: Paint
    factor: float = 1.0
    falloff: Falloff = EVEN
    photometry: Photometry | None = None
    is_planckian: bool = False


def shine_of(translation: Translation, lamp: Any) -> Shine:
    """Light of a lamp from its color, temperature, spectrum and nodes, without its power."""
    tint = translation.linear_rgb(lamp.color)
    nodes = _of_nodes(translation, lamp)
    spectrum = spectra.spectrum_of(translation, lamp)
    if spectrum is not None:
        return replace(nodes, color=spectrum, factor=nodes.factor * spectra.strength_of(translation, lamp))
    kelvin = compat.light_temperature_k(lamp)
    if kelvin is not None:
        tint = tint * translation.linear_rgb(lamp.temperature_color)
        if np.ptp(lamp.color[:]) < 1e-6 and isinstance(nodes.color, Color) and np.all(nodes.color.linear_rgb == 1):
            # Blender's temperature keeps the luminance of white, as a normalized illuminant does
            light = blackbody(min(max(kelvin, 800.0), 20000.0))
            return replace(nodes, color=light, factor=nodes.factor * float(lamp.color[0]), is_planckian=True)
    if isinstance(nodes.color, Color):
        return replace(nodes, color=Color(tint * nodes.color.linear_rgb))
    if not np.allclose(tint, tint[0]):
        translation.note(lamp.name, "a lamp color times a spectrum in its nodes: the spectrum alone was used")
    return replace(nodes, factor=nodes.factor * float(tint.mean()))


def _of_nodes(translation: Translation, lamp: Any) -> Shine:
    """Light of a lamp's node tree: white of factor 1 without nodes."""
    white = Shine(Color(np.ones(3)))
    tree = compat.node_tree(lamp)
    output = surface_output(tree, "OUTPUT_LIGHT") if tree is not None else None
    if output is None:
        return white
    source = linked(Input(output.inputs["Surface"]))
    if source is None:
        return replace(white, factor=0.0)  # black, as in Cycles
    shine = _shader(Reader(translation, lamp.name), source)
    if shine is None:
        message = f"its nodes end in {source.label!r}, not in an Emission node; its own color is used"
        translation.note(lamp.name, message)
        return white
    return shine


def _shader(reader: Reader, source: Output, depth: int = 0) -> Shine | None:
    """An Emission node, or several that are mixed by a number or added; None for anything else."""
    node = source.node
    if node.type == "EMISSION":
        return _emission(reader, source)
    if node.type not in ("MIX_SHADER", "ADD_SHADER") or depth > 50:
        return None
    inputs = [Input(socket, source.groups) for socket in node.inputs if socket.type == "SHADER"]
    parts = [(found, _shader(reader, found, depth + 1)) for place in inputs if (found := linked(place)) is not None]
    shines = [shine for _, shine in parts if shine is not None]
    factor = reader.number(source.input("Fac") or source.input("Factor"), 0.5) if node.type == "MIX_SHADER" else 1.0
    weights = [1.0 - factor, factor] if node.type == "MIX_SHADER" else [1.0, 1.0]
    if len(shines) != len(inputs):
        reader.note(f"{source.label!r} combines other nodes than Emission; these count as black")
    if not all(isinstance(shine.color, Color) for shine in shines):
        reader.note(f"{source.label!r} combines spectra; the first alone was used")
        return shines[0] if shines else None
    total = np.zeros(3)
    for weight, shine in zip(weights, shines, strict=False):
        assert isinstance(shine.color, Color)
        total = total + weight * shine.factor * shine.color.linear_rgb
    shaped = next((shine for shine in shines if shine.falloff != EVEN or shine.photometry), Shine(Color(total)))
    return replace(shaped, color=Color(total), factor=1.0)


def _emission(reader: Reader, source: Output) -> Shine:
    white = Color(np.ones(3))
    spectrum = spectra.spectrum_of(reader.translation, source.node)
    paint = spectrum if spectrum is not None else reader.paint(source.input("Color"), white)
    shine = _strength(reader, source.input("Strength"))
    if isinstance(paint, ImageTexture):
        reader.note("an image on a lamp is shown as its mean color")
        paint = Color(mean_color(paint))
    planckian = spectrum is None and isinstance(paint, Spectrum) and paint.source == "Planck's law"
    factor = shine.factor * spectra.strength_of(reader.translation, source.node)
    return replace(shine, color=paint, factor=factor, is_planckian=planckian)


def _strength(reader: Reader, place: Input | None) -> Shine:
    """A strength: a number, a Light Falloff or IES node, or such a node times numbers."""
    white = Color(np.ones(3))
    source = linked(place)
    if source is None:
        return Shine(white, reader.number(place, 1.0))
    kind = source.node.type
    if kind == "LIGHT_FALLOFF":
        falloff = Falloff(FALLOFF_POWERS.get(source.socket.name, 0), max(_number(reader, source, "Smooth"), 0.0))
        inner = _strength(reader, source.input("Strength"))
        return replace(inner, falloff=falloff)
    if kind == "TEX_IES":
        photometry = _luminaire(reader, source)
        if linked(source.input("Vector")) is not None:
            reader.note(f"coordinates into {source.label!r} are not supported; its own axes are used")
        return replace(_strength(reader, source.input("Strength")), photometry=photometry)
    if kind == "MATH" and source.node.operation == "MULTIPLY":
        first, second = (_strength(reader, Input(socket, source.groups)) for socket in source.node.inputs[:2])
        shaped = first if first.falloff != EVEN or first.photometry is not None else second
        return replace(shaped, factor=first.factor * second.factor)
    return Shine(white, reader.number(place, 1.0))


def _number(reader: Reader, source: Output, name: str) -> float:
    return reader.number(source.input(name), 0.0)


def _luminaire(reader: Reader, source: Output) -> Photometry | None:
    """The table of an IES node, read from its text or file; None, with a note, if it cannot be read."""
    import bpy

    node = source.node
    if node.mode == "INTERNAL":
        text = node.ies.as_string() if node.ies is not None else ""
    else:
        try:
            with Path(bpy.path.abspath(node.filepath)).open(encoding="latin-1") as file:
                text = file.read(1 << 22)
        except (OSError, ValueError) as error:
            reader.note(f"the file of {source.label!r} cannot be read ({error}); the lamp emits evenly")
            return None
    try:
        return Photometry(*read_ies(text))
    except InvalidInputError as error:
        reader.note(f"{source.label!r}: {error}; the lamp emits evenly")
        return None
