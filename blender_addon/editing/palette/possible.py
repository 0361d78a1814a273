# SPDX-License-Identifier: GPL-3.0-or-later
"""Possible? The core's answer for the selected cell, kept for the panel, with a picture of the set."""

from __future__ import annotations

import numpy as np
from bpy.types import PropertyGroup, Scene
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.palette.possible import SECTION_LIMIT, PossibleColors, possible_colors, section_linear_rgb
from spectral_core.palette.reachable import CellReach, NearestColor
from spectral_core.spectra.color import display_rgb_from_linear, lab_from_linear_rgb, linear_from_display_rgb
from spectral_core.spectra.spectrum import Illuminant

from ...translate.palette.problem import palette_problem
from ...translate.spectra.stored import spectrum_of

SIZE = 96
VISIBLE = 1.0
"""ΔE2000 from which an eye sees a difference."""
_pictures: dict[int, NDArray[np.float32]] = {}
"""Picture of the last answer by scene. Not saved: a file that is opened asks anew."""


def ask(scene: Scene) -> PropertyGroup:
    """Answer for the selected cell, and keep the answer. Raises InvalidInputError where nothing can be said."""
    palette = scene.spectral.palette
    row, column = palette.active_row, palette.active_column
    problem = palette_problem(palette)
    lights, actual = solved_state(palette)
    colors = possible_colors(problem, (row, column), lights=lights, actual=actual)
    cell = palette.materials[row].cells[column]
    wanted = linear_from_display_rgb(cell.target if cell.mode == "FIXED" or not cell.has_result else cell.actual)
    found = colors.nearest(wanted)
    answer = palette.possible
    answer.material_uid, answer.light_uid = palette.materials[row].uid, palette.lights[column].uid
    answer.asked = np.clip(display_rgb_from_linear(wanted), 0, 1)
    answer.nearest = np.clip(display_rgb_from_linear(found.color), 0, 1)
    answer.nearest_linear = found.color
    answer.reachable = found.reachable
    answer.words = "\n".join(_words(palette, colors, found, wanted))
    _pictures[scene.session_uid] = _picture(colors, wanted, found)
    return answer


def solved_state(palette: PropertyGroup) -> tuple[list[Illuminant] | None, NDArray[np.float64] | None]:
    """Lights and colors of the last solution; None where there is none."""
    if not palette.status or not all(cell.has_result for material in palette.materials for cell in material.cells):
        return None, None
    lights = []
    for light in palette.lights:
        found = spectrum_of(light, "result")
        if not isinstance(found, Illuminant):
            return None, None
        lights.append(found)
    actual = [[tuple(cell.actual_linear) for cell in material.cells] for material in palette.materials]
    return lights, np.array(actual, dtype=np.float64)


def _words(
    palette: PropertyGroup, colors: PossibleColors, found: NearestColor, wanted: NDArray[np.float64]
) -> list[str]:
    """The answer for an artist."""
    if found.reachable:
        lines = ["Possible."]
    else:
        lines = [f"Not possible; the nearest color is ΔE {found.delta_e_2000:.1f} away."]
        for cell, _ in colors.in_the_way(found)[:2]:
            left = colors.without(cell, wanted)
            name = palette.lights[cell[1]].name
            lines.append(f"In the way: the exact color under {name}. Without it ΔE {left:.1f} would be left.")
        if CellReach(colors.light, colors.reach.grid, scale=None).nearest(wanted).delta_e_2000 > VISIBLE:
            lines.append("No reflectance has it, whatever the other cells ask. More light or another lamp helps.")
    if colors.open:
        names = ", ".join(palette.lights[column].name for _, column in colors.open)
        lines.append(f"Targets under {names} are not exact, so they may give way.")
    return lines


def _picture(colors: PossibleColors, wanted: NDArray[np.float64], found: NearestColor) -> NDArray[np.float32]:
    """Section of the set at the wanted lightness, (SIZE, SIZE, 4), b* upward."""
    lab = lab_from_linear_rgb(np.clip(wanted, 0, None))
    lightness = float(np.clip(lab[0], 5, 95))
    inside = colors.section(lightness, SIZE)
    shown = display_rgb_from_linear(np.clip(section_linear_rgb(lightness, SIZE), 0, 1))
    picture = np.where(inside[..., None], shown, 0.12 + 0.12 * shown)
    picture = _marked(picture, lab, ring=True)
    if not found.reachable:
        picture = _marked(picture, lab_from_linear_rgb(np.clip(found.color, 0, None)), ring=False)
    return np.concatenate([picture, np.ones((SIZE, SIZE, 1))], axis=2).astype(np.float32)


def _marked(picture: NDArray[np.float64], lab: NDArray[np.float64], *, ring: bool) -> NDArray[np.float64]:
    center = (lab[1:] + SECTION_LIMIT) / (2 * SECTION_LIMIT) * (SIZE - 1)
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    distance = np.hypot(x - center[0], y - center[1])
    dark = np.abs(distance - 5) < 1.8 if ring else distance < 4
    light = np.abs(distance - 5) < 0.8 if ring else distance < 2.6
    marked = np.where(dark[..., None], 0.0, picture)
    return np.where(light[..., None], 1.0, marked)


def picture_of(scene: Scene) -> NDArray[np.float32] | None:
    """Picture of the last answer; None in a file that was just opened."""
    return _pictures.get(scene.session_uid)


def take_nearest(scene: Scene) -> None:
    """Make the nearest possible color the target of the cell that was asked about."""
    palette = scene.spectral.palette
    answer = palette.possible
    rows = {material.uid: material for material in palette.materials}
    columns = {light.uid: column for column, light in enumerate(palette.lights)}
    if not answer.words or answer.material_uid not in rows or answer.light_uid not in columns:
        raise InvalidInputError("nothing was asked yet; select a cell and press Possible?")
    cell = rows[answer.material_uid].cells[columns[answer.light_uid]]
    cell.mode = "FIXED"
    cell.target = display_rgb_from_linear(np.maximum(answer.nearest_linear, 0.0))
    answer.words = ""
