# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets, Solve, Apply, and help with a conflict."""

import bpy
from bpy.props import EnumProperty, IntProperty
from bpy.types import Context, PropertyGroup

from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette import PaletteSolution

from ..editing.palette import live
from ..editing.palette import solve as palette_solve
from ..translate.palette import load as palette_load
from ..translate.palette import table
from ..translate.palette.apply import store_result
from .common import UNDOABLE, palette_in, reporting

PRESETS = [
    ("METAMER_PAIR", "Metamer Pair", "Two materials that look the same under one lamp and differ under another", 0),
    ("SPLIT_LIGHT", "Split Light", "Five materials that share one, then three, then five colors under three lights", 1),
    ("HIDDEN_MARK", "Hidden Mark", "A mark that daylight hides and a street lamp reveals", 2),
    ("COLOR_CONSTANCY", "Color Constancy", "One material keeps its color when the light changes, another does not", 3),
    ("XRAY_SMOKE", "X-Ray Smoke", "A smoke that is not there under two lights and shows under a third", 4),
    ("MOST_DISTINCT", "Most Distinct", "Materials that match in daylight and differ as much as they can elsewhere", 5),
]

LAMP_NAMES = {"D65": "Daylight", "HP1": "Sodium", "A": "Tungsten", "FL11": "Fluorescent"}


class SPECTRAL_OT_palette_preset(bpy.types.Operator):
    """Replace the palette by one of the ready-made ideas, and solve it"""

    bl_idname = "spectral.palette_preset"
    bl_label = "Palette Preset"
    bl_options = UNDOABLE
    preset: EnumProperty(name="Preset", items=PRESETS)

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.palette import presets

        problem = getattr(presets, self.preset.lower())()
        palette_load.store_problem(palette_in(context), problem)
        _rename_for_artists(palette_in(context))
        _solve(context)


def _rename_for_artists(palette: PropertyGroup) -> None:
    """Short names that fit a narrow table; the library names spectra by how they were made."""
    for number, light in enumerate(palette.lights, 1):
        light.name = f"Light {number}" if light.name.startswith("sine") else LAMP_NAMES.get(light.name, light.name)
    for number, material in enumerate(palette.materials, 1):
        plain = material.name.rpartition(" ")[0] in ("reflectance", "material")
        material.name = f"Paint {number}" if plain else material.name.capitalize()


class SPECTRAL_OT_palette_clear(bpy.types.Operator):
    """Begin with an empty table"""

    bl_idname = "spectral.palette_clear"
    bl_label = "Clear Palette"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        table.clear(palette_in(context))


def _solve(context: Context) -> PaletteSolution:
    solution = palette_solve.solve_scene(context.scene)
    if solution is None:
        raise InvalidInputError(palette_in(context).message)
    live.show()
    return solution


class SPECTRAL_OT_palette_solve(bpy.types.Operator):
    """Find spectra that come as near to all wishes as they can"""

    bl_idname = "spectral.palette_solve"
    bl_label = "Solve"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        solution = _solve(context)
        if not solution.status.trusted:
            self.report({"WARNING"}, solution.remedy)


class SPECTRAL_OT_palette_apply(bpy.types.Operator):
    """Give the designed spectra to the lights and materials of the scene that the table names. One undo step"""

    bl_idname = "spectral.palette_apply"
    bl_label = "Apply to Scene"
    bl_options = UNDOABLE
    create: bpy.props.BoolProperty(
        name="Create Missing Materials", default=False, description="Make a Blender material for rows that name none"
    )

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        if palette.is_stale and palette.live:
            palette_solve.solve_scene(context.scene)  # an edit whose timer has not come yet
        _require_appliable(palette)
        if self.create:
            _create_materials(palette)
        count = sum(_apply_light(light) for light in palette.lights)
        count += sum(_apply_material(material) for material in palette.materials)
        if not count:
            raise InvalidInputError(
                "no row or column names a material or light of the scene; choose some below the table, or create them"
            )
        self.report({"INFO"}, f"{count} spectra applied")


def _require_appliable(palette: PropertyGroup) -> None:
    if not palette.status:
        raise InvalidInputError("the palette is not solved yet; press Solve first")
    if palette.is_stale:
        raise InvalidInputError(f"the palette has changed since it was solved; solve it. {palette.message}".strip())
    if palette.allow_negative:
        raise InvalidInputError("unphysical spectra cannot be applied; switch Unphysical Spectra off and solve again")
    if palette.status in ("inaccurate", "invisible"):
        raise SolveError(f"the solution cannot be relied on and is not applied: {palette.remedy}")


def _create_materials(palette: PropertyGroup) -> None:
    for row in palette.materials:
        if row.material is None:
            row.material = bpy.data.materials.new(row.name)


def _apply_light(light: PropertyGroup) -> int:
    targets = [target for target in (light.light, light.world) if target is not None]
    for target in targets:
        store_result(target, light)
    return len(targets)


def _apply_material(row: PropertyGroup) -> int:
    if row.material is None:
        return 0
    store_result(row.material, row)
    return 1


class SPECTRAL_OT_palette_relieve(bpy.types.Operator):
    """Stop caring about one cell, and solve again"""

    bl_idname = "spectral.palette_relieve"
    bl_label = "Let Go of Cell"
    bl_options = UNDOABLE
    row: IntProperty(min=0)
    column: IntProperty(min=0)

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        cells = dict(table.places(palette))
        if (self.row, self.column) not in cells:
            raise InvalidInputError(f"there is no cell in row {self.row}, column {self.column}")
        with table.paused():
            cells[self.row, self.column].mode = "IGNORE"
        _solve(context)


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_palette_preset,
        SPECTRAL_OT_palette_clear,
        SPECTRAL_OT_palette_solve,
        SPECTRAL_OT_palette_apply,
        SPECTRAL_OT_palette_relieve,
    )
)
