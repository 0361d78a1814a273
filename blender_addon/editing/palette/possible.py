# SPDX-License-Identifier: GPL-3.0-or-later
"""Possible colors: the core's answer for the selected cell, stored for the panel, with a picture of the set."""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from functools import partial

import bpy
import numpy as np
from bpy.types import PropertyGroup, Scene
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.palette import PaletteProblem
from spectral_core.palette.explain.inward import in_single_precision
from spectral_core.palette.reach.possible import SECTION_LIMIT, PossibleAnswer, possible_answer, section_linear_rgb
from spectral_core.palette.reach.reachable import NearestColor
from spectral_core.spectra.color import display_rgb_from_linear, lab_from_linear_rgb, linear_from_display_rgb
from spectral_core.spectra.spectrum import Illuminant

from ...translate.palette.paint import Dyes, dyes_of, paint_of
from ...translate.palette.problem import palette_problem
from ...translate.palette.table import active_cell
from ...translate.spectra.stored import spectrum_of
from ..apart import APART
from ..behind import Behind
from ..deferred import redraw

SIZE = 96
VISIBLE = 1.0
"""ΔE2000 from which a difference is visible."""
NOTHING = 0.05
"""ΔE2000 below which a difference reads as 0.0: a nearest color that was taken lies on the edge of what is possible."""
ANSWERS = Behind("possible")
_pictures: dict[int, NDArray[np.float32]] = {}
"""Picture of the last answer by scene. Not saved: an opened file computes it again."""


@dataclass(frozen=True)
class Question:
    """The question, read from the properties, so that a thread can answer. ``spectra``: of the lights as solved;
    ``materials``, ``lights``: names of the rows and columns; ``dyes``: wavelengths of the dyes of each row.
    """

    problem: PaletteProblem
    place: tuple[int, int]
    spectra: list[Illuminant] | None
    wanted: NDArray[np.float64]
    uids: tuple[int, int]
    materials: tuple[str, ...]
    lights: tuple[str, ...]
    dyes: Dyes = ()


@dataclass(frozen=True)
class Answer:
    """The core's answer to a question."""

    question: Question
    found: NearestColor
    taken: NDArray[np.float64]
    """The nearest color, linear sRGB, such that an exact cell can have it with the digits that Blender stores."""
    words: str
    picture: NDArray[np.float32]


def question_of(palette: PropertyGroup) -> Question:
    """Question for the selected cell. Raises InvalidInputError for a table that cannot be solved."""
    row, column = palette.active_row, palette.active_column
    cell = palette.materials[row].cells[column]
    wanted = _wanted(cell)
    uids = palette.materials[row].uid, palette.lights[column].uid
    materials, lights = (tuple(each.name for each in entries) for entries in (palette.materials, palette.lights))
    place, spectra, dyes = (row, column), solved_lights(palette), paint_of(palette)[1]
    return Question(palette_problem(palette), place, spectra, wanted, uids, materials, lights, dyes)


def _wanted(cell: PropertyGroup) -> NDArray[np.float64]:
    """The color that a cell asks for, linear sRGB: of a free one, the color that it has."""
    if cell.mode == "BLACK":
        return np.zeros(3)
    if cell.mode == "FIXED" or not cell.has_result:
        return linear_from_display_rgb(cell.target)
    return np.array(cell.wanted_linear if cell.mode in ("SAME", "CONSTANT") else cell.actual_linear, dtype=np.float64)


def answered(question: Question) -> Answer:
    """The answer; reads nothing from Blender. Raises InvalidInputError if there is none."""
    dyes = dyes_of(dict(enumerate(question.dyes)))
    ask = partial(
        possible_answer,
        question.problem,
        question.place,
        question.wanted,
        lights=question.spectra,
        dyes=dyes,
        size=SIZE,
        stored=in_single_precision,
    )
    found = APART.call(ask)
    words, picture = "\n".join(_words(question, found)), _picture(found, question.wanted)
    return Answer(question, found.nearest, found.taken, words, picture)


def keep(scene: Scene, known: Answer) -> PropertyGroup:
    """Store an answer for the panel."""
    answer = scene.spectral.palette.possible
    answer.material_uid, answer.light_uid = known.question.uids
    answer.asked = np.clip(display_rgb_from_linear(known.question.wanted), 0, 1)
    answer.nearest = np.clip(display_rgb_from_linear(known.found.color), 0, 1)
    answer.nearest_linear = known.taken
    answer.reachable = is_possible(known.found)
    answer.words = known.words
    _pictures[scene.session_uid] = known.picture
    return answer


def changed(scene: Scene) -> None:
    """The table is another one: answer for it, or show no answer rather than that of the table before."""
    if bpy.app.background or not scene.spectral.palette.possible_follows:
        scene.spectral.palette.possible.words = ""
    else:
        follow(scene)


def follow(scene: Scene) -> None:
    """Answer for the selected cell on a thread, if the artist enabled that; the panel shows the answer when it is
    ready.
    """
    palette = scene.spectral.palette
    if bpy.app.background or not palette.possible_follows:
        return
    if active_cell(palette) is None:
        ANSWERS.drop(scene)  # it is for a cell of the table before
        return
    if ANSWERS.is_busy(scene, follow):
        return
    try:
        question = question_of(palette)
    except SpectralError:  # the palette's own message reports it
        _show(scene, None)
        return
    ANSWERS.run(scene, partial(_answer_or_none, question), _show, patience_seconds=0.0)


def _answer_or_none(question: Question) -> Answer | None:
    try:
        return answered(question)
    except SpectralError:  # a table without an answer shows none
        return None
    except Exception:  # noqa: BLE001 - a thread cannot pass the error to a caller
        traceback.print_exc()
        return None


def _show(scene: Scene, answer: Answer | None) -> None:
    if answer is None:
        scene.spectral.palette.possible.words = ""
    else:
        keep(scene, answer)
    redraw("VIEW_3D", "PROPERTIES")


def solved_lights(palette: PropertyGroup) -> list[Illuminant] | None:
    """Lights of the last solution; None if there is none."""
    if not palette.status or not all(cell.has_result for material in palette.materials for cell in material.cells):
        return None
    lights = []
    for light in palette.lights:
        found = spectrum_of(light, "result")
        if not isinstance(found, Illuminant):
            return None
        lights.append(found)
    return lights


def is_possible(found: NearestColor) -> bool:
    """True if the nearest color cannot be told from the wanted one."""
    return found.reachable or found.delta_e_2000 < NOTHING


def _words(question: Question, answer: PossibleAnswer) -> list[str]:
    """Text of the answer."""
    lights, found = question.lights, answer.nearest
    if is_possible(found):
        lines = ["Possible."]
    else:
        lines = [f"Not possible; the color that is nearest in CIELAB is ΔE2000 {found.delta_e_2000:.1f} away."]
        for (row, column), left in answer.conflicts:
            of_other = "" if row == question.place[0] else f" of {question.materials[row]}"
            lines.append(
                f"Conflict: the exact color{of_other} under {lights[column]}. {_without(left, found.delta_e_2000)}"
            )
        if answer.alone > VISIBLE:
            lines.append("No reflectance has it, even without the other cells. More light or another lamp helps.")
    if answer.open:
        names = ", ".join(lights[column] for _, column in answer.open)
        lines.append(f"Targets under {names} are not exact, so they may be missed.")
    return lines


def _without(left: float, before: float) -> str:
    """What releasing a cell does to the distance of the color that is nearest in CIELAB, given in ΔE2000.

    The distance in CIELAB never grows, the one in ΔE2000 may.
    """
    if round(left, 1) < round(before, 1):
        return f"Without it ΔE2000 {left:.1f} would remain."
    return f"Without it a color may be nearer in CIELAB, but ΔE2000 does not fall ({left:.1f})."


def _picture(answer: PossibleAnswer, wanted: NDArray[np.float64]) -> NDArray[np.float32]:
    """Section of the set at the wanted lightness, (SIZE, SIZE, 4), b* upward."""
    shown = display_rgb_from_linear(np.clip(section_linear_rgb(answer.lightness, SIZE), 0, 1))
    picture = np.where(answer.inside[..., None], shown, 0.12 + 0.12 * shown)
    picture = _marked(picture, lab_from_linear_rgb(np.clip(wanted, 0, None)), ring=True)
    if not is_possible(answer.nearest):
        picture = _marked(picture, lab_from_linear_rgb(np.clip(answer.nearest.color, 0, None)), ring=False)
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
    """Make the nearest possible color the target of the answered cell."""
    palette = scene.spectral.palette
    answer = palette.possible
    rows = {material.uid: material for material in palette.materials}
    columns = {light.uid: column for column, light in enumerate(palette.lights)}
    if not answer.words or answer.material_uid not in rows or answer.light_uid not in columns:
        raise InvalidInputError("there is no question yet; select a cell and press Possible?")
    cell = rows[answer.material_uid].cells[columns[answer.light_uid]]
    cell.mode = "FIXED"
    cell.target = display_rgb_from_linear(answer.nearest_linear)
    answer.words = ""
