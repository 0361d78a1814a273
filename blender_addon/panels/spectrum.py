# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Spectrum" of materials, lights, worlds and shader nodes."""

from typing import ClassVar

import bpy
from bpy.types import ID, Context, Material, Node, UILayout

from .parts import draw_spectrum, is_editable, wrapped


class _SpectrumPanel:
    layout: UILayout
    """Base of the four panels; ``carrier`` names the type of data-block with the spectrum."""

    bl_label = "Spectrum"
    carrier = ""

    @staticmethod
    def owner(context: Context) -> ID | Node | None:
        """The data-block of the shown spectrum; each panel defines it."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context: Context) -> bool:
        return cls.owner(context) is not None

    def draw(self, context: Context) -> None:
        owner = self.owner(context)
        if owner is None:
            return
        layout = self.layout.column()
        layout.enabled = is_editable(owner.id_data)
        draw_spectrum(layout, context, owner.spectral, self.carrier)
        if self.carrier == "NODE" and owner.spectral.source == "NONE":
            _draw_whose(layout, context, owner)


def _draw_whose(layout: UILayout, context: Context, node: Node) -> None:
    """Draw the source of the spectrum: a node without one shows that of its material, light or world."""
    shown = [getattr(context, name, None) for name in ("material", "light", "world")]
    active = context.object.active_material if context.object else None
    for owner in (*shown, active, context.scene.world):
        tree = None if owner is None else owner.node_tree
        if tree == node.id_data and owner.spectral.source != "NONE":
            hint = layout.column()
            hint.active = False
            text = f"The spectrum of {owner.name!r} sets its main color; one chosen here has precedence."
            wrapped(hint, context, text, icon="INFO")
            return


class _PropertiesPanel(_SpectrumPanel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"


class SPECTRAL_PT_material_spectrum(_PropertiesPanel, bpy.types.Panel):
    """Spectrum of the active material's main color"""

    bl_context = "material"
    carrier = "MATERIAL"

    @staticmethod
    def owner(context: Context) -> ID | Node | None:
        """The material that is shown."""
        return context.material


class _BelowMaterialSpectrum:
    """Base of the panels below the spectrum of the active material."""

    layout: UILayout
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_parent_id = "SPECTRAL_PT_material_spectrum"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.material is not None

    def draw(self, context: Context) -> None:
        material = context.material
        if material is None:
            return
        layout = self.layout.column()
        layout.enabled = is_editable(material)
        self.draw_settings(layout, context, material)

    def draw_settings(self, layout: UILayout, context: Context, material: Material) -> None:
        """Draw the settings of a material; each panel defines it."""
        raise NotImplementedError


def _draw_hint(layout: UILayout, context: Context, text: str) -> None:
    hint = layout.column()
    hint.active = False
    wrapped(hint, context, text)


class SPECTRAL_PT_material_dyes(_BelowMaterialSpectrum, bpy.types.Panel):
    """Fluorescent dyes of the active material"""

    bl_label = "Fluorescence"

    def draw_settings(self, layout: UILayout, context: Context, material: Material) -> None:
        """Draw a box for each dye."""
        for index, dye in enumerate(material.spectral.dyes):
            box = layout.box()
            line = box.row()
            wavelengths = line.column(align=True)
            wavelengths.prop(dye, "excitation_nm")
            wavelengths.prop(dye, "emission_nm")
            line.operator("spectral.material_dye", text="", icon="X").index = index
            box.prop(dye, "amount", slider=True)
        layout.operator("spectral.material_dye", icon="ADD").index = -1
        text = (
            "A dye absorbs light and emits it at a longer wavelength. Visible with spectral transport, most under a "
            "violet or ultraviolet lamp."
        )
        _draw_hint(layout, context, text)


class SPECTRAL_PT_material_dispersion(_BelowMaterialSpectrum, bpy.types.Panel):
    """Dispersion of the active material's glass"""

    bl_label = "Dispersion"

    def draw_settings(self, layout: UILayout, context: Context, material: Material) -> None:
        """Draw the choice, and the number or the name that belongs to it."""
        layout.use_property_split, layout.use_property_decorate = True, False
        dispersion = material.spectral.dispersion
        layout.prop(dispersion, "source")
        if dispersion.source == "ABBE":
            layout.prop(dispersion, "abbe_number")
        elif dispersion.source == "NAMED":
            layout.prop(dispersion, "material")
        if dispersion.source != "NONE":
            text = (
                "Glass, Refraction and Principled with transmission part white light into colors. Visible with "
                "spectral transport; it needs more samples than glass of one index."
            )
            _draw_hint(layout, context, text)


class SPECTRAL_PT_light_spectrum(_PropertiesPanel, bpy.types.Panel):
    """Spectrum of the active light"""

    bl_context = "data"
    carrier = "LIGHT"

    @staticmethod
    def owner(context: Context) -> ID | Node | None:
        """The light that is shown."""
        return context.light


class SPECTRAL_PT_world_spectrum(_PropertiesPanel, bpy.types.Panel):
    """Spectrum of the world's color"""

    bl_context = "world"
    carrier = "WORLD"

    @staticmethod
    def owner(context: Context) -> ID | Node | None:
        """The world that is shown."""
        return context.world


class SPECTRAL_PT_node_spectrum(_SpectrumPanel, bpy.types.Panel):
    """Spectrum of the active shader node's color"""

    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Spectral"
    carrier = "NODE"

    @staticmethod
    def owner(context: Context) -> ID | Node | None:
        """The active node, if it has a color that a spectrum can replace."""
        node = context.active_node
        if not isinstance(node, bpy.types.ShaderNode):
            return None
        sockets = node.outputs if node.bl_idname == "ShaderNodeRGB" else node.inputs
        return node if any(socket.type == "RGBA" for socket in sockets) else None


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_PT_material_spectrum,
        SPECTRAL_PT_material_dyes,
        SPECTRAL_PT_material_dispersion,
        SPECTRAL_PT_light_spectrum,
        SPECTRAL_PT_world_spectrum,
        SPECTRAL_PT_node_spectrum,
    )
)
