# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral.texture``: two pictures for one surface, or one with wanted colors; the lights; the result."""

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
from .fields import Field, by_name
from .spectrum import SpectralSpectrum

TEXTURE_FIELDS = by_name(
    Field(
        "floor", FloatProperty, "floor", name="Black Shown As", default=0.02, min=0.0, max=0.5, precision=3,
        description="Gray that replaces black. A surface that is black under one light is dark under all, so a little "
        "gray in black makes the pictures more independent",
    ),
    Field(
        "slope", FloatProperty, "slope", name="Contrast Kept", default=0.95, min=0.05, max=1.0, precision=3,
        description="Wanted share of the pictures' contrast. Black plus contrast is at most 1",
    ),
    Field(
        "mapping", EnumProperty, "mapping", name="Impossible Colors", default="least_delta_e",
        description="Treatment of colors that no reflectance can show together",
        items=[
            ("least_delta_e", "Nearest Color", "Show the nearest pair of colors there", 0),
            ("uniform_contrast", "Lower All Contrast", "Lower the contrast of all texels until each is exact", 1),
        ],
    ),
    Field(
        "spectra", IntProperty, "spectra", name="Spectra", default=6, min=6, max=8,
        description="Reflectances that are mixed at every texel, each a channel. More keep more contrast under "
        "given lamps and meet more wanted colors",
    ),
    Field(
        "importance", FloatProperty, "importance", name="First over Second", default=1.0, min=0.01, soft_max=25.0,
        max=1000.0,
        description="How much color errors of the first picture count against those of the second. At 25 the first is "
        "almost exact and the second is hardly visible",
    ),
    Field(
        "daylight_share", FloatProperty, "daylight_share", name="Realism", default=0.0, min=0.0, max=0.9,
        subtype="FACTOR",
        description="Daylight mixed into both lights: other surfaces look more natural, and the pictures lose contrast",
    ),
    Field(
        "led_width_nm", FloatProperty, "led_width_nm", name="LED Width (nm)", default=20.0, min=5.0, max=60.0,
        precision=0,
        description="Width of the LEDs' bands. Narrow LEDs separate pictures; wide ones render other surfaces better",
    ),
)  # fmt: skip


def _nothing(_self: object, _context: object) -> None:
    """Do nothing: a setting takes effect when the texture is designed."""


class SpectralTextureWantedColor(bpy.types.PropertyGroup):
    """A color of the picture, and its wanted appearance under the second light."""

    color: FloatVectorProperty(
        name="Color", subtype="COLOR_GAMMA", size=3, default=(0.6, 0.2, 0.2), min=0.0, max=1.0,
        description="A color of the picture under the first light (sRGB)",
    )  # fmt: skip
    wanted: FloatVectorProperty(
        name="Wanted", subtype="COLOR_GAMMA", size=3, default=(0.4, 0.3, 0.2), min=0.0, max=1.0,
        description="Wanted color under the second light (sRGB)",
    )  # fmt: skip
    outcome: StringProperty(description="Result for this color")
    reached: FloatVectorProperty(
        name="Reached",
        subtype="COLOR_GAMMA",
        size=3,
        min=0.0,
        max=1.0,
        description="Color that the design reaches under the second light",
    )


class SpectralTextureLight(bpy.types.PropertyGroup):
    """A given light."""

    SPECTRUM_KIND = "illuminant"
    spectral: PointerProperty(type=SpectralSpectrum)


class SpectralTextureDesign(bpy.types.PropertyGroup):
    """Pictures, lights, settings, and the last designed texture."""

    kind: EnumProperty(
        name="Pictures", default="TWO", description="Pictures that the surface shows: two, or one with wanted colors",
        items=[
            ("TWO", "A Picture for Each Light", "Two unrelated pictures, one under each light", 0),
            ("ONE", "One Picture with Wanted Colors", "One picture; some colors change under the second light", 1),
        ],
    )  # fmt: skip
    first: PointerProperty(
        type=bpy.types.Image, name="First Picture", description="Picture of the surface under the first light"
    )
    second: PointerProperty(
        type=bpy.types.Image, name="Second Picture",
        description="Picture of the surface under the second light, of the same size as the first",
    )  # fmt: skip
    wanted_colors: CollectionProperty(type=SpectralTextureWantedColor)
    lights: EnumProperty(
        name="Lights", default="DESIGNED", description="Whether the two lights are designed or given",
        items=[
            ("DESIGNED", "Designed", "Two mixes of LEDs that both look white like daylight", 0),
            ("GIVEN", "Given", "Two existing lamps; they allow much less contrast", 1),
        ],
    )  # fmt: skip
    light_1: PointerProperty(type=SpectralTextureLight)
    light_2: PointerProperty(type=SpectralTextureLight)
    floor: TEXTURE_FIELDS["floor"].declared(_nothing)
    slope: TEXTURE_FIELDS["slope"].declared(_nothing)
    mapping: TEXTURE_FIELDS["mapping"].declared(_nothing)
    spectra: TEXTURE_FIELDS["spectra"].declared(_nothing)
    importance: TEXTURE_FIELDS["importance"].declared(_nothing)
    daylight_share: TEXTURE_FIELDS["daylight_share"].declared(_nothing)
    led_width_nm: TEXTURE_FIELDS["led_width_nm"].declared(_nothing)
    folder: StringProperty(
        name="Folder", subtype="DIR_PATH", default="//spectral_texture", options=path_options(),
        description="Folder of the texture, the lights and the pictures of its errors",
    )  # fmt: skip

    status: StringProperty(description="Progress or result of the design")
    is_under_way: BoolProperty(description="Whether a design works for it; also in files that are saved meanwhile")
    failed: BoolProperty(description="Whether the last design failed")
    progress: FloatProperty(options={"SKIP_SAVE"})
    texture_file: StringProperty(
        subtype="FILE_PATH", options=path_options(), description="The texture that was designed last"
    )
    designed_as: StringProperty(description="Name of the scene when its texture was designed")
    report: StringProperty(description="Contrast and errors of the result, one line each")
    lost_1: PointerProperty(type=bpy.types.Image, description="Color error of picture 1; white is ΔE 10 or more")
    lost_2: PointerProperty(type=bpy.types.Image, description="Color error of picture 2; white is ΔE 10 or more")
    lamp_1: PointerProperty(
        type=bpy.types.Light, name="First Lamp", description="Lamp of the scene that gets the first light"
    )
    lamp_2: PointerProperty(
        type=bpy.types.Light, name="Second Lamp", description="Lamp of the scene that gets the second light"
    )


CLASSES = (SpectralTextureWantedColor, SpectralTextureLight, SpectralTextureDesign)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
