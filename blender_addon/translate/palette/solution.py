# SPDX-License-Identifier: GPL-3.0-or-later
"""From the core's solution of a palette to the properties that panels show."""

import numpy as np
from bpy.types import PropertyGroup
from numpy.typing import NDArray

from spectral_core.palette import PaletteSolution
from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.spectrum import Illuminant, Reflectance, Spectrum

from ...properties.palette.cell import NO_ERROR
from ..spectra.stored import store_spectrum
from .table import places

Array = NDArray[np.float64]


def store_solution(palette: PropertyGroup, solution: PaletteSolution, *, finished: bool = True) -> None:
    """Write spectra, colors, errors and status of a solution into the properties that panels show.

    ``finished``: True if conflicts were searched; if not, the shown ones stay while targets are missed.
    """
    for light, spectrum in zip(palette.lights, solution.illuminants, strict=True):
        store_designed(light.result, spectrum, Illuminant)
    for material, spectrum in zip(palette.materials, solution.reflectances, strict=True):
        store_designed(material.result, spectrum, Reflectance)
    for light, amounts in zip(palette.lights, solution.amounts, strict=True):
        for lamp, amount in zip(light.primaries, () if amounts is None else amounts, strict=False):
            lamp.amount = amount
    store_cells(palette, solution.actual_linear_rgb, solution.target_linear_rgb, solution.delta_e_2000)
    palette.status, palette.remedy, palette.is_alternative = str(solution.status), solution.remedy, False
    palette.notes = "\n".join(solution.notes)
    palette.worst_delta_e = solution.max_delta_e_2000
    palette.light_scale = solution.light_scale
    palette.milliseconds = 1e3 * solution.timings.get("total", 0.0)
    palette.is_unfinished = not finished
    if finished or palette.status == "solved":
        _store_conflicts(palette, solution)


def store_cells(palette: PropertyGroup, actual: Array, wanted: Array, errors: Array) -> None:
    """Write the results of all cells: linear sRGB (R, L, 3) twice, and ΔE2000 (R, L); NaN without a request."""
    for place, cell in places(palette):
        cell.actual_linear = actual[place]
        cell.wanted_linear = wanted[place] if np.isfinite(wanted[place]).all() else cell.actual_linear
        _show_colors(cell)
        cell.delta_e = errors[place] if np.isfinite(errors[place]) else NO_ERROR
        cell.has_result = True


def _show_colors(cell: PropertyGroup) -> None:
    """The display colors of a result."""
    cell.actual_display = display_rgb_from_linear(cell.actual_linear)
    cell.wanted_display = display_rgb_from_linear(cell.wanted_linear)


def show_stored_colors(palette: PropertyGroup) -> None:
    """Compute the display colors of results in a file of an earlier version, which stored only linear colors."""
    for _, cell in places(palette):
        if cell.has_result and not any(cell.actual_display) and not any(cell.wanted_display):
            _show_colors(cell)


def _store_conflicts(palette: PropertyGroup, solution: PaletteSolution) -> None:
    palette.conflicts.clear()
    for conflict in solution.conflicts:
        entry = palette.conflicts.add()
        row, column = conflict.cell
        entry.material_uid, entry.light_uid = palette.materials[row].uid, palette.lights[column].uid
        entry.text = conflict.text
        if conflict.relieved_by:
            row, column = conflict.relieved_by[0]
            entry.relief_material_uid, entry.relief_light_uid = palette.materials[row].uid, palette.lights[column].uid


def store_designed(result: PropertyGroup, spectrum: Spectrum, kind: type) -> None:
    """Spectra beyond physical limits ("Unphysical Spectra") are stored for the curves, and not as a spectrum."""
    store_spectrum(result, spectrum, physical=isinstance(spectrum, kind), is_absolute=True)
