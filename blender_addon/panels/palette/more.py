# SPDX-License-Identifier: GPL-3.0-or-later
"""Sub-panels of the palette: alternatives side by side, mixed paints, and fluorescent paints."""

import json

from bpy.types import Context, UILayout

from ...drawing.icons import swatch_icon
from ...editing.palette.alternatives import is_of_other_rows
from ..parts import BUTTON_PIXELS, ICON_PIXELS, PANEL_PIXELS, names_in, width_of, wrapped

MOST_SWATCHES = 12
"""Most materials of an alternative; a larger table shows its first ones."""
NAMES_SHARE = 0.4
"""Share of the width of an alternative that the names of materials have."""


def draw_alternatives(layout: UILayout, context: Context) -> None:
    """Draw alternatives as rows of swatches, with locks and a button for each."""
    palette = context.scene.spectral.palette
    row = layout.row(align=True)
    row.operator("spectral.palette_alternatives", icon="DUPLICATE").seed = len(palette.alternatives)
    row.prop(palette, "alternative_count", text="")
    designed = [material for material in palette.materials if material.design == "DESIGNED"]
    if designed:
        flow = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        room = (width_of(context) - PANEL_PIXELS) / 2 - ICON_PIXELS - BUTTON_PIXELS
        names = names_in([material.name for material in designed], room, context)
        for material, name in zip(designed, names, strict=True):
            icon = "LOCKED" if material.locked else "UNLOCKED"
            flow.prop(material, "locked", text=name, icon=icon, toggle=True, translate=False)
    if not len(palette.alternatives):
        hint = layout.column()
        hint.active = False
        wrapped(hint, context, "Solutions that meet the targets equally well, and differ elsewhere.")
        return
    if is_of_other_rows(palette, palette.alternatives[0]):
        wrapped(layout, context, "The table has other rows or columns now: find alternatives again.", icon="INFO")
        return
    lamps = palette.alternatives[0].lamps
    room = NAMES_SHARE * (width_of(context) - PANEL_PIXELS) - BUTTON_PIXELS
    known = names_in([material.name for material in palette.materials], room, context)
    wrapped(layout, context, f"Seen under {lamps}, from left to right.", icon="LIGHT")
    for index, answer in enumerate(palette.alternatives):
        box = layout.box()
        head = box.row()
        head.label(text="As solved" if index == 0 else f"ΔE {answer.apart:.0f} apart")
        head.operator("spectral.palette_alternative_take", text="Take", icon="CHECKMARK").index = index
        for name, colors in list(zip(known, json.loads(answer.colors), strict=False))[:MOST_SWATCHES]:
            split = box.split(factor=NAMES_SHARE, align=True)
            split.label(text=name, translate=False)
            line = split.row(align=True)
            for color in colors:
                line.template_icon(swatch_icon(color), scale=1.3)
        if len(known) > MOST_SWATCHES:
            box.label(text=f"and {len(known) - MOST_SWATCHES} more")


def draw_paint(layout: UILayout, context: Context) -> None:
    """Draw matching tints, and fluorescent dyes of the selected material."""
    palette = context.scene.spectral.palette
    layout.prop(palette, "use_tints")
    row = layout.row()
    row.enabled = palette.use_tints
    row.prop(palette, "tint_weight")
    hint = layout.column()
    hint.active = False
    wrapped(
        hint, context,
        "Paints mix by absorption and scattering (Kubelka and Munk), so materials that match may differ as tints.",
    )  # fmt: skip
    if palette.active_row >= len(palette.materials):
        return
    material = palette.materials[palette.active_row]
    box = layout.box()
    head = box.row(align=True)
    head.label(text=f"Dyes of {material.name}", icon="LIGHT_SUN")
    head.operator("spectral.palette_dye", text="", icon="ADD").index = -1
    for index, dye in enumerate(material.dyes):
        line = box.row()
        wavelengths = line.column(align=True)
        wavelengths.prop(dye, "excitation_nm")
        wavelengths.prop(dye, "emission_nm")
        line.operator("spectral.palette_dye", text="", icon="X").index = index
        if dye.amount > 0:
            box.label(text=f"Amount {dye.amount:.2f}")
    hint = box.column()
    hint.active = False
    wrapped(
        hint, context,
        "A dye absorbs light and emits it at a longer wavelength. In Design, let From be below the wavelength that it "
        "absorbs. Apply to Scene gives materials their dyes, and rendering shows their light.",
        indent=60.0,
    )  # fmt: skip
