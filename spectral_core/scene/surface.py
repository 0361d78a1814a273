# SPDX-License-Identifier: GPL-3.0-or-later
"""How surfaces scatter and emit: closures as frozen data, named and parameterized as Blender's shader nodes are."""

from __future__ import annotations

from dataclasses import dataclass, field

from spectral_core.scene.paint import Color, Paint, Scalar, gray
from spectral_core.spectra.spectrum import Spectrum


@dataclass(frozen=True, slots=True, eq=False)
class Diffuse:
    """Lambertian; Oren-Nayar where ``roughness`` is over 0."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Glossy:
    """Microfacet mirror (GGX, ``alpha = roughness²``) that reflects ``color`` at every angle.

    ``multiple_scattering``: whether light that bounces between facets is kept (Blender's Multiscatter GGX) or lost.
    """

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.5
    multiple_scattering: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Glass:
    """Dielectric that reflects and refracts by Fresnel; ``ior`` a number, or a spectrum where it disperses."""

    color: Paint = field(default_factory=lambda: gray(1.0))
    roughness: Scalar = 0.0
    ior: float | Spectrum = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Transparent:
    """Lets light through unbent, times ``color``."""

    color: Paint = field(default_factory=lambda: gray(1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Emission:
    """Emits ``color · strength`` as radiance: (1, 1, 1) · 1 is a white pixel of value 1 seen directly."""

    color: Paint = field(default_factory=lambda: gray(1.0))
    strength: Scalar = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Principled:
    """Blender's Principled BSDF, the part of it that is understood; the names are those of its sockets."""

    base_color: Paint = field(default_factory=lambda: gray(0.8))
    metallic: Scalar = 0.0
    roughness: Scalar = 0.5
    ior: float | Spectrum = 1.5
    alpha: Scalar = 1.0
    specular_level: float = 0.5
    anisotropic: float = 0.0
    transmission: Scalar = 0.0
    coat_weight: float = 0.0
    coat_roughness: float = 0.03
    coat_ior: float = 1.5
    coat_tint: Paint = field(default_factory=lambda: gray(1.0))
    diffuse_roughness: Scalar = 0.0
    multiple_scattering: bool = True
    sheen_weight: float = 0.0
    emission_color: Paint = field(default_factory=lambda: Color((1.0, 1.0, 1.0)))  # type: ignore[arg-type]
    emission_strength: Scalar = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MixSurface:
    """``first`` with probability 1 - factor, ``second`` with probability factor."""

    factor: Scalar
    first: Surface
    second: Surface


@dataclass(frozen=True, slots=True, eq=False)
class AddSurface:
    """Both at once: the sum of what they scatter and emit."""

    first: Surface
    second: Surface


Surface = Diffuse | Glossy | Glass | Transparent | Emission | Principled | MixSurface | AddSurface


@dataclass(frozen=True, slots=True, eq=False)
class ScatteringMedium:
    """Homogeneous participating medium inside a closed mesh, per scene unit of length.

    ``density · extinction``: extinction 1/length, per wavelength where ``extinction`` is a color or spectrum;
    ``color``: single-scattering albedo; ``anisotropy``: Henyey-Greenstein g; ``emission_color · emission_strength``:
    radiance emitted per unit length.
    """

    density: float = 1.0
    color: Paint = field(default_factory=lambda: gray(0.5))
    extinction: Paint | None = None
    anisotropy: float = 0.0
    emission_color: Paint = field(default_factory=lambda: gray(1.0))
    emission_strength: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A named surface and, where light also travels inside, the medium in it. No surface: only the medium shows."""

    name: str
    surface: Surface | None = field(default_factory=Diffuse)
    medium: ScatteringMedium | None = None
