# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Spectral Volume" of Volume objects: materials with their curves and colors, steps and quality."""

from functools import lru_cache

import bpy
import numpy as np
from bpy.types import ID, Context, PropertyGroup, Scene, UILayout, Volume

from spectral_core.errors import SpectralError
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ, display_rgb_from_linear, linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

from ..drawing.icons import swatch_icon
from ..operators.volume import shown_volume, volume_in
from ..translate.spectra.stored import spectrum_of
from ..translate.volume_looks.curves import curve_node
from ..translate.volume_looks.transfer import curve_ends
from .parts import draw_curve, draw_source, draw_swatches, is_editable, takes_from_palette, wrapped

LIGHT_GRID = SpectralGrid.uniform(380.0, 780.0, 5.0)
TITLE_SHARE = 0.66
"""Share of the width that the title of a curve has: all of it in a properties editor of Blender's own width."""


def scene_light(scene: Scene) -> Illuminant:
    """The total spectrum of the scene's lights, by their power; daylight if none has a spectrum.

    A light that the eye does not see, such as an infrared one, and a light of negative power add nothing: alone, such
    lights have no color.
    """
    together: np.ndarray = np.zeros(LIGHT_GRID.size)
    for each in scene.objects:
        if each.type != "LIGHT" or each.hide_render or each.data.energy <= 0:
            continue
        try:
            spectrum = spectrum_of(each.data)
            shape = _daylight() if spectrum is None else _shape(_as_light(spectrum))
        except SpectralError:
            continue  # the panel of that light shows the error
        together += each.data.energy * shape
    return Illuminant("scene", LIGHT_GRID, together if together.any() else _daylight())


def _as_light(spectrum: Spectrum) -> Illuminant:
    return Illuminant(spectrum.name, spectrum.grid, spectrum.values)


def _shape(light: Illuminant) -> np.ndarray:
    return normalized(light).resampled(LIGHT_GRID, average=True).values


@lru_cache(maxsize=1)
def _daylight() -> np.ndarray:
    return _shape(catalogue.illuminant("D65"))


def swatch_of(entry: PropertyGroup, light: Illuminant) -> np.ndarray:
    """sRGB (3,) of a volume's material under a light, or of its own emission."""
    try:
        spectrum = spectrum_of(entry)
    except SpectralError:
        spectrum = None
    shown = normalized(light) if entry.lit else normalized(catalogue.illuminant("D65"))
    if spectrum is None:
        daylight = normalized(catalogue.illuminant("D65"))
        tint = (RGB_FROM_XYZ @ xyz_of(shown)) / (RGB_FROM_XYZ @ xyz_of(daylight))
        linear: np.ndarray = np.array(entry.color) * tint
    else:
        linear = linear_rgb_from_xyz(xyz_of(shown, spectrum))
    return np.clip(display_rgb_from_linear(linear), 0.0, 1.0)


class SPECTRAL_UL_volume_materials(bpy.types.UIList):
    """Materials with their color under the scene's lights"""

    light = Illuminant("daylight", LIGHT_GRID, np.ones(LIGHT_GRID.size))
    """The scene's light, computed once per draw of the panel instead of once per row."""

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        _data: ID,
        item: PropertyGroup,
        _icon: int,
        _active_data: ID,
        _active_name: str,
    ) -> None:
        row = layout.row(align=True)
        row.label(text="", icon_value=swatch_icon(swatch_of(item, self.light)))
        row.prop(item, "name", text="", emboss=False)
        row.prop(item, "density", text="", emboss=False)
        row.label(text="", icon="LIGHT_SUN" if item.lit else "OUTLINER_OB_LIGHT")


class _VolumePanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return volume_in(context) is not None


class SPECTRAL_PT_volume(_VolumePanel, bpy.types.Panel):
    """The transfer function of a volume"""

    bl_label = "Spectral Volume"

    def draw_header(self, context: Context) -> None:
        self.layout.prop(shown_volume(context).spectral, "enabled", text="")

    def draw(self, context: Context) -> None:
        data = shown_volume(context)
        settings, layout = data.spectral, self.layout
        layout.enabled = is_editable(data)
        layout.active = settings.enabled
        if settings.facts:
            wrapped(layout, context, settings.facts, icon="VOLUME_DATA")
        row = layout.row(align=True)
        row.operator_menu_enum("spectral.transfer_preset", "preset", text="Preset")
        row.operator("spectral.transfer_import", text="", icon="IMPORT")
        row.operator("spectral.transfer_export", text="", icon="EXPORT")
        SPECTRAL_UL_volume_materials.light = light = scene_light(context.scene)
        heading = layout.row()
        heading.active = False
        heading.label(text="Material")
        heading.label(text="Density per voxel")
        row = layout.row()
        row.template_list("SPECTRAL_UL_volume_materials", "", settings, "materials", settings, "active", rows=3)
        side = row.column(align=True)
        side.operator("spectral.volume_material_add", text="", icon="ADD")
        side.operator("spectral.volume_material_remove", text="", icon="REMOVE")
        if not len(settings.materials):
            wrapped(layout, context, "Choose a preset, or add a material and draw at which data values it shows.")
            return
        active = settings.materials[min(settings.active, len(settings.materials) - 1)]
        _draw_color(layout, context, active, light)
        _draw_curves(layout, data, active)


def _draw_color(layout: UILayout, context: Context, entry: PropertyGroup, light: Illuminant) -> None:
    """The appearance of a material."""
    draw_source(layout, entry.spectral)
    if takes_from_palette(context, entry.spectral):
        layout.operator("spectral.volume_color_from_palette", icon="MOD_SIMPLIFY")
    if entry.spectral.message:
        message = layout.column()
        message.alert = True
        wrapped(message, context, entry.spectral.message, icon="ERROR")
    if entry.spectral.source == "NONE":
        layout.prop(entry, "color", text="")
        draw_swatches(layout, (("In the scene's light" if entry.lit else "Its own light", swatch_of(entry, light)),))
    elif len(entry.spectral.samples):
        draw_curve(layout, context, entry.spectral)
    layout.prop(entry, "lit")


def _draw_curves(layout: UILayout, data: Volume, entry: PropertyGroup) -> None:
    """The data values at which a material shows."""
    _draw_curve_of(layout, data, entry, "density", "Density over the data", strength="density")
    _draw_curve_of(layout, data, entry, "emission", "Emission over the data", strength="emission")
    layout.prop(entry, "use_gradient")
    if entry.use_gradient:
        _draw_curve_of(layout, data, entry, "gradient", "Weight over the change", strength="gradient")


def _draw_curve_of(
    layout: UILayout, data: Volume, entry: PropertyGroup, which: str, title: str, *, strength: str
) -> None:
    box = layout.box()
    row = box.split(factor=TITLE_SHARE)
    row.label(text=title)
    row.prop(entry, strength, text="")
    node = curve_node(data, entry, which)
    if node is not None:
        box.template_curve_mapping(node, "mapping", type="NONE")
        _draw_ends(box, data, which)
    elif which != "emission" or entry.emission > 0:
        box.operator("spectral.volume_curve_add", text="Draw its Curve", icon="FCURVE").which = which


def _draw_ends(box: UILayout, data: Volume, which: str) -> None:
    """Draw the values at both ends of a curve over the data, if an import has stored them."""
    try:
        ends = curve_ends(data)
    except SpectralError as error:
        wrapped(box, bpy.context, str(error), icon="ERROR")
        return
    if ends is None or which == "gradient":
        return
    row = box.row()
    row.active = False
    row.label(text=f"Data from {ends[0]:g}")
    high = row.row()
    high.alignment = "RIGHT"
    high.label(text=f"to {ends[1]:g}")


class SPECTRAL_PT_volume_quality(_VolumePanel, bpy.types.Panel):
    """Sampling and lighting of the volume"""

    bl_label = "Quality and Light"
    bl_parent_id = "SPECTRAL_PT_volume"

    def draw(self, context: Context) -> None:
        settings, layout = shown_volume(context).spectral, self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = settings.enabled
        layout.prop(settings, "quality_db", text="Quality (dB)")
        layout.prop(settings, "rule")
        layout.prop(settings, "lighting")


class SPECTRAL_PT_volume_source(_VolumePanel, bpy.types.Panel):
    """The source of the volume's data"""

    bl_label = "Source"
    bl_parent_id = "SPECTRAL_PT_volume"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        settings, layout = shown_volume(context).spectral, self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "grid")
        row = layout.row()
        row.enabled = False
        row.prop(settings, "source", text="Imported from")


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_UL_volume_materials, SPECTRAL_PT_volume, SPECTRAL_PT_volume_quality, SPECTRAL_PT_volume_source)
)
