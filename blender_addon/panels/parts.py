# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements that several panels share: wrapped text, a spectrum with its curve, swatches under lamps."""

import re
from collections.abc import Iterable, Sequence

import bpy
from bpy.types import ID, Context, PropertyGroup, UILayout

from spectral_core.errors import counted

from .. import compat
from ..drawing.icons import curve_icon, swatch_icon
from ..drawing.text import lines_in, text_width, told_apart, widths_in
from ..translate.spectra.stored import kind_in
from .swatches import NO_SWATCH, Swatch, swatches_of

ICON_PIXELS = 20.0
BUTTON_PIXELS = 16.0
"""Margin of a button at the sides of its text."""
PANEL_PIXELS = 56.0
"""Width of the margins of a panel, with the tabs at its side."""
TAB_PIXELS = 20.0
"""Width of the tabs at the edge of a sidebar."""
GAP_PIXELS = 10.0
"""Between the columns of a grid whose buttons are not aligned."""
CLIP_PIXELS = 6.0
"""What Blender keeps free of a centered text in a button; it cuts off the end of a longer text."""
LEAST_LINE = 60.0
"""Unscaled pixels of a line in a panel that is too narrow to read; Blender cuts off a line that is too long."""
UNIT = re.compile(r"(?<=ΔE) (?=\d)|(?<=\bR[afg]) (?=\d)|(?<=\d) (?=(?:MB|GB|nm|dB|ms|s|min|h|K|W|g|lm|%)(?![\w]))")
"""The space between a number and its unit, or the name of an index."""


def width_of(context: Context) -> float:
    """Width of the region in unscaled pixels."""
    scale = context.preferences.system.ui_scale if context.preferences else 1.0
    return context.region.width / scale if context.region else 300.0


def column_room(context: Context, columns: int) -> float:
    """Unscaled pixels that a text has in one of so many even columns of a grid that fills the panel."""
    margins = PANEL_PIXELS - TAB_PIXELS + _tabs(context)
    return (width_of(context) - margins - (columns - 1) * GAP_PIXELS) / columns - CLIP_PIXELS


def _tabs(context: Context) -> float:
    """Unscaled pixels of the tabs at the side of a sidebar; other regions have none."""
    return TAB_PIXELS if context.region and getattr(context.region, "type", "") == "UI" else 0.0


def wrapped(layout: UILayout, context: Context, text: str, icon: str = "NONE", indent: float = 40.0) -> None:
    """A text in as many lines as the panel's width requires; a number stays on the line of its unit."""
    text = UNIT.sub("\u00a0", text)
    column = layout.column(align=True)
    column.scale_y = 0.8
    room = width_of(context) - _tabs(context) - indent - (0.0 if icon == "NONE" else ICON_PIXELS)
    for number, line in enumerate(lines_in(text, max(room, LEAST_LINE), context)):
        shown = icon if number == 0 else ("BLANK1" if icon != "NONE" else "NONE")
        column.label(text=line, icon=shown, translate=False)  # a line may be one word that Blender translates


def share_of(context: Context, names: Sequence[str]) -> float:
    """Share of a panel's width that the longest of these names needs as the label of a switch; above 1 if it needs
    more than all of it.
    """
    needed = max(text_width(name, context) for name in names) + ICON_PIXELS + BUTTON_PIXELS
    return needed / max(column_room(context, 1), 1.0)


def names_in(names: Sequence[str], room: float, context: Context) -> list[str]:
    """Distinct names in at most ``room`` unscaled pixels each: Blender would cut off their ends, which differ."""
    return told_apart(names, room, widths_in(context))


def draw_source(layout: UILayout, spectral: PropertyGroup) -> None:
    """Draw the source of the spectrum."""
    layout.row(align=True).prop(spectral, "source", expand=True)
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    if spectral.source == "CATALOGUE":
        column.prop(spectral, "catalogue_name", text="Name")
    elif spectral.source == "FILE":
        column.prop(spectral, "filepath", text="File")
        column.prop(spectral, "file_entry", text="Entry")


def takes_from_palette(context: Context, spectral: PropertyGroup) -> bool:
    """Whether to offer *Take from Palette*: beside a name or a file it would look like a second source."""
    return spectral.source == "DESIGNED" or (
        spectral.source == "NONE" and bool(len(context.scene.spectral.palette.materials))
    )


def draw_spectrum(layout: UILayout, context: Context, spectral: PropertyGroup, carrier: str) -> None:
    """Choice, curve and swatches of the spectrum of a material, light, world or node."""
    draw_source(layout, spectral)
    if takes_from_palette(context, spectral):
        layout.operator("spectral.spectrum_from_palette", icon="MOD_SIMPLIFY").carrier = carrier
    if spectral.message:
        message = layout.column()
        message.alert = True
        wrapped(message, context, spectral.message, icon="ERROR")
    if spectral.source == "NONE" or not len(spectral.samples):
        return
    draw_curve(layout, context, spectral)
    if kind_in(spectral) == "illuminant":
        row = layout.row()
        row.use_property_split = True
        row.use_property_decorate = False
        row.prop(spectral, "strength", text="Strength")
    if spectral.source == "FILE":
        layout.operator("spectral.spectrum_reload", icon="FILE_REFRESH").carrier = carrier


def draw_curve(layout: UILayout, context: Context, spectral: PropertyGroup) -> None:
    """The curve, its name, and its swatches."""
    row = layout.row()
    row.template_icon(curve_icon(spectral, 256), scale=min(8.0, max(4.0, width_of(context) / 45)))
    facts = row.column()
    facts.label(text=spectral.spectrum_name or "Spectrum", translate=False)
    origin = facts.column(align=True)
    origin.active = False
    origin.scale_y = 0.8
    samples, beside = spectral.samples, width_of(context) / 2
    extent = f"{samples[0].wavelength_nm:.0f}–{samples[-1].wavelength_nm:.0f} nm"
    wrapped(origin, context, f"{extent}, {counted(len(samples), 'value')}", indent=beside)
    if spectral.origin:
        wrapped(origin, context, spectral.origin.partition(", see ")[0], indent=beside)
    draw_swatches(layout, swatches_of(spectral))


def draw_swatches(layout: UILayout, swatches: Iterable[Swatch]) -> None:
    """Draw colors with the name of the lamp, or of the surface, below each."""
    row = layout.row(align=True)
    for name, color in swatches:
        column = row.column(align=True)
        if color is NO_SWATCH:
            column.label(text=name, icon="ERROR")
            continue
        column.template_icon(swatch_icon(color), scale=1.6)
        label = column.row()
        label.alignment = "CENTER"
        label.scale_y = 0.7
        label.label(text=name)


def is_editable(owner: ID) -> bool:
    """True if this is not linked from another file."""
    return not isinstance(owner, bpy.types.ID) or compat.is_editable(owner)
