# SPDX-License-Identifier: GPL-3.0-or-later
"""From the palette to the scene: spectra for the materials, lights and worlds of the table."""

import bpy
from bpy.props import BoolProperty
from bpy.types import Context, PropertyGroup

from spectral_core.errors import InvalidInputError, SolveError, counted

from ... import compat
from ...editing.palette import bindings, picture
from ...editing.palette import solve as palette_solve
from ...translate.palette.apply import expose, level_of, store_colors, store_result
from ...translate.spectra.stored import require_editable
from ..common import UNDOABLE, palette_in, reporting


class SPECTRAL_OT_palette_apply(bpy.types.Operator):
    """Assign the designed spectra to the lights and materials in the table. One undo step"""

    bl_idname = "spectral.palette_apply"
    bl_label = "Apply to Scene"
    bl_options = UNDOABLE
    create: BoolProperty(
        name="Create Missing Materials", default=False, description="Make a Blender material for rows without one"
    )
    make_local: BoolProperty(
        name="Make Linked Data Local", default=False,
        description="Make linked materials and lights local to this file, so that they can be changed",
    )  # fmt: skip

    @classmethod
    def description(cls, context: Context, properties: PropertyGroup) -> str:
        if properties.create:
            return "Make a Blender material for each row without one, and assign the designed spectra"
        return str(cls.__doc__)

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        if palette.is_stale and palette.live:
            palette_solve.solve_scene(context.scene)  # an edit whose timer has not yet run
        _require_appliable(palette)
        if self.make_local:
            _make_local(palette)
        for _, _, block in bindings.bound(palette):
            if block is not None:
                require_editable(block)  # before anything is written
        if self.create:
            _create_materials(palette)
        count = _apply(palette)
        if not count:
            raise InvalidInputError(
                "no row or column names a material or light of the scene; choose some below the table, "
                "or press Apply and Make Materials"
            )
        lost = [fault.text for fault in bindings.faults(palette) if fault.kind in ("deleted", "unused")]
        if lost:
            self.report({"WARNING"}, f"the table names deleted or unused data: {'; '.join(lost)}")
        for text in bindings.shared(palette):
            self.report({"WARNING"}, f"{text}; choose another one for each")
        self.report({"INFO"}, f"{counted(count, 'spectrum', 'spectra')} applied")


def _apply(palette: PropertyGroup) -> int:
    """Write the spectra, and adapt lights or exposure to the brightness of the palette."""
    level = level_of(palette)
    to_exposure = palette.level_to == "EXPOSURE"
    count = 0
    for entry, _, block in bindings.bound(palette):
        if block is not None:
            store_result(block, entry, level=level if to_exposure else 1.0)
            if palette.apply_colors:
                store_colors(block)
            count += 1
    if count:
        expose(palette.id_data, level if to_exposure else 1.0)
        picture.forget(palette.id_data)
    return count


def _require_appliable(palette: PropertyGroup) -> None:
    if not palette.status:
        raise InvalidInputError("the palette is not solved yet; press Solve first")
    if palette.is_stale:
        raise InvalidInputError(f"the palette has changed since it was solved; solve it. {palette.message}".strip())
    if palette.allow_negative:
        raise InvalidInputError("unphysical spectra cannot be applied; switch Unphysical Spectra off and solve again")
    if palette.status in ("inaccurate", "invisible"):
        raise SolveError(f"the solution cannot be relied on and is not applied: {palette.remedy}")


def _make_local(palette: PropertyGroup) -> None:
    linked = [fault for fault in bindings.faults(palette) if fault.kind == "linked"]
    for fault in linked:
        bindings.require_reached(getattr(fault.entry, fault.pointer))  # before anything is changed
    for fault in linked:
        if not compat.is_editable(getattr(fault.entry, fault.pointer)):  # two entries may name one data-block
            bindings.make_local(fault.entry, fault.pointer)


def _create_materials(palette: PropertyGroup) -> None:
    for row in palette.materials:
        if row.material is None:
            row.material = bpy.data.materials.new(row.name)


class SPECTRAL_OT_palette_mend(bpy.types.Operator):
    """Update names, find data that was deleted and made again, make linked data local, and remove deleted data"""

    bl_idname = "spectral.palette_mend"
    bl_label = "Mend Table"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> set[str]:
        done, left = bindings.mend(palette_in(context))
        if done or not left:
            self.report({"INFO"}, "; ".join(done) or "nothing to mend: every name in the table is current")
        for text in left:
            self.report({"WARNING"}, text)
        return {"FINISHED"} if done else {"CANCELLED"}  # an undo step of no change would undo nothing


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_palette_apply, SPECTRAL_OT_palette_mend))
