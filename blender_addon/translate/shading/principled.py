# SPDX-License-Identifier: GPL-3.0-or-later
"""The Principled BSDF."""

from __future__ import annotations

import numpy as np

from spectral_core.scene import IOR, Color, Computed, Paint, Principled, Surface, gray
from spectral_core.scene.shading import Raised
from spectral_core.spectra.spectrum import Spectrum

from .fields import Value, paint_of, scalar_of
from .reader import Reader
from .shader_inputs import (
    direction_at,
    held,
    ior,
    lobe_tangent,
    main_color,
    model_of,
    radius_of,
    thin_film,
    varying_ior,
)
from .tree import Output, linked

LEAST_COAT_IOR = 1.0
"""A link may give less, and Cycles takes this."""


def _is_white(paint: Paint) -> bool:
    return isinstance(paint, Color) and bool(np.all(paint.linear_rgb == 1))


def _coat_normal(reader: Reader, output: Output, normal: Computed | None) -> Computed | None:
    """Normal of the coat if it differs from that of what lies below it, else None."""
    over, below = (linked(output.input(name)) for name in ("Coat Normal", "Normal"))
    if over is not None:
        same = below is not None and over == below
        return None if same else direction_at(reader, output, "Coat Normal")
    # without a link the coat is about the normal of the geometry, which displacement as bump bends for both
    return None if normal is None or isinstance(normal, Raised) else Computed(reader.point("normal").program(3))


def _emission_color(reader: Reader, output: Output, *, is_coated: bool) -> Paint:
    """The emission color, attenuated and tinted by the coat above it."""
    plain = reader.paint(output.input("Emission Color"), gray(1.0))
    if not is_coated:
        return plain
    if isinstance(plain, Spectrum):
        reader.note(f"{output.label!r}: its coat does not dim the spectrum that it emits")
        return plain

    def math(kind: str, first: Value | float, second: Value | float = 0.0, third: float = 0.0) -> Value:
        return reader.emit("math", first, second, third, settings=(kind,))

    coat_normal = output.input("Coat Normal")
    normal = reader.point("normal")
    if coat_normal is not None and linked(coat_normal) is not None:
        normal = reader.as_value(reader.field(coat_normal))
    incoming = reader.point("incoming")
    weight = reader.read(output, "Coat Weight", 0.0)
    index = math("MAXIMUM", reader.read(output, "Coat IOR", 1.5), LEAST_COAT_IOR)
    reflected = reader.emit("fresnel", index, normal, incoming, 0.0)
    clear = math("SUBTRACT", 1.0, math("MULTIPLY", weight, reflected))
    # through the coat: its tint to the power of the path's length over its thickness
    cosine = reader.emit("vector_number", normal, incoming, settings=("DOT_PRODUCT",))
    sine = math("SUBTRACT", 1.0, math("MULTIPLY", cosine, cosine))
    inner = math("SQRT", math("SUBTRACT", 1.0, math("DIVIDE", sine, math("MULTIPLY", index, index))))
    way = math("DIVIDE", 1.0, math("MAXIMUM", inner, 1e-3))
    tint = reader.read(output, "Coat Tint", np.ones(3))
    coated = reader.emit("vector_math", tint, way, 0.0, 0.0, settings=("POWER",))
    lost = reader.emit("vector_math", np.ones(3), coated, 0.0, 0.0, settings=("SUBTRACT",))
    taken = reader.emit("vector_math", lost, weight, 0.0, 0.0, settings=("MULTIPLY",))
    passed = reader.emit("vector_math", np.ones(3), taken, 0.0, 0.0, settings=("SUBTRACT",))
    dimmed = reader.emit("vector_math", passed, clear, 0.0, 0.0, settings=("MULTIPLY",))
    color = reader.read(output, "Emission Color", np.ones(3))
    return paint_of(reader.emit("vector_math", color, dimmed, 0.0, 0.0, settings=("MULTIPLY",)))


def principled(reader: Reader, output: Output) -> Surface:
    normal = direction_at(reader, output, "Normal")
    scalar = lambda name, fallback: reader.scalar(output.input(name), fallback)  # noqa: E731
    coat_weight = reader.factor(output.input("Coat Weight"), 0.0)
    coat_normal = _coat_normal(reader, output, normal) if coat_weight != 0 else None
    sheen = reader.factor(output.input("Sheen Weight"), 0.0)
    asked = reader.as_value(reader.read(output, "Sheen Weight", 0.0)).constant
    if asked is not None and float(np.max(asked)) > 1.0:  # a link alone can exceed 1
        reader.note(f"{output.label!r}: its Sheen Weight of {float(np.max(asked)):.3g} is above 1; 1 was used")
    if coat_normal is not None and sheen != 0:
        reader.note(f"{output.label!r}: its sheen follows the normal of what lies below the coat")
    anisotropic = scalar("Anisotropic", 0.0)
    below = reader.factor(output.input("Subsurface Weight"), 0.0)
    # negative light of an Emission shader takes light away, not that of a Principled BSDF
    strength = scalar_of(reader.emit("math", reader.read(output, "Emission Strength"), 0.0, 0.0, settings=("MAXIMUM",)))
    lit = isinstance(strength, Computed) or strength != 0
    index, transmission = varying_ior(reader, output.input("IOR"), 1.5), scalar("Transmission Weight", 0.0)
    coat_tint = reader.paint(output.input("Coat Tint"), gray(1.0))
    return Principled(
        base_color=main_color(reader, output, 0.8, "Base Color"),
        metallic=scalar("Metallic", 0.0),
        roughness=scalar("Roughness", 0.5),
        ior=index,
        alpha=reader.factor(output.input("Alpha"), 1.0),
        specular_level=scalar("Specular IOR Level", 0.5),
        specular_tint=reader.paint(output.input("Specular Tint"), gray(1.0)),
        anisotropic=anisotropic,
        anisotropic_rotation=scalar("Anisotropic Rotation", 0.0),
        tangent=lobe_tangent(reader, output, anisotropic),
        transmission=transmission,
        coat_weight=coat_weight,
        coat_roughness=scalar("Coat Roughness", 0.03),
        coat_ior=max(ior(reader, output.input("Coat IOR"), 1.5), LEAST_COAT_IOR),
        coat_tint=coat_tint,
        coat_normal=coat_normal,
        diffuse_roughness=scalar("Diffuse Roughness", 0.0),
        multiple_scattering=getattr(output.node, "distribution", "") == "MULTI_GGX",
        sheen_weight=sheen,
        sheen_roughness=scalar("Sheen Roughness", 0.5),
        sheen_tint=reader.paint(output.input("Sheen Tint"), gray(1.0)),
        subsurface_weight=below,
        subsurface_radius=radius_of(reader, output, "Subsurface Radius") if below != 0 else (1.0, 0.2, 0.1),
        subsurface_scale=scalar("Subsurface Scale", 0.05),
        subsurface_anisotropy=scalar("Subsurface Anisotropy", 0.0),
        subsurface_ior=held(scalar("Subsurface IOR", 1.4), IOR),
        subsurface_model=model_of(getattr(output.node, "subsurface_method", "RANDOM_WALK")),
        emission_color=_emission_color(reader, output, is_coated=coat_weight != 0) if lit else gray(1.0),
        emission_strength=strength,
        normal=normal,
        **thin_film(reader, output),
    )
