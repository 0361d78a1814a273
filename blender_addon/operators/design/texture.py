# SPDX-License-Identifier: GPL-3.0-or-later
"""Design a spectral texture in the background, use it on an object, give its lights to lamps."""

from pathlib import Path

import bpy
from bpy.props import IntProperty
from bpy.types import Context, Object

from spectral_core.errors import InvalidInputError, counted
from spectral_core.files.guarded import is_file

from ... import compat
from ...editing import texture_job
from ...properties.texture import NODE
from ...translate.spectra.stored import require_editable, store_spectrum
from ..common import UNDOABLE, add_or_remove, reporting, require_kept


class SPECTRAL_OT_texture_design(bpy.types.Operator):
    """Find the reflectance of every texel in the background; Blender stays responsive"""

    bl_idname = "spectral.texture_design"
    bl_label = "Design Texture"
    bl_options: set[str] = set()

    @reporting
    def execute(self, context: Context) -> None:
        require_kept(context.scene, "texture")
        texture_job.start(context.scene)
        if bpy.app.background:
            texture_job.wait()
            return
        texture_job.watch()


class SPECTRAL_OT_texture_cancel(bpy.types.Operator):
    """Stop the design and keep the earlier texture"""

    bl_idname = "spectral.texture_cancel"
    bl_label = "Cancel Texture"
    bl_options: set[str] = set()

    @reporting
    def execute(self, _context: Context) -> None:
        texture_job.cancel()


class SPECTRAL_OT_texture_wanted_color(bpy.types.Operator):
    """Add or remove a color of the picture that should look different under the second light"""

    bl_idname = "spectral.texture_wanted_color"
    bl_label = "Add Wanted Color"
    bl_options = UNDOABLE
    index: IntProperty(name="Remove", default=-1, description="The row to remove; -1 adds one")

    @reporting
    def execute(self, context: Context) -> None:
        require_kept(context.scene, "texture")
        add_or_remove(context.scene.spectral.texture.wanted_colors, self.index, "wanted color")


class SPECTRAL_OT_texture_material(bpy.types.Operator):
    """Make a material with the designed texture, and assign it to the selected object"""

    bl_idname = "spectral.texture_material"
    bl_label = "Make Material"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        path, target = _designed(context), context.object
        if target is not None and target.type == "MESH":
            _require_slot(target)
        material = bpy.data.materials.new("Spectral Texture")
        tree = compat.use_nodes(material)
        tree.nodes.clear()
        end, shader = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfDiffuse")
        node = tree.nodes.new(NODE)
        node.location, shader.location = (-400, 0), (-180, 0)
        node.filepath, node.extension = path, "EXTEND"
        if node.message:
            self.report({"WARNING"}, node.message)
        tree.links.new(node.outputs[0], shader.inputs["Color"])
        tree.links.new(shader.outputs[0], end.inputs["Surface"])
        if target is None or target.type != "MESH":
            self.report({"INFO"}, f"made material {material.name!r}; no mesh is selected that could use it")
            return
        if not len(target.data.uv_layers):
            self.report({"WARNING"}, f"{target.name!r} has no UV map, so the texture cannot be applied; unwrap it")
        if target.material_slots:
            slot = target.material_slots[target.active_material_index]
            slot.link = slot.link if compat.is_editable(target.data) else "OBJECT"
            slot.material = material
        else:
            target.data.materials.append(material)


class SPECTRAL_OT_texture_lights(bpy.types.Operator):
    """Assign the spectra of both lights to the chosen lamps"""

    bl_idname = "spectral.texture_lights"
    bl_label = "Give Lights to Lamps"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.spectra.files import read_spectra

        design = context.scene.spectral.texture
        spectra = read_spectra(Path(_designed(context)).with_name("lights.csv"), kind="illuminant")
        lamps = [design.lamp_1, design.lamp_2]
        if not any(lamps):
            raise InvalidInputError("no lamp is chosen; choose the lamps that get the first and the second light")
        for lamp in filter(None, lamps):
            require_editable(lamp)  # before anything is written
        for lamp, spectrum in zip(lamps, spectra, strict=True):
            if lamp is not None:
                store_spectrum(lamp.spectral, spectrum)
        self.report(
            {"INFO"},
            f"{counted(sum(lamp is not None for lamp in lamps), 'lamp has its light', 'lamps have their light')}",
        )


def _require_slot(target: Object) -> None:
    """Raise InvalidInputError if an object cannot get a material: Blender loses a change of linked data."""
    for block in (target, *([] if target.material_slots else [target.data])):
        if block.library is not None:
            raise InvalidInputError(
                f"{block.name!r} is linked from {bpy.path.basename(block.library.filepath)} and cannot get the "
                "material; make it local, or select another object"
            )


def _designed(context: Context) -> str:
    scene = context.scene
    path = bpy.path.abspath(scene.spectral.texture.texture_file, library=scene.library)
    if not path or not is_file(path):
        raise InvalidInputError("no texture is designed yet; press Design Texture first")
    return path


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_texture_design,
        SPECTRAL_OT_texture_cancel,
        SPECTRAL_OT_texture_wanted_color,
        SPECTRAL_OT_texture_material,
        SPECTRAL_OT_texture_lights,
    )
)
