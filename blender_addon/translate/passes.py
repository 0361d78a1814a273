# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of a view layer that this engine does not fill, told to the artist instead of missing in the file."""

from __future__ import annotations

from bpy.types import ViewLayer

from spectral_core.scene import Note

RENDERED = {"use_pass_combined"}
OF_OTHERS = {"use_pass_cryptomatte_accurate", "use_pass_grease_pencil"}
"""Not passes of their own: how another pass is made, and a pass that only Grease Pencil fills."""


def pass_notes(layer: ViewLayer) -> tuple[Note, ...]:
    """A note that names every pass that is switched on and is not rendered."""
    asked = [
        prop.name
        for prop in layer.bl_rna.properties
        if prop.identifier.startswith("use_pass_")
        and prop.identifier not in RENDERED | OF_OTHERS
        and getattr(layer, prop.identifier)
    ]
    asked += [f"AOV {aov.name}" for aov in layer.aovs]
    asked += ["Freestyle lines"] if layer.use_freestyle and layer.id_data.render.use_freestyle else []
    if not asked:
        return ()
    which = ", ".join(asked)
    return (Note(f"view layer {layer.name}", f"{which}: not rendered; the file holds Combined only"),)
