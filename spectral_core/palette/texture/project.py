# SPDX-License-Identifier: GPL-3.0-or-later
"""The inputs of a spectral texture as a document, and the design of the texture from them.

A document names pictures, lights and wanted colors. The panel in Blender, the command line and a script make the same
document.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from spectral_core.checks import require_declared, require_range, require_whole
from spectral_core.documents import Schema, read_document
from spectral_core.documents.codecs import SpectrumFiles, decoded_color, decoded_spectrum
from spectral_core.errors import InvalidInputError
from spectral_core.palette.given import require_each
from spectral_core.palette.texture.basis import MOST_SPECTRA
from spectral_core.palette.texture.lights import LightDesign, design_lights, led_range
from spectral_core.palette.texture.pinned import FEWEST_SPECTRA, design_pinned_texture
from spectral_core.palette.texture.reach import TEXTURE_GRID, ReachableContrast, reachable_contrast
from spectral_core.palette.texture.texture import (
    MOST_FLOOR,
    Mapping,
    Picture,
    TextureDesign,
    design_texture,
    require_one_size,
)
from spectral_core.palette.texture.uplift import Pin, PinResult
from spectral_core.spectra.spectrum import Illuminant

FORMAT = "spectral-scene texture"
VERSION = 1
TEXTURE_SCHEMA = Schema("spectral_core.palette.texture", "texture.schema.json")
DESIGNED_FLOOR, GIVEN_FLOOR = 0.02, 0.1
"""Gray that replaces black by default: designed lights allow far more contrast than given ones."""
OF_TWO_PICTURES = ("floor", "slope", "mapping", "importance")
OF_DESIGNED_LIGHTS = ("daylight_share", "led_width_nm")
"""Settings that are for two pictures, and for lights that are designed."""
_LIGHTS_SHARE, _BASIS_SHARE = 0.45, 0.75
"""Share of the work done when the lights are known, and when the basis is."""


@dataclass(frozen=True, slots=True, eq=False)
class TextureSettings:
    """Settings of a texture. A value of None is chosen by the design.

    ``floor``: gray in place of black; ``slope``: contrast kept; ``mapping``: treatment of colors that cannot be
    reached; ``spectra``: K; ``importance``: weight of picture 1 over picture 2; ``daylight_share`` and
    ``led_width_nm``: of designed lights.
    """

    floor: float | None = None
    slope: float | None = None
    mapping: Mapping = "least_delta_e"
    spectra: int | None = None
    importance: float = 1.0
    daylight_share: float = 0.0
    led_width_nm: float = 20.0

    def __post_init__(self) -> None:
        require_declared(self)
        require_range("daylight_share", self.daylight_share, 0.0, 0.9)
        require_range("led_width_nm", self.led_width_nm, 5.0, 60.0, " nm")
        require_range("importance", self.importance, 1e-3, 1e3)
        if self.floor is not None:
            require_range("floor", self.floor, 0.0, MOST_FLOOR)
        if self.slope is not None:  # with the default floor, the design itself refuses a sum over 1
            require_range("slope", self.slope, 0.0, round(1.0 - (self.floor or 0.0), 12))


@dataclass(frozen=True, slots=True, eq=False)
class TextureProject:
    """Pictures (files), lights (none: designed), wanted colors (of one picture), settings."""

    pictures: tuple[Path, ...]
    lights: tuple[Illuminant, ...] = ()
    wanted_colors: tuple[Pin, ...] = ()
    settings: TextureSettings = TextureSettings()

    def __post_init__(self) -> None:
        require_declared(self)
        require_each("lights", self.lights, Illuminant, "an Illuminant")
        require_each("wanted_colors", self.wanted_colors, Pin, "a Pin")
        if len(self.pictures) not in (1, 2):
            raise InvalidInputError(
                f"one surface takes one picture with wanted colors or two pictures; got {len(self.pictures)}"
            )
        if len(self.lights) not in (0, 2):
            raise InvalidInputError(
                f"got {len(self.lights)} of the lights; a texture needs two, or none for two pictures, whose lights "
                "are then designed"
            )
        if len(self.pictures) == 1 and not self.lights:
            raise InvalidInputError("one picture needs two lights: its own, and that of the wanted colors")
        if self.settings.spectra is not None:
            fewest = FEWEST_SPECTRA if len(self.pictures) == 1 else 3 * len(self.pictures)
            require_whole("the number of basis spectra", self.settings.spectra, fewest, MOST_SPECTRA)
        if len(self.pictures) == 2 and self.wanted_colors:
            raise InvalidInputError("wanted colors are for one picture; with two pictures the second gives the colors")


@dataclass(frozen=True, slots=True, eq=False)
class TextureOutcome:
    """The texture, the design of the lights if they were designed, and the outcome of each wanted color.

    ``notes``: settings of the project that had no effect.
    """

    design: TextureDesign
    allowed: ReachableContrast | None
    designed_lights: LightDesign | None = None
    wanted_colors: tuple[PinResult, ...] = ()
    notes: tuple[str, ...] = ()


def without_effect(project: TextureProject) -> tuple[str, ...]:
    """A note for each cause by which settings of a project have no effect; those with their default need none."""
    plain = TextureSettings()
    changed = [each.name for each in fields(plain) if getattr(project.settings, each.name) != getattr(plain, each.name)]
    causes: list[tuple[tuple[str, ...], str]]
    if len(project.pictures) == 1:
        causes = [(OF_TWO_PICTURES + OF_DESIGNED_LIGHTS, "one picture is designed without them; they are for two")]
    else:
        causes = [(OF_DESIGNED_LIGHTS, "both lights are given")] if project.lights else []
        if project.settings.mapping == "uniform_contrast":
            causes.append((("slope",), "uniform_contrast keeps as much contrast as every texel can show"))
    found = [([name for name in names if name in changed], why) for names, why in causes]
    return tuple(f"settings without effect: {', '.join(names)}; {why}" for names, why in found if names)


def run_project(
    project: TextureProject,
    pictures: Sequence[Picture],
    progress: Callable[[float, str], None] | None = None,
) -> TextureOutcome:
    """Design the texture of ``project``.

    Parameters
    ----------
    project : the requests.
    pictures : its pictures, as read.
    progress : called with the share done, from 0 to 1, and the name of the present task.

    Raises
    ------
    InvalidInputError : pictures of different sizes, or lights, a basis or wanted colors that cannot be used.
    """
    settings = project.settings

    def tell(share: float, what: str) -> None:
        if progress is not None:
            progress(share, what)

    def texels(share: float) -> None:
        tell(_BASIS_SHARE + (0.95 - _BASIS_SHARE) * share, "texels")

    if len(pictures) == 1:
        tell(0.0, "spectra for the wanted colors")
        first, second = project.lights
        pinned = design_pinned_texture(
            pictures[0], first, second, project.wanted_colors, count=settings.spectra or 8, progress=texels
        )
        return TextureOutcome(pinned.design, None, wanted_colors=pinned.uplift.pins, notes=without_effect(project))
    require_one_size(pictures)
    tell(0.0, "lights")
    designed = None
    lights = project.lights
    floor = settings.floor
    if lights:
        floor = GIVEN_FLOOR if floor is None else floor
        allowed = reachable_contrast(lights, max(floor, 0.01))
    else:
        designed = design_lights(led_range(settings.led_width_nm), daylight_share=settings.daylight_share)
        lights = designed.lights
        floor = DESIGNED_FLOOR if floor is None else floor
        allowed = reachable_contrast(lights, designed.floor)
    tell(_LIGHTS_SHARE, "spectra")
    design = design_texture(
        pictures, lights, floor=floor, slope=settings.slope, mapping=settings.mapping,
        count=settings.spectra or (8 if project.lights else 6), importance=(settings.importance, 1.0),
        progress=texels,
    )  # fmt: skip
    return TextureOutcome(design, allowed, designed, notes=without_effect(project))


def read_project(path: str | Path) -> TextureProject:
    """The texture document in a TOML or JSON file. Raises FileFormatError (file, and place in the document)."""
    return read_document(path, project_of, "a texture")


def project_of(document: dict[str, Any], folder: Path) -> TextureProject:
    """The project that a document states; its files are sought in ``folder``. Raises InvalidInputError."""
    TEXTURE_SCHEMA.require_valid(document)
    files = SpectrumFiles(folder)
    lights = tuple(decoded_spectrum(each, "illuminant", TEXTURE_GRID, files) for each in document.get("lights", ()))
    # "wishes" is the key that earlier versions wrote.
    listed = [*document.get("wanted_colors", ()), *document.get("wishes", ())]
    wanted_colors = [Pin(decoded_color(each["color"]), decoded_color(each["wanted"])) for each in listed]
    return TextureProject(
        tuple(folder / name for name in document["pictures"]),
        tuple(Illuminant(light.name, light.grid, light.values) for light in lights),
        tuple(wanted_colors),
        TextureSettings(**document.get("settings", {})),
    )


def document_of(project: TextureProject) -> dict[str, Any]:
    """The project as strings, numbers, lists and tables. Entries with their default are omitted."""
    plain = TextureSettings()
    settings = {
        each.name: getattr(project.settings, each.name)
        for each in fields(TextureSettings)
        if getattr(project.settings, each.name) != getattr(plain, each.name)
    }
    document: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "pictures": [str(path) for path in project.pictures],
    }
    if project.lights:
        document["lights"] = [
            {"name": each.name, "wavelengths_nm": each.grid.wavelengths_nm.tolist(), "values": each.values.tolist()}
            for each in project.lights
        ]
    if settings:
        document["settings"] = settings
    if project.wanted_colors:
        document["wanted_colors"] = [
            {"color": pin.color.tolist(), "wanted": pin.wanted.tolist()} for pin in project.wanted_colors
        ]
    return document
