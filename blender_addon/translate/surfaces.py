# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes to surfaces: each node type to the closest closure that the scene data knows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spectral_core.scene import (
    AddSurface,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    ImageTexture,
    MixSurface,
    Paint,
    Principled,
    Scalar,
    Surface,
    Transparent,
    gray,
)
from spectral_core.spectra.spectrum import Illuminant, Spectrum

from . import color_nodes, spectra, texture_nodes  # noqa: F401  (the node modules teach Reader what they know)
from .fields import mean_color
from .nodes import Input, Output, linked
from .reader import Reader

BLACK = Diffuse(gray(0.0))
"""What an empty shader socket shows: nothing is reflected."""


def surface_of(reader: Reader, place: Input | None) -> Surface:
    """The surface that a shader socket is fed with; black where nothing feeds it, as in Cycles."""
    source = linked(place)
    if source is None:
        return BLACK
    read = SURFACES.get(source.node.type)
    if read is None:
        reader.note(f"the shader {source.label!r} is not understood; a plain diffuse surface was used for it")
        return Diffuse(_color(reader, source, 0.8) if source.input("Color") else gray(0.8))
    for name in ("Normal", "Coat Normal"):
        bump = linked(source.input(name))
        if bump is not None:
            reader.note(f"{bump.label!r} (into {name} of {source.label!r}) is not simulated; the surface stays smooth")
    return read(reader, source)


def _color(reader: Reader, output: Output, fallback: float, name: str = "Color") -> Paint:
    """Main color of a shader node: the spectrum it carries, else its socket."""
    spectrum = spectra.spectrum_of(reader.translation, output.node)
    return spectrum if spectrum is not None else reader.paint(output.input(name), gray(fallback))


def _diffuse(reader: Reader, output: Output) -> Surface:
    return Diffuse(_color(reader, output, 0.8), reader.scalar(output.input("Roughness"), 0.0))


def _diffuse_like(what: str) -> Callable[[Reader, Output], Surface]:
    def read(reader: Reader, output: Output) -> Surface:
        reader.note(f"{output.label!r} is shown as a diffuse surface: {what}")
        return Diffuse(_color(reader, output, 0.8))

    return read


def _glossy(reader: Reader, output: Output) -> Surface:
    if getattr(output.node, "distribution", "GGX") not in ("GGX", "MULTI_GGX", "SHARP"):
        reader.note(f"{output.label!r}: its distribution is replaced by GGX")
    if reader.number(output.input("Anisotropy"), 0.0) != 0:
        reader.note(f"{output.label!r}: anisotropic reflection is shown as isotropic")
    sharp = getattr(output.node, "distribution", "") == "SHARP"
    roughness: Scalar = 0.0 if sharp else reader.scalar(output.input("Roughness"), 0.5)
    multiple = getattr(output.node, "distribution", "") == "MULTI_GGX"
    return Glossy(_color(reader, output, 0.8), roughness, multiple)


def _glass(reader: Reader, output: Output) -> Surface:
    if output.node.type == "BSDF_REFRACTION":
        reader.note(f"{output.label!r} also reflects here, as glass does")
    sharp = getattr(output.node, "distribution", "") == "SHARP"
    roughness: Scalar = 0.0 if sharp else reader.scalar(output.input("Roughness"), 0.0)
    return Glass(_color(reader, output, 1.0), roughness, ior(reader, output.input("IOR"), 1.5))


def ior(reader: Reader, place: Input | None, fallback: float) -> float:
    """Index of refraction: one number, within what a dielectric can have."""
    value = reader.number(place, fallback)
    return min(max(value, 1e-3), 1000.0)


def _transparent(reader: Reader, output: Output) -> Surface:
    return Transparent(_color(reader, output, 1.0))


def _emission(reader: Reader, output: Output) -> Surface:
    strength = _scaled(reader.scalar(output.input("Strength"), 1.0), spectra.strength_of(output.node))
    return Emission(_color(reader, output, 1.0), strength)


def _scaled(strength: Scalar, factor: float) -> Scalar:
    if isinstance(strength, ImageTexture) and factor != 1.0:
        from .images import linear_pixels, with_pixels

        return with_pixels(strength, linear_pixels(strength) * factor, strength.name)
    return strength if isinstance(strength, ImageTexture) else strength * factor


def _mix(reader: Reader, output: Output) -> Surface:
    factor = reader.factor(output.input("Fac") or output.input("Factor"), 0.5)
    first, second = [socket for socket in output.node.inputs if socket.type == "SHADER"][:2]
    if isinstance(factor, float) and factor in (0.0, 1.0):
        return surface_of(reader, Input(second if factor else first, output.groups))
    ends = [surface_of(reader, Input(socket, output.groups)) for socket in (first, second)]
    return MixSurface(factor, ends[0], ends[1])


def _add(reader: Reader, output: Output) -> Surface:
    sources = [Input(socket, output.groups) for socket in output.node.inputs if socket.type == "SHADER"]
    fed = [surface_of(reader, place) for place in sources if linked(place) is not None]
    if not fed:
        return BLACK
    return fed[0] if len(fed) == 1 else AddSurface(fed[0], fed[1])


def _holdout(reader: Reader, output: Output) -> Surface:
    reader.note(f"{output.label!r} cuts no hole into the picture here; it is black")
    return BLACK


PRINCIPLED_UNUSED = {
    "Subsurface Weight": "light that travels below the surface is shown as diffuse",
    "Thin Film Thickness": "its thin film is left out",
    "Anisotropic Rotation": "its anisotropy keeps the direction of the UV map",
}


def _principled(reader: Reader, output: Output) -> Surface:
    for name, message in PRINCIPLED_UNUSED.items():
        place = output.input(name)
        if place is not None and (linked(place) is not None or np.any(np.asarray(place.default) != 0)):
            reader.note(f"{output.label!r}: {message}")
    if np.any(mean_color(reader.field(tint)) != 1) if (tint := output.input("Specular Tint")) else False:
        reader.note(f"{output.label!r}: its specular tint is left out")
    number = lambda name, fallback: reader.number(output.input(name), fallback)  # noqa: E731
    scalar = lambda name, fallback: reader.scalar(output.input(name), fallback)  # noqa: E731
    strength = scalar("Emission Strength", 0.0)
    lit = isinstance(strength, ImageTexture) or strength != 0
    return Principled(
        base_color=_color(reader, output, 0.8, "Base Color"),
        metallic=scalar("Metallic", 0.0),
        roughness=scalar("Roughness", 0.5),
        ior=ior(reader, output.input("IOR"), 1.5),
        alpha=reader.factor(output.input("Alpha"), 1.0),
        specular_level=number("Specular IOR Level", 0.5),
        anisotropic=number("Anisotropic", 0.0),
        transmission=scalar("Transmission Weight", 0.0),
        coat_weight=number("Coat Weight", 0.0),
        coat_roughness=number("Coat Roughness", 0.03),
        coat_ior=ior(reader, output.input("Coat IOR"), 1.5),
        coat_tint=reader.paint(output.input("Coat Tint"), gray(1.0)),
        diffuse_roughness=scalar("Diffuse Roughness", 0.0),
        multiple_scattering=getattr(output.node, "distribution", "") == "MULTI_GGX",
        sheen_weight=number("Sheen Weight", 0.0),
        emission_color=reader.paint(output.input("Emission Color"), gray(1.0)) if lit else gray(1.0),
        emission_strength=strength,
    )


SURFACES: dict[str, Callable[[Reader, Output], Surface]] = {
    "BSDF_PRINCIPLED": _principled,
    "BSDF_DIFFUSE": _diffuse,
    "BSDF_GLOSSY": _glossy,
    "BSDF_ANISOTROPIC": _glossy,
    "BSDF_METALLIC": _diffuse_like("the Metallic node is not understood"),
    "BSDF_GLASS": _glass,
    "BSDF_REFRACTION": _glass,
    "BSDF_TRANSPARENT": _transparent,
    "BSDF_TRANSLUCENT": _diffuse_like("light through it is not simulated"),
    "SUBSURFACE_SCATTERING": _diffuse_like("light below the surface is not simulated"),
    "BSDF_SHEEN": _diffuse_like("sheen is not simulated"),
    "BSDF_VELVET": _diffuse_like("velvet is not simulated"),
    "BSDF_TOON": _diffuse_like("toon shading is not physical"),
    "BSDF_HAIR": _diffuse_like("hair shading is not simulated"),
    "BSDF_HAIR_PRINCIPLED": _diffuse_like("hair shading is not simulated"),
    "BSDF_RAY_PORTAL": _diffuse_like("portals are not simulated"),
    "EMISSION": _emission,
    "BACKGROUND": _emission,
    "MIX_SHADER": _mix,
    "ADD_SHADER": _add,
    "HOLDOUT": _holdout,
}


def with_spectrum(surface: Surface, spectrum: Spectrum) -> Surface:
    """The surface with the spectrum of its material in place of its main color.

    The main color is that of what scatters diffusely (Principled and Diffuse); where nothing does, of every closure
    that reflects or lets through.
    """
    leaves = _leaves(surface)
    main: tuple[type, ...] = (Principled, Diffuse)
    if not any(isinstance(leaf, main) and leaf is not BLACK for leaf in leaves):
        main = (Glossy, Glass, Transparent)
    return _replace_leaves(surface, main, spectrum)


def _leaves(surface: Surface) -> list[Surface]:
    if isinstance(surface, (MixSurface, AddSurface)):
        return _leaves(surface.first) + _leaves(surface.second)
    return [surface]


def _replace_leaves(surface: Surface, kinds: tuple[type, ...], spectrum: Spectrum) -> Surface:
    from dataclasses import replace

    change: dict[str, Any]
    if isinstance(surface, (MixSurface, AddSurface)):
        change = {name: _replace_leaves(getattr(surface, name), kinds, spectrum) for name in ("first", "second")}
    elif not isinstance(surface, kinds) or surface is BLACK:
        return surface
    else:
        name = "base_color" if isinstance(surface, Principled) else "color"
        if isinstance(getattr(surface, name), (Illuminant, Spectrum)):
            return surface  # a node's own spectrum comes before its material's
        change = {name: spectrum}
    return replace(surface, **change)
