# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.spectral.recipe``: the type of mixture, the library of colorants, the requirements, and the last recipe."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..compat import path_options
from .hooks import Topic, offers


class SpectralRecipe(bpy.types.PropertyGroup):
    """A recipe for a spectrum that can be made."""

    SPECTRUM_KIND = "reflectance"
    kind: EnumProperty(
        name="Mix", default="LAMP", description="Components of the mixture",
        items=[
            ("LAMP", "LED Lamp", "Drive levels of LED channels for a white", 0),
            ("PAINTS", "Paints", "Grams of opaque paints (Kubelka and Munk)", 1),
            ("INKS", "Inks", "Coverages of printed inks (Yule and Nielsen)", 2),
            ("FILTERS", "Filters", "Thicknesses of filters in front of white (Bouguer and Beer)", 3),
        ],
    )  # fmt: skip
    library: EnumProperty(
        name="From", default="BUILTIN", description="Available channels, paints, inks or filters",
        items=[
            ("BUILTIN", "Built In", "Common LEDs, or the 24 paints of the ColorChecker", 0),
            ("FILE", "File", "Your own measurements: one spectrum per channel or colorant", 1),
        ],
    )  # fmt: skip
    filepath: StringProperty(
        name="File",
        subtype="FILE_PATH",
        options=path_options(),
        description="A .csv, .spdx or .spd file with one spectrum per channel or colorant",
    )
    most: IntProperty(
        name="At Most", default=4, min=1, max=16, description="Channels or colorants in the recipe at most"
    )
    cct: FloatProperty(
        name="Temperature (K)", default=4000.0, min=1500.0, max=20000.0, precision=0,
        description="Correlated color temperature (CCT) of the white",
    )  # fmt: skip
    duv: FloatProperty(
        name="Tint (Duv)", default=0.0, min=-0.02, max=0.02, precision=4,
        description="Tint of the white: above 0 greenish, below 0 pinkish",
    )  # fmt: skip
    use_cri: BoolProperty(name="Rendering Ra", default=True, description="Require a color rendering index")
    cri: FloatProperty(
        name="At Least", default=80.0, min=0.0, max=100.0, precision=0, description="Least color rendering index Ra"
    )
    use_fidelity: BoolProperty(name="Fidelity Rf", default=False, description="Require a fidelity by TM-30")
    fidelity: FloatProperty(
        name="At Least", default=90.0, min=0.0, max=100.0, precision=0, description="Least fidelity Rf of TM-30"
    )
    use_gamut: BoolProperty(name="Gamut Rg", default=False, description="Require a gamut by TM-30")
    gamut_low: FloatProperty(
        name="From", default=97.0, min=40.0, max=160.0, precision=0,
        description="Least gamut Rg of TM-30; below 100 colors look duller",
    )  # fmt: skip
    gamut_high: FloatProperty(
        name="To", default=105.0, min=40.0, max=160.0, precision=0,
        description="Greatest gamut Rg of TM-30; above 100 colors look more vivid",
    )  # fmt: skip
    wanted: EnumProperty(
        name="For", default="PALETTE", description="The target reflectance",
        items=[
            ("PALETTE", "Palette Material", "The material that is selected in the palette, as it was solved", 0),
            ("NAMED", "Named Surface", "A measured surface by name", 1),
        ],
    )  # fmt: skip
    surface: StringProperty(
        name="Surface", default="dark skin", description="A measured surface by name; type to search",
        search=offers(Topic.SPECTRUM_NAMES), search_options={"SORT", "SUGGESTION"},
    )  # fmt: skip
    grams: FloatProperty(name="Grams", default=100.0, min=0.001, soft_max=10000.0, description="Weight of the mixture")
    dot_gain: FloatProperty(
        name="Dot Gain n",
        default=2.0,
        min=1.0,
        max=100.0,
        description="Spread of light in the paper (Yule and Nielsen)",
    )
    text: StringProperty(description="The recipe, one line each")
    found_kind: StringProperty(description="Components of the recipe")
    met: BoolProperty(description="Whether all requirements are met")
    spectrum: StringProperty(description="Spectrum of the recipe, as JSON")

    @property
    def reads_file(self) -> bool:
        """True if the colorants come from a file; inks and filters differ from maker to maker: none are built in."""
        return self.library == "FILE" or self.kind in ("INKS", "FILTERS")


CLASSES = (SpectralRecipe,)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
