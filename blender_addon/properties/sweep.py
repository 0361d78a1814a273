# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral.sweep``: swept settings of the file, their ranges, and the number of points."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..compat import path_options


class SpectralSweepParameter(bpy.types.PropertyGroup):
    """A swept setting; ``name`` is its full data path. A switch or a list has ``choices``, a number a range."""

    block: PointerProperty(
        type=bpy.types.ID,
        description="Data-block of the setting, which may be renamed; a full copy of the scene has its own",
    )
    label: StringProperty(name="Name", description="Column of the table: letters, digits and underscores")
    low: FloatProperty(name="From", default=0.0, description="Lower end of the range")
    high: FloatProperty(name="To", default=1.0, description="Upper end of the range")
    is_angle: BoolProperty(description="The setting is an angle: the panel shows its range in the units of the scene")
    low_angle: FloatProperty(
        name="From", subtype="ANGLE", description="Lower end of the range",
        get=lambda self: self.low, set=lambda self, value: setattr(self, "low", value),
    )  # fmt: skip
    high_angle: FloatProperty(
        name="To", subtype="ANGLE", description="Upper end of the range",
        get=lambda self: self.high, set=lambda self, value: setattr(self, "high", value),
    )  # fmt: skip
    scale: EnumProperty(
        name="Scale",
        description="Distribution of the points over the range",
        items=[
            ("linear", "Linear", "Points are distributed evenly over the range", 0),
            (
                "log",
                "Logarithmic",
                "Points are distributed evenly over the logarithm: for energies and other ratios",
                1,
            ),
        ],
    )
    whole: BoolProperty(name="Whole Numbers", description="Only whole numbers, both ends included")
    choices: StringProperty(name="Values", description="Values to try, separated by commas; remove those to leave out")


class SpectralSweep(bpy.types.PropertyGroup):
    """Swept settings, the budget, and the folder of the outcome."""

    parameters: CollectionProperty(type=SpectralSweepParameter)
    active: IntProperty(name="Parameter", min=0)
    budget: IntProperty(name="Points", default=32, min=1, max=100000, description="Exactly this many renders")
    design: EnumProperty(
        name="Design",
        description="How the ranges are sampled",
        items=[
            ("lattice", "Lattice", "Points far apart; more points refine the sweep without moving one", 0),
            ("sobol", "Sobol", "Points that estimate means well", 1),
            ("latin_hypercube", "Latin Hypercube", "Even on each single axis; cannot be refined", 2),
        ],
    )
    percentage: IntProperty(
        name="Size",
        default=25,
        min=1,
        max=100,
        subtype="PERCENTAGE",
        description="Size of the pictures in percent of the output size",
    )
    samples: IntProperty(name="Samples", default=32, min=1, max=65536, description="Light paths per pixel")
    workers: IntProperty(name="Workers", default=1, min=1, max=64, description="Renderers that run at the same time")
    folder: StringProperty(
        name="Folder", subtype="DIR_PATH", default="//sweep.cdb", options=path_options(),
        description="Where table and pictures are kept",
    )  # fmt: skip
    swept_as: StringProperty(description="Name of the scene when its sweep was last started")
    point: IntProperty(name="Row", default=1, min=1, description="Row of the table, counted from 1")
    status: StringProperty(options={"SKIP_SAVE"})
    is_under_way: BoolProperty(description="Whether a run works for this scene; also in files that are saved meanwhile")
    done: IntProperty(options={"SKIP_SAVE"})
    total: IntProperty(options={"SKIP_SAVE"})


CLASSES = (SpectralSweepParameter, SpectralSweep)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
