# SPDX-License-Identifier: GPL-3.0-or-later
"""Answers beside the solution: possible colors of a cell, alternatives, dyes of fluorescent paints."""

import bpy
from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ..fields import without_keyframes
from ..hooks import Topic, announces
from ..spectrum import DYE_FIELDS

edited = announces(Topic.PALETTE)


class SpectralPossible(bpy.types.PropertyGroup):
    """The answer to "Possible?" for one cell, with its question."""

    material_uid: IntProperty()
    light_uid: IntProperty()
    asked: FloatVectorProperty(
        name="Wanted", subtype="COLOR_GAMMA", size=3, min=0.0, max=1.0, description="The wanted color that was tested"
    )
    nearest: FloatVectorProperty(
        name="Nearest", subtype="COLOR_GAMMA", size=3, min=0.0, max=1.0,
        description="The possible color that is nearest to the wanted one",
    )  # fmt: skip
    nearest_linear: FloatVectorProperty(size=3)
    reachable: BoolProperty()
    words: StringProperty(description="Whether it is possible, and the conflicting cells; one line each")


class SpectralAlternative(bpy.types.PropertyGroup):
    """An alternative solution of the palette: spectra and colors of all designed materials."""

    apart: FloatProperty(description="Largest ΔE of any material to the first solution")
    asked: StringProperty(description="Fingerprint of the table that it answers")
    spectra: StringProperty(description="Designed spectra by the lasting number of their row or column, as JSON")
    cells: StringProperty(description="Actual and wanted colors and errors of all cells, as JSON")
    colors: StringProperty(description="sRGB by material and lamp, as JSON")
    lamps: StringProperty(description="Names of the lamps that the colors are seen under")


class SpectralDye(bpy.types.PropertyGroup):
    """A fluorescent dye that a material may hold."""

    excitation_nm: DYE_FIELDS["excitation_nm"].declared(edited)
    emission_nm: DYE_FIELDS["emission_nm"].declared(edited)
    amount: FloatProperty(
        name="Amount", description="Amount of the dye in the design; 1 absorbs all light at its wavelength"
    )


CLASSES = (SpectralPossible, SpectralAlternative, SpectralDye)

without_keyframes(*CLASSES)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
