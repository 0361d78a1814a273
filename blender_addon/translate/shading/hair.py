# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes of hair: Principled Hair BSDF, Hair BSDF and Curves Info."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import e
from typing import Any

import numpy as np

from spectral_core.scene import (
    IOR,
    STRAND_AXIS,
    STRAND_PLACE,
    STRAND_RANDOM,
    STRAND_TANGENT,
    Color,
    Computed,
    EllipseHair,
    Hair,
    HairLobe,
    Paint,
    Surface,
)
from spectral_core.scene.hair import FUR, SCALES_RAD

from .. import spectra
from .fields import Value, scalar_of
from .nodes.coordinates import info
from .reader import Reader, evaluator
from .shader_inputs import direction_at, held, main_color
from .tree import Output, linked

EUMELANIN = np.array((0.506, 0.841, 1.653))
PHEOMELANIN = np.array((0.343, 0.733, 1.924))
"""Absorption of pigments at concentration 1, linear sRGB (d'Eon et al. 2011)."""
DEPTH = 4.0
"""Depth at which the transmittance of a varying absorption is stored."""
OF_HAIR = {
    "Intercept": (STRAND_PLACE, 0), "Length": (STRAND_PLACE, 1), "Thickness": (STRAND_PLACE, 2),
    "Random": (STRAND_RANDOM, 0),
}  # fmt: skip
"""Outputs of Curves Info: the attribute of strands, and its component."""


def principled_hair(reader: Reader, output: Output) -> Surface:
    """Principled Hair BSDF by Chiang's or Huang's model."""
    is_huang = getattr(output.node, "model", "CHIANG") == "HUANG"
    random = reader.read(output, "Random")
    if linked(output.input("Random")) is None:
        own = reader.emit("component", reader.point(STRAND_RANDOM), settings=(0,))
        random = (
            own if random.constant is not None and not np.any(random.constant) else _on_strands(reader, own, random)
        )
    factor = partial(_randomized, reader, random)
    along = factor(reader.read(output, "Roughness", 0.3), reader.read(output, "Random Roughness"))
    around = factor(reader.read(output, "Radial Roughness", 0.3), reader.read(output, "Random Roughness"))
    place = output.input("IOR")
    if linked(place) is not None or (place is not None and isinstance(place.default, float) and place.default < 1):
        reader.note("where the index of refraction of its hair is below 1, it counts as 1 here")
    inputs: dict[str, Any] = {
        "roughness": scalar_of(along),
        "ior": held(reader.scalar(output.input("IOR"), 1.55), IOR),
        "offset_rad": reader.scalar(output.input("Offset"), SCALES_RAD),
        "tangent": _tangent(reader),
        "edge": Computed(reader.point("edge_u").program(3)),
    }
    color, is_fur, depth = _absorbing(reader, output, factor, along if is_huang else around)
    if is_huang:
        return EllipseHair(color, is_fur, depth, **inputs, **_ellipse(reader, output))
    inputs["radial_roughness"] = scalar_of(around)
    return Hair(color, is_fur, depth, coat=reader.scalar(output.input("Coat"), 0.0), **inputs)


def _ellipse(reader: Reader, output: Output) -> dict[str, Any]:
    """Inputs of Huang's model alone."""
    label = output.label
    reader.note(
        f"{label!r}: light is averaged over the width of strands also where the camera sees them wider than a pixel"
    )
    names = {"reflection": "R lobe", "transmission": "TT lobe", "secondary_reflection": "TRT lobe"}
    found: dict[str, Any] = {name: reader.scalar(output.input(socket), 1.0) for name, socket in names.items()}
    found["aspect_ratio"] = reader.scalar(output.input("Aspect Ratio"), 0.85)
    if found["aspect_ratio"] != 1.0:
        axis = reader.emit("transformed", reader.point(STRAND_AXIS), settings=("VECTOR", "OBJECT", "WORLD"))
        found["major_axis"] = Computed(axis.program(3))
    return found


def _absorbing(
    reader: Reader, output: Output, factor: Callable[[Value, Value], Value], radial: Value
) -> tuple[Paint, bool, float]:
    """Color of a coat of fibers, or transmittance of a depth of one radius; True for the first; the depth."""
    node = output.node
    if node.parametrization == "COLOR" or spectra.spectrum_of(reader.translation, node) is not None:
        return main_color(reader, output, 0.5), True, 1.0
    if node.parametrization == "ABSORPTION":
        absorption = reader.read(output, "Absorption Coefficient", np.zeros(3))
    else:
        absorption = _melanin(reader, output, factor, radial)
    known = absorption.constant
    if known is not None:
        known = np.maximum(np.broadcast_to(known, (3,)), 0.0)
        depth = max(float(known.max()), 1e-3)
        return Color(np.exp(-known / depth)), False, depth
    color = _each(reader, absorption, lambda part: _exp(reader, _math(reader, "DIVIDE", part, -DEPTH)))
    return Computed(color.program(3)), False, DEPTH


def hair_lobe(reader: Reader, output: Output) -> Surface:
    """Hair BSDF."""
    along, around, offset = (
        reader.scalar(output.input(name), fallback)
        for name, fallback in (("RoughnessU", 0.1), ("RoughnessV", 1.0), ("Offset", 0.0))
    )
    tangent = direction_at(reader, output, "Tangent") or _tangent(reader)
    edge = Computed(reader.point("edge_v").program(3))
    transmits = output.node.component == "Transmission"
    return HairLobe(main_color(reader, output, 0.8), transmits, along, around, offset, tangent, edge)


def _tangent(reader: Reader) -> Computed:
    """Direction of the strand in the world; 0 on surfaces without strands."""
    along = reader.emit("transformed", reader.point(STRAND_TANGENT), settings=("VECTOR", "OBJECT", "WORLD"))
    return Computed(along.program(3))


def _math(reader: Reader, mode: str, a: Any, b: Any = 0.0) -> Value:
    return reader.emit("math", a, b, 0.0, settings=(mode,))


def _exp(reader: Reader, value: Value) -> Value:
    return _math(reader, "EXPONENT", value)


def _log(reader: Reader, value: Any) -> Value:
    return _math(reader, "LOGARITHM", _math(reader, "MAXIMUM", value, 1e-8), e)


def _on_strands(reader: Reader, own: Value, otherwise: Value) -> Value:
    """``own`` on strands, ``otherwise`` on a mesh."""
    length = reader.emit("component", reader.point(STRAND_PLACE), settings=(1,))
    return reader.emit("blend", _math(reader, "GREATER_THAN", length), otherwise, own, settings=("MIX",))


def _each(reader: Reader, color: Value, change: Callable[[Value], Value]) -> Value:
    parts = [change(reader.emit("component", color, settings=(k,))) for k in range(3)]
    return reader.emit("joined", *parts)


def _randomized(reader: Reader, random: Value, value: Value, amount: Value) -> Value:
    """``value · (1 + 2 (random - 0.5) amount)``."""
    if amount.constant is not None and not np.any(amount.constant):
        return value
    around = _math(reader, "MULTIPLY", _math(reader, "SUBTRACT", random, 0.5), 2.0)
    return _math(reader, "MULTIPLY", value, _math(reader, "ADD", _math(reader, "MULTIPLY", around, amount), 1.0))


def _melanin(reader: Reader, output: Output, factor: Callable[[Value, Value], Value], radial: Value) -> Value:
    """Absorption by pigments of a share ``Melanin``, on a scale that looks even, and by the tint."""
    chance = reader.emit("clamp", reader.read(output, "Random Color"), 0.0, 1.0, settings=("MINMAX",))
    share = factor(reader.read(output, "Melanin", 0.8), chance)
    left = _math(reader, "MAXIMUM", _math(reader, "SUBTRACT", 1.0, share), 1e-4)
    amount = _math(reader, "MULTIPLY", _log(reader, left), -1.0)
    redness = reader.read(output, "Melanin Redness", 1.0)
    red = _math(reader, "MULTIPLY", amount, redness)
    dark = _math(reader, "SUBTRACT", amount, red)
    fit: Any = 0.0
    for coefficient in FUR:
        fit = _math(reader, "ADD", _math(reader, "MULTIPLY", fit, radial), coefficient)
    tint = reader.read(output, "Tint", np.ones(3))
    parts = []
    for k in range(3):
        logarithm = _math(reader, "DIVIDE", _log(reader, reader.emit("component", tint, settings=(k,))), fit)
        pigments = _math(
            reader, "ADD", _math(reader, "MULTIPLY", dark, EUMELANIN[k]), _math(reader, "MULTIPLY", red, PHEOMELANIN[k])
        )
        parts.append(_math(reader, "ADD", pigments, _math(reader, "MULTIPLY", logarithm, logarithm)))
    return reader.emit("joined", *parts)


@evaluator("HAIR_INFO")
def _hair_info(reader: Reader, output: Output) -> Any:
    name = output.socket.name
    if name == "Is Strand":
        length = reader.emit("component", reader.point(STRAND_PLACE), settings=(1,))
        return reader.emit("math", length, 0.0, 0.0, settings=("GREATER_THAN",))
    if name not in OF_HAIR:
        return info(reader, output)
    attribute, component = OF_HAIR[name]
    return reader.emit("component", reader.point(attribute), settings=(component,))
