# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes from files: written as OpenVDB beside the .blend, the format of Blender's Volume objects."""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)
from bpy.types import Context, Event, Volume
from bpy_extras.io_utils import ImportHelper

from spectral_core.errors import InvalidInputError
from spectral_core.files.whole import make_folder
from spectral_core.volume.files.registry import known_formats

from ..properties.volume import RANGE_KEY
from ..translate.volume_looks import transfer as volume_transfer
from .common import UNDOABLE, chosen_path, reporting
from .volume import PRESETS

if TYPE_CHECKING:
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files.sequence import VolumeSequence

ENDINGS = tuple(ending for known in known_formats() for ending in known.extensions)
OPENED_BY_BLENDER = (".vdb", ".tif", ".tiff", ".hdr")
"""Endings of grids and images that Blender itself opens where a file is dropped into a 3D view."""
MENU_TEXT = f"Volume ({'/'.join(known.extensions[0] for known in known_formats())})"
RAW_TYPES = [
    (name, name, "", number)
    for number, name in enumerate(("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"))
]


class SPECTRAL_OT_volume_import(bpy.types.Operator, ImportHelper):
    """Import a volume with a transfer function"""

    bl_idname = "spectral.volume_import"
    bl_label = "Import Volume"
    bl_description = (
        f"Import a volume ({', '.join(known.description for known in known_formats())}) with a transfer function"
    )
    bl_options = UNDOABLE
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
        return ImportHelper.invoke(self, context, event)

    @reporting
    def execute(self, context: Context) -> None:
        for path in self._paths():
            _add_to_scene(context, *self._import(path), self.size)

    def _paths(self) -> list[Path]:
        named = [Path(self.directory) / file.name for file in self.files if file.name]
        return named or [chosen_path(self.filepath)]

    def _import(self, path: Path) -> "tuple[Volume, ScalarVolume]":
        """A Volume data-block of the file, or of its sequence, and the (first) volume itself."""
        from spectral_core.volume.files import RawLayout, read_volume, sequence_of
        from spectral_core.volume.fill_values import fill_values_note

        options = {"field": self.field or None, "component": None if self.component < 0 else self.component}
        if self.raw:
            order = "big" if self.raw_big_endian else "little"
            options["raw"] = RawLayout(tuple(self.raw_shape), self.raw_type, order, self.raw_offset)
        frames = None
        if self.sequence:
            frames = sequence_of(path, **options)
            if frames is None:
                raise InvalidInputError(
                    f"{path.name} is no frame of a sequence: no other file differs in its number only"
                )
            if frames.missing:
                self.report({"WARNING"}, f"frames {', '.join(map(str, frames.missing[:8]))} have no file")
        first = read_volume(path, **options) if frames is None else frames.read(frames.numbers[0])
        data = bpy.data.volumes.new(first.name)
        try:
            _fill(data, path, first, frames, self._key(), centered=self.size > 0)
            note = fill_values_note(first.data, first.range_without_fill_values)
            if note:
                self.report({"WARNING"}, f"{first.name}: {note}")
            _choose_preset(data, first, self.preset)
        except Exception:
            bpy.data.volumes.remove(data)
            raise
        return data, first

    def _key(self) -> str:
        raw = (*self.raw_shape, self.raw_type, self.raw_big_endian, self.raw_offset) if self.raw else ()
        return f"{self.field} {self.component} {raw}"


def _fill(
    data: Volume, path: Path, first: "ScalarVolume", frames: "VolumeSequence | None", key: str, *, centered: bool
) -> None:
    """Write the OpenVDB files of a data-block and point it to them; ``centered``: the object's origin is its middle."""
    from spectral_core.volume.files import write_volume

    low, high = first.range_without_fill_values
    whole_low, whole_high = first.value_range
    shift = -first.corners_world.mean(axis=0) if centered else np.zeros(3)
    stem = _stem(path if frames is None else Path(frames.pattern), f"{key} {centered}")
    if frames is None:
        target = folder_for_volumes() / f"{stem}.vdb"
        write_volume(_moved(first, shift), target)
    else:
        # Consecutive numbers, because Blender counts frames from the first file's.
        for place, number in enumerate(frames.numbers, 1):
            volume = frames.read(number)
            own = volume.range_without_fill_values
            low, high = min(low, own[0]), max(high, own[1])
            whole_low, whole_high = min(whole_low, volume.value_range[0]), max(whole_high, volume.value_range[1])
            write_volume(_moved(volume, shift), folder_for_volumes() / f"{stem}_{place:04d}.vdb")
        target = folder_for_volumes() / f"{stem}_0001.vdb"
        data.is_sequence, data.frame_start, data.frame_duration = True, 1, len(frames)
    data.filepath = bpy.path.relpath(str(target)) if bpy.data.filepath else str(target)
    data[RANGE_KEY] = [low, high]
    settings = data.spectral
    settings.source = str(path)
    settings.facts = (
        f"{' × '.join(map(str, first.shape))} voxels of {first.data.dtype}, {whole_low:g} to {whole_high:g}"
    )
    # The viewport shows the data as smoke: nearly opaque over its whole depth.
    voxel = float(np.prod(first.voxel_size) ** (1 / 3))
    data.display.density = 20.0 / max(abs(high), abs(low), 1e-9) / (max(first.shape) * voxel)


def _moved(volume: Volume, shift: np.ndarray) -> "ScalarVolume":
    """The same volume at another position."""
    from spectral_core.volume.field import ScalarVolume

    matrix = volume.world_from_index.copy()
    matrix[:3, 3] += shift
    return ScalarVolume(volume.name, volume.data, matrix)


def _choose_preset(data: Volume, volume: Volume, name: str) -> None:
    from spectral_core.volume.documents.transfer_document import stated_in_fractions
    from spectral_core.volume.presets import preset

    stated = stated_in_fractions(preset(name, volume), volume, volume_transfer.value_range(data))
    volume_transfer.store_transfer(data, stated)


def _add_to_scene(context: Context, data: Volume, volume: Volume, size: float) -> None:
    """Add an object of the data at the cursor; its longest side has the length ``size``."""
    shown = bpy.data.objects.new(data.name, data)
    if size:
        shown.scale = (size / float(np.ptp(volume.corners_world, axis=0).max()),) * 3
        shown.location = context.scene.cursor.location
    context.collection.objects.link(shown)
    for other in context.selected_objects:
        other.select_set(False)
    shown.select_set(True)
    context.view_layer.objects.active = shown


def _stem(path: Path, key: str) -> str:
    """A file name that identifies the source and its version, so that no other volume's file is overwritten."""
    try:
        state = f"{path.stat().st_mtime_ns} {path.stat().st_size}"
    except OSError:  # a pattern
        state = ""
    plain = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in path.name.split(".")[0])
    mark = hashlib.sha256(f"{path.resolve()} {state} {key}".encode()).hexdigest()[:8]
    return f"{plain.strip('_') or 'volume'}_{mark}"


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
