# SPDX-License-Identifier: GPL-3.0-or-later
"""How surfaces scatter and emit: closures as frozen data, named and parameterized as Blender's shader nodes are."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from spectral_core.checks import require_range
from spectral_core.scene.paint import Color, MixedPaint, Paint, Scalar, gray
from spectral_core.scene.shading.program import Computed, Program
from spectral_core.spectra.spectrum import Spectrum

LARGEST = 1e38
"""Beyond it nothing is left of a number in 32 bits."""
IOR = (1e-3, 1000.0)
"""Indices of refraction that a dielectric can have."""


class _Numbers:
    """Closures and media: plain numbers in them are finite."""

    __slots__ = ()

    def __post_init__(self) -> None:
        """Raise InvalidInputError that names the first number that is NaN, infinite, or no index of refraction."""
        names: tuple[str, ...] = type(self).__slots__
        for name in names:
            value = getattr(self, name)
            if isinstance(value, (int, float, np.number)):
                least, most = IOR if name in ("ior", "coat_ior") else (-LARGEST, LARGEST)
                require_range(f"{type(self).__name__} {name.replace('_', ' ')}", float(value), least, most)


@dataclass(frozen=True, slots=True, eq=False)
class Diffuse(_Numbers):
    """Lambertian; Oren-Nayar where ``roughness`` is over 0."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.0
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Glossy(_Numbers):
    """Microfacet mirror (GGX, ``alpha = roughness²``) that reflects ``color`` at every angle.

    ``multiple_scattering``: whether light that bounces between facets is kept (Blender's Multiscatter GGX) or lost.
    """

    color: Paint = field(default_factory=lambda: gray(0.8))
    roughness: Scalar = 0.5
    multiple_scattering: bool = True
    anisotropy: Scalar = 0.0
    rotation: Scalar = 0.0
    tangent: Computed | None = None
    distribution: Literal["ggx", "beckmann"] = "ggx"
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Glass(_Numbers):
    """Dielectric that reflects and refracts by Fresnel; ``ior`` a number, or a spectrum where it disperses."""

    color: Paint = field(default_factory=lambda: gray(1.0))
    roughness: Scalar = 0.0
    ior: float | Spectrum = 1.5
    normal: Computed | None = None
    reflects: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Translucent:
    """Lambertian transmission: light leaves on the other side."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Toon(_Numbers):
    """A lobe with a hard or soft edge around the normal or, ``glossy``, around the mirrored direction."""

    color: Paint = field(default_factory=lambda: gray(0.8))
    size: Scalar = 0.5
    smooth: Scalar = 0.0
    glossy: bool = False
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Metal(_Numbers):
    """Microfacet conductor: ``color`` facing, ``edge_tint`` at 82 degrees (Kutz, Hasan and Edmondson 2021)."""

    color: Paint = field(default_factory=lambda: gray(0.6))
    edge_tint: Paint = field(default_factory=lambda: gray(0.7))
    roughness: Scalar = 0.5
    anisotropy: Scalar = 0.0
    rotation: Scalar = 0.0
    tangent: Computed | None = None
    multiple_scattering: bool = True
    normal: Computed | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Transparent:
    """Lets light through unbent, times ``color``."""

    color: Paint = field(default_factory=lambda: gray(1.0))


@dataclass(frozen=True, slots=True, eq=False)
class Emission(_Numbers):
    """Emits ``color · strength`` as radiance: (1, 1, 1) · 1 is a white pixel of value 1 seen directly."""

    color: Paint = field(default_factory=lambda: gray(1.0))
    strength: Scalar = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Principled(_Numbers):
    """Blender's Principled BSDF, the part of it that is understood; the names are those of its sockets."""

    base_color: Paint = field(default_factory=lambda: gray(0.8))
    metallic: Scalar = 0.0
    roughness: Scalar = 0.5
    ior: float | Spectrum = 1.5
    alpha: Scalar = 1.0
    specular_level: float = 0.5
    specular_tint: Paint = field(default_factory=lambda: gray(1.0))
    anisotropic: Scalar = 0.0
    anisotropic_rotation: Scalar = 0.0
    tangent: Computed | None = None
    transmission: Scalar = 0.0
    coat_weight: Scalar = 0.0
    coat_roughness: Scalar = 0.03
    coat_ior: float = 1.5
    coat_tint: Paint = field(default_factory=lambda: gray(1.0))
    diffuse_roughness: Scalar = 0.0
    multiple_scattering: bool = True
    sheen_weight: Scalar = 0.0
    normal: Computed | None = None
    emission_color: Paint = field(default_factory=lambda: Color((1.0, 1.0, 1.0)))  # type: ignore[arg-type]
    emission_strength: Scalar = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MixSurface(_Numbers):
    """``first`` with probability 1 - factor, ``second`` with probability factor."""

    factor: Scalar
    first: Surface
    second: Surface


@dataclass(frozen=True, slots=True, eq=False)
class AddSurface:
    """Both at once: the sum of what they scatter and emit."""

    first: Surface
    second: Surface


Closure = Diffuse | Glossy | Glass | Translucent | Toon | Metal | Transparent | Emission | Principled
Surface = Closure | MixSurface | AddSurface


@dataclass(frozen=True, slots=True)
class Weight:
    """A product of factors and of complements of factors: ``Π value`` or ``Π (1 - value)``."""

    factors: tuple[tuple[Scalar, bool], ...] = ()

    def times(self, value: Scalar, *, complement: bool = False) -> Weight:
        """This weight times ``value`` or ``1 - value``."""
        return Weight((*self.factors, (value, complement)))

    @property
    def constant(self) -> float:
        """Product of the factors that are plain numbers, each held within [0, 1]."""
        product = 1.0
        for value, complement in self.factors:
            if isinstance(value, (int, float)):
                held = min(max(float(value), 0.0), 1.0)
                product *= 1 - held if complement else held
        return product

    @property
    def varying(self) -> tuple[tuple[Scalar, bool], ...]:
        """The factors that are not plain numbers."""
        return tuple(item for item in self.factors if not isinstance(item[0], (int, float)))


def weighted_leaves(surface: Surface | None, weight: Weight = Weight()) -> Iterator[tuple[Weight, Closure]]:
    """The closures that a surface is mixed and added from, with their weights; those of weight 0 are left out."""
    stack: list[tuple[Weight, Surface | None]] = [(weight, surface)]
    while stack:  # no recursion: a tree may be thousands of mixes deep
        amount, item = stack.pop()
        if item is None or amount.constant == 0:
            continue
        if isinstance(item, MixSurface):
            stack.append((amount.times(item.factor), item.second))
            stack.append((amount.times(item.factor, complement=True), item.first))
        elif isinstance(item, AddSurface):
            stack += [(amount, item.second), (amount, item.first)]
        else:
            yield amount, item


def leaves(surface: Surface | None) -> Iterator[Closure]:
    """Every closure that a surface is mixed and added from, whatever its weight."""
    stack = [surface]
    while stack:
        item = stack.pop()
        if isinstance(item, (MixSurface, AddSurface)):
            stack += [item.second, item.first]
        elif item is not None:
            yield item


def map_leaves(surface: Surface, change: Callable[[Closure], Surface]) -> Surface:
    """The surface with every closure changed; the same object where nothing changes."""
    if isinstance(surface, (MixSurface, AddSurface)):
        first, second = map_leaves(surface.first, change), map_leaves(surface.second, change)
        same = first is surface.first and second is surface.second
        return surface if same else replace(surface, first=first, second=second)
    return change(surface)


def values_of(surface: Surface | None) -> Iterator[Any]:
    """Every color, number and normal in a surface, factors of mixes included."""
    stack: list[Surface | None] = [surface]
    while stack:
        item = stack.pop()
        if isinstance(item, (MixSurface, AddSurface)):
            stack += [item.second, item.first]
            if isinstance(item, MixSurface):
                yield item.factor
        elif item is not None:
            yield from (getattr(item, name) for name in type(item).__slots__)


def programs_of(surface: Surface | None) -> Iterator[Program]:
    """Every program in a surface."""
    stack = list(values_of(surface))
    while stack:
        value = stack.pop()
        if isinstance(value, Computed):
            yield value.program
        elif isinstance(value, MixedPaint):
            stack += [value.factor, value.first, value.second]


@dataclass(frozen=True, slots=True, eq=False)
class ScatteringMedium(_Numbers):
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

    def __post_init__(self) -> None:
        _Numbers.__post_init__(self)  # slots make another class of this one, which super() would not know
        require_range("ScatteringMedium density", self.density, 0.0, LARGEST)
        require_range("ScatteringMedium anisotropy", self.anisotropy, -1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A named surface and, where light also travels inside, the medium in it. No surface: only the medium shows."""

    name: str
    surface: Surface | None = field(default_factory=Diffuse)
    medium: ScatteringMedium | None = None
