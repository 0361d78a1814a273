# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets, Solve, and the resolution of a conflict."""

from collections.abc import Callable

import bpy
from bpy.props import EnumProperty, IntProperty
from bpy.types import Context, PropertyGroup, Scene

from spectral_core.errors import InvalidInputError
from spectral_core.palette import PaletteSolution

from ...editing.apart import stoppable
from ...editing.palette import live, picture, possible
from ...editing.palette import solve as palette_solve
from ...editing.waiting import Waiting
from ...translate.palette import load as palette_load
from ...translate.palette import table
from ..common import UNDOABLE, palette_in, reporting

PRESETS = [
    ("METAMER_PAIR", "Metamer Pair", "Two materials that look the same under one lamp and differ under another", 0),
    ("SPLIT_LIGHT", "Split Light", "Five materials that share one, then three, then five colors under three lights", 1),
    ("HIDDEN_MARK", "Hidden Mark", "A mark that daylight hides and a street lamp reveals", 2),
    ("COLOR_CONSTANCY", "Color Constancy", "One material keeps its color when the light changes, another does not", 3),
    ("XRAY_SMOKE", "X-Ray Smoke", "A smoke that is invisible under two lights and visible under a third", 4),
    ("MOST_DISTINCT", "Most Distinct", "Materials that match in daylight and differ the most under a sodium lamp", 5),
]

LAMP_NAMES = {"D65": "Daylight", "HP1": "Sodium", "A": "Tungsten", "FL11": "Fluorescent"}


class Solving(Waiting):
    """Base of operators that change the table and then solve it."""

    can_be_left = True
    stopped_text = "stopped; press Solve to continue"
    result_of = "palette"
    _solve: palette_solve.Solve | None = None
    _is_changed = False
    """True after ``begin`` if the table is another one than before."""

    def change(self, context: Context) -> None:
        """Change the table. May raise SpectralError."""

    def begin(self, context: Context) -> Callable[[], PaletteSolution | str]:
        palette_in(context)  # refuses a linked scene
        self.change(context)
        self._is_changed = type(self).change is not Solving.change
        if not palette_in(context).status:  # another table: the picture shows nothing of the one before
            picture.follow(context.scene)
        solve = palette_solve.button_solve(context.scene, stoppable(self.stopping))
        if solve is None:
            message = palette_in(context).message
            return lambda: message
        self._solve = solve
        return solve.answer

    def end(self, scene: Scene, answer: PaletteSolution | str) -> None:
        solution = None if self._solve is None else palette_solve.keep(scene, self._solve, answer)
        possible.changed(scene)
        live.show()
        if solution is None:
            self.unsolved(scene.spectral.palette.message or "the table has changed since; press Solve again")
        else:
            self.solved(solution)

    def solved(self, solution: PaletteSolution) -> None:
        """Report on the stored solution."""

    def refused(self, error: Exception) -> set[str]:
        found = super().refused(error)
        return {"FINISHED"} if self._is_changed else found  # an undo takes the change of the table back

    def unsolved(self, message: str) -> None:
        """Report that there is no solution. May raise SpectralError."""
        raise InvalidInputError(message)


class SPECTRAL_OT_palette_preset(Solving, bpy.types.Operator):
    """Replace the palette by a preset, and solve it"""

    bl_idname = "spectral.palette_preset"
    bl_label = "Palette Preset"
    bl_options = UNDOABLE
    preset: EnumProperty(name="Preset", items=PRESETS, description="Palette to begin with")

    def change(self, context: Context) -> None:
        from spectral_core.palette import presets

        problem = getattr(presets, self.preset.lower())()
        palette_load.store_problem(palette_in(context), problem)
        _rename_for_artists(palette_in(context))


def _rename_for_artists(palette: PropertyGroup) -> None:
    """Short names for a narrow table; the library names spectra by their construction."""
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
        possible.changed(context.scene)
        picture.follow(context.scene)


class SPECTRAL_OT_palette_solve(Solving, bpy.types.Operator):
    """Find the spectra with the least error over all targets"""

    bl_idname = "spectral.palette_solve"
    bl_label = "Solve"
    bl_options = UNDOABLE

    def solved(self, solution: PaletteSolution) -> None:
        if not solution.status.trusted:
            self.report({"WARNING"}, solution.remedy)


class SPECTRAL_OT_palette_relieve(Solving, bpy.types.Operator):
    """Set this cell to Ignore, and solve again"""

    bl_idname = "spectral.palette_relieve"
    bl_label = "Ignore Cell"
    bl_options = UNDOABLE
    row: IntProperty(min=0)
    column: IntProperty(min=0)

    def change(self, context: Context) -> None:
        palette = palette_in(context)
        cells = dict(table.places(palette))
        if (self.row, self.column) not in cells:
            raise InvalidInputError(f"there is no cell in row {self.row}, column {self.column}")
        with table.paused():
            cells[self.row, self.column].mode = "IGNORE"


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_palette_preset,
        SPECTRAL_OT_palette_clear,
        SPECTRAL_OT_palette_solve,
        SPECTRAL_OT_palette_relieve,
    )
)
