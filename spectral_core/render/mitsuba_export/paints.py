# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors, numbers and emission as XML; spectra stay spectra, in files of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.files.exr import openexr, write_exr
from spectral_core.render.mitsuba_export import xml_elements as xml
from spectral_core.render.mitsuba_export.draft import Draft
from spectral_core.render.mitsuba_scene.paint import color_pixels, emitted_rgb, emitted_spectrum, in_daylight
from spectral_core.scene import Color, Computed, ImageTexture, MixedPaint, Paint, Scalar, SpectralImage
from spectral_core.spectra.files import mitsuba_spd
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import upsampled

Array = NDArray[np.float64]

Y_OF_MITSUBA = 106.7502593994140625
"""Mitsuba's integral of ȳ: in its unit a flat spectrum of 1 has luminance 1, in ours one of 1 over the integral."""
SMALLEST_BAKE, LARGEST_BAKE = 512, 2048
"""Sides in pixels of an image that holds a node tree."""
_UPRIGHT = np.array([[1.0, 0, 0], [0, -1, 1], [0, 0, 1]])
"""Mitsuba's v runs down an image, Blender's up: from one to the other and back."""


def reflectance(draft: Draft, name: str, paint: Paint, subject: str, power: float = 1.0) -> xml.Element:
    """A reflectance or transmittance, raised to ``power``."""
    if isinstance(paint, Illuminant):
        paint = Color(emitted_rgb(paint))
    if isinstance(paint, MixedPaint):
        paint = _mixed(draft, paint, subject)
    if isinstance(paint, SpectralImage):
        draft.note(subject, f"the spectral texture {paint.name!r} is written in its colors under D65")
        paint = in_daylight(paint)
    if isinstance(paint, Computed):
        paint = baked(draft, paint, subject)
    if isinstance(paint, Spectrum):
        held = np.clip(paint.values, 0.0, 1.0) ** power
        return xml.spectrum(name, spectrum_file(draft, Spectrum(paint.name, paint.grid, held), (paint, power)))
    if isinstance(paint, ImageTexture):
        pixels = np.clip(color_pixels(paint), 0.0, 1.0) ** power
        return bitmap(draft, name, paint, pixels, f"color {power}")
    rgb = np.asarray(paint.linear_rgb)
    if rgb.min() < 0 or rgb.max() > 1:
        draft.note(subject, "has a color outside 0 to 1, which no surface reflects; it is written at the limit")
    return xml.rgb(name, np.clip(rgb, 0.0, 1.0) ** power)


def amount(
    draft: Draft, name: str, value: Scalar, subject: str, power: float = 1.0, *, complement: bool = False
) -> xml.Element:
    """A number, or an image of numbers, raised to ``power``; ``complement``: one minus that."""
    if isinstance(value, Computed):
        found = baked(draft, value, subject)
        value = float(found.linear_rgb[0]) if isinstance(found, Color) else found
    if isinstance(value, ImageTexture):
        pixels = color_pixels(value)[..., :3].mean(axis=2, keepdims=True) ** power
        return bitmap(draft, name, value, 1.0 - pixels if complement else pixels, f"number {power} {complement}")
    made = float(value) ** power
    return xml.number(name, 1.0 - made if complement else made)


def emission(draft: Draft, name: str, paint: Paint, strength: float, subject: str) -> xml.Element:
    """Radiance, intensity or irradiance ``paint · strength``, brightened by the film's exposure."""
    strength *= draft.brightness
    if isinstance(paint, MixedPaint):
        paint = _mixed(draft, paint, subject)
    if isinstance(paint, SpectralImage):
        draft.note(subject, "emits light through a spectral texture; it is written in its color under D65")
        paint = in_daylight(paint)
    if isinstance(paint, Computed):
        paint = baked(draft, paint, subject)
    if isinstance(paint, ImageTexture):
        draft.note(subject, "emits light through an image, which spectral variants of Mitsuba limit to 1 per channel")
        return bitmap(draft, name, paint, np.maximum(color_pixels(paint), 0.0) * strength, f"light {strength}")
    if isinstance(paint, Color) and draft.white is None:
        return xml.rgb(name, np.maximum(paint.linear_rgb, 0.0) * strength)
    light = emitted_spectrum(paint, draft.white)
    scaled = Spectrum(light.name, light.grid, light.values * strength * Y_OF_MITSUBA)
    label = paint.name if isinstance(paint, Spectrum) else subject
    if not np.any(scaled.values):
        return xml.rgb(name, np.zeros(3))
    return xml.spectrum(name, spectrum_file(draft, Spectrum(label, scaled.grid, scaled.values)))


def spectrum_file(draft: Draft, spectrum: Spectrum, content: Any = None) -> str:
    """Path of a spectrum's file."""
    return draft.file("spectra", spectrum.name, ".spd", lambda path: mitsuba_spd.write(path, spectrum), content)


def image_file(draft: Draft, name: str, pixels: NDArray[np.float32], content: Any = None) -> str:
    """Path of an EXR file of linear pixels (height, width, 1 or 3), first row at the top."""

    def write(path: Path) -> None:
        kept = np.ascontiguousarray(pixels, dtype=np.float32)
        channels = {"Y": kept[..., 0].copy()} if kept.shape[2] == 1 else {"RGB": kept}
        module = openexr()
        header = {"compression": module.ZIP_COMPRESSION, "type": module.scanlineimage}
        write_exr(path, module.File(header, channels))

    return draft.file("textures", name, ".exr", write, content)


def bitmap(draft: Draft, name: str, texture: ImageTexture, pixels: NDArray[np.float32], use: str) -> xml.Element:
    """A texture of pixels (height, width, 1 or 3) with the placement of an image."""
    uv = texture.uv_from_mesh_uv
    if texture.extension == "clip":  # a frame of zeros that the clamped borders then repeat
        height, width = pixels.shape[:2]
        pixels = np.pad(pixels, ((1, 1), (1, 1), (0, 0)))
        shares = width / (width + 2), height / (height + 2)
        uv = np.array([[shares[0], 0, 1 / (width + 2)], [0, shares[1], 1 / (height + 2)], [0, 0, 1]]) @ uv
    if texture.interpolation == "cubic":
        draft.note(texture.name, "its cubic interpolation is written as linear")
    path = image_file(draft, texture.name, pixels[::-1], (texture.pixels, texture.extension, use))
    children = [
        xml.string("filename", path),
        xml.string("wrap_mode", {"repeat": "repeat", "mirror": "mirror"}.get(texture.extension, "clamp")),
        xml.string("filter_type", "nearest" if texture.interpolation == "nearest" else "bilinear"),
        xml.boolean("raw", pixels.shape[2] == 1),
    ]
    if not np.array_equal(uv, np.eye(3)):
        children.append(xml.transform("to_uv", _UPRIGHT @ uv @ _UPRIGHT))
    return xml.plugin("texture", "bitmap", *children, name=name)


def baked(draft: Draft, paint: Computed, subject: str) -> ImageTexture | Color:
    """A node tree as an image over the UV square where it reads UV alone, else its mean; both with a note."""
    if id(paint) in draft.kept:
        found: ImageTexture | Color = draft.kept[id(paint)][0]
        return found
    program = paint.program
    if program.inputs <= {"uv"}:
        size = max((max(image.pixels.shape[:2]) for image in program.images if hasattr(image, "pixels")), default=0)
        size = min(max(size, SMALLEST_BAKE), LARGEST_BAKE)
        made: ImageTexture | Color = _image_of(paint, f"{subject} tree", size)
        draft.note(subject, f"a node tree is written as an image of {size} × {size} pixels over the UV square")
    else:
        made = Color(np.broadcast_to(paint.typical, (3,)))
        names = ", ".join(sorted(program.inputs))
        draft.note(subject, f"a node tree reads {names}, which no image over UV holds; its mean is written")
    draft.kept[id(paint)] = (made, paint)
    return made


def _image_of(paint: Computed, name: str, size: int) -> ImageTexture:
    centers = (np.arange(size) + 0.5) / size
    u, v = (part.ravel() for part in np.meshgrid(centers, centers))
    values = paint.program.evaluate(lambda _name, _shift: (u, v, np.zeros_like(u)), np.float32)
    planes = values.reshape(len(values), -1)
    pixels = np.broadcast_to(planes, (size * size, planes.shape[1])).reshape(size, size, -1)
    return ImageTexture(name, np.nan_to_num(pixels).astype(np.float32), "linear")


def _mixed(draft: Draft, paint: MixedPaint, subject: str) -> Color | Spectrum | ImageTexture | SpectralImage | Computed:
    """A mix of two constant paints as one; the likelier part, with a note, of any other."""
    parts = [_mixed(draft, p, subject) if isinstance(p, MixedPaint) else p for p in (paint.first, paint.second)]
    share = paint.factor
    if isinstance(share, (int, float)) and all(isinstance(part, (Color, Spectrum)) for part in parts):
        if all(isinstance(part, Color) for part in parts):
            first, second = (np.asarray(part.linear_rgb) for part in parts if isinstance(part, Color))
            return Color((1 - share) * first + share * second)
        grid = SpectralGrid(WAVELENGTHS_NM)
        first, second = (_sampled(part, grid.wavelengths_nm) for part in parts)
        return Spectrum(f"{subject} mix", grid, (1 - share) * first + share * second)
    draft.note(subject, "mixes paints by a factor that varies, or with images; the larger part is written")
    if isinstance(share, (int, float)):
        return parts[1] if share > 0.5 else parts[0]
    typical = float(np.mean(share.typical)) if isinstance(share, Computed) else float(color_pixels(share).mean())
    return parts[1] if typical > 0.5 else parts[0]


def _sampled(paint: Any, wavelengths_nm: Array) -> Array:
    if isinstance(paint, Spectrum):
        return np.asarray(paint.at(wavelengths_nm))
    return np.asarray(upsampled(np.clip(paint.linear_rgb, 0.0, 1.0), wavelengths_nm))
