# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of closures that depend on an index of refraction: numbers and tables of albedos, so that another index needs
no new kernel.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.closures.facets import albedo
from spectral_core.render.plugins.closures.facets.film import response
from spectral_core.render.plugins.paints import spectrum_rows
from spectral_core.render.plugins.surfaces.sources import Albedos, Number, Sampled, Source, Textured
from spectral_core.scene import Computed, Glass, Metal, Principled, Scalar, nominal_ior
from spectral_core.scene.fluorescent import EXCITED_NM
from spectral_core.spectra.spectrum import LAST_NM, SpectralGrid, Spectrum

PARTS_OF_LAYER, PARTS_OF_GLASS = 2, 6
"""Parts of the facets at whose mean cosines the reflectance of a film is taken: of layers, and of glass."""

PLACES = 64
"""Even steps of ``albedo.place_of_index`` among which are the tables of dispersive glass."""
VISIBLE_NM = (400.0, 700.0)
"""Wavelengths in nm between whose indices of refraction these tables are."""

Array = NDArray[np.float64]


def _kept(name: str, table: Array) -> dict[str, Any]:
    """A table of the energy of one bounce, and of its mean over the hemisphere."""
    return {name: Albedos(table), f"{name}_mean" if name != "single" else "mean": Albedos(_mean(table))}


def _mean(table: Array) -> Array:
    """A table's mean over the hemisphere, at every cosine."""
    return np.repeat(albedo.average(table)[:, None], albedo.SIZE, axis=1)


def facet_inputs() -> dict[str, Any]:
    """Energy that the facets of a perfect mirror reflect in one bounce."""
    return _kept("single", albedo.conductor())


def specular_inputs(ior: float, keeps_energy: bool) -> dict[str, Any]:
    """Inputs of the dielectric layer over the diffuse part."""
    return {
        "ior": Number(ior),
        "ior_fresnel": Number(_average_fresnel(ior)),
        "facing_reflectance": Number(((ior - 1.0) / (ior + 1.0)) ** 2),
        # as in Cycles, the light below is that below the inverse of an index under 1, and not what total reflection
        # leaves
        "specular_albedo": Albedos(_layer_albedo(max(ior, 1 / ior), keeps_energy)),
    }


def varying_specular_inputs(
    context: Context, numbers: tuple[Scalar, Scalar], keeps_energy: bool, subject: str
) -> dict[str, Any]:
    """Inputs of that layer where the index of refraction or the specular level varies (``numbers``)."""
    names = ("ior", "specular_level")
    return {
        **{name: paint.number(context, value, subject) for name, value in zip(names, numbers, strict=True)},
        "specular_layers": Albedos(_layer_stack(keeps_energy)),
    }


@cache
def _layer_stack(keeps_energy: bool) -> Array:
    return np.stack([_layer_albedo(ior, keeps_energy) for ior in albedo.layer_iors()])


@cache
def _glass_stack(indices: tuple[float, ...]) -> tuple[Array, Array]:
    outside, inside = ([albedo.dielectric(ior**power)[1] for ior in indices] for power in (1, -1))
    return np.stack(outside), np.stack(inside)


def coat_inputs(ior: float) -> dict[str, Any]:
    """Inputs of the dielectric layer over everything else."""
    return {
        "coat_ior": Number(ior),
        "coat_fresnel": Number(_average_fresnel(ior)),
        "coat_albedo": Albedos(_layer_albedo(ior, True)),
    }


def glass_inputs(
    context: Context, ior: float | Spectrum | Computed, subject: str, *, keeps_energy: bool
) -> dict[str, Any]:
    """Inputs of a transmissive interface; RGB transport reads a spectrum of the index at the sodium line."""
    index: Any
    if isinstance(ior, Computed):
        index = paint.number(context, ior, subject)
        return {"ior": index, **_stacked(albedo.layer_iors())} if keeps_energy else {"ior": index}
    if isinstance(ior, Spectrum) and context.spectral:
        everywhere = _to_the_ends(ior)
        index = _dispersive(context, everywhere)
        return {"ior": index, **_around(everywhere)} if keeps_energy else {"ior": index}
    index = Number(nominal_ior(ior))
    if not keeps_energy:
        return {"ior": index}
    nominal = round(index.value, 6)
    outside, inside = albedo.dielectric(nominal)[1], albedo.dielectric(1 / nominal)[1]
    return {"ior": index, **_kept("outside", outside), **_kept("inside", inside)}


def _stacked(indices: list[float]) -> dict[str, Any]:
    """Energy of one bounce on glass seen from outside and from inside, by index of refraction."""
    inputs: dict[str, Any] = {"layers": len(indices)}
    for name, stack in zip(("outside", "inside"), _glass_stack(tuple(indices)), strict=True):
        means = np.stack([_mean(table) for table in stack])
        inputs |= {name: Albedos(stack), f"{name}_mean": Albedos(means)}
    return inputs


def _around(index: Spectrum) -> dict[str, Any]:
    """The same between two indices around those of visible light: one table for all wavelengths gave rough glass of
    strong dispersion 0.95 of its energy in blue light and 1.04 in red.

    The two are among ``PLACES``, so that another number of a glass mostly needs no new table.
    """
    visible = index.at(np.linspace(*VISIBLE_NM, 61))
    places = [min(albedo.place_of_index(float(each)), 1.0) * (PLACES - 1) for each in visible]
    first = min(int(min(places)), PLACES - 2)
    last = max(int(np.ceil(max(places))), first + 1)
    first_place, last_place = first / (PLACES - 1), last / (PLACES - 1)
    return {
        **_stacked([albedo.index_at(first_place), albedo.index_at(last_place)]),
        "first_place": Number(first_place),
        "per_place": Number(1 / (last_place - first_place)),
    }


def _dispersive(context: Context, index: Spectrum) -> Source:
    """An index of refraction by wavelength: a row of the table of spectra, whose knots may be uneven whole nm."""
    if spectrum_rows.fits(index):
        return Sampled(index, "color")
    return Textured(paint.sampled_spectrum(context, index), "color")


def _to_the_ends(index: Spectrum) -> Spectrum:
    """An index of refraction over all traced wavelengths, and those of ultraviolet light that excites dyes: outside of
    those that are given, that at the nearest one.
    """
    given = index.grid.wavelengths_nm
    ends = [nm for nm in (float(EXCITED_NM[0]), float(LAST_NM)) if not given[0] <= nm <= given[-1]]
    knots = np.union1d(given, ends)
    return Spectrum(index.name, SpectralGrid(knots), np.interp(knots, given, index.values))


def facing_inputs(*, passes: bool) -> dict[str, Any]:
    """Mean cosines to parts of the facets of a film, or of glass with a tint of its reflection."""
    parts = albedo.facing_parts(PARTS_OF_GLASS if passes else PARTS_OF_LAYER, lost=passes)
    return {f"film_facing_{number}": Albedos(part) for number, part in enumerate(parts)}


def film_inputs(
    context: Context, closure: Glass | Metal | Principled, subject: str, *, passes: bool = False
) -> dict[str, Any]:
    """The film on a surface; empty without one.

    For its albedo, the reflectance is taken at the mean cosines to parts of the facets: where light ``passes``, of
    those whose reflections are lost. Near the angle of total reflection a small share of the facets decides.
    """
    if closure.thin_film_thickness == 0:
        return {}
    inputs: dict[str, Any] = {
        **facing_inputs(passes=passes),
        "thin_film_thickness": paint.number(context, closure.thin_film_thickness, subject),
        "thin_film_ior": paint.number(context, closure.thin_film_ior, subject),
    }
    if not context.spectral:
        inputs["thin_film_response"] = Albedos(response())
    return inputs


@cache
def _layer_albedo(ior: float, keeps_energy: bool) -> Array:
    """Directional albedo of a rough dielectric's reflection, with the energy of later bounces between facets if
    kept.
    """
    reflected, _ = albedo.dielectric(round(ior, 6))
    single = albedo.conductor()
    if not keeps_energy:
        # Cycles layers by the mean Fresnel factor of the facets, as if no light were lost between them
        return reflected / single
    mean, average_fresnel = albedo.average(single)[:, None], _average_fresnel(ior)
    many = average_fresnel * mean / (1 - average_fresnel * (1 - mean))
    return np.asarray(reflected * (1 + many * (1 - single) / single))


@cache
def _average_fresnel(ior: float) -> float:
    """2 ∫ F(μ) μ dμ of a dielectric."""
    cosine = (np.arange(256) + 0.5) / 256
    return float((albedo.fresnel_dielectric(cosine, ior) * cosine).mean() * 2)
