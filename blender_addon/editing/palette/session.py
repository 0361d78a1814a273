# SPDX-License-Identifier: GPL-3.0-or-later
"""The changes between two edits of a table, for the core's live session, which solves only these."""

import hashlib
from dataclasses import fields
from typing import Any

import numpy as np

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, PaletteSolution
from spectral_core.spectra.spectrum import Spectrum

_sessions: dict[int, Any] = {}
"""Live session by scene. Not saved: an opened file starts a new one."""

TABLE = ("grid", "lights", "reflectances", "cells")
"""Attributes of a problem that are compared entry by entry; all others are compared as a whole."""


def live_solution(scene_uid: int, problem: PaletteProblem) -> PaletteSolution:
    """Quick solution after the edit that led to ``problem``, from the previous one; it may not be optimal yet.

    If lights are designed, one round follows each edit; ``solve_palette`` continues from this solution.
    """
    from spectral_core.palette.live.session import PaletteSession

    session = _sessions.pop(scene_uid, None)  # an edit that fails leaves no partly edited session behind
    if session is None or not same_table(session.problem, problem):
        session = PaletteSession(problem)
    else:
        changed = _changed_settings(session.problem, problem)
        cells = _changed_cells(session.problem, problem)
        if changed:
            session.change(cells=problem.cells, **changed)
        elif cells:
            session.edit_cells(cells)
    _sessions[scene_uid] = session
    return session.solution(quick=True)


def forget_sessions() -> None:
    """Start a new session at the next edit."""
    _sessions.clear()


def same_table(before: PaletteProblem, after: PaletteProblem) -> bool:
    """True if two problems have the same rows, columns and designed spectra, so that one solution fits both."""

    def shape(problem: PaletteProblem) -> tuple:
        lights = tuple((light.free, len(light.primaries)) for light in problem.lights)
        return lights, tuple(item.free for item in problem.reflectances)

    return before.grid.same_as(after.grid) and shape(before) == shape(after)


def same_problem(before: PaletteProblem, after: PaletteProblem) -> bool:
    """True if an answer to one of two problems answers the other."""
    if not same_table(before, after):
        return False
    return not _changed_settings(before, after) and not _changed_cells(before, after)


def fingerprint(problem: PaletteProblem) -> str:
    """A text that is the same for problems with the same requests, spectra and settings, whatever their names are."""
    settings = [getattr(problem, each.name) for each in fields(PaletteProblem) if each.name not in TABLE]
    lights = [(tuple(lamp and lamp[1:] for lamp in key[0]), key[1:]) for key in map(_light_key, problem.lights)]
    items = [spectrum and spectrum[1:] for _, spectrum in map(_item_key, problem.reflectances)]
    cells = [[_cell_key(cell) for cell in row] for row in problem.cells]
    parts = (_bytes(problem.grid.wavelengths_nm), settings, lights, items, cells)
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _changed_settings(before: PaletteProblem, after: PaletteProblem) -> dict[str, Any]:
    settings = [each.name for each in fields(PaletteProblem) if each.name not in TABLE]
    changed = {name: getattr(after, name) for name in settings if getattr(before, name) != getattr(after, name)}
    if [_light_key(light) for light in before.lights] != [_light_key(light) for light in after.lights]:
        changed["lights"] = after.lights
    if [_item_key(item) for item in before.reflectances] != [_item_key(item) for item in after.reflectances]:
        changed["reflectances"] = after.reflectances
    return changed


def _changed_cells(before: PaletteProblem, after: PaletteProblem) -> dict[tuple[int, int], Cell]:
    return {
        (row, column): cell
        for row, cells in enumerate(after.cells)
        for column, cell in enumerate(cells)
        if _cell_key(before.cells[row][column]) != _cell_key(cell)
    }


def _bytes(values: Any) -> bytes | None:
    return None if values is None else np.asarray(values, dtype=np.float64).tobytes()


def _spectrum_key(spectrum: Spectrum | None) -> tuple | None:
    if spectrum is None:
        return None
    return spectrum.name, _bytes(spectrum.grid.wavelengths_nm), _bytes(spectrum.values)


def _light_key(light: PaletteLight) -> tuple:
    lamps = tuple(_spectrum_key(each) for each in (light.spectrum, *light.primaries, None, *light.variants))
    return lamps, light.free, _bytes(light.white_xyz), light.luminance


def _item_key(item: PaletteReflectance) -> tuple:
    return item.name, _spectrum_key(item.spectrum)


def _cell_key(cell: Cell) -> tuple:
    return cell.mode, _bytes(cell.target), cell.others, _bytes(cell.box), cell.weight, cell.exact
