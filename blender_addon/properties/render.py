# SPDX-License-Identifier: GPL-3.0-or-later
"""What the render engine is asked: samples, transport, and decisions of the plan that the artist takes over."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty


def tag(properties, _context) -> None:
    """Blender copies a changed property to the evaluated scene only when told."""
    properties.id_data.update_tag()


class SpectralPlanChoice(bpy.types.PropertyGroup):
    """A decision of the plan that the artist has taken over; ``name`` is the effect's."""

    value: StringProperty(name="Value", description="What the artist decided instead of the plan")


class SpectralPlanLine(bpy.types.PropertyGroup):
    """A decision of the plan as it was last made, to be shown; ``name`` is the effect's."""

    value: StringProperty()
    reason: StringProperty()
    cost: StringProperty(description="What goes wrong in the picture without it")
    choices: StringProperty(description="What it may be set to, separated by '|'; empty for a whole number")
    is_overridable: BoolProperty()
    is_artists: BoolProperty(description="Whether the artist decided it")


class SpectralRender(bpy.types.PropertyGroup):
    """Settings of the render engine."""

    samples: IntProperty(
        name="Samples",
        default=128,
        min=1,
        soft_max=4096,
        update=tag,
        description="Light paths per pixel of a final render",
    )
    viewport_samples: IntProperty(
        name="Viewport Samples",
        default=16,
        min=1,
        soft_max=1024,
        update=tag,
        description="Light paths per pixel in the viewport",
    )
    seed: IntProperty(
        name="Seed",
        default=0,
        min=0,
        update=tag,
        description="Start of the random numbers: the same seed, the same noise",
    )
    transport: EnumProperty(
        name="Transport", default="AUTO", update=tag, description="How light is carried through the scene",
        items=[
            ("AUTO", "Automatic", "Spectral where a spectrum in the scene asks for it, else RGB", 0),
            ("SPECTRAL", "Spectral", "Trace wavelengths, always", 1),
            ("RGB", "RGB", "Trace red, green and blue, always: designed spectra lose their effect", 2),
        ],
    )  # fmt: skip
    tolerance: FloatProperty(
        name="Tolerance", default=1.0, min=0.0, soft_max=5.0, update=tag,
        description="Color error (ΔE2000) below which the plan may leave an effect out",
    )  # fmt: skip
    overrides: CollectionProperty(type=SpectralPlanChoice)
    plan: CollectionProperty(type=SpectralPlanLine)
    plan_message: StringProperty()


CLASSES = (SpectralPlanChoice, SpectralPlanLine, SpectralRender)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
