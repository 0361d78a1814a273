# SPDX-License-Identifier: GPL-3.0-or-later
"""A thin film (about a wavelength) on glass or metal: its reflectance, by Airy's formula, over Dr.Jit arrays.

Light that goes through the film m times more is later by m optical paths L = 2 n d cos θ. The amplitudes of all m add
up, for each polarization, to R = 1 - (1 - ρ²)(1 - a²) / (1 + x² + 2 x cos ψ) with ρ reflected by the film's upper face,
a e^{iφ} by its lower, x = ρ a and ψ = 2π L / λ + φ (Born and Wolf 1999, "Principles of Optics", section 7.6). Spectral
transport does just this for each wavelength.

RGB transport gives the colors of Cycles: the Fourier series of that reflectance in ψ up to the third order, whose
cosines are averages over the color matching functions under a light of equal energy (Belcour and Barla 2017, "A
practical extension to microfacet theory for the modeling of varying iridescence"), read from ``response``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.closures.facets.microfacet import f82
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.metal import MOST_FACING
from spectral_core.spectra.observer import STANDARD, observer

ORDERS = 3
"""Orders of the series in RGB transport."""
STEP_NM, STEPS = 5.0, 1920
"""Optical paths of the table. Past the last, no color is left in channels so wide."""
THINNEST_NM = 1.0
"""Thickness from which on a film counts in full in RGB transport, where the series does not end at no film."""


@cache
def response() -> NDArray[np.float64]:
    """(STEPS + 1, 6): means of e^{2πi L / λ} under the sensitivities of red, green and blue: real parts, imaginary."""
    viewer = observer(STANDARD)
    channels = RGB_FROM_XYZ @ viewer.cmfs
    channels /= channels.sum(axis=1, keepdims=True)
    waves = np.exp(2j * np.pi * np.arange(STEPS + 1)[:, None] * STEP_NM / viewer.wavelengths_nm)
    means = waves @ channels.T
    means[-1] = 0.0
    return np.concatenate([means.real, means.imag], axis=1)


class Film:
    """The film of a closure. ``inputs``: its ``thin_film_thickness`` in nm and ``thin_film_ior``, textures, and the
    table ``thin_film_response`` in RGB transport.
    """

    def __init__(self, inputs: Any) -> None:
        self.thickness, self.ior = inputs["thin_film_thickness"], inputs["thin_film_ior"]
        self.response = inputs.get("thin_film_response", None)

    def at(self, mi: Any, dr: Any, si: Any, active: Any) -> FilmAt:
        """The film at a hit."""
        thickness = dr.maximum(self.thickness.eval_1(si, active), 0.0)
        return FilmAt(mi, dr, thickness, dr.maximum(self.ior.eval_1(si, active), 1e-3), si.wavelengths, self.response)


def film_of(inputs: Any) -> Film | None:
    """The film that inputs of a closure describe, None without one."""
    return Film(inputs) if "thin_film_thickness" in inputs else None


def facing_of(inputs: Any) -> list[Any]:
    """Tables of the mean cosines to parts of the facets."""
    return [inputs[name] for name in sorted(inputs) if name.startswith("film_facing_")]


@dataclass
class FilmAt:
    """A film at some points: ``thickness`` in nm, index of refraction ``ior``."""

    mi: Any
    dr: Any
    thickness: Any
    ior: Any
    wavelengths: Any
    response: Any

    def on_dielectric(self, cosine: Any, outside: Any, inside: Any) -> Any:
        """Reflectance, for light that comes from ``outside`` (index of refraction) at a ``cosine`` to the normal."""
        dr = self.dr
        film, thickness = self._blended(outside), self.thickness
        if not self.mi.is_spectral:  # as Cycles has it: from within, the film is thinner by the index of refraction
            thickness = thickness / dr.maximum(outside, 1e-3)
        sine = dr.square(outside) * (1.0 - dr.square(cosine))
        above, below = outside * dr.abs(cosine), dr.safe_sqrt(dr.square(inside) - sine)
        within = dr.safe_sqrt(dr.square(film) - sine)
        path, one = 2.0 * thickness * within, self.mi.Float(1.0)
        found = self.mi.Spectrum(0.0)
        for first, second in (
            (_face(above, within), _face(within, below)),
            (_face(dr.square(film) * above, dr.square(outside) * within),
             _face(dr.square(inside) * within, dr.square(film) * below)),
        ):  # fmt: skip
            found += 0.5 * self._reflected(first, dr.abs(second), (dr.copysign(one, second), 0.0 * one), path)
        # past the angle of total reflection at either face nothing passes; that a film may be too thin for that is left
        # out, as in Cycles: it takes one with a smaller index than air
        total = (sine >= dr.square(inside)) | (sine >= dr.square(film))
        return dr.select(total, 1.0, dr.clip(found, 0.0, 1.0))

    def on_metal(self, cosine: Any, metal: Any, edge: Any = None) -> Any:
        """Reflectance of a metal (index of refraction, extinction) under the film.

        ``edge``: reflectance of a metal of the F82 model at a cosine of 1 / 7; its lower face follows that model.
        """
        mi, dr = self.mi, self.dr
        film = self._blended(mi.Float(1.0))
        sine = 1.0 - dr.square(cosine)
        above, within = dr.abs(cosine), dr.safe_sqrt(dr.square(film) - sine)
        path = 2.0 * self.thickness * within
        faces = (_face(above, within), _face(dr.square(film) * above, within))
        found = mi.Spectrum(0.0)
        for first, (real, imaginary) in zip(faces, metal_faces(dr, within, film, metal, sine), strict=True):
            size = dr.maximum(dr.sqrt(dr.square(real) + dr.square(imaginary)), 1e-9)
            phase = real / size, imaginary / size
            if edge is not None:
                size = dr.sqrt(_f82_within(dr, within / film, film, metal, edge))
            found += 0.5 * self._reflected(first, dr.minimum(size, 1.0), phase, path)
        return dr.select(sine >= dr.square(film), 1.0, dr.clip(found, 0.0, 1.0))

    def _blended(self, outside: Any) -> Any:
        """Index of refraction of the film; that of the medium above where the film is too thin to matter."""
        dr = self.dr
        if self.mi.is_spectral:
            return self.ior
        share = dr.clip(self.thickness / THINNEST_NM, 0.0, 1.0)
        return dr.lerp(outside, self.ior, share * share * (3.0 - 2.0 * share))

    def _reflected(self, first: Any, second: Any, phase: tuple[Any, Any], path: Any) -> Any:
        """Common reflectance of both faces for one polarization: ρ, a, e^{iφ} and the optical path in nm."""
        mi, dr = self.mi, self.dr
        product = first * second
        passed = (1.0 - dr.square(first)) * (1.0 - dr.square(second))
        if mi.is_spectral:
            sine, cosine = dr.sincos(2.0 * dr.pi * path / self.wavelengths)
            wave = phase[0] * cosine - phase[1] * sine
            return 1.0 - passed / dr.maximum(1.0 + dr.square(product) + 2.0 * product * wave, 1e-9)
        series, power, (real, imaginary) = mi.Spectrum(1.0), mi.Spectrum(1.0), (mi.Spectrum(1.0), mi.Spectrum(0.0))
        for order in range(1, ORDERS + 1):
            power *= -product
            real, imaginary = real * phase[0] - imaginary * phase[1], real * phase[1] + imaginary * phase[0]
            mean, turned = self._means(order * path)
            series += 2.0 * power * (real * mean - imaginary * turned)
        return 1.0 - passed / dr.maximum(1.0 - dr.square(product), 1e-6) * series

    def _means(self, path: Any) -> tuple[Any, Any]:
        """Real and imaginary part of the colors' response to an optical path in nm."""
        mi, dr = self.mi, self.dr
        place = dr.clip(path / STEP_NM, 0.0, STEPS - 1e-3)
        row = mi.UInt32(place)
        share = place - mi.Float(row)
        at = [dr.lerp(self.response.entry(6 * row + k), self.response.entry(6 * row + 6 + k), share) for k in range(6)]
        return mi.Color3f(*at[:3]), mi.Color3f(*at[3:])


def _face(before: Any, behind: Any) -> Any:
    """Amplitude that a face reflects, from the waves' numbers along the normal on either side."""
    return (before - behind) / (before + behind)


def metal_faces(dr: Any, within: Any, film: Any, metal: tuple[Any, Any], sine: Any) -> Any:
    """Amplitudes (real, imaginary) that a metal reflects of both polarizations, across and along.

    ``within``: cosine times index of refraction ``film`` of the medium above; ``sine``: square of index times sine.
    """
    n, k = metal
    real, imaginary = dr.square(n) - dr.square(k), 2.0 * n * k
    rest = real - sine
    size = dr.sqrt(dr.square(rest) + dr.square(imaginary))
    u, v = dr.safe_sqrt(0.5 * (size + rest)), dr.safe_sqrt(0.5 * (size - rest))
    squared = dr.square(film)
    return (
        _quotient(dr, (within - u, -v), (within + u, v)),
        _quotient(
            dr,
            (real * within - squared * u, imaginary * within - squared * v),
            (real * within + squared * u, imaginary * within + squared * v),
        ),
    )


def metal_of(dr: Any, facing: Any, edge: Any) -> tuple[Any, Any]:
    """Index of refraction and extinction of a metal by its color ``facing`` and the tint of its ``edge`` (Gulbrandsen
    2014, "Artist friendly metallic Fresnel").
    """
    r = dr.clip(facing, 0.0, MOST_FACING)
    root = dr.sqrt(r)
    n = dr.lerp((1.0 + root) / (1.0 - root), (1.0 - r) / (1.0 + r), dr.clip(edge, 0.0, 2.0))
    return n, dr.safe_sqrt((r * dr.square(n + 1.0) - dr.square(n - 1.0)) / (1.0 - r))


def metal_reflectance(
    mi: Any, dr: Any, colors: tuple[Any, Any], facing: Any, film: FilmAt | None, *, physical: bool = False
) -> tuple[Any, Any]:
    """Reflectance of a metal at a cosine to its facets, and its hemispherical mean without the film.

    ``colors``: facing and edge, of the F82 model or, where ``physical``, of Gulbrandsen's.
    """
    if not physical:
        reflected, mean = f82(dr, *colors, facing)
        if film is None:
            return reflected, mean
        edge = f82(dr, *colors, 1.0 / 7.0)[0]
        return film.on_metal(facing, metal_of(dr, colors[0], edge), edge), mean
    metal = metal_of(dr, *colors)
    straight, edge = bare_metal(mi, dr, mi.Float(1.0), metal), bare_metal(mi, dr, mi.Float(1.0 / 7.0), metal)
    mean = straight + (1.0 - straight) / 21.0 - _bend(straight, edge) / 126.0
    reflected = bare_metal(mi, dr, facing, metal) if film is None else film.on_metal(facing, metal)
    return reflected, dr.clip(mean, 0.0, 1.0)


def bare_metal(mi: Any, dr: Any, cosine: Any, metal: tuple[Any, Any]) -> Any:
    """Reflectance of a metal (index of refraction, extinction) in air."""
    above = dr.clip(cosine, 1e-4, 1.0)
    across, along = metal_faces(dr, above, mi.Float(1.0), metal, 1.0 - dr.square(above))
    squares = (dr.square(real) + dr.square(imaginary) for real, imaginary in (across, along))
    return dr.clip(0.5 * sum(squares), 0.0, 1.0)


def _quotient(dr: Any, above: tuple[Any, Any], below: tuple[Any, Any]) -> tuple[Any, Any]:
    size = dr.rcp(dr.maximum(dr.square(below[0]) + dr.square(below[1]), 1e-12))
    real = above[0] * below[0] + above[1] * below[1]
    return real * size, (above[1] * below[0] - above[0] * below[1]) * size


def _f82_within(dr: Any, cosine: Any, film: Any, metal: tuple[Any, Any], edge: Any) -> Any:
    """Reflectance of a metal of the F82 model at its border with the film instead of air."""
    n, k = metal[0] / film, dr.square(metal[1] / film)
    facing = (dr.square(n - 1.0) + k) / (dr.square(n + 1.0) + k)
    bend = _bend(facing, edge)
    grazing = dr.clip(1.0 - cosine, 0.0, 1.0)
    return dr.clip(facing + (1.0 - facing) * grazing**5 - bend * cosine * grazing**6, 0.0, 1.0)


def _bend(facing: Any, edge: Any) -> Any:
    """Difference of the F82 model from Schlick's, by the reflectance at normal incidence and at a cosine of 1 / 7."""
    sixth = 6.0 / 7.0
    return (facing + (1.0 - facing) * sixth**5 - edge) * (7.0 / sixth**6)
