# SPDX-License-Identifier: GPL-3.0-or-later
"""How surfaces scatter and emit: closures as frozen data, named and parameterized as Blender's shader nodes are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from spectral_core.checks import require_declared, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.scene.fluorescent import Fluorescent, Holdout, RayPortal, Transparent
from spectral_core.scene.hair import EllipseHair, Hair, HairLobe
from spectral_core.scene.medium_grid import MediumGrid
from spectral_core.scene.paint import LARGEST, Color, Numbers, Paint, Scalar, Weight, gray
from spectral_core.scene.shading.program import Computed
from spectral_core.spectra.spectrum import Spectrum

SODIUM_NM = 589.3
"""Wavelength at which an index of refraction is given as one number."""


def nominal_ior(ior: float | Spectrum | Computed) -> float:
    """An index of refraction as one number: that at the sodium line, or the mean of a varying one.

    Outside the wavelengths of a spectrum the index is that at the nearest one.
    """
    if isinstance(ior, Spectrum):
        return float(np.interp(SODIUM_NM, ior.grid.wavelengths_nm, ior.values))
    return float(np.mean(ior.typical)) if isinstance(ior, Computed) else float(ior)


def specular_ior(ior: float, level: float) -> float:
    """Index of refraction with the reflectance of Principled's specular level: F0 times twice the level (Blender 4)."""
    if level == 0.5:
        return ior
    normal = float(np.clip(((ior - 1) / (ior + 1)) ** 2 * 2 * level, 0.0, 0.99))
    raised = (1 + np.sqrt(normal)) / (1 - np.sqrt(normal))
    return float(raised if ior >= 1 else 1 / raised)


SubsurfaceModel = Literal["random_walk", "random_walk_skin", "burley"]
"""How light scatters below a surface: Random Walk, Random Walk (Skin), Christensen-Burley."""


@dataclass(frozen=True, slots=True, eq=False)
class Diffuse(Numbers):
    """Lambertian; Oren-Nayar if ``roughness`` is above 0."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.0
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Glossy(Numbers):
    """Microfacet mirror (GGX, ``alpha = roughness²``) that reflects ``color`` at every angle.

    ``multiple_scattering``: True to keep light that bounces between facets (Blender's Multiscatter GGX). The
    facets of Beckmann and of Ashikhmin and Shirley lose it, as in Cycles.
    """

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.5
    multiple_scattering: bool = True
    anisotropy: Scalar = 0.0
    rotation: Scalar = 0.0
    tangent: Computed | None = None
    distribution: Literal["ggx", "beckmann", "ashikhmin"] = "ggx"
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Glass(Numbers):
    """Dielectric that reflects and refracts by Fresnel; ``ior``: a number, a varying one, or a spectrum for dispersion.

    ``multiple_scattering``: True to keep light that bounces between facets of GGX that reflect and refract. Those of
    Beckmann and those that only refract (``reflects`` False) lose it.

    ``thin_film_thickness`` (nm; 0 for none) and ``thin_film_ior``: of a thin film on the surface, as in other closures.
    """

    color: Paint = field(default_factory=lambda: gray(1.0))
    roughness: Scalar = 0.0
    ior: float | Spectrum | Computed = 1.5
    normal: Computed | None = None
    reflects: bool = True
    multiple_scattering: bool = True
    thin_film_thickness: Scalar = 0.0
    thin_film_ior: Scalar = 1.33
    distribution: Literal["ggx", "beckmann"] = "ggx"


@dataclass(frozen=True, slots=True, eq=False)
class Translucent(Numbers):
    """Lambertian transmission: light leaves on the other side."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Toon(Numbers):
    """A lobe with a hard or soft edge around the normal or, ``glossy``, around the mirrored direction."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    size: Scalar = 0.5
    smooth: Scalar = 0.0
    glossy: bool = False
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Metal(Numbers):
    """Microfacet conductor: ``color`` facing, ``edge_tint`` at 82 degrees (Kutz, Hasan and Edmondson 2021).

    ``physical``: Fresnel's equations in place of that model, with the index of refraction and extinction that ``color``
    and ``edge_tint`` times ``edge_scale`` stand for by Gulbrandsen 2014; tints of metals of little extinction reach 2.
    """

    color: Paint = field(default_factory=lambda: gray(0.6))
    edge_tint: Paint = field(default_factory=lambda: gray(0.7))
    roughness: Scalar = 0.5
    anisotropy: Scalar = 0.0
    rotation: Scalar = 0.0
    tangent: Computed | None = None
    multiple_scattering: bool = True
    normal: Computed | None = None
    physical: bool = False
    thin_film_thickness: Scalar = 0.0
    thin_film_ior: Scalar = 1.33
    distribution: Literal["ggx", "beckmann"] = "ggx"
    edge_scale: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Sheen(Numbers):
    """Fibers or dust that reflect toward grazing angles; ``microfiber``: Blender's own model, else Ashikhmin's."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.5
    microfiber: bool = True
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Emission(Numbers):
    """Emits ``color · strength`` as radiance: (1, 1, 1) · 1 is a white pixel of value 1 seen directly."""

    color: Paint = field(default_factory=lambda: gray(1.0))
    strength: Scalar = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Subsurface(Numbers):
    """Subsurface scattering: mean free paths are proportional to ``radius`` (of red, green, blue) times ``scale``.

    ``ior``, ``roughness``: of the facets that refract light into the medium.
    """

    color: Paint = field(default_factory=lambda: gray(0.8))
    radius: tuple[float, float, float] | Computed = (1.0, 0.2, 0.1)
    scale: Scalar = 0.05
    scattering_anisotropy: Scalar = 0.0
    normal: Computed | None = None
    ior: Scalar = 1.4
    roughness: Scalar = 1.0
    model: SubsurfaceModel = "random_walk"


@dataclass(frozen=True, slots=True, eq=False)
class Principled(Numbers):
    """Blender's Principled BSDF with the inputs that are supported; the names are those of its sockets.

    ``coat_normal``: None where the coat has the normal of what lies below it.
    """

    base_color: Paint = field(default_factory=lambda: gray(0.8))
    metallic: Scalar = 0.0
    roughness: Scalar = 0.5
    ior: float | Spectrum | Computed = 1.5
    alpha: Scalar = 1.0
    specular_level: Scalar = 0.5
    specular_tint: Paint = field(default_factory=lambda: gray(1.0))
    anisotropic: Scalar = 0.0
    anisotropic_rotation: Scalar = 0.0
    tangent: Computed | None = None
    transmission: Scalar = 0.0
    coat_weight: Scalar = 0.0
    coat_roughness: Scalar = 0.03
    coat_ior: float = 1.5
    coat_tint: Paint = field(default_factory=lambda: gray(1.0))
    coat_normal: Computed | None = None
    diffuse_roughness: Scalar = 0.0
    multiple_scattering: bool = True
    sheen_weight: Scalar = 0.0
    sheen_roughness: Scalar = 0.5
    sheen_tint: Paint = field(default_factory=lambda: gray(1.0))
    subsurface_weight: Scalar = 0.0
    subsurface_radius: tuple[float, float, float] | Computed = (1.0, 0.2, 0.1)
    subsurface_scale: Scalar = 0.05
    subsurface_anisotropy: Scalar = 0.0
    subsurface_ior: Scalar = 1.4
    subsurface_model: SubsurfaceModel = "random_walk"
    normal: Computed | None = None
    emission_color: Paint = field(default_factory=lambda: Color((1.0, 1.0, 1.0)))  # type: ignore[arg-type]
    emission_strength: Scalar = 0.0
    thin_film_thickness: Scalar = 0.0
    thin_film_ior: Scalar = 1.33


@dataclass(frozen=True, slots=True, eq=False)
class MixSurface(Numbers):
    """``first`` with probability 1 - factor, ``second`` with probability factor."""

    factor: Scalar
    first: Surface
    second: Surface


@dataclass(frozen=True, slots=True, eq=False)
class AddSurface:
    """Both surfaces at once: their scattered and emitted light is added."""

    first: Surface
    second: Surface

    def __post_init__(self) -> None:
        require_declared(self)


@dataclass(frozen=True, slots=True, eq=False)
class SumSurface:
    """Any number of surfaces at once, each with its weight, which may be above 1; for trees of mixes and sums that read
    a shader more than once, or that are deep.
    """

    parts: tuple[tuple[Weight, Surface], ...]


Closure = (
    Diffuse
    | Glossy
    | Glass
    | Translucent
    | Toon
    | Metal
    | Transparent
    | RayPortal
    | Holdout
    | Sheen
    | Emission
    | Principled
    | Subsurface
    | Fluorescent
    | EllipseHair
    | Hair
    | HairLobe
)
Surface = Closure | MixSurface | AddSurface | SumSurface


@dataclass(frozen=True, slots=True, eq=False)
class ScatteringMedium(Numbers):
    """Participating medium inside a closed mesh, per scene unit of length; homogeneous without a ``grid``.

    ``density · extinction``: extinction 1/length, per wavelength where ``extinction`` is a color or spectrum;
    ``color``: single-scattering albedo; ``anisotropy``: Henyey-Greenstein g; ``emission_color · emission_strength``:
    radiance emitted per unit length. ``lobes``: in place of ``anisotropy``, weight, g and α of phase functions by
    Draine that add up (α 0 is Henyey and Greenstein's). ``grid``: how the medium varies; its values are at most 1, so
    that the other fields bound it.
    """

    density: float = 1.0
    color: Paint = field(default_factory=lambda: gray(0.5))
    extinction: Paint | None = None
    anisotropy: float = 0.0
    emission_color: Paint = field(default_factory=lambda: gray(1.0))
    emission_strength: float = 0.0
    lobes: tuple[tuple[float, float, float], ...] = ()
    grid: MediumGrid | None = None

    def __post_init__(self) -> None:
        Numbers.__post_init__(self)  # slots create another class, which super() would not know
        if self.grid is not None and any(values.max() > 1 for values in self.grid.given):
            raise InvalidInputError("ScatteringMedium has a grid with values above 1; put their scale into its density")
        require_range("ScatteringMedium density", self.density, 0.0, LARGEST)
        require_range("ScatteringMedium anisotropy", self.anisotropy, -1.0, 1.0)
        require_range("ScatteringMedium emission strength", self.emission_strength, 0.0, LARGEST)
        if not all(isinstance(lobe, tuple | list) and len(lobe) == 3 for lobe in self.lobes):
            raise InvalidInputError(f"lobes are {self.lobes}; expected three numbers of each: weight, g and α")
        for weight, g, alpha in self.lobes:
            require_range("weight of a phase function", weight, 0.0, 1e6)
            require_range("g of a phase function", g, -1.0, 1.0)
            require_range("α of a phase function", alpha, 0.0, 1e6)
