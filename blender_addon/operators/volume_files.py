# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes from files: written as OpenVDB beside the .blend, the format of Blender's Volume objects."""

from collections.abc import Callable
from pathlib import Path

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)
from bpy.types import Context, Event, Scene
from bpy_extras.io_utils import ImportHelper

from spectral_core.files.whole import make_folder
from spectral_core.volume.files.registry import known_formats

from ..editing.volume.importing import Import, Imported
from ..editing.waiting import WaitingForFile
from .common import UNDOABLE, chosen_path, require_kept
from .volume import PRESETS

ENDINGS = tuple(ending for known in known_formats() for ending in known.extensions)
OPENED_BY_BLENDER = (".vdb", ".tif", ".tiff", ".hdr")
"""Endings of grids and images that Blender itself opens where a file is dropped into a 3D view."""
MENU_TEXT = f"Volume ({'/'.join(known.extensions[0] for known in known_formats())})"
RAW_TYPES = [
    (name, name, "", number)
    for number, name in enumerate(("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"))
]


class SPECTRAL_OT_volume_import(WaitingForFile, bpy.types.Operator, ImportHelper):
    """Import a volume with a transfer function"""

    bl_idname = "spectral.volume_import"
    bl_label = "Import Volume"
    bl_description = (
        f"Import a volume ({', '.join(known.description for known in known_formats())}) with a transfer function"
    )
    bl_options = UNDOABLE
    can_be_left = True
    stopped_text = "stopped; nothing was imported"
    _work: Import | None = None
    filter_glob: StringProperty(default=";".join(f"*{ending}" for ending in ENDINGS), options={"HIDDEN"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    preset: EnumProperty(
        name="Transfer Function", items=PRESETS, default="wide", description="Transfer function to begin with"
    )
    size: FloatProperty(
        name="Size", default=2.0, min=0.0, soft_max=10.0, unit="LENGTH",
        description="Longest side of the volume in the scene; 0 keeps the file's own units",
    )  # fmt: skip
    sequence: BoolProperty(
        name="Sequence",
        default=False,
        description="Import all files that differ from this one in their number, as frames",
    )
    field: StringProperty(name="Array", description="Array, grid or key, if the file has several")
    component: IntProperty(
        name="Component",
        default=-1,
        min=-1,
        description="Vector component, channel or time step; -1 if there is only one",
    )
    raw: BoolProperty(name="Bare Numbers", default=False, description="The file has no header: state its layout")
    raw_shape: IntVectorProperty(
        name="Voxels", size=3, default=(256, 256, 256), min=1, description="Number of voxels along x, y and z"
    )
    raw_type: EnumProperty(name="Type", items=RAW_TYPES, default="uint8", description="Type of each number")
    raw_big_endian: BoolProperty(
        name="Big Endian", default=False, description="The most significant byte of each number comes first"
    )
    raw_offset: IntProperty(
        name="Offset", default=0, min=-1, description="Bytes before the data; -1 if the data end the file"
    )

    def draw(self, _context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for name in ("preset", "size", "sequence", "field", "component", "raw"):
            layout.prop(self, name)
        if self.raw:
            box = layout.box()
            for name in ("raw_shape", "raw_type", "raw_big_endian", "raw_offset"):
                box.prop(self, name)

    def invoke(self, context: Context, event: Event) -> set[str]:
        if self.directory and self.files:  # dropped onto the window: the files are already chosen
            return context.window_manager.invoke_props_dialog(self)
        return super().invoke(context, event)

    def begin(self, context: Context) -> Callable[[], list[Imported]]:
        require_kept(context.scene, "objects")
        options = {"field": self.field or None, "component": None if self.component < 0 else self.component}
        if self.raw:
            from spectral_core.volume.files import RawLayout

            order = "big" if self.raw_big_endian else "little"
            options["raw"] = RawLayout(tuple(self.raw_shape), self.raw_type, order, self.raw_offset)
        self._work = Import(
            self._paths(), options, self._key(), folder_for_volumes(), self.preset, self.sequence,
            centered=self.size > 0, stopping=self.stopping,
        )  # fmt: skip
        return self._work.read

    def end(self, scene: Scene, answer: list[Imported]) -> None:
        for imported in answer:
            for text in imported.warnings:
                self.report({"WARNING"}, text)
            imported.add_to(bpy.context, scene, self.size)

    def progress_text(self) -> str:
        return "" if self._work is None else self._work.progress

    def _paths(self) -> list[Path]:
        named = [Path(self.directory) / file.name for file in self.files if file.name]
        return named or [chosen_path(self.filepath)]

    def _key(self) -> str:
        raw = (*self.raw_shape, self.raw_type, self.raw_big_endian, self.raw_offset) if self.raw else ()
        return f"{self.field} {self.component} {raw}"


def folder_for_volumes() -> Path:
    """Folder beside the .blend; for a file that was never saved, the extension's own folder, which persists after the
    session.
    """
    if bpy.data.filepath:
        return make_folder(Path(bpy.data.filepath).parent / "volumes")
    package = __package__.rpartition(".")[0]
    try:
        return Path(bpy.utils.extension_path_user(package, path="volumes", create=True))
    except ValueError:  # run from its source, not installed as an extension
        return make_folder(Path(bpy.utils.user_resource("DATAFILES", path="spectral_scene", create=True)) / "volumes")


class SPECTRAL_FH_volume(bpy.types.FileHandler):
    """Volume files may be dropped into the 3D view"""

    bl_idname = "SPECTRAL_FH_volume"
    bl_label = "Volume"
    bl_import_operator = "spectral.volume_import"
    # Blender compares the last ending of a name alone, so not .nii.gz
    bl_file_extensions = ";".join(each for each in ENDINGS if each not in OPENED_BY_BLENDER and each.count(".") == 1)

    @classmethod
    def poll_drop(cls, context: Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


def _import_entry(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator("spectral.volume_import", text=MENU_TEXT)


MENUS = ("TOPBAR_MT_file_import", "VIEW3D_MT_volume_add")
_register, _unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_volume_import, SPECTRAL_FH_volume))


def register() -> None:
    """Register the importer and its menu entries."""
    _register()
    for name in MENUS:
        getattr(bpy.types, name).append(_import_entry)


def unregister() -> None:
    """Remove them."""
    for name in MENUS:
        getattr(bpy.types, name).remove(_import_entry)
    _unregister()
