# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette of a scene: lights in columns, materials in rows, and the weights of their targets."""

from collections.abc import Callable

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

from ..fields import Field, by_name, without_keyframes
from ..hooks import Topic, announce, announces
from ..spectrum import SpectralSpectrum
from .answers import SpectralAlternative, SpectralDye, SpectralPossible
from .cell import SpectralPaletteCell, edited

WHITE_XYZ = (0.95047167, 0.99995703, 1.08897820)
"""White of sRGB, D65 of 2° and luminance 1; a test compares it with the core's."""
DESIGN = [
    ("MEASURED", "Measured", "Keep a measured spectrum as it is", "IMPORT", 0),
    ("DESIGNED", "Designed", "Let the palette find the spectrum", "MOD_SIMPLIFY", 1),
]
OBSERVERS = [
    ("cie_1931_2deg", "CIE 1931 2°", "The observer of sRGB and of the renderer; always counted", 1),
    ("cie_1964_10deg", "CIE 1964 10°", "Larger fields of view", 2),
    ("cie_2015_2deg", "CIE 2015 2°", "The newer physiological observer", 4),
    ("cie_2015_10deg", "CIE 2015 10°", "The newer physiological observer, larger fields", 8),
]


PALETTE_FIELDS = by_name(
    Field(
        "scale_lights", BoolProperty, "scale_lights", name="Brighten as Needed", default=False,
        description="Brighten all lights by one factor until every material reflects at most all light",
    ),
    Field(
        "smoothness", FloatProperty, "smoothness", name="Smoothness", default=0.01, min=0.0, soft_max=1.0, precision=4,
        description="How much smooth spectra, like those of real paints and lamps, count against exact colors",
    ),
    Field(
        "operator", EnumProperty, "smoothness_operator", name="Measure", default="mended",
        description="How roughness of a spectrum is measured",
        items=[
            ("mended", "Curvature", "Second derivative with free ends, the same on every grid", 0),
            ("thesis", "Thesis", "Eq. 5.13 of the thesis, which forces the ends to zero", 1),
        ],
    ),
    Field(
        "match", EnumProperty, "match", name="Match", default="linear", description="How color errors are measured",
        items=[
            ("linear", "Linear RGB", "Difference in linear RGB", 0),
            ("perceptual", "Perceptual", "Perceived difference, CIELAB at the wanted color", 1),
        ],
    ),
    Field(
        "rounds", IntProperty, "rounds", name="Rounds", default=1000, min=1, soft_max=1000, max=10_000,
        description="Most rounds; each designs all materials, then all lights",
    ),
    Field(
        "observers", EnumProperty, "observers", name="Observers", items=OBSERVERS, options={"ENUM_FLAG"},
        default={"cie_1931_2deg"}, description="Cells that match do so for these observers. Shift-click for several",
    ),
    Field(
        "robustness", EnumProperty, "robustness", name="Other Observers and Lamps", default="soft",
        description="How matches for several observers and lamps are weighted",
        items=[
            ("soft", "On Average", "Make the squared errors of all of them small together", 0),
            ("worst_case", "Worst Case", "Make the largest of their errors small; takes seconds", 1),
        ],
    ),
    Field(
        "robust_weight", FloatProperty, "robust_weight", name="Weight", default=1.0, min=0.0, soft_max=10.0,
        max=1000.0, description="How much other observers and lamp variants count",
    ),
    Field(
        "allow_negative", BoolProperty, ("reflectance_bounds", "light_bounds"), name="Unphysical Spectra",
        default=False,
        description="Let reflectances leave 0 to 1 and lights go below 0. For study: nothing real does it, and it "
        "cannot be applied",
    ),
    Field(
        "grid_start", FloatProperty, "grid", name="From (nm)", default=400.0, min=300.0, max=780.0, precision=0,
        description="Least wavelength of designed spectra",
    ),
    Field(
        "grid_stop", FloatProperty, "grid", name="To (nm)", default=700.0, min=400.0, max=900.0, precision=0,
        description="Greatest wavelength of designed spectra",
    ),
    Field(
        "grid_samples", IntProperty, "grid", name="Samples", default=31, min=5, soft_max=101, max=601,
        description="Number of samples of a designed spectrum; 31 over 400 to 700 nm is one every 10 nm",
    ),
)  # fmt: skip
"""Settings of the whole table that are shared with the core's ``PaletteProblem``."""


def _remembers(pointer: str) -> Callable[[bpy.types.PropertyGroup, bpy.types.Context], None]:
    """Store the name of a chosen data-block, the only trace of it after its deletion, and show the solution on it."""

    def changed(entry: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
        block = getattr(entry, pointer)
        setattr(entry, f"{pointer}_name", "" if block is None else block.name)
        announce(Topic.PALETTE_PICTURE, entry.id_data.spectral.palette)

    return changed


class SpectralPaletteLamp(bpy.types.PropertyGroup):
    """One lamp of a list: a primary of a light, or a variant under which matches should hold."""

    SPECTRUM_KIND = "illuminant"
    spectral: PointerProperty(type=SpectralSpectrum)
    amount: FloatProperty(name="Amount", default=0.0, description="Amount of this lamp in the design")


class SpectralPaletteLight(bpy.types.PropertyGroup):
    """A column: a light."""

    SPECTRUM_KIND = "illuminant"
    name: StringProperty(
        name="Name", update=announces(Topic.PALETTE_NAME), description="Name of this light; each has its own"
    )
    known_as: StringProperty(description="Its name before the last change, by which a look may know it")
    uid: IntProperty()
    design: EnumProperty(
        name="Spectrum", items=DESIGN, default="MEASURED", update=edited, description="Given, or found by the palette"
    )
    spectral: PointerProperty(type=SpectralSpectrum, description="The measured spectrum, or where a design starts from")
    result: PointerProperty(type=SpectralSpectrum, description="The spectrum as the palette has it now")
    intensity: FloatProperty(
        name="Brightness", default=1.0, min=0.001, soft_max=4.0, update=edited,
        description="Brightness of this light relative to the others",
    )  # fmt: skip
    keeps_luminance: BoolProperty(
        name="Keep Brightness", default=False, update=edited, description="A design may not brighten or dim this light"
    )
    looks_white: BoolProperty(
        name="Look White", default=False, update=edited, description="The light itself must look white (D65)"
    )
    white_xyz: FloatVectorProperty(
        name="White", size=3, default=WHITE_XYZ, description="The white that it must look like, as XYZ; D65"
    )
    use_primaries: BoolProperty(
        name="Mix from Lamps", default=False, update=edited,
        description="Mix this light from a list of lamps or LEDs, instead of any spectrum",
    )  # fmt: skip
    primaries: CollectionProperty(type=SpectralPaletteLamp)
    variants: CollectionProperty(
        type=SpectralPaletteLamp, description="Other lights under which matches of this column should hold too"
    )
    light: PointerProperty(
        type=bpy.types.Light, name="Light", update=_remembers("light"),
        description="Blender light that gets this spectrum",
    )  # fmt: skip
    light_name: StringProperty(description="Name of that light when it was chosen: shows if it was deleted")
    world: PointerProperty(
        type=bpy.types.World, name="World", update=_remembers("world"), description="World that gets this spectrum"
    )
    world_name: StringProperty(description="Name of that world when it was chosen")


class SpectralPaletteMaterial(bpy.types.PropertyGroup):
    """A row: a material."""

    SPECTRUM_KIND = "reflectance"
    name: StringProperty(
        name="Name", update=announces(Topic.PALETTE_NAME), description="Name of this material; each has its own"
    )
    known_as: StringProperty(description="Its name before the last change, by which messages may know it")
    uid: IntProperty()
    design: EnumProperty(
        name="Spectrum", items=DESIGN, default="DESIGNED", update=edited, description="Given, or found by the palette"
    )
    spectral: PointerProperty(type=SpectralSpectrum, description="The measured spectrum")
    result: PointerProperty(type=SpectralSpectrum, description="The spectrum as the palette has it now")
    material: PointerProperty(
        type=bpy.types.Material, name="Material", update=_remembers("material"),
        description="Blender material that gets this spectrum",
    )  # fmt: skip
    material_name: StringProperty(description="Name of that material when it was chosen")
    cells: CollectionProperty(type=SpectralPaletteCell)
    locked: BoolProperty(
        name="Lock", default=False, description="Keep this material unchanged while alternatives are found"
    )
    dyes: CollectionProperty(type=SpectralDye)


class SpectralPaletteConflict(bpy.types.PropertyGroup):
    """A cell that misses its target, and its remedy."""

    material_uid: IntProperty()
    light_uid: IntProperty()
    relief_material_uid: IntProperty()
    relief_light_uid: IntProperty()
    text: StringProperty()


class SpectralPalette(bpy.types.PropertyGroup):
    """Table, weights, and the state of the last solve."""

    lights: CollectionProperty(type=SpectralPaletteLight)
    materials: CollectionProperty(type=SpectralPaletteMaterial)
    next_uid: IntProperty(default=1)
    active_row: IntProperty(name="Material", min=0, description="Row of the selected cell")
    active_column: IntProperty(name="Light", min=0, description="Column of the selected cell")

    live: BoolProperty(
        name="Live", default=True, update=announces(Topic.PALETTE_LIVE),
        description="Solve again at every change of a target, weight or light",
    )  # fmt: skip
    in_viewport: BoolProperty(
        name="Show in Viewport", default=True, update=announces(Topic.PALETTE_PICTURE),
        description="Show the solution in Rendered viewports and in the picture of the light dial while "
        "colors are edited, before Apply. Renders show it after Apply",
    )  # fmt: skip
    picture: StringProperty(description="How the last edit is shown in the picture; empty if it is not shown")
    apply_colors: BoolProperty(
        name="Set Colors Too", default=True,
        description="Apply also sets the base colors, the viewport colors and the colors of lamps that Solid mode and "
        "EEVEE show: each material's color in daylight. Linked inputs stay unchanged",
    )  # fmt: skip
    show_curves: BoolProperty(
        name="Curves in the View", default=False, description="Draw all spectra of the palette over the 3D view"
    )
    brightness: FloatProperty(
        name="Light Level", default=3.0, min=0.01, soft_max=10.0, update=edited,
        description="Brightness of all lights. At 1, white needs a surface that reflects everything; more light "
        "leaves room for saturated colors",
    )  # fmt: skip
    level_to: EnumProperty(
        name="Apply It To", default="EXPOSURE", description="How the scene gets the brightness of the palette",
        items=[
            ("EXPOSURE", "View Exposure", "Lights keep their power, so materials with plain colors stay as they are in "
             "the render; the exposure in Color Management shows the palette's colors", 0),
            ("LIGHTS", "Lights", "Lights are multiplied by it: materials with plain colors become brighter too", 1),
        ],
    )  # fmt: skip
    applied_exposure: FloatProperty(description="Stops that Apply has added to the exposure of the view")
    scale_lights: PALETTE_FIELDS["scale_lights"].declared(edited)
    smoothness: PALETTE_FIELDS["smoothness"].declared(edited)
    operator: PALETTE_FIELDS["operator"].declared(edited)
    match: PALETTE_FIELDS["match"].declared(edited)
    rounds: PALETTE_FIELDS["rounds"].declared(edited)
    observers: PALETTE_FIELDS["observers"].declared(edited)
    robustness: PALETTE_FIELDS["robustness"].declared(edited)
    robust_weight: PALETTE_FIELDS["robust_weight"].declared(edited)
    allow_negative: PALETTE_FIELDS["allow_negative"].declared(edited)
    grid_start: PALETTE_FIELDS["grid_start"].declared(edited)
    grid_stop: PALETTE_FIELDS["grid_stop"].declared(edited)
    grid_samples: PALETTE_FIELDS["grid_samples"].declared(edited)

    is_stale: BoolProperty(description="Whether something changed since the last solve")
    is_unfinished: BoolProperty(description="Whether the solution is that of a quick solve, which names no conflicts")
    is_alternative: BoolProperty(description="Whether the shown solution is an alternative that was taken")
    status: StringProperty(description="Status of the last solve: 'solved', 'compromise', …; empty before the first")
    remedy: StringProperty()
    message: StringProperty(description="Error of the palette; empty if none")
    notes: StringProperty(description="Notes on automatic changes, one per line")
    conflicts: CollectionProperty(type=SpectralPaletteConflict)
    possible: PointerProperty(type=SpectralPossible)
    possible_follows: BoolProperty(
        name="Keep Answering", default=True,
        description="Answer for the selected cell whenever it or the table changes, beside other work",
    )  # fmt: skip
    alternatives: CollectionProperty(type=SpectralAlternative)
    alternative_count: IntProperty(
        name="Alternatives", default=4, min=2, max=12, description="Number of alternatives to find"
    )
    use_tints: BoolProperty(
        name="Match as Tints", default=False, update=edited,
        description="Materials that match should also match when mixed as paint into white: 75, 50 and 25 %. Takes "
        "seconds: press Solve",
    )  # fmt: skip
    tint_weight: FloatProperty(
        name="Weight of Tints", default=1.0, min=0.0, soft_max=10.0, max=1000.0, update=edited,
        description="How much tints count beside the cells of the table",
    )  # fmt: skip
    milliseconds: FloatProperty()
    light_scale: FloatProperty(default=1.0)
    worst_delta_e: FloatProperty()


CLASSES = (
    SpectralPaletteLamp,
    SpectralPaletteLight,
    SpectralPaletteMaterial,
    SpectralPaletteConflict,
    SpectralPalette,
)

without_keyframes(*CLASSES)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
