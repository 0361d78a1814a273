# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes, spectra and swatches to and from files."""

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Context, Operator, PropertyGroup
from bpy_extras.io_utils import ExportHelper, ImportHelper

from spectral_core.errors import InvalidInputError, counted, first_of

from ... import compat
from ...editing.palette import solve as palette_solve
from ...editing.waiting import WaitingForFile
from ...translate.palette import load as palette_load
from ...translate.palette.problem import palette_problem
from ...translate.spectra.stored import carried_spectrum
from ..common import UNDOABLE, chosen_path, palette_in, palette_shown, reporting
from .solve import Solving


class SPECTRAL_OT_palette_import(Solving, WaitingForFile, bpy.types.Operator, ImportHelper):
    """Replace the palette by one from a TOML or JSON file, and solve it"""

    bl_idname = "spectral.palette_import"
    bl_label = "Import Palette"
    bl_options = UNDOABLE
    filename_ext = ".toml"
    filter_glob: StringProperty(default="*.toml;*.json", options={"HIDDEN"})

    def change(self, context: Context) -> None:
        from spectral_core.palette.files import read_palette

        for note in palette_load.store_problem(palette_in(context), read_palette(chosen_path(self.filepath))):
            self.report({"WARNING"}, note)

    def unsolved(self, message: str) -> None:
        self.report({"WARNING"}, message)  # the table is there, and can be mended


class SPECTRAL_OT_palette_export(bpy.types.Operator, ExportHelper):
    """Write the palette's targets and settings as TOML or JSON"""

    bl_idname = "spectral.palette_export"
    bl_label = "Export Palette"
    filename_ext = ".toml"
    filter_glob: StringProperty(default="*.toml;*.json", options={"HIDDEN"})
    check_extension = None

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.palette.files import write_palette

        palette = palette_shown(context)
        write_palette(chosen_path(self.filepath), palette_problem(palette), comment=f"Scene {context.scene.name}")
        _tell_left_out(self, "palette files", [*_dyes(palette), *(["Match as Tints"] if palette.use_tints else [])])


def _dyes(palette: PropertyGroup) -> list[str]:
    dyed = [material.name for material in palette.materials if len(material.dyes)]
    return [f"the fluorescent dyes of {', '.join(dyed)}"] if dyed else []


def _tell_left_out(operator: Operator, files: str, left: list[str]) -> None:
    if left:
        operator.report({"WARNING"}, f"{files} cannot hold {' and '.join(left)}; what was written is without them")


FORMATS = [
    ("csv", "CSV", "All spectra in one table", 0),
    ("spdx", "SPDX", "IES TM-27-14, one file for each spectrum", 1),
    ("spd", "SPD", "For Mitsuba, one file for each spectrum", 2),
]


ENDINGS = tuple(f".{name}" for name, *_ in FORMATS)


def _solved(operator: Operator, context: Context) -> PropertyGroup:
    """The palette with its last solution, with a warning if it has changed since then."""
    palette = palette_shown(context)
    if palette.is_stale and palette.live and compat.is_editable(context.scene):
        palette_solve.solve_scene(context.scene)  # an edit whose timer has not yet run
    if not palette.status:
        raise InvalidInputError("the palette is not solved yet; press Solve first")
    if palette.is_stale:
        operator.report({"WARNING"}, "the palette has changed since it was solved; the last solution was written")
    return palette


class SPECTRAL_OT_spectra_export(bpy.types.Operator, ExportHelper):
    """Write the spectra of the solved palette: one CSV, or one SPDX or SPD file for each"""

    bl_idname = "spectral.spectra_export"
    bl_label = "Export Spectra"
    filename_ext = ""
    check_extension = None
    file_format: EnumProperty(name="Format", items=FORMATS, description="Format of the files")

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.files.names import file_words
        from spectral_core.spectra.files import write_spectra

        palette = _solved(self, context)
        spectra = [carried_spectrum(entry, "result") for entry in (*palette.lights, *palette.materials)]
        path = chosen_path(self.filepath)
        stem = path.stem if path.suffix.lower() in ENDINGS else path.name
        path = path.with_name(f"{stem}.{self.file_format}")
        if self.file_format == "csv":
            write_spectra(path, spectra)
        else:
            for spectrum, name in zip(spectra, file_words([spectrum.name for spectrum in spectra]), strict=True):
                write_spectra(path.with_name(f"{stem}_{name}{path.suffix}"), [spectrum])
            self.report({"INFO"}, f"{counted(len(spectra), 'file')} written beside {path.name}")
        _tell_left_out(self, "files of spectra", _dyes(palette))


class SPECTRAL_OT_swatches_export(bpy.types.Operator, ExportHelper):
    """Write the colors of the table for painting programs: Adobe Swatch Exchange or GIMP palette"""

    bl_idname = "spectral.swatches_export"
    bl_label = "Export Swatches"
    filename_ext = ".ase"
    filter_glob: StringProperty(default="*.ase;*.gpl", options={"HIDDEN"})
    check_extension = None
    clip: BoolProperty(
        name="Clip to Gamut",
        default=True,
        description="Cut the channels of colors that screens cannot show, as the table and the Standard view do. "
        "Hues may change",
    )

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.palette.files import Swatch, write_swatches

        palette = _solved(self, context)
        swatches = [
            Swatch(material.name, np.array(material.cells[column].actual_linear), light.name)
            for column, light in enumerate(palette.lights)
            for material in palette.materials
        ]
        moved = write_swatches(chosen_path(self.filepath), swatches, clip=self.clip)
        if moved:
            self.report(
                {"WARNING"},
                f"colors outside the gamut were clipped, which may change hues: {first_of(moved, len(moved), 4)}",
            )


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_palette_import,
        SPECTRAL_OT_palette_export,
        SPECTRAL_OT_spectra_export,
        SPECTRAL_OT_swatches_export,
    )
)
