# SPDX-License-Identifier: GPL-3.0-or-later
"""Participating media as textures per unit of length."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.media.grid import grid_row, slots_of
from spectral_core.render.trace.media.table import MediumRow
from spectral_core.scene import Color, Paint, ScatteringMedium, gray
from spectral_core.scene.fluorescent import EXCITED_NM
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import upsampled

Array = NDArray[np.float64]


def medium_row(context: Context, medium: ScatteringMedium, subject: str, group: str = "") -> MediumRow | None:
    """Row of a medium for the path integrator; None if it is empty. ``group``: light group of its emission."""
    nm = _traced_nm(context, medium)
    values = partial(_values, context, nm=nm, subject=subject)
    extinction = medium.density * (1.0 if medium.extinction is None else values(medium.extinction))
    scattered = extinction * np.clip(values(medium.color), 0.0, 1.0)
    emission = medium.emission_strength * np.ones(1)
    if not (np.any(extinction > 0) or medium.emission_strength > 0):
        return None
    lobes = medium.lobes or ((1.0, medium.anisotropy, 0.0),)
    table = np.array(lobes, dtype=np.float64)
    table[:, 0] /= table[:, 0].sum()
    table[:, 1] = np.clip(table[:, 1], -0.99, 0.99)
    absorbed = np.maximum(extinction - scattered, 0.0)
    emission_color, grid = medium.emission_color, None
    if medium.grid is not None:
        colored = [slot is not None and slot.ndim == 4 for slot in slots_of(medium.grid)]
        # a grid of colors contains the color of a coefficient; the medium has its scale
        scattered = np.array(medium.density) if colored[0] else scattered
        absorbed = np.array(medium.density) if colored[1] else absorbed
        emission_color = gray(1.0) if colored[2] else emission_color
        tints = tuple(_texture(context, values(Color(one)), nm) for one in np.eye(3))
        largest, spectra = (float(np.max(scattered)), float(np.max(absorbed))), medium.grid.spectra
        own = None
        if spectra is not None:
            own = tuple(tuple(_texture(context, each.at(nm), nm) for each in of_slot) for of_slot in spectra)
        rgb = tints if any(colored) and own is None else None
        grid = grid_row(medium.grid, largest, rgb, own, emits=bool(emission[0] > 0))
    emitted = None
    if emission[0] > 0:
        emitted = paint.emission(context, emission_color, medium.emission_strength, subject)
        emitted = context.switched(emitted, group)
    return MediumRow(_texture(context, scattered, nm), _texture(context, absorbed, nm), emitted, table, grid, group)


def clear_row(context: Context) -> MediumRow:
    """Row of a medium that neither scatters nor absorbs light."""
    clear = _texture(context, np.zeros(1), WAVELENGTHS_NM)
    return MediumRow(clear, clear, None, np.array([[1.0, 0.0, 0.0]]))


def _values(context: Context, color: Paint, *, nm: Array, subject: str) -> Array:
    """A color as linear RGB (3,), or per wavelength of ``nm`` in spectral transport; it may exceed 1."""
    if isinstance(color, Spectrum):
        if context.spectral:
            return np.maximum(color.at(nm), 0.0)
        return np.maximum(paint.daylight_rgb(color), 0.0)
    if not isinstance(color, Color):
        context.note(subject, "has a volume whose color varies; it is rendered gray")
        color = Color(np.full(3, 0.5))
    rgb = np.maximum(color.linear_rgb, 0.0)
    if not context.spectral:
        return np.asarray(rgb)
    size = max(float(rgb.max()), 1.0)
    return np.asarray(upsampled(rgb / size, nm) * size)


def _texture(context: Context, values: Array, nm: Array) -> Any:
    values = np.atleast_1d(values)
    if not context.spectral:
        rgb = np.broadcast_to(values, (3,))
        return context.load({"type": "srgb", "color": [float(v) for v in rgb], "unbounded": True})
    full = np.broadcast_to(values, nm.shape)
    return paint.sampled_spectrum(context, Spectrum("medium", SpectralGrid(nm), np.array(full)))


def _traced_nm(context: Context, medium: ScatteringMedium) -> Array:
    """Wavelengths of the tables of a medium: the visible ones at each whole nm, the ultraviolet that excites the
    scene's dyes, and the knots of its spectra between whole nm.
    """
    whole = EXCITED_NM if context.has_dyes else WAVELENGTHS_NM
    given = [each.grid.wavelengths_nm for each in (medium.extinction, medium.color) if isinstance(each, Spectrum)]
    knots = np.concatenate([np.zeros(0), *given])
    return np.union1d(whole, knots[(knots > whole[0]) & (knots < whole[-1])])
