# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes to surfaces: each node type to the closest closure that the scene data knows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from spectral_core.scene import (
    IOR,
    LARGEST,
    AddSurface,
    Computed,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Metal,
    MixSurface,
    Paint,
    Principled,
    Scalar,
    Subsurface,
    Surface,
    Toon,
    Translucent,
    Transparent,
    gray,
)

from .. import spectra
from . import color_nodes, sky_nodes, texture_nodes  # noqa: F401  (the node modules teach Reader what they know)
from .conductor import conductor_colors
from .coordinate_nodes import round_tangent
from .fields import mean_color, scalar_of
from .reader import Reader
from .tree import Input, Output, linked

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
    return read(reader, source)


def _color(reader: Reader, output: Output, fallback: float, name: str = "Color") -> Paint:
    """Main color of a shader node: the spectrum it carries, else its socket."""
    spectrum = spectra.spectrum_of(reader.translation, output.node)
    return spectrum if spectrum is not None else reader.paint(output.input(name), gray(fallback))


def _vector(reader: Reader, output: Output, name: str) -> Computed | None:
    """What is linked to a normal or tangent socket, None where nothing is."""
    place = output.input(name)
    if place is None or linked(place) is None:
        return Computed(reader.raised.program(3)) if reader.raised is not None and name == "Normal" else None
    value = reader.as_value(reader.field(place))
    return Computed(value.program(3))


def _tangent(reader: Reader, output: Output, anisotropy: Scalar) -> Computed | None:
    """Direction of an anisotropic lobe: what is linked, else around the object's Z axis, as in Cycles."""
    if anisotropy == 0:
        return None
    return _vector(reader, output, "Tangent") or Computed(round_tangent(reader).program(3))


def _diffuse(reader: Reader, output: Output) -> Surface:
    roughness = reader.scalar(output.input("Roughness"), 0.0)
    return Diffuse(_color(reader, output, 0.8), roughness, _vector(reader, output, "Normal"))


def _diffuse_like(what: str) -> Callable[[Reader, Output], Surface]:
    def read(reader: Reader, output: Output) -> Surface:
        reader.note(f"{output.label!r} is shown as a diffuse surface: {what}")
        return Diffuse(_color(reader, output, 0.8), normal=_vector(reader, output, "Normal"))

    return read


def _roughness(reader: Reader, output: Output, fallback: float) -> Scalar:
    sharp = getattr(output.node, "distribution", "") == "SHARP"
    return 0.0 if sharp else reader.scalar(output.input("Roughness"), fallback)


def _glossy(reader: Reader, output: Output) -> Surface:
    distribution = getattr(output.node, "distribution", "GGX")
    if distribution == "ASHIKHMIN_SHIRLEY":
        reader.note(f"{output.label!r}: Ashikhmin-Shirley is rendered as Beckmann, whose lobe is nearly the same")
    anisotropy = reader.scalar(output.input("Anisotropy"), 0.0)
    return Glossy(
        _color(reader, output, 0.8),
        _roughness(reader, output, 0.5),
        distribution == "MULTI_GGX",
        anisotropy,
        reader.scalar(output.input("Rotation"), 0.0),
        _tangent(reader, output, anisotropy),
        "beckmann" if distribution in ("BECKMANN", "ASHIKHMIN_SHIRLEY") else "ggx",
        _vector(reader, output, "Normal"),
    )


def _metallic(reader: Reader, output: Output) -> Surface:
    node = output.node
    if getattr(node, "distribution", "") == "BECKMANN":
        reader.note(f"{output.label!r}: its distribution is replaced by GGX")
    color, edge = _color(reader, output, 0.6, "Base Color"), reader.paint(output.input("Edge Tint"), gray(0.7))
    if getattr(node, "fresnel_type", "F82") == "PHYSICAL_CONDUCTOR":
        index, extinction = (reader.vector(output.input(name), 1.0) for name in ("IOR", "Extinction"))
        color, edge = conductor_colors(index, extinction)
    anisotropy = reader.scalar(output.input("Anisotropy"), 0.0)
    return Metal(
        color,
        edge,
        _roughness(reader, output, 0.5),
        anisotropy,
        reader.scalar(output.input("Rotation"), 0.0),
        _tangent(reader, output, anisotropy),
        getattr(node, "distribution", "") == "MULTI_GGX",
        _vector(reader, output, "Normal"),
    )


def _glass(reader: Reader, output: Output) -> Surface:
    refracts_only = output.node.type == "BSDF_REFRACTION"
    index = ior(reader, output.input("IOR"), 1.5)
    normal = _vector(reader, output, "Normal")
    return Glass(_color(reader, output, 1.0), _roughness(reader, output, 0.0), index, normal, not refracts_only)


def ior(reader: Reader, place: Input | None, fallback: float) -> float:
    """Index of refraction: one number, within what a dielectric can have."""
    value = reader.number(place, fallback)
    return min(max(value, IOR[0]), IOR[1])


def _transparent(reader: Reader, output: Output) -> Surface:
    return Transparent(_color(reader, output, 1.0))


def _translucent(reader: Reader, output: Output) -> Surface:
    return Translucent(_color(reader, output, 0.8), _vector(reader, output, "Normal"))


def _toon(reader: Reader, output: Output) -> Surface:
    size, smooth = (reader.scalar(output.input(name), fallback) for name, fallback in (("Size", 0.5), ("Smooth", 0.0)))
    glossy = output.node.component == "GLOSSY"
    return Toon(_color(reader, output, 0.8), size, smooth, glossy, _vector(reader, output, "Normal"))


def _emission(reader: Reader, output: Output) -> Surface:
    strength = _scaled(reader, output, spectra.strength_of(reader.translation, output.node))
    return Emission(_color(reader, output, 1.0), strength)


def _scaled(reader: Reader, output: Output, factor: float) -> Scalar:
    place = output.input("Strength")
    if place is None or factor == 1.0:
        return reader.scalar(place, 1.0)
    strength = reader.as_value(reader.field(place))
    scaled = scalar_of(reader.emit("math", strength, factor, 0.0, settings=("MULTIPLY",)))
    return min(scaled, LARGEST) if isinstance(scaled, float) else scaled


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


def _subsurface(reader: Reader, output: Output) -> Surface:
    _note_model(reader, output, getattr(output.node, "falloff", "RANDOM_WALK"))
    return Subsurface(
        _color(reader, output, 0.8),
        _radius(reader, output, "Radius"),
        reader.scalar(output.input("Scale"), 0.05),
        reader.number(output.input("Anisotropy"), 0.0),
        _vector(reader, output, "Normal"),
    )


def _note_model(reader: Reader, output: Output, model: str) -> None:
    if model != "RANDOM_WALK":
        reader.note(f"{output.label!r}: light below the surface goes by Random Walk instead of {model.capitalize()}")


def _radius(reader: Reader, output: Output, name: str) -> tuple[float, float, float]:
    """Radii of red, green and blue, one for the whole surface."""
    if (value := reader.read(output, name, np.array((1.0, 0.2, 0.1)))).constant is None:
        reader.note(f"{output.label!r}: a radius that varies is shown with its mean")
    red, green, blue = (float(part) for part in np.broadcast_to(mean_color(value), (3,)))
    return max(red, 0.0), max(green, 0.0), max(blue, 0.0)


PRINCIPLED_UNUSED = {
    "Thin Film Thickness": "its thin film is left out",
}


def _principled(reader: Reader, output: Output) -> Surface:
    for name, message in PRINCIPLED_UNUSED.items():
        place = output.input(name)
        if place is not None and (linked(place) is not None or np.any(np.asarray(place.default) != 0)):
            reader.note(f"{output.label!r}: {message}")
    coat_normal = output.input("Coat Normal")
    normal = _vector(reader, output, "Normal")
    scalar = lambda name, fallback: reader.scalar(output.input(name), fallback)  # noqa: E731
    coat_weight = reader.factor(output.input("Coat Weight"), 0.0)
    if coat_weight != 0 and (linked(coat_normal) is not None or normal is not None):
        reader.note(f"{output.label!r}: its coat follows the normal of what lies below it")
    anisotropic = scalar("Anisotropic", 0.0)
    below = reader.factor(output.input("Subsurface Weight"), 0.0)
    if below != 0:
        _note_model(reader, output, getattr(output.node, "subsurface_method", "RANDOM_WALK"))
    strength = scalar("Emission Strength", 0.0)
    lit = isinstance(strength, Computed) or strength != 0
    if lit and coat_weight != 0:
        reader.note(f"{output.label!r}: its coat does not dim what it emits")
    index, transmission = ior(reader, output.input("IOR"), 1.5), scalar("Transmission Weight", 0.0)
    if index < 1 and transmission != 1:
        reader.note(f"{output.label!r}: an index of refraction below 1 reflects less at grazing angles than in Cycles")
    return Principled(
        base_color=_color(reader, output, 0.8, "Base Color"),
        metallic=scalar("Metallic", 0.0),
        roughness=scalar("Roughness", 0.5),
        ior=index,
        alpha=reader.factor(output.input("Alpha"), 1.0),
        specular_level=reader.number(output.input("Specular IOR Level"), 0.5),
        specular_tint=reader.paint(output.input("Specular Tint"), gray(1.0)),
        anisotropic=anisotropic,
        anisotropic_rotation=scalar("Anisotropic Rotation", 0.0),
        tangent=_tangent(reader, output, anisotropic),
        transmission=transmission,
        coat_weight=coat_weight,
        coat_roughness=scalar("Coat Roughness", 0.03),
        coat_ior=ior(reader, output.input("Coat IOR"), 1.5),
        coat_tint=reader.paint(output.input("Coat Tint"), gray(1.0)),
        diffuse_roughness=scalar("Diffuse Roughness", 0.0),
        multiple_scattering=getattr(output.node, "distribution", "") == "MULTI_GGX",
        sheen_weight=reader.factor(output.input("Sheen Weight"), 0.0),
        subsurface_weight=below,
        subsurface_radius=_radius(reader, output, "Subsurface Radius") if below != 0 else (1.0, 0.2, 0.1),
        subsurface_scale=scalar("Subsurface Scale", 0.05),
        subsurface_anisotropy=reader.number(output.input("Subsurface Anisotropy"), 0.0),
        emission_color=reader.paint(output.input("Emission Color"), gray(1.0)) if lit else gray(1.0),
        emission_strength=strength,
        normal=normal,
    )


SURFACES: dict[str, Callable[[Reader, Output], Surface]] = {
    "BSDF_PRINCIPLED": _principled,
    "BSDF_DIFFUSE": _diffuse,
    "BSDF_GLOSSY": _glossy,
    "BSDF_ANISOTROPIC": _glossy,
    "BSDF_METALLIC": _metallic,
    "BSDF_GLASS": _glass,
    "BSDF_REFRACTION": _glass,
    "BSDF_TRANSPARENT": _transparent,
    "BSDF_TRANSLUCENT": _translucent,
    "SUBSURFACE_SCATTERING": _subsurface,
    "BSDF_SHEEN": _diffuse_like("sheen is not simulated"),
    "BSDF_VELVET": _diffuse_like("velvet is not simulated"),
    "BSDF_TOON": _toon,
    "BSDF_HAIR": _diffuse_like("hair shading is not simulated"),
    "BSDF_HAIR_PRINCIPLED": _diffuse_like("hair shading is not simulated"),
    "BSDF_RAY_PORTAL": _diffuse_like("portals are not simulated"),
    "EMISSION": _emission,
    "BACKGROUND": _emission,
    "MIX_SHADER": _mix,
    "ADD_SHADER": _add,
    "HOLDOUT": _holdout,
}
