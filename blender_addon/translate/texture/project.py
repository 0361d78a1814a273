# SPDX-License-Identifier: GPL-3.0-or-later
"""The Spectral Texture panel as a texture project of the core, its images as files, and its report as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.types import Image, PropertyGroup
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.files.guarded import is_file
from spectral_core.files.whole import write_bytes
from spectral_core.palette.texture.project import TextureProject, TextureSettings
from spectral_core.palette.texture.uplift import Pin
from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb
from spectral_core.spectra.pictures import png_bytes, write_picture
from spectral_core.spectra.spectrum import Illuminant

from ... import compat
from ...properties.texture_design import TEXTURE_FIELDS
from ..shading.image_files.color_spaces import holds_numbers, is_linear, scene_linear
from ..spectra.stored import spectrum_of

OPAQUE = ("NONE", "CHANNEL_PACKED")
"""Alpha modes in which alpha is no coverage."""
READ_AS_THEY_ARE = (".png", ".jpg", ".jpeg", ".exr", ".hdr", ".bmp", ".tga")
OBSERVERS = {"cie_1964_10deg": "CIE 1964 10°", "cie_2015_2deg": "CIE 2015 2°", "cie_2015_10deg": "CIE 2015 10°"}


def project_of(design: PropertyGroup, folder: Path) -> TextureProject:
    """The project of the panel; images that are no plain files are written into ``folder``.

    Raises InvalidInputError that names the missing picture or light.
    """
    images = [design.first] if design.kind == "ONE" else [design.first, design.second]
    for number, image in enumerate(images, 1):
        if image is None:
            raise InvalidInputError(f"picture {number} is not chosen; choose or open an image")
    sizes = [tuple(image.size) for image in images]
    if len(set(sizes)) > 1:
        named = ", ".join(f"{image.name} {image.size[0]}×{image.size[1]}" for image in images)
        raise InvalidInputError(f"the pictures differ in size: {named}; scale one of them with Image ▸ Resize")
    given = design.kind == "ONE" or design.lights == "GIVEN"
    lights = tuple(_light(design, number) for number in (1, 2)) if given else ()
    values = _offered(design)
    wanted_colors = tuple(
        Pin(linear_from_display_rgb(row.color), linear_from_display_rgb(row.wanted))
        for row in (design.wanted_colors if design.kind == "ONE" else ())
    )
    files = tuple(_file_of(image, folder, number) for number, image in enumerate(images, 1))
    return TextureProject(files, lights, wanted_colors, TextureSettings(**values))


def _offered(design: PropertyGroup) -> dict[str, Any]:
    """The settings that the panel offers for this kind of texture; others may have values that do not fit together."""
    if design.kind == "ONE":
        return {"spectra": max(design.spectra, 8)}
    values = {name: getattr(design, name) for name in TEXTURE_FIELDS}
    for name in ("floor", "slope"):
        values[name] = round(values[name], 6)  # as typed: single precision stores 0.02 and 0.98, together more than 1
    if design.mapping == "uniform_contrast":
        del values["slope"]
    elif values["floor"] + values["slope"] > 1 + 1e-9:
        raise InvalidInputError(
            f"black is shown as {values['floor']:g} and contrast {values['slope']:g} is kept, together more than 1; "
            "lower one of them"
        )
    return values


def _light(design: PropertyGroup, number: int) -> Illuminant:
    holder = getattr(design, f"light_{number}")
    if holder.spectral.source == "NONE":
        raise InvalidInputError(f"light {number} has no spectrum; choose a lamp by name or a file")
    if holder.spectral.message:
        raise InvalidInputError(f"light {number}: {holder.spectral.message}")
    holder.spectral.kind = "ILLUMINANT"
    found = _spectrum(holder)
    return Illuminant(found.name, found.grid, found.values)


def _spectrum(holder: PropertyGroup) -> Any:
    try:
        found = spectrum_of(holder)
    except AttributeError as error:  # an empty spectrum names its owner, and this one has no name
        raise InvalidInputError("a given light has an empty spectrum; choose a lamp by name or a file") from error
    assert found is not None
    return found


def _file_of(image: Image, folder: Path, number: int) -> Path:
    """A file with the picture: its own if the core reads it as Blender shows it, else a new one."""
    path = Path(bpy.path.abspath(image.filepath, library=image.library)) if image.filepath else None
    if path is not None and is_file(path) and _is_read_as_shown(image, path):
        return path.resolve()
    width, height = image.size
    if not width or not height:
        raise InvalidInputError(f"picture {image.name!r} is empty; reload it, or choose another")
    flat = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(flat)
    pixels = flat.reshape(height, width, image.channels)[::-1]
    if image.channels == 4 and image.alpha_mode not in OPAQUE and pixels[..., 3].min() < 1:
        raise InvalidInputError(f"picture {image.name!r} is partly transparent; lay it on a background first")
    colors = np.repeat(pixels[..., :1], 3, axis=2) if image.channels < 3 else pixels[..., :3]
    if image.is_float:
        made = folder / f"picture_{number}.exr"
        write_picture(made, np.ascontiguousarray(_linear_srgb(image, colors)))
        return made
    is_display = image.colorspace_settings.name == "sRGB"
    shown = colors if is_display else display_rgb_from_linear(_linear_srgb(image, colors))
    made = folder / f"picture_{number}.png"
    write_bytes(made, png_bytes(np.round(np.clip(shown, 0, 1) * 255).astype(np.uint8)))
    return made


def _is_read_as_shown(image: Image, path: Path) -> bool:
    """True if nothing was painted or packed, and the core reads the file's colors and alpha as Blender does."""
    ending = path.suffix.lower()
    if image.source != "FILE" or image.is_dirty or image.packed_file is not None or ending not in READ_AS_THEY_ARE:
        return False
    keeps_floats = ending in (".exr", ".hdr")
    return image.alpha_mode not in OPAQUE and (
        is_linear(image) or holds_numbers(image) if keeps_floats else image.colorspace_settings.name == "sRGB"
    )


def _linear_srgb(image: Image, colors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear sRGB (height, width, 3) of an image's pixels; Blender has brought floats to its scene-linear space."""
    space = image.colorspace_settings.name
    if holds_numbers(image) or (is_linear(image) and not image.is_float):
        return colors
    linear = colors if image.is_float else scene_linear(colors, space)
    matrix = compat.rec709_from_working(compat.working_space(bpy.data))
    return (linear @ matrix.T).astype(np.float32)


def report_lines(figures: dict[str, Any]) -> list[str]:
    """The core's figures as text for an artist."""
    lines = []
    if "allowed_contrast" in figures:
        lines.append(
            f"With these lights, unrelated pictures can have a contrast of {figures['allowed_contrast']:.2g}:1."
        )
    for number, loss in enumerate(figures["pictures"], 1):
        text = (
            f"Picture {number}: ΔE {loss['mean_delta_e']:.2f} in the mean, at most {loss['p99_delta_e']:.1f} "
            "at 99 % of the texels"
        )
        if len(figures["pictures"]) > 1:
            text += f"; {100 * loss['ghost']:.1f} % of the other picture is visible"
        lines.append(text + ".")
    if figures["compressed_share"] > 0:
        lines.append(f"{100 * figures['compressed_share']:.1f} % of the texels show the nearest possible color.")
    if "white_delta_e" in figures:
        lines.append(f"Both lights look white: ΔE {max(figures['white_delta_e']):.2f} to daylight.")
        others = [
            f"{OBSERVERS[each['observer']]} {each['to_daylight_delta_e']:.0f}"
            for each in figures["whites"]
            if each["observer"] in OBSERVERS
        ]
        lines.append(f"Other observers see tinted whites, ΔE {', '.join(others)}.")
    return lines
