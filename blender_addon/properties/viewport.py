# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the Rendered viewport, and the light of its look."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from bpy.types import Context, PropertyGroup

from .hooks import Topic, announce, offers

LOOKS = [
    ("SCENE", "As It Is", "All lamps of the scene, with their own spectra", "SCENE_DATA", 0),
    ("COLUMN", "Palette Light", "A light of the palette alone", "COLOR", 1),
    ("GROUP", "Light Group", "The lamps of one light group alone", "OUTLINER_OB_LIGHT", 2),
    ("LAMP", "Lamp", "All lamps, with the spectrum of a lamp of the catalogue", "LIGHT_SUN", 3),
]


def changed(properties: PropertyGroup, _context: Context) -> None:
    """Notify Blender, which otherwise does not copy a property to the evaluated scene, and the listeners of the
    viewport.
    """
    properties.id_data.update_tag()
    announce(Topic.VIEWPORT, properties)


class SpectralLook(bpy.types.PropertyGroup):
    """The light of a look."""

    kind: EnumProperty(name="Look", items=LOOKS, default="SCENE", update=changed, description="Light to look under")
    column: StringProperty(name="Palette Light", update=changed, description="Light of the palette")
    group: StringProperty(name="Light Group", update=changed, description="Light group that is shown alone")
    lamp: StringProperty(
        name="Lamp", default="D65", search=offers(Topic.LAMP_NAMES), search_options={"SORT", "SUGGESTION"},
        update=changed, description="Spectrum of all lamps: a lamp of the catalogue, or 'blackbody 3200'",
    )  # fmt: skip
    exposure: FloatProperty(
        name="Exposure", default=0.0, soft_min=-5.0, soft_max=5.0, min=-32.0, max=32.0, update=changed,
        description="Brightness of the picture under this light, in stops",
    )  # fmt: skip
    adapts: BoolProperty(
        name="Adapt to Light", default=False, update=changed,
        description="Show the appearance after adaptation to this light: white surfaces look white (Bradford)",
    )  # fmt: skip


class SpectralViewport(bpy.types.PropertyGroup):
    """Refinement and content of the Rendered viewport."""

    samples: IntProperty(
        name="Viewport Samples", default=256, min=1, soft_max=4096, update=changed,
        description="Light paths per pixel after which the Rendered viewport stops",
    )  # fmt: skip
    denoise: BoolProperty(
        name="Denoise", default=False, update=changed,
        description="Smooth the noise of Rendered viewports with Open Image Denoise, first after one sample per pixel. "
        "Fine detail may blur at first",
    )  # fmt: skip
    is_paused: BoolProperty(
        name="Pause", default=False, update=changed,
        description="Keep the Rendered viewport as it is, and leave the processor to other work",
    )  # fmt: skip
    look: PointerProperty(type=SpectralLook)
    other: PointerProperty(type=SpectralLook, description="Look of the right side of a split view")
    is_split: BoolProperty(
        name="Split View", default=False, update=changed,
        description="Show the scene under two lights side by side in Rendered viewports",
    )  # fmt: skip
    divider: FloatProperty(
        name="Divider", default=0.5, min=0.0, max=1.0, subtype="FACTOR", update=changed,
        description="Where the two sides of a split view meet",
    )  # fmt: skip
    preview_lamp: StringProperty(
        name="Preview Lamp", search=offers(Topic.LAMP_NAMES), search_options={"SORT", "SUGGESTION"},
        update=lambda settings, _context: announce(Topic.PREVIEW_LAMP, settings),
        description="Lamp under which material, light and world previews and icons are shown; empty for white light",
    )  # fmt: skip
    preview_message: StringProperty(description="Error of the lamp for previews; empty if none")


CLASSES = (SpectralLook, SpectralViewport)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
