# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of one material, light, world or node."""

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import ID, Context, Event, Node, Object, PropertyGroup, bpy_prop_collection

from spectral_core.errors import InvalidInputError

from ..editing.spectrum import reload
from ..translate.palette.apply import store_result
from ..translate.spectra.stored import kind_of, require_editable
from .common import UNDOABLE, palette_shown, reporting

CARRIERS = [
    ("MATERIAL", "Material", "The active material", 0),
    ("LIGHT", "Light", "The active light", 1),
    ("WORLD", "World", "The world", 2),
    ("NODE", "Node", "The active shader node", 3),
]


def carrier(context: Context, which: str) -> ID | Node | None:
    """The material, light, world or node of a panel; None without one."""
    active = context.object
    if which == "MATERIAL":
        return getattr(context, "material", None) or (active.active_material if active else None)
    if which == "LIGHT":
        return getattr(context, "light", None) or (active.data if active and active.type == "LIGHT" else None)
    if which == "WORLD":
        return getattr(context, "world", None) or context.scene.world
    return getattr(context, "active_node", None) or _active_node(active)


def _active_node(active: Object | None) -> Node | None:
    material = active.active_material if active else None
    return material.node_tree.nodes.active if material and material.node_tree else None


def _required(context: Context, which: str) -> ID | Node:
    found = carrier(context, which)
    if found is None or not hasattr(found, "spectral"):
        raise InvalidInputError(f"there is no active {which.lower()} that can have a spectrum; select one")
    require_editable(found.id_data)
    return found


class SPECTRAL_OT_spectrum_reload(bpy.types.Operator):
    """Read the spectrum from its file or the catalogue again"""

    bl_idname = "spectral.spectrum_reload"
    bl_label = "Reload Spectrum"
    bl_options = UNDOABLE
    carrier: EnumProperty(name="Of", items=CARRIERS, description="Whose spectrum is read again")

    @reporting
    def execute(self, context: Context) -> None:
        spectral = _required(context, self.carrier).spectral
        reload(spectral)
        if spectral.message:
            raise InvalidInputError(spectral.message)


def _designed_names(self: bpy.types.Operator, context: Context, typed: str) -> list[str]:
    owner = carrier(context, self.carrier)
    if owner is None:
        return []
    return [entry.name for entry in _entries(palette_shown(context), owner) if typed.lower() in entry.name.lower()]


def _entries(palette: PropertyGroup, owner: ID) -> bpy_prop_collection:
    return palette.lights if kind_of(owner) == "illuminant" else palette.materials


class SPECTRAL_OT_spectrum_from_palette(bpy.types.Operator):
    """Take the spectrum that the palette designed for one of its lights or materials"""

    bl_idname = "spectral.spectrum_from_palette"
    bl_label = "Take from Palette"
    bl_options = UNDOABLE
    carrier: EnumProperty(name="For", items=CARRIERS, description="What gets the spectrum")
    entry: StringProperty(name="Name", search=_designed_names, description="Light or material of the palette")

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context: Context) -> None:
        owner = _required(context, self.carrier)
        entries = {entry.name: entry for entry in _entries(palette_shown(context), owner)}
        if self.entry not in entries:
            raise InvalidInputError(
                f"the palette has no {kind_of(owner)} named {self.entry!r}; it has: {', '.join(entries) or 'none'}"
            )
        store_result(owner, entries[self.entry])


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_spectrum_reload, SPECTRAL_OT_spectrum_from_palette)
)
