# SPDX-License-Identifier: GPL-3.0-or-later
"""The transfer function of the active Volume: presets, files, materials, colors from the palette."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Event, PropertyGroup, Scene, Volume
from bpy_extras.io_utils import ExportHelper, ImportHelper

from spectral_core.errors import InvalidInputError

from ..editing.volume.frames import frames_of, range_of
from ..editing.waiting import Waiting, WaitingForFile
from ..properties.volume import RANGE_KEY
from ..translate.palette.apply import store_result
from ..translate.spectra.stored import require_editable
from ..translate.volume_looks import curves as stored
from ..translate.volume_looks import transfer as volume_transfer
from .common import UNDOABLE, chosen_path, palette_shown, reporting

if TYPE_CHECKING:
    from spectral_core.volume.documents.transfer_document import TransferDocument
    from spectral_core.volume.field import ScalarVolume

PRESETS = [
    ("wide", "Wide", "Three overlapping, mostly transparent materials over the whole range", 0),
    ("narrow", "Shells", "Two isosurface-like shells", 1),
    ("opaque", "Solid", "Two solid materials: both nearly opaque", 2),
    ("xray", "Radiograph", "Light in proportion to the value, none removed", 3),
    ("edges", "Edges", "Only where the value changes quickly", 4),
]


def volume_in(context: Context) -> Volume | None:
    """The active Volume data-block, None without one."""
    shown = getattr(context, "volume", None)
    if shown is not None:
        return shown
    active = context.object
    return active.data if active is not None and active.type == "VOLUME" else None


def shown_volume(context: Context) -> Volume:
    """The active Volume data-block. Raises InvalidInputError without one."""
    found = volume_in(context)
    if found is None:
        raise InvalidInputError("there is no active Volume object; select one")
    return found


def _reading(context: Context, data: Volume) -> "Callable[[], ScalarVolume]":
    """Reads the data at the present frame; only an evaluated copy has it, which may be made by the nodes of the
    object.
    """
    from ..translate.volumes import SavedGrids, is_made, reading_of

    depsgraph, active = context.evaluated_depsgraph_get(), context.object
    owner = active.evaluated_get(depsgraph) if active is not None and active.data == data else None
    evaluated = data.evaluated_get(depsgraph) if owner is None else owner.data
    saved = SavedGrids(evaluated) if is_made(evaluated, owner) else None
    return reading_of(evaluated, saved, data.spectral.grid)


def _editable_volume(context: Context) -> Volume:
    """The active Volume data-block. Raises InvalidInputError without one, or if it is linked."""
    found = shown_volume(context)
    require_editable(found)
    return found


def _active_material(context: Context) -> PropertyGroup:
    settings = _editable_volume(context).spectral
    if not len(settings.materials):
        raise InvalidInputError("the volume has no material; add one first")
    return settings.materials[min(settings.active, len(settings.materials) - 1)]


class _OnVolume:
    bl_options = UNDOABLE

    @classmethod
    def poll(cls, context: Context) -> bool:
        if volume_in(context) is not None:
            return True
        cls.poll_message_set("select a Volume object first")  # type: ignore[attr-defined]
        return False


@dataclass(frozen=True)
class _Fitted:
    """A transfer function in fractions, and the range of the frames of a sequence that they refer to from now on."""

    look: "TransferDocument"
    ends: tuple[float, float] | None = None


class _Fitting(_OnVolume):
    """Base of operators that read the voxels of the active volume, and then store a transfer function in it."""

    can_be_left = True
    stopping: threading.Event
    _uid = 0

    def remember(self, context: Context) -> Volume:
        """The active Volume data-block, which gets the transfer function. Raises InvalidInputError."""
        data = _editable_volume(context)
        self._uid = data.session_uid
        return data

    def fitting(
        self, context: Context, fit: "Callable[[ScalarVolume, tuple[float, float] | None], TransferDocument]"
    ) -> Callable[[], _Fitted]:
        """Work that reads the voxels, those of all frames of a sequence of Blender's own, and fits a function to them.

        ``fit`` takes the voxels, and the range that fractions refer to or None.
        """
        data = self.remember(context)
        frames, stopping = frames_of(data), self.stopping
        if frames is None:
            read, known = _reading(context, data), volume_transfer.value_range(data)
            return lambda: _Fitted(fit(read(), known))

        def work() -> _Fitted:
            found = range_of(frames, stopping)
            if found is None:
                raise InvalidInputError(f"none of the {len(frames)} files {frames.pattern} can be read")
            return _Fitted(fit(found.widest, found.ends), found.ends)

        return work

    def end(self, _scene: Scene, answer: _Fitted) -> None:
        data = next((each for each in bpy.data.volumes if each.session_uid == self._uid), None)
        if data is None:
            raise InvalidInputError(
                "the volume was deleted while its voxels were read, so no transfer function is stored"
            )
        volume_transfer.store_transfer(data, answer.look)
        if answer.ends is not None:
            data[RANGE_KEY] = list(answer.ends)


class SPECTRAL_OT_transfer_preset(_Fitting, Waiting, bpy.types.Operator):
    """Replace the transfer function by a ready-made one that fits the data"""

    bl_idname = "spectral.transfer_preset"
    bl_label = "Transfer Function Preset"
    preset: EnumProperty(name="Preset", items=PRESETS, description="Transfer function to begin with")

    def begin(self, context: Context) -> Callable[[], _Fitted]:
        from spectral_core.volume.documents.transfer_document import stated_in_fractions
        from spectral_core.volume.presets import preset

        name = self.preset
        return self.fitting(context, lambda voxels, known: stated_in_fractions(preset(name, voxels), voxels, known))


class SPECTRAL_OT_transfer_import(_Fitting, WaitingForFile, bpy.types.Operator, ImportHelper):
    """Replace the transfer function by one from a TOML or JSON file"""

    bl_idname = "spectral.transfer_import"
    bl_label = "Import Transfer Function"
    filename_ext = ".toml"
    filter_glob: StringProperty(default="*.toml;*.json", options={"HIDDEN"})

    def begin(self, context: Context) -> Callable[[], _Fitted]:
        from spectral_core.volume.documents.transfer_document import stated_in_fractions
        from spectral_core.volume.documents.transfer_file import read_transfer

        data, stated = self.remember(context), read_transfer(chosen_path(self.filepath))
        is_stated = (stated.values, stated.length) == ("fraction", "voxel")
        if is_stated and frames_of(data) is None:
            return lambda: _Fitted(stated)

        def fit(voxels: "ScalarVolume", known: tuple[float, float] | None) -> "TransferDocument":
            return stated if is_stated else stated_in_fractions(stated.for_volume(voxels, known), voxels, known)

        return self.fitting(context, fit)


class SPECTRAL_OT_transfer_export(_OnVolume, bpy.types.Operator, ExportHelper):
    """Write the transfer function as TOML or JSON, for other volumes and for the command line"""

    bl_idname = "spectral.transfer_export"
    bl_label = "Export Transfer Function"
    bl_options: set[str] = set()
    filename_ext = ".toml"
    filter_glob: StringProperty(default="*.toml;*.json", options={"HIDDEN"})
    check_extension = None

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.volume.documents.transfer_file import write_transfer

        write_transfer(chosen_path(self.filepath), volume_transfer.stated_transfer(shown_volume(context)))


class SPECTRAL_OT_volume_material_add(_OnVolume, bpy.types.Operator):
    """Add a material to the transfer function"""

    bl_idname = "spectral.volume_material_add"
    bl_label = "Add Material"

    @reporting
    def execute(self, context: Context) -> None:
        data = _editable_volume(context)
        stored.add_material(data, "Material")
        data.spectral.enabled = True


class SPECTRAL_OT_volume_material_remove(_OnVolume, bpy.types.Operator):
    """Remove the selected material from the transfer function"""

    bl_idname = "spectral.volume_material_remove"
    bl_label = "Remove Material"

    @reporting
    def execute(self, context: Context) -> None:
        _active_material(context)
        data = shown_volume(context)
        stored.remove_material(data, min(data.spectral.active, len(data.spectral.materials) - 1))


class SPECTRAL_OT_volume_curve_add(_OnVolume, bpy.types.Operator):
    """Give the selected material a separate curve for its emission or its edges, or a new one for its density"""

    bl_idname = "spectral.volume_curve_add"
    bl_label = "Add Curve"
    which: EnumProperty(
        name="Curve",
        description="Curve that is added",
        items=[
            ("emission", "Emission", "Over the data", 0),
            ("gradient", "Edges", "Over their change", 1),
            ("density", "Density", "Over the data", 2),
        ],
    )

    @reporting
    def execute(self, context: Context) -> None:
        stored.set_curve(shown_volume(context), _active_material(context), self.which, [0.0, 1.0], [0.0, 1.0])


def _palette_names(self: bpy.types.Operator, context: Context, typed: str) -> list[str]:
    return [entry.name for entry in palette_shown(context).materials if typed.lower() in entry.name.lower()]


class SPECTRAL_OT_volume_color_from_palette(_OnVolume, bpy.types.Operator):
    """Take the spectrum that the palette designed for one of its materials"""

    bl_idname = "spectral.volume_color_from_palette"
    bl_label = "Take from Palette"
    entry: StringProperty(name="Name", search=_palette_names, description="Material of the palette")

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context: Context) -> None:
        entries = {entry.name: entry for entry in palette_shown(context).materials}
        if self.entry not in entries:
            known = ", ".join(entries) or "none"
            raise InvalidInputError(f"the palette has no material named {self.entry!r}; it has: {known}")
        store_result(_active_material(context), entries[self.entry])


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_transfer_preset,
        SPECTRAL_OT_transfer_import,
        SPECTRAL_OT_transfer_export,
        SPECTRAL_OT_volume_material_add,
        SPECTRAL_OT_volume_material_remove,
        SPECTRAL_OT_volume_curve_add,
        SPECTRAL_OT_volume_color_from_palette,
    )
)
