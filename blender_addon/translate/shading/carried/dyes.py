# SPDX-License-Identifier: GPL-3.0-or-later
"""The fluorescent dyes of a material, in the closures whose color its spectrum replaces."""

from __future__ import annotations

from typing import Any

from spectral_core.errors import InvalidInputError
from spectral_core.scene import (
    AddSurface,
    Color,
    Diffuse,
    Fluorescent,
    MixSurface,
    Principled,
    Scalar,
    Surface,
    gray,
    leaves,
    map_leaves,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

from ...context import Translation
from ..surfaces import BLACK
from .layers import below_layers

Dyes = tuple[FluorescentDye, ...]
LEAST_KNOWN = 0.5
"""Share of a dye's excitation at the wavelengths of its material's spectrum, below which a note names the dye."""
LEAST_AMOUNT = 1e-4
"""Amounts of a dye below it are omitted: a design contains a little of every dye that it may use."""


def dyes_of(owner: Any) -> tuple[Dyes, tuple[float, ...]]:
    """Dyes of a material, and their amounts, at the wavelengths of its spectrum.

    Raises InvalidInputError for a dye that emits at its excitation wavelengths.
    """
    spectral = getattr(owner, "spectral", None)
    used = [] if spectral is None else [dye for dye in spectral.dyes if dye.amount > LEAST_AMOUNT]
    dyes = []
    for dye in used:
        name = f"dye {dye.excitation_nm:.0f} to {dye.emission_nm:.0f} nm"
        bells = FluorescentDye.gaussian(name, dye.excitation_nm, dye.emission_nm)
        dyes.append(bells)
    return tuple(dyes), tuple(float(dye.amount) for dye in used)


def with_dyes(translation: Translation, surface: Surface, material: Any, spectrum: Spectrum | None) -> Surface:
    """The surface with the dyes of its material in its diffuse closures (Diffuse, and the base of Principled).

    Dyes that would return more light than arrives are reduced, and a note states the factor.
    """
    try:
        dyes, amounts = dyes_of(material)
    except InvalidInputError as error:
        translation.note(material.name, f"{error}; it is shown without its dyes")
        return surface
    if not dyes:
        return surface
    if spectrum is not None:  # a designed dye is defined at the wavelengths of the design
        dyes, amounts = _on_grid(translation, material.name, spectrum.grid, dyes, amounts)
    main = [leaf for leaf in leaves(surface) if isinstance(leaf, (Diffuse, Principled)) and leaf is not BLACK]
    if not main:
        translation.note(material.name, "has fluorescent dyes, but no Diffuse or Principled shader that can use them")
        return surface

    def change(leaf: Closure) -> Surface:
        if leaf is BLACK:
            return leaf
        if isinstance(leaf, Diffuse):
            if leaf.roughness != 0:
                translation.note(material.name, "with dyes it scatters evenly; the roughness of its Diffuse is ignored")
            return _fitting(translation, material.name, leaf.color, dyes, amounts, leaf.normal)
        return _on_principled(translation, material.name, leaf, dyes, amounts) if isinstance(leaf, Principled) else leaf

    return map_leaves(surface, change)


def _on_grid(
    translation: Translation, name: str, grid: SpectralGrid, dyes: Dyes, amounts: tuple[float, ...]
) -> tuple[Dyes, tuple[float, ...]]:
    """Dyes that are excited at the wavelengths of a material's spectrum alone, and their amounts.

    A note names each dye that absorbs most light at other wavelengths, also if nothing of it is left.
    """
    kept = []
    for dye, amount in zip(dyes, amounts, strict=True):
        taken, whole = dye.excitation_on(grid), dye.excitation.grid
        if taken @ grid.cell_widths_nm < LEAST_KNOWN * (dye.excitation.values @ whole.cell_widths_nm):
            ends = f"{grid.wavelengths_nm[0]:g} to {grid.wavelengths_nm[-1]:g} nm"
            text = f"{dye.name} absorbs light mainly outside of the wavelengths of its spectrum, {ends}"
            translation.note(name, f"{text}: there it is not excited; use a spectrum with these wavelengths")
        try:
            kept.append((FluorescentDye(dye.name, Spectrum("excitation", grid, taken), dye.emission), amount))
        except InvalidInputError:  # no excitation is left, or none below the emission
            continue
    return tuple(dye for dye, _ in kept), tuple(amount for _, amount in kept)


def _fitting(
    translation: Translation, name: str, color: Any, dyes: Any, amounts: tuple[float, ...], normal: Any
) -> Fluorescent:
    """The closure, with a smaller amount of its dyes if they return more than arrives."""
    if not isinstance(color, (Color, Spectrum)):
        text = "its texture and its dyes together are not checked for returning more light than arrives"
        translation.note(name, text)
    share = Fluorescent.largest_share(color, dyes, amounts)
    if share < 1:
        text = f"its color and dyes return more light than arrives; its dyes are reduced to {100 * share:.0f} %"
        translation.note(name, text)
    return Fluorescent(color, dyes, tuple(amount * min(share, 1.0) for amount in amounts), normal)


def _on_principled(
    translation: Translation, name: str, leaf: Principled, dyes: Any, amounts: tuple[float, ...]
) -> Surface:
    """Principled, mixed with the emission of dyes in its base: where it is neither metal nor glass nor transparent.

    Light that the layers above reflect or absorb does not reach the dyes (``layers``).
    """
    within = _fitting(translation, name, leaf.base_color, dyes, amounts, None)
    below, factors = below_layers(leaf, within.dyes)
    scaled = tuple(amount * factor for amount, factor in zip(within.amounts, factors, strict=True))
    emission: Surface = Fluorescent(gray(0.0), below, scaled)
    covers: tuple[tuple[Scalar, bool], ...] = ((leaf.metallic, True), (leaf.transmission, True), (leaf.alpha, False))
    for share, hides in covers:
        if share == (0.0 if hides else 1.0):
            continue
        emission = MixSurface(share, emission, BLACK) if hides else MixSurface(share, BLACK, emission)
    return AddSurface(leaf, emission)
