# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the render engine: samples, transport, and the artist's overrides of the plan."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy.types import Context, PropertyGroup

from .fields import Field, by_name

ENGINE = "SPECTRAL"
"""Identifier of this render engine in Blender, which .blend files store."""


def tag(properties: PropertyGroup, _context: Context) -> None:
    """Notify Blender, which otherwise does not copy a changed property to the evaluated scene."""
    properties.id_data.update_tag()


def tag_passes(properties: PropertyGroup, context: Context) -> None:
    """Notify Blender, and let it list the passes anew: the compositor has sockets for them."""
    tag(properties, context)
    for layer in properties.id_data.view_layers:
        layer.update_render_passes()


RENDER_FIELDS = by_name(
    Field(
        "samples", IntProperty, "samples", name="Samples", default=128, min=1, soft_max=4096,
        description="Light paths per pixel of a final render",
    ),
    Field(
        "seed", IntProperty, "seed", name="Seed", default=0, min=0,
        description="Start of the random numbers: the same seed, the same noise",
    ),
    Field(
        "transport", EnumProperty, "transport", name="Transport", default="AUTO",
        description="Type of light transport",
        items=[
            ("AUTO", "Automatic", "Spectral if the scene needs it, else RGB", 0),
            ("SPECTRAL", "Spectral", "Trace wavelengths, always", 1),
            ("RGB", "RGB", "Trace red, green and blue, always: designed spectra lose their effect", 2),
        ],
    ),
    Field(
        "target_error", FloatProperty, "target_error", name="Error", default=1.0, min=0.02, max=100.0, soft_max=5.0,
        description="Mean color error (ΔE2000) of the picture's noise, at which sampling ends",
    ),
    Field(
        "time_budget", FloatProperty, "time_budget_s", name="Seconds", default=60.0, min=0.1, max=1e7, soft_max=3600.0,
        description="Time of a render from its start; noisy parts of the picture get more samples",
    ),
    Field(
        "tolerance", FloatProperty, "tolerance_delta_e", name="Tolerance", default=0.25, min=0.0, soft_max=5.0,
        description="Color error (ΔE2000) below which the plan may omit an effect",
    ),
    Field(
        "denoise", BoolProperty, "denoise", name="Denoise", default=False,
        description="Smooth the noise of the finished picture with Open Image Denoise. Fine detail may blur",
    ),
)  # fmt: skip
"""Settings of a render that are shared with the core's ``Sampling`` and ``RenderSettings``."""


class SpectralPlanChoice(bpy.types.PropertyGroup):
    """The artist's override of a decision of the plan; ``name`` is the effect's."""

    value: StringProperty(name="Value", update=tag, description="The artist's choice instead of the plan's")


class SpectralPlanLine(bpy.types.PropertyGroup):
    """A decision of the last plan, for display; ``name`` is the effect's."""

    value: StringProperty()
    reason: StringProperty()
    cost: StringProperty(description="Error of the picture without it")
    error: FloatProperty(description="Color error (ΔE2000) of the picture without it; -1 if unknown")
    how: StringProperty(description="Where the error comes from: exact, bounded, measured or not known")
    time_share: FloatProperty(subtype="FACTOR", description="Its share of the time of a render with all effects")
    choices: StringProperty(description="Possible values, separated by '|'; empty for a whole number")
    is_overridable: BoolProperty()
    is_artists: BoolProperty(description="Whether the artist decided it")


class SpectralCostPoint(bpy.types.PropertyGroup):
    """A point of the last cost curve; ``name`` is the setting's."""

    axis: StringProperty()
    seconds: FloatProperty()
    delta_e: FloatProperty(description="Mean color error (ΔE2000) of noise")
    bias: FloatProperty(description="Mean color error (ΔE2000) of the bias of the setting")
    is_measured: BoolProperty()


class SpectralRender(bpy.types.PropertyGroup):
    """Settings of the render engine."""

    goal: EnumProperty(
        name="Until",
        description="When sampling ends",
        update=tag,
        items=[
            ("SAMPLES", "Samples", "A number of light paths for each pixel", 0),
            ("ERROR", "Error", "A mean color error; noisy parts of the picture get more samples", 1),
            ("TIME", "Time", "A time; noisy parts of the picture get more samples", 2),
        ],
    )
    target_error: RENDER_FIELDS["target_error"].declared(tag)
    time_budget: RENDER_FIELDS["time_budget"].declared(tag)
    cost: CollectionProperty(type=SpectralCostPoint)
    cost_summary: StringProperty(description="The last prediction for the settings")
    samples: RENDER_FIELDS["samples"].declared(tag)
    seed: RENDER_FIELDS["seed"].declared(tag)
    transport: RENDER_FIELDS["transport"].declared(tag)
    tolerance: RENDER_FIELDS["tolerance"].declared(tag)
    denoise: RENDER_FIELDS["denoise"].declared(tag_passes)
    overrides: CollectionProperty(type=SpectralPlanChoice)
    plan: CollectionProperty(type=SpectralPlanLine)
    plan_accepted: FloatProperty(description="Largest color error (ΔE2000) of the plan")
    own_settings: StringProperty(
        description="Own engine, compositing, sequencer and view layers, while the extension reads the scene"
    )


CLASSES = (SpectralPlanChoice, SpectralPlanLine, SpectralCostPoint, SpectralRender)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
