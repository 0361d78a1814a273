# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternative solutions of the palette: found by the core, stored in the file, selected by the artist."""

from __future__ import annotations

import json
import operator
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError
from spectral_core.palette.alternatives import Alternative, alternatives
from spectral_core.spectra.color import display_rgb_from_linear
from spectral_core.spectra.observer import linear_rgb_from_product
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

from ...translate.palette.paint import has_paint
from ...translate.palette.problem import palette_problem
from ...translate.palette.solution import store_cells, store_designed
from ...translate.palette.table import paused
from ...translate.spectra.stored import spectrum_of
from . import picture
from .session import fingerprint
from .solve import forget_solutions

NO_REQUEST = -1.0
"""Stored in place of NaN, which JSON does not have."""

Found = list[dict[str, Any]]
"""Values of ``palette.alternatives``, one dict for each."""


def search(scene: Scene, seed: int = 0, call: Callable[..., Any] = operator.call) -> Callable[[], Found]:
    """The search for alternative solutions, which reads nothing from Blender any more. ``call``: calls the core's part.

    Raises InvalidInputError if nothing is free.
    """
    palette = scene.spectral.palette
    _require_plain(palette)
    problem, count = palette_problem(palette), palette.alternative_count
    locked = {}
    for row, material in enumerate(palette.materials):
        if material.locked and material.design == "DESIGNED":
            kept = spectrum_of(material, "result")
            if kept is None:
                raise InvalidInputError(f"{material.name!r} is locked but was never solved; solve the palette first")
            locked[row] = Reflectance(material.name, kept.grid, kept.values)
    uids = [entry.uid for entry in (*palette.lights, *palette.materials)]
    asked = _asked(palette)
    found = partial(alternatives, problem, count=count, locked=locked, seed=seed)
    return lambda: [{"asked": asked, **_told(each, uids)} for each in call(found)]


def _require_plain(palette: PropertyGroup) -> None:
    if has_paint(palette):
        raise InvalidInputError("alternatives do not support tints and dyes; switch them off")


def _asked(palette: PropertyGroup) -> str:
    """Requests of the table, and its rows and columns in their order: two rows may have the same requests."""
    return f"{fingerprint(palette_problem(palette))}:{_order(palette)}"


def _order(palette: PropertyGroup) -> str:
    return ",".join(str(entry.uid) for entry in (*palette.lights, *palette.materials))


def is_of_other_rows(palette: PropertyGroup, answer: PropertyGroup) -> bool:
    """True if rows or columns were added, removed or moved since an answer was found."""
    return answer.asked.rpartition(":")[2] != _order(palette)


def _told(found: Alternative, uids: list[int]) -> dict[str, Any]:
    """The values to store. ``uids``: numbers of the lights and materials. Given spectra are among them, too, as the
    palette's brightness may have changed since they were stored.
    """
    solution, items = found.solution, found.solution.reflectances
    entries = zip(uids, (*solution.illuminants, *items), strict=True)
    spectra = {
        # Nine digits, as many as Blender stores; samples of a dim light may be 1e-6.
        str(uid): {"nm": item.grid.wavelengths_nm.tolist(), "values": [float(f"{each:.9g}") for each in item.values]}
        for uid, item in entries
    }
    cells = {
        "actual": solution.actual_linear_rgb.tolist(),
        "wanted": np.nan_to_num(solution.target_linear_rgb, nan=NO_REQUEST).tolist(),
        "delta_e": np.nan_to_num(solution.delta_e_2000, nan=NO_REQUEST).tolist(),
        "light_scale": solution.light_scale,
        "status": str(solution.status),
        "remedy": solution.remedy,
        "notes": "\n".join(solution.notes),
        "amounts": [() if each is None else each.tolist() for each in solution.amounts],
    }
    colors = [[linear_rgb_from_product(light, item.grid) @ item.values for light in found.seen_under] for item in items]
    shown = np.clip(display_rgb_from_linear(np.array(colors)), 0, 1).round(4).tolist()
    return {
        "apart": found.apart,
        "spectra": json.dumps(spectra),
        "cells": json.dumps(cells),
        "colors": json.dumps(shown),
        "lamps": ", ".join(light.name for light in found.seen_under),
    }


def store(scene: Scene, found: Found) -> None:
    """Store what a search has found."""
    entries = scene.spectral.palette.alternatives
    entries.clear()
    for values in found:
        entry = entries.add()
        for name, value in values.items():
            setattr(entry, name, value)


def take(scene: Scene, index: int) -> None:
    """Make an alternative the palette's solution: spectra, and the colors and errors of the cells.

    Raises InvalidInputError if there is none of this number, if it answers another table, or if this one has tints or
    dyes by now.
    """
    palette = scene.spectral.palette
    if not 0 <= index < len(palette.alternatives):
        raise InvalidInputError(
            f"there is no alternative {index}; there are {len(palette.alternatives)}, counted from 0"
        )
    _require_plain(palette)
    answer = palette.alternatives[index]
    if answer.asked != _asked(palette):
        raise InvalidInputError("the table has changed since this alternative was found; press Find Alternatives again")
    spectra, cells = json.loads(answer.spectra), json.loads(answer.cells)
    actual, wanted, errors = (np.array(cells[name]) for name in ("actual", "wanted", "delta_e"))
    with paused():
        for entry, kind in (*((light, Illuminant) for light in palette.lights),
                            *((material, Reflectance) for material in palette.materials)):  # fmt: skip
            found = spectra.get(str(entry.uid))
            if found is not None:
                store_designed(entry.result, _physical(entry.name, found, kind), kind)
        for light, amounts in zip(palette.lights, cells["amounts"], strict=False):
            for lamp, amount in zip(light.primaries, amounts, strict=False):
                lamp.amount = amount
        asked = errors != NO_REQUEST
        store_cells(palette, actual, np.where(asked[..., None], wanted, np.nan), np.where(asked, errors, np.nan))
        palette.worst_delta_e = errors[asked].max(initial=0.0)
        palette.light_scale = cells["light_scale"]
        palette.status, palette.remedy, palette.notes = (cells[name] for name in ("status", "remedy", "notes"))
        palette.conflicts.clear()
        palette.milliseconds = 0.0
        palette.is_alternative, palette.is_stale, palette.is_unfinished, palette.message = True, False, False, ""
    forget_solutions()
    picture.follow(scene)


def _physical(name: str, found: dict[str, list[float]], kind: type[Spectrum]) -> Spectrum:
    """A spectrum of this kind; a plain one beyond its limits ("Unphysical Spectra")."""
    values = np.array(found["values"])
    low, high = values.min(), values.max()
    possible = low >= 0 if kind is Illuminant else low >= -Reflectance.TOLERANCE and high <= 1 + Reflectance.TOLERANCE
    return (kind if possible else Spectrum)(name, SpectralGrid(np.array(found["nm"])), values, source="designed")
