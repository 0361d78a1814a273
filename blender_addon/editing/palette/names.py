# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the palette's lights and materials: each has its own, and choices and messages by name follow a new one."""

import re
from collections.abc import Iterable

from bpy.types import PropertyGroup

from ...properties import hooks
from ...properties.hooks import Topic
from ...translate.palette.table import palette_of, unique
from . import possible


def know(palette: PropertyGroup) -> None:
    """Store the names of the entries of a file that an earlier version has saved."""
    for entry in (*palette.lights, *palette.materials):
        entry.known_as = entry.known_as or entry.name


def renamed(entry: PropertyGroup) -> None:
    """Keep the name of a light or material apart from the others, and in one line; let looks under a light, and what
    was told of the last solution, follow its name.
    """
    palette = palette_of(entry)
    is_light = entry.SPECTRUM_KIND == "illuminant"
    others = {each.name for each in (palette.lights if is_light else palette.materials) if each != entry}
    name = entry.name if entry.name.isprintable() else " ".join(entry.name.split())  # pasted with a line break or tab
    if not name.strip():  # cleared: the one before stays, as for objects of Blender
        name = entry.known_as or ("Light" if is_light else "Material")
    name = unique(name, others)
    if name != entry.name:
        with hooks.silenced(Topic.PALETTE_NAME):
            entry.name = name
    before, entry.known_as = entry.known_as, entry.name
    _name_results(palette, before if before not in others else "", entry)
    if not is_light:
        return
    settings = palette.id_data.spectral.viewport
    for look in (settings.look, settings.other):
        if before and look.column == before and before not in others:
            look.column = entry.name


def name_results(palette: PropertyGroup, solved_as: Iterable[str]) -> None:
    """Let a stored solution have the present names. ``solved_as``: those of the lights and materials when it was read.

    They differ after a rename during the solve, and where an undo brings back a name and a known solution.
    """
    entries = (*palette.lights, *palette.materials)
    for before, entry in zip(solved_as, entries, strict=True):
        if before != entry.name:
            _name_results(palette, before, entry)


def _name_results(palette: PropertyGroup, before: str, entry: PropertyGroup) -> None:
    """Give the results of an entry its present name. ``before``: the one in the texts; "" leaves these unchanged."""
    if len(entry.result.samples):  # files and materials get the designed spectrum under this name
        entry.result.spectrum_name = entry.name
    if before and before != entry.name:
        _tell_anew(palette, before, entry)


def _tell_anew(palette: PropertyGroup, before: str, entry: PropertyGroup) -> None:
    """Exchange a name in the texts about the last solution, where a cell is “material” under “light”.

    Notes begin with the side: light 'name' is black.
    """
    is_light = entry.SPECTRUM_KIND == "illuminant"
    other_side = palette.materials if is_light else palette.lights
    where = ""
    if before in other_side.keys():  # noqa: SIM118 - a collection is no mapping
        where = "(?<=under )" if is_light else "(?<!under )"
    pattern, side = re.compile(f"{where}“{re.escape(before)}”"), "light" if is_light else "material"
    for holder, name in ((palette, "remedy"), (palette, "notes"), *((each, "text") for each in palette.conflicts)):
        told = pattern.sub(lambda _: f"“{entry.name}”", getattr(holder, name))
        setattr(holder, name, told.replace(f"{side} {before!r}", f"{side} {entry.name!r}"))
    palette.message = palette.message.replace(repr(before), repr(entry.name))
    if is_light and before in palette.possible.words:
        palette.possible.words = ""
        possible.follow(palette.id_data)
