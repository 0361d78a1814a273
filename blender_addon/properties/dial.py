# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral.dial``: the light dial of a scene, its bulbs, and the recording of their lights."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..compat import path_options
from .hooks import Topic, announces, offers

STORAGE = [
    ("DIAL", "Mixtures", "Any mixture of the scene's lights, exact; least memory", 0),
    ("BANDS31", "31 Bands", "New spectra too, approximately; good for smooth lamps", 1),
    ("BANDS61", "61 Bands", "New spectra too, approximately; better for lamps with lines", 2),
    ("BANDS121", "121 Bands", "New spectra too; good for lamps with lines", 3),
    ("EXACT", "Exact", "Every spectrum on a 10 nm grid, exact; most memory", 4),
]


_changed = announces(Topic.DIAL)


class SpectralDialMember(bpy.types.PropertyGroup):
    """A light or emissive object of a bulb's group, and its ``name`` and brightness at the time of the recording."""

    owner: PointerProperty(type=bpy.types.ID)
    slot: IntProperty(default=-1, description="Material slot of an emissive object; -1 for a lamp or a world")
    node: StringProperty(description="Node of the strength; empty for a lamp's power")
    socket: StringProperty(description="Input of the node; empty for its first strength")
    base: FloatProperty(description="Power or strength as recorded")


class SpectralDialBulb(bpy.types.PropertyGroup):
    """A bulb of the dial; ``name`` is its light group in the recording."""

    place: FloatVectorProperty(
        name="Position",
        size=2,
        subtype="XYZ",
        default=(0.0, 1.0),
        update=_changed,
        description="Position of the bulb on the dial",
    )
    is_on: BoolProperty(
        name="On", default=True, update=_changed, description="Whether the bulb contributes to the mixture"
    )
    lamp: StringProperty(
        name="Lamp", search=offers(Topic.LAMP_NAMES), search_options={"SORT", "SUGGESTION"}, update=_changed,
        description="A measured lamp in place of the lights' own spectrum; empty keeps it. Not for Mixtures storage",
    )  # fmt: skip
    color: FloatVectorProperty(
        name="Color", size=3, subtype="COLOR_GAMMA", default=(1.0, 1.0, 1.0), min=0.0, max=1.0,
        description="Color of the light alone, for the dial",
    )  # fmt: skip
    members: CollectionProperty(type=SpectralDialMember)
    lit: FloatProperty(default=1.0, description="Factor on its lights when they were last applied and not dark")
    is_dark: BoolProperty(description="Whether its lights were made dark by the dial")


class SpectralLightDial(bpy.types.PropertyGroup):
    """Selector, bulbs and transport."""

    selector: FloatVectorProperty(
        name="Selector",
        size=2,
        subtype="XYZ",
        default=(0.0, 0.0),
        update=_changed,
        description="Position of the selector on the dial",
    )
    intensity: FloatProperty(
        name="Intensity", default=1.0, min=0.0, soft_max=10.0, update=_changed,
        description="Factor on all lights. With n bulbs on and the selector at the center of their polygon, "
        "n gives the light as recorded",
    )  # fmt: skip
    bulbs: CollectionProperty(type=SpectralDialBulb)
    active: IntProperty(name="Bulb", min=0, description="The selected bulb")
    show: BoolProperty(
        name="Dial in the View", default=True, description="Draw the dial over the 3D view and the image editor"
    )
    over_camera: BoolProperty(
        name="Picture over the Camera View", default=True, update=_changed,
        description="Show the relit picture over the camera view, in every 3D view",
    )  # fmt: skip
    storage: EnumProperty(
        name="Storage",
        items=STORAGE,
        default="DIAL",
        description="Stored data, which determine the changes that are possible later",
    )
    one_per_light: BoolProperty(
        name="One per Light", default=True,
        description="A bulb for each light, emissive object and the world; otherwise one for each light group",
    )  # fmt: skip
    filepath: StringProperty(
        name="File", subtype="FILE_PATH", options=path_options(),
        description="File of the transport; empty: beside the .blend file",
    )  # fmt: skip
    own_ending: StringProperty(description="Part of the file's name, where several scenes of a .blend have recordings")
    scene_hash: StringProperty(description="Of the scene that the transport was recorded from")
    picture: PointerProperty(type=bpy.types.Image, description="Image that follows the dial")
    facts: StringProperty(description="Facts of the recording, for the panel")
    keeps_spectra: BoolProperty(default=True, description="Whether lights of the recording can have new spectra")
    named_by_object: BoolProperty(description="Whether the bulbs have the names of their objects")
    recorded_parts: StringProperty(description="Hash of each part of the scene when it was recorded")
    recorded_groups: StringProperty(description="Hash of each light group, and of all else, when they were recorded")
    changes: StringProperty(description="Changes of the scene since it was recorded; empty if none")
    message: StringProperty(description="Error of the recording; empty if none")


CLASSES = (SpectralDialMember, SpectralDialBulb, SpectralLightDial)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
