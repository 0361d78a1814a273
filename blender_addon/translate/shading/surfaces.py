# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes to surfaces: each node type to the closest closure of the scene data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from spectral_core.scene import (
    LARGEST,
    AddSurface,
    Computed,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Holdout,
    Metal,
    RayPortal,
    Scalar,
    Sheen,
    Subsurface,
    Surface,
    Toon,
    Translucent,
    Transparent,
    gray,
)
from spectral_core.spectra.spectrum import Spectrum

from .. import spectra
from ..lighting import light_inputs  # noqa: F401  (as below)
from .fields import Value, scalar_of
from .hair import hair_lobe, principled_hair
from .nodes import colors, skies, textures  # noqa: F401  (importing the node modules registers their evaluators)
from .principled import principled
from .reader import Reader
from .shader_inputs import (
    conductor_colors,
    direction_at,
    lobe_tangent,
    main_color,
    model_of,
    radius_of,
    thin_film,
    varying_ior,
)
from .tree import Input, Output, linked
from .walks.shaders import folded, sum_inputs
from .walks.sums import Sums

FACETS: dict[str, Literal["beckmann", "ashikhmin"]] = {"BECKMANN": "beckmann", "ASHIKHMIN_SHIRLEY": "ashikhmin"}
"""Distributions of facets other than GGX."""
BLACK = Diffuse(gray(0.0))
"""Surface of an empty shader socket: nothing is reflected."""


def surface_of(reader: Reader, place: Input | None) -> Surface:
    """The surface at a shader socket; black without a link, as in Cycles."""
    sums, shares = Sums(reader), dict[Output, Value]()

    def places(source: Output) -> list[Input]:
        """The shaders that a mix or sum reads: one of a mix whose factor is 0 or 1."""
        inputs = sum_inputs(source)
        if source.node.type != "MIX_SHADER":
            return inputs
        share = shares[source] = reader.share(source.input("Fac") or source.input("Factor"), 0.5)
        amount = share.constant
        return inputs if amount is None or amount[0] not in (0.0, 1.0) else [inputs[int(amount[0])]]

    def made(source: Output, parts: list[Surface | None]) -> Surface | None:
        if source.node.type == "MIX_SHADER":
            ends = [BLACK if part is None else part for part in parts]
            return ends[0] if len(ends) == 1 else sums.mixed(shares[source], ends[0], ends[1])
        if source.node.type == "ADD_SHADER":
            fed = [part for part in parts if part is not None]
            return AddSurface(fed[0], fed[1]) if len(fed) == 2 else (fed or [BLACK])[0]
        return _closure(reader, source)

    found = folded(linked(place), made, None, places)
    return BLACK if found is None else sums.settled(sums.held_out(found), BLACK)


def _closure(reader: Reader, source: Output) -> Surface:
    """The surface of a shader that reads no others."""
    read = SURFACES.get(source.node.type)
    if read is None:
        reader.note(f"the shader {source.label!r} is not supported; a plain diffuse surface was used")
        return Diffuse(main_color(reader, source, 0.8) if source.input("Color") else gray(0.8))
    return read(reader, source)


def _diffuse(reader: Reader, output: Output) -> Surface:
    roughness = reader.scalar(output.input("Roughness"), 0.0)
    return Diffuse(main_color(reader, output, 0.8), roughness, direction_at(reader, output, "Normal"))


def _roughness(reader: Reader, output: Output, fallback: float) -> Scalar:
    sharp = getattr(output.node, "distribution", "") == "SHARP"
    return 0.0 if sharp else reader.scalar(output.input("Roughness"), fallback)


def _facets(node: Any) -> Literal["ggx", "beckmann"]:
    return "beckmann" if getattr(node, "distribution", "") == "BECKMANN" else "ggx"


def _glossy(reader: Reader, output: Output) -> Surface:
    distribution = getattr(output.node, "distribution", "GGX")
    anisotropy = reader.scalar(output.input("Anisotropy"), 0.0)
    return Glossy(
        main_color(reader, output, 0.8),
        _roughness(reader, output, 0.5),
        distribution == "MULTI_GGX",
        anisotropy,
        reader.scalar(output.input("Rotation"), 0.0),
        lobe_tangent(reader, output, anisotropy),
        FACETS.get(distribution, "ggx"),
        direction_at(reader, output, "Normal"),
    )


def _metallic(reader: Reader, output: Output) -> Surface:
    node = output.node
    color, edge = main_color(reader, output, 0.6, "Base Color"), reader.paint(output.input("Edge Tint"), gray(0.7))
    physical = getattr(node, "fresnel_type", "F82") == "PHYSICAL_CONDUCTOR"
    scale = 1.0
    if physical:
        index, extinction = (reader.vector(output.input(name), 1.0) for name in ("IOR", "Extinction"))
        facing, edge, scale = conductor_colors(index, extinction)
        color = color if isinstance(color, Spectrum) else facing
    anisotropy = reader.scalar(output.input("Anisotropy"), 0.0)
    return Metal(
        color,
        edge,
        _roughness(reader, output, 0.5),
        anisotropy,
        reader.scalar(output.input("Rotation"), 0.0),
        lobe_tangent(reader, output, anisotropy),
        getattr(node, "distribution", "") == "MULTI_GGX",
        direction_at(reader, output, "Normal"),
        physical,
        **thin_film(reader, output),
        distribution=_facets(node),
        edge_scale=scale,
    )


def _glass(reader: Reader, output: Output) -> Surface:
    refracts_only = output.node.type == "BSDF_REFRACTION"
    index = varying_ior(reader, output.input("IOR"), 1.5)
    normal = direction_at(reader, output, "Normal")
    keeps_energy = not refracts_only and getattr(output.node, "distribution", "") == "MULTI_GGX"
    roughness = _roughness(reader, output, 0.0)
    color, film = main_color(reader, output, 1.0), thin_film(reader, output)
    return Glass(
        color, roughness, index, normal, not refracts_only, keeps_energy, **film, distribution=_facets(output.node)
    )


def _transparent(reader: Reader, output: Output) -> Surface:
    return Transparent(main_color(reader, output, 1.0))


def _translucent(reader: Reader, output: Output) -> Surface:
    return Translucent(main_color(reader, output, 0.8), direction_at(reader, output, "Normal"))


def _sheen(reader: Reader, output: Output) -> Surface:
    microfiber = getattr(output.node, "distribution", "MICROFIBER") == "MICROFIBER"
    roughness = reader.scalar(output.input("Roughness"), 0.5)
    return Sheen(main_color(reader, output, 0.8), roughness, microfiber, direction_at(reader, output, "Normal"))


def _velvet(reader: Reader, output: Output) -> Surface:
    sigma = reader.scalar(output.input("Sigma"), 1.0)
    return Sheen(main_color(reader, output, 0.8), sigma, False, direction_at(reader, output, "Normal"))


def _toon(reader: Reader, output: Output) -> Surface:
    size, smooth = (reader.scalar(output.input(name), fallback) for name, fallback in (("Size", 0.5), ("Smooth", 0.0)))
    glossy = output.node.component == "GLOSSY"
    return Toon(main_color(reader, output, 0.8), size, smooth, glossy, direction_at(reader, output, "Normal"))


def _emission(reader: Reader, output: Output) -> Surface:
    strength = _scaled(reader, output, spectra.strength_of(reader.translation, output.node))
    return Emission(main_color(reader, output, 1.0), strength)


def _scaled(reader: Reader, output: Output, factor: float) -> Scalar:
    place = output.input("Strength")
    if place is None or factor == 1.0:
        return reader.scalar(place, 1.0)
    strength = reader.as_value(reader.field(place))
    scaled = scalar_of(reader.emit("math", strength, factor, 0.0, settings=("MULTIPLY",)))
    return min(scaled, LARGEST) if isinstance(scaled, float) else scaled


def _holdout(reader: Reader, output: Output) -> Surface:
    return Holdout()


def _portal(reader: Reader, output: Output) -> Surface:
    direction = reader.read(output, "Direction", np.zeros(3))
    return RayPortal(
        main_color(reader, output, 1.0),
        direction_at(reader, output, "Position"),
        None if direction.constant is not None and not np.any(direction.constant) else Computed(direction.program(3)),
    )


def _eevee(reader: Reader, output: Output) -> Surface:
    reader.note(f"{output.label!r} is a shader of EEVEE alone; it is black, as in Cycles")
    return BLACK


def _subsurface(reader: Reader, output: Output) -> Surface:
    return Subsurface(
        main_color(reader, output, 0.8),
        radius_of(reader, output, "Radius"),
        reader.scalar(output.input("Scale"), 0.05),
        reader.scalar(output.input("Anisotropy"), 0.0),
        direction_at(reader, output, "Normal"),
        varying_ior(reader, output.input("IOR"), 1.4),
        reader.scalar(output.input("Roughness"), 1.0),
        model_of(getattr(output.node, "falloff", "RANDOM_WALK")),
    )


SURFACES: dict[str, Callable[[Reader, Output], Surface]] = {
    "BSDF_PRINCIPLED": principled,
    "BSDF_DIFFUSE": _diffuse,
    "BSDF_GLOSSY": _glossy,
    "BSDF_ANISOTROPIC": _glossy,
    "BSDF_METALLIC": _metallic,
    "BSDF_GLASS": _glass,
    "BSDF_REFRACTION": _glass,
    "BSDF_TRANSPARENT": _transparent,
    "BSDF_TRANSLUCENT": _translucent,
    "SUBSURFACE_SCATTERING": _subsurface,
    "BSDF_SHEEN": _sheen,
    "BSDF_VELVET": _velvet,
    "BSDF_TOON": _toon,
    "BSDF_HAIR": hair_lobe,
    "BSDF_HAIR_PRINCIPLED": principled_hair,
    "BSDF_RAY_PORTAL": _portal,
    "EMISSION": _emission,
    "BACKGROUND": _emission,
    "HOLDOUT": _holdout,
    "EEVEE_SPECULAR": _eevee,
}
