# SPDX-License-Identifier: GPL-3.0-or-later
"""The transfer function of a Volume for the core, and back: in fractions of the data's range, per voxel."""

import numpy as np
from bpy.types import PropertyGroup, Volume

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid
from spectral_core.volume.documents.transfer_document import TransferDocument
from spectral_core.volume.fill_values import with_width
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix, spectrum_of_color
from spectral_core.volume.transfer import Material, TransferFunction

from ... import compat
from ...properties.volume import LEAST_STEEPNESS, RANGE_KEY
from ..context import finite, finite_numbers
from ..spectra.stored import require_editable, spectrum_of, store_spectrum
from .curves import add_material, clear, curve_points, require_held, set_curve

GRID = SpectralGrid.uniform(380.0, 780.0, 5.0)
"""Wavelengths of a transfer function with a spectrum in any of its materials."""


Curve = tuple[np.ndarray, np.ndarray]
"""Positions and heights."""


def stated_transfer(volume: Volume, rgb_from_working: np.ndarray | None = None) -> TransferDocument:
    """The transfer function of a Volume. Raises InvalidInputError without materials.

    ``rgb_from_working``: (3, 3) from Blender's scene-linear colors to linear sRGB, the file's own by default.
    """
    settings = volume.spectral
    if not len(settings.materials):
        raise InvalidInputError(f"volume {volume.name!r} has no material; add one, or choose a preset")
    if rgb_from_working is None:
        rgb_from_working = _rgb_from_working()
    spectra = [spectrum_of(material) for material in settings.materials]
    spectral = any(spectrum is not None for spectrum in spectra)
    materials = []
    for entry, spectrum in zip(settings.materials, spectra, strict=True):
        color = finite_numbers(entry, "color", f"of material {entry.name!r} of volume {volume.name!r}")
        color = color @ rgb_from_working.T
        if spectral:
            nm = GRID.wavelengths_nm
            color = spectrum_of_color(color, nm) if spectrum is None else spectrum.resampled(GRID).values
        materials.append(_stated(volume, entry, color))
    transfer = TransferFunction(tuple(materials), GRID.wavelengths_nm if spectral else None)
    return TransferDocument(transfer, "fraction", "voxel", volume.name)


def value_range(volume: Volume) -> tuple[float, float] | None:
    """The reference of fractions: the range of the imported data; None if unknown.

    Raises InvalidInputError for a property that a script has set to something else.
    """
    stored = volume.get(RANGE_KEY)
    if stored is None:
        return None
    try:
        low, high = map(float, stored)
    except (TypeError, ValueError):
        low = high = np.nan
    if not np.isfinite((low, high)).all():
        given = list(stored) if hasattr(stored, "__len__") and not isinstance(stored, str) else stored
        raise InvalidInputError(
            f"the property {RANGE_KEY} of volume {volume.name!r} is {given}; expected its least and greatest value. "
            "Delete the property, or import the file again"
        )
    return low, high


def curve_ends(volume: Volume) -> tuple[float, float] | None:
    """The data values at both ends of the curves; None if unknown. Raises as ``value_range``."""
    known = value_range(volume)
    return known and with_width(*known)


def _stated(volume: Volume, entry: PropertyGroup, color: np.ndarray) -> Material:
    whose = f"of material {entry.name!r} of volume {volume.name!r}"
    values, extinction = curve_points(volume, entry, "density")
    extinction, emission = extinction * finite(entry, "density", whose), None
    if (top := finite(entry, "emission", whose)) != 0:
        places, heights = curve_points(volume, entry, "emission")
        values, extinction, emission = _on_one_axis((values, extinction), (places, heights * top))
    gradient = {}
    if entry.use_gradient:
        places, weights = curve_points(volume, entry, "gradient")
        gradient = {"gradient_values": places * finite(entry, "gradient", whose), "gradient_weights": weights}
    return Material(
        entry.name,
        values,
        extinction,
        color,
        emission,
        entry.lit,
        **gradient,
    )


def _on_one_axis(first: Curve, second: Curve) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two piecewise linear curves, each with its own knots, on the knots of both; jumps stay jumps."""
    (x, y), (u, v) = first, second
    if np.array_equal(x, u):
        return x, y, v
    knots = np.unique(np.concatenate([x, u]))
    doubled = [knot for knot in knots if np.sum(x == knot) > 1 or np.sum(u == knot) > 1]
    knots = np.sort(np.concatenate([knots, doubled]))
    left = np.zeros(len(knots), bool)
    left[:-1] = knots[:-1] == knots[1:]  # the first of a pair is the value before the jump
    return knots, _values_at(knots, left, x, y), _values_at(knots, left, u, v)


def _values_at(knots: np.ndarray, left: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    from spectral_core.volume.transfer import interpolate

    after = interpolate(knots, x, y)
    mirrored = interpolate(-knots, -x[::-1], y[::-1])  # at a jump the later knot counts; mirrored, the earlier one
    return np.where(left, mirrored, after)


def store_transfer(volume: Volume, stated: TransferDocument) -> None:
    """Replace the materials of a Volume.

    Raises InvalidInputError if they are not in fractions and voxels, or have peaks too narrow for Blender's curves.
    """
    if (stated.values, stated.length) != ("fraction", "voxel"):
        raise InvalidInputError("a volume keeps fractions of its range, per voxel; fit the function to it first")
    require_editable(volume)
    transfer = stated.transfer
    for material in transfer.materials:
        for heights in (material.extinction, material.emission):
            if heights is not None:
                require_held(material.name, material.values, heights)
        if material.gradient_values is not None and material.gradient_weights is not None:
            require_held(material.name, material.gradient_values / _steepest(material), material.gradient_weights)
    colors = np.clip(display_matrix(transfer), 0.0, 1.0) @ np.linalg.inv(_rgb_from_working()).T
    clear(volume)
    for material, color in zip(transfer.materials, colors, strict=True):
        _store(volume, material, np.clip(color, 0.0, 1.0), transfer.wavelengths_nm)
    volume.spectral.active = 0
    volume.spectral.enabled = True


def _store(volume: Volume, material: Material, color: np.ndarray, wavelengths_nm: np.ndarray | None) -> None:
    entry = add_material(volume, material.name)
    entry.color, entry.lit = color, material.lit
    if wavelengths_nm is not None:
        store_spectrum(entry.spectral, Reflectance(material.name, SpectralGrid(wavelengths_nm), material.color))
    entry.density = _store_curve(volume, entry, "density", material.values, material.extinction)
    if material.emission is not None and np.any(material.emission):
        entry.emission = _store_curve(volume, entry, "emission", material.values, material.emission)
    if material.gradient_values is not None and material.gradient_weights is not None:
        steepest = _steepest(material)
        entry.use_gradient, entry.gradient = True, steepest
        set_curve(volume, entry, "gradient", material.gradient_values / steepest, material.gradient_weights)


def _steepest(material: Material) -> float:
    """Gradient at the end of the curve of gradients."""
    knots = material.gradient_values
    return LEAST_STEEPNESS if knots is None else max(float(knots.max()), LEAST_STEEPNESS)


def _store_curve(volume: Volume, entry: PropertyGroup, which: str, values: np.ndarray, heights: np.ndarray) -> float:
    """Store a curve scaled to a top of 1, and the value of the top."""
    top = float(heights.max())
    set_curve(volume, entry, which, values, heights / top if top > 0 else heights)
    return top


def _rgb_from_working() -> np.ndarray:
    import bpy

    return compat.rec709_from_working(compat.working_space(bpy.data))
