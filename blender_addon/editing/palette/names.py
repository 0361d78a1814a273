# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the palette's lights and materials: each has its own, and what is chosen by name follows a new one."""

from bpy.types import PropertyGroup

from ...properties import hooks
from ...properties.hooks import Topic
from ...translate.palette.table import palette_of, unique


def know(palette: PropertyGroup) -> None:
    """Store the names of the lights of a file that an earlier version has saved."""
    for light in palette.lights:
        light.known_as = light.known_as or light.name


def renamed(entry: PropertyGroup) -> None:
    """Keep the name of a light or material apart from the others, and let looks under a light follow its name."""
    palette = palette_of(entry)
    is_light = entry.SPECTRUM_KIND == "illuminant"
    others = {each.name for each in (palette.lights if is_light else palette.materials) if each != entry}
    if entry.name in others:
        with hooks.silenced(Topic.PALETTE_NAME):
            entry.name = unique(entry.name, others)
    if len(entry.result.samples):  # files and materials get the designed spectrum under this name
        entry.result.spectrum_name = entry.name
    if not is_light:
        return
    before, entry.known_as = entry.known_as, entry.name
    settings = palette.id_data.spectral.viewport
    for look in (settings.look, settings.other):
        if before and look.column == before and before not in others:
            look.column = entry.name
