# SPDX-License-Identifier: GPL-3.0-or-later
"""One cell of the palette table: the target color of a material under a light, and its actual color.

Wanted colors are stored as sRGB, the numbers that an artist reads off a screen; so they do not depend on the working
space of the file. Results are stored in linear sRGB, also outside the gamut of displays.
"""

from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty

from ..fields import without_keyframes
from ..hooks import Topic, announces

MODES = [
    ("FIXED", "Color", "This color", "COLOR", 0),
    ("FREE", "Any Color", "Any color, or any color in a range", "QUESTION", 1),
    ("SAME", "Same As", "The same color as another cell, which may have any color: metamers", "LINKED", 2),
    ("CONSTANT", "Constant", "The color that this material has under other lights", "FREEZE", 3),
    ("BLACK", "Black", "No color at all: invisible under this light", "HIDE_ON", 4),
    ("DISTINCT", "Distinct", "As different as possible from other cells", "ARROW_LEFTRIGHT", 5),
    ("IGNORE", "Ignore", "No request", "REMOVE", 6),
]
REFERRING = ("SAME", "CONSTANT", "DISTINCT")
BOXED = ("FREE", "SAME", "CONSTANT")
ASKED = ("target", "use_box", "box_low", "box_high", "weight", "exact", "mode")
"""The target of a cell without the cells that it refers to; copied together, the mode last."""
NO_ERROR = -1.0
VISIBLE_DELTA_E = 3.0
"""The library's own, which properties do not import; a test compares them."""
LEAST_DELTA_E = 0.005
"""Smaller ones are shown as less than 0.01, in the cell and in the status above the table alike."""
WEIGHT_LIMIT = 1000.0
"""Solvers become inaccurate from ratios of 1e4 on. For a larger weight, make the cell exact."""


edited = announces(Topic.PALETTE)


def _shown(name: str) -> dict[str, Any]:
    """Callbacks of a swatch that is shown but cannot be set: a read-only property would be drawn faded."""

    def value(self: bpy.types.PropertyGroup) -> tuple[float, ...]:
        return tuple(min(max(float(channel), 0.0), 1.0) for channel in getattr(self, name))

    return {"get": value, "set": lambda _self, _value: None}


class SpectralPaletteReference(bpy.types.PropertyGroup):
    """Another cell, by the permanent numbers of its material and light."""

    material_uid: IntProperty()
    light_uid: IntProperty()


class SpectralPaletteCell(bpy.types.PropertyGroup):
    """The target of a material under a light, and the result."""

    mode: EnumProperty(
        name="Target",
        items=MODES,
        default="FIXED",
        update=announces(Topic.PALETTE_CELL_MODE),
        description="Target of this cell",
    )
    target: FloatVectorProperty(
        name="Wanted Color", subtype="COLOR_GAMMA", size=3, default=(0.5, 0.5, 0.5), soft_min=0.0, soft_max=1.0,
        update=edited, description="The color that the material should show under this light (sRGB)",
    )  # fmt: skip
    others: CollectionProperty(type=SpectralPaletteReference)
    use_box: BoolProperty(
        name="Limit the Color", default=False, update=edited, description="Hold the free color inside a range"
    )
    box_low: FloatVectorProperty(
        name="From", subtype="COLOR_GAMMA", size=3, default=(0.0, 0.0, 0.0), soft_min=0.0, soft_max=1.0, update=edited,
        description="Least red, green and blue of the range (sRGB)",
    )  # fmt: skip
    box_high: FloatVectorProperty(
        name="To", subtype="COLOR_GAMMA", size=3, default=(1.0, 1.0, 1.0), soft_min=0.0, soft_max=1.0, update=edited,
        description="Greatest red, green and blue of the range (sRGB)",
    )  # fmt: skip
    weight: FloatProperty(
        name="Weight", default=1.0, min=0.0, soft_max=10.0, max=WEIGHT_LIMIT, update=edited,
        description="How much this cell counts beside the others, up to 1000. To enforce it, make it exact",
    )  # fmt: skip
    exact: BoolProperty(
        name="Exact", default=False, update=edited, description="Must hold exactly; the other cells may be missed"
    )

    actual_linear: FloatVectorProperty(size=3)
    wanted_linear: FloatVectorProperty(size=3)
    actual_display: FloatVectorProperty(size=3)
    wanted_display: FloatVectorProperty(size=3)
    has_result: BoolProperty()
    delta_e: FloatProperty(
        name="ΔE", default=NO_ERROR,
        description="Largest CIEDE2000 between wanted and actual color, over observers and lamp variants",
    )  # fmt: skip
    actual: FloatVectorProperty(
        name="Actual Color", subtype="COLOR_GAMMA", size=3, min=0.0, max=1.0, **_shown("actual_display"),
        description="The actual color. Click to read its numbers; it cannot be edited",
    )  # fmt: skip
    wanted: FloatVectorProperty(
        name="Color to Match", subtype="COLOR_GAMMA", size=3, min=0.0, max=1.0, **_shown("wanted_display"),
        description="The color of the cell that this one refers to. Click to read its numbers",
    )  # fmt: skip

    @property
    def is_missed(self) -> bool:
        """True if the difference between wanted and actual color is visible."""
        return self.delta_e > VISIBLE_DELTA_E

    @property
    def error_text(self) -> str:
        """ΔE with the significant digits."""
        if not self.has_result:
            return "–"
        if self.delta_e < 0:
            return "free" if self.mode in ("FREE", "DISTINCT") else "–"
        return "ΔE <0.01" if self.delta_e < LEAST_DELTA_E else f"ΔE {self.delta_e:.{2 if self.delta_e < 1 else 1}f}"


CLASSES = (SpectralPaletteReference, SpectralPaletteCell)

without_keyframes(*CLASSES)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
