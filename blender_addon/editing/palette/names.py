# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the palette's lights and materials: each has its own, and choices and messages by name follow a new one."""

import re

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
    """Keep the name of a light or material apart from the others; let looks under a light, and what was told of the
    last solution, follow its name.
    """
    palette = palette_of(entry)
    is_light = entry.SPECTRUM_KIND == "illuminant"
    others = {each.name for each in (palette.lights if is_light else palette.materials) if each != entry}
    if entry.name in others:
        with hooks.silenced(Topic.PALETTE_NAME):
            entry.name = unique(entry.name, others)
    if len(entry.result.samples):  # files and materials get the designed spectrum under this name
        entry.result.spectrum_name = entry.name
    before, entry.known_as = entry.known_as, entry.name
    if before and before != entry.name and before not in others:
        _tell_anew(palette, before, entry)
    if not is_light:
        return
    settings = palette.id_data.spectral.viewport
    for look in (settings.look, settings.other):
        if before and look.column == before and before not in others:
            look.column = entry.name


def _tell_anew(palette: PropertyGroup, before: str, entry: PropertyGroup) -> None:
    """Exchange a name in the texts about the last solution, where a cell is “material” under “light”."""
    is_light = entry.SPECTRUM_KIND == "illuminant"
    other_side = palette.materials if is_light else palette.lights
    where = ""
    if before in other_side.keys():  # noqa: SIM118 - a collection is no mapping
        where = "(?<=under )" if is_light else "(?<!under )"
    pattern = re.compile(f"{where}“{re.escape(before)}”")
    for holder, name in ((palette, "remedy"), (palette, "notes"), *((each, "text") for each in palette.conflicts)):
        told = getattr(holder, name)
        setattr(holder, name, pattern.sub(lambda _: f"“{entry.name}”", told))
    palette.message = palette.message.replace(repr(before), repr(entry.name))
    if is_light and before in palette.possible.words:
        palette.possible.words = ""
        possible.follow(palette.id_data)
