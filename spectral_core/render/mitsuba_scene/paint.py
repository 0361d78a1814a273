# SPDX-License-Identifier: GPL-3.0-or-later
"""Paints as Mitsuba textures: reflectances in [0, 1], emission in units where white (1, 1, 1) has Y = 1.

Spectral transport: a reflectance color becomes the smooth spectrum of Jakob and Hanika 2019; an emitted color tints
D65; a sampled spectrum is read linearly between its knots and is zero outside. RGB transport: a sampled spectrum
becomes its color, a reflectance under D65.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import limits, radiometry
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.plugins.numbers import table
from spectral_core.render.plugins.paints import spectrum_rows
from spectral_core.render.plugins.surfaces.sources import Kind, Number, Programmed, Sampled, Source, Textured, Tint
from spectral_core.render.trace.wavelengths import single_precision_spectrum
from spectral_core.scene import Color, Computed, ImageTexture, MixedPaint, Paint, Program, Scalar, SpectralImage
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ, linear_from_display_rgb
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import light_tint

Array = NDArray[np.float64]


@cache
def white_light() -> Illuminant:
    """D65 with Y = 1: the spectrum of emitted linear RGB (1, 1, 1), per nm."""
    return normalized(catalogue.illuminant("D65"))


def color(context: Context, paint: Paint, subject: str, *, bright: bool = False) -> Source:
    """A reflectance or transmittance as an input of a closure.

    ``bright``: True if more light may leave than arrives, as in Cycles; otherwise colors above 1 are rendered as 1.
    """
    kind: Kind = "bright" if bright else "color"
    if isinstance(paint, Illuminant):  # a light's spectrum in place of a surface's, such as a Blackbody node's
        return color(context, Color(emitted_rgb(paint)), subject, bright=bright)
    if isinstance(paint, Color):
        hold = limits.without_negative if bright else limits.held
        return Tint(hold(context, paint.linear_rgb, subject), kind)
    if isinstance(paint, Spectrum):
        paint = limits.held_spectrum(context, paint, subject, bright=bright)
    if isinstance(paint, Spectrum) and (not context.spectral or spectrum_rows.fits(paint)):
        most = max(1.0, float(paint.values.max()))  # no more than 1 if the spectrum reaches no more
        return Sampled(paint, kind) if context.spectral else Tint(np.clip(daylight_rgb(paint), 0.0, most), kind)
    if isinstance(paint, Computed):
        return Programmed(paint.program, kind)
    return Textured(reflectance(context, paint, subject), kind)


def number(context: Context, value: Scalar, subject: str) -> Source:
    """A number, constant or varying, as an input of a closure."""
    if isinstance(value, Computed):
        return Programmed(value.program, "number")
    found = scalar(context, value, subject)
    return Number(found) if isinstance(found, float) else Textured(found, "number")


def vector(program: Program) -> Source:
    """A direction as an input of a closure."""
    return Programmed(program, "vector")


def daylight_rgb(reflectance: Spectrum) -> Array:
    """Linear sRGB (3,) of a reflectance under white light; outside its gamut some are below 0 or above 1."""
    return np.asarray(RGB_FROM_XYZ @ xyz_of(white_light(), reflectance))


def reflectance(context: Context, paint: Paint, subject: str) -> Any:
    """Texture of a reflectance; colors above 1 are rendered as 1, with a note under ``subject``."""
    if isinstance(paint, Color):
        held = context.mitsuba.ScalarColor3f(limits.held(context, paint.linear_rgb, subject))
        return context.load({"type": "srgb", "color": held})
    if isinstance(paint, Illuminant):  # a light's spectrum in place of a surface's, such as a Blackbody node's
        return reflectance(context, Color(emitted_rgb(paint)), subject)
    if isinstance(paint, Spectrum):
        paint = limits.held_spectrum(context, paint, subject)
        if context.spectral:
            return sampled_spectrum(context, paint)
        return reflectance(context, Color(np.clip(daylight_rgb(paint), 0.0, 1.0)), subject)
    if isinstance(paint, ImageTexture):
        return image(context, paint, subject)
    if isinstance(paint, SpectralImage):
        return spectral_image(context, paint, subject)
    if isinstance(paint, MixedPaint):
        return _mixed(context, paint, lambda part: reflectance(context, part, subject))
    return context.computed(paint.program)


def emission(context: Context, paint: Paint, strength: float, subject: str) -> Any:
    """Texture of emitted radiance ``paint · strength``."""
    if isinstance(paint, (Color, Spectrum)):
        limits.note_unlike_light(context, paint, context.white or white_light(), subject)
        return constant_emission(context, paint, strength)
    if isinstance(paint, ImageTexture):
        return _emitting_image(context, paint, strength, subject)
    if isinstance(paint, Computed):
        return context.computed(paint.program, constant_emission(context, Color(np.ones(3)), strength))
    if isinstance(paint, SpectralImage):
        context.note(subject, "emits light through a spectral texture; it is emitted in its color under D65")
        return _emitting_image(context, in_daylight(paint), strength, subject)
    return _mixed(context, paint, lambda part: emission(context, part, strength, subject))


def constant_emission(context: Context, paint: Color | Spectrum, strength: float) -> Any:
    """Constant texture of an emitted spectrum, in radiance or, for lights, in radiant intensity."""
    if context.spectral:
        return sampled_spectrum(context, radiometry.at_strength(emitted_spectrum(paint, context.white), strength))
    rgb = emitted_rgb(paint) * strength
    return context.load({"type": "srgb", "color": context.mitsuba.ScalarColor3f(rgb), "unbounded": True})


def emitted_rgb(paint: Color | Spectrum) -> Array:
    """Linear sRGB (3,) of an emission; Y = 1 for a sampled spectrum."""
    if isinstance(paint, Color):
        return np.asarray(paint.linear_rgb)
    rgb = RGB_FROM_XYZ @ xyz_of(unit_luminance(paint))
    # the blue of a black body below 1900 K is outside of sRGB; Cycles cuts it off
    return np.maximum(rgb, 0.0) if paint.source == catalogue.PLANCK else rgb


def emitted_spectrum(paint: Color | Spectrum, white: Spectrum | None = None) -> Spectrum:
    """Radiance per nm of a light: ``white`` (D65) tinted by a color, or a sampled spectrum with Y = 1."""
    if isinstance(paint, Spectrum):
        return unit_luminance(paint)
    white = white or white_light()
    if float(paint.linear_rgb.max()) <= 0:
        return white.scaled(0.0)
    # between the knots of the white and of 1 nm: the color varies slowly, a white such as HP1 may not; the knots are
    # the same for all colors, so that another color needs no new kernel
    grid = SpectralGrid(np.union1d(WAVELENGTHS_NM, white.grid.wavelengths_nm))
    tinted = white.at(grid.wavelengths_nm) * light_tint(paint.linear_rgb, white, grid.wavelengths_nm)
    return Spectrum("emitted color", grid, tinted)


def unit_luminance(light: Spectrum) -> Spectrum:
    """The light scaled to Y = 1 under a perfect white; a light of zero stays zero."""
    if not np.any(light.values):
        return light
    return normalized(Illuminant(light.name, light.grid, light.values, source=light.source))


def sampled_spectrum(context: Context, spectrum: Spectrum) -> Any:
    """The spectrum in Mitsuba, with the same knots: linear in between, zero outside."""
    knots, values = spectrum.grid.wavelengths_nm, spectrum.values
    if not np.any(values):  # Mitsuba refuses a sampled spectrum that is zero everywhere
        return context.load({"type": "uniform", "value": 0.0})
    steps = np.diff(knots)
    # a regular spectrum needs no search; the ends of one of few nm would be rounded, and its power with them
    if np.ptp(steps) < 1e-9 * knots[-1] and knots[-1] - knots[0] > 2.0:
        ends = {"wavelength_min": float(knots[0]), "wavelength_max": float(knots[-1])}
        return context.load({"type": "regular", **ends, "values": _listed(values)})
    knots, values = single_precision_spectrum(spectrum)
    return context.load({"type": "irregular", "wavelengths": _listed(knots), "values": _listed(values)})


def _listed(numbers: Array) -> str:
    return ",".join(f"{number:.9g}" for number in numbers)


def typical_number(value: Scalar) -> float:
    """A number, or the mean of one that varies."""
    if isinstance(value, Computed):
        return float(np.mean(value.typical))
    return float(color_pixels(value).mean()) if isinstance(value, ImageTexture) else float(value)


@dataclass(frozen=True, eq=False)
class Made:
    """An existing texture in place of a number or an image."""

    texture: Any


def scalar(context: Context, value: Scalar, subject: str, power: float = 1.0) -> Any:
    """A constant number as float, a varying one as texture; ``power`` is applied to either."""
    if isinstance(value, Computed):
        return context.computed(value.program)
    if isinstance(value, Made):
        return value.texture
    if not isinstance(value, ImageTexture):
        return float(value) ** power
    amounts = color_pixels(value)
    return bitmap(context, value, amounts[..., :3].mean(axis=2, keepdims=True) ** power, subject)


def scalar_texture(context: Context, value: Scalar, subject: str) -> Any:
    """Like ``scalar``, but a texture in both cases."""
    found = scalar(context, value, subject)
    return context.constant(found) if isinstance(found, float) else found


def image(context: Context, texture: ImageTexture, subject: str) -> Any:
    """Texture of an image's colors (the material uses its alpha), clipped to [0, 1]."""
    pixels = color_pixels(texture)
    if pixels.min() < 0 or pixels.max() > 1:
        context.note(subject, f"uses image {texture.name!r} with values outside 0 to 1; they are rendered at the limit")
        pixels = np.clip(pixels, 0.0, 1.0)
    return bitmap(context, texture, pixels if pixels.shape[2] == 3 else np.repeat(pixels, 3, axis=2), subject)


def spectral_image(context: Context, paint: SpectralImage, subject: str) -> Any:
    """Texture of reflectances; in RGB transport their colors under D65."""
    if not context.spectral:
        return image(context, in_daylight(paint), subject)
    mi = context.mitsuba
    knots = paint.grid.wavelengths_nm
    even = np.linspace(knots[0], knots[-1], max(2, round((knots[-1] - knots[0]) / np.diff(knots).min()) + 1))
    spectra = np.stack([np.interp(even, knots, row) for row in paint.spectra], axis=-1)
    weights = np.moveaxis(paint.weights, 0, -1).astype(np.float32)
    return context.load(
        {
            "type": "spectral_image",
            "weights": mi.TensorXf(table(mi.Float, weights), weights.shape),
            "spectra": mi.TensorXf(table(mi.Float, spectra), spectra.shape),
            "first_nm": float(knots[0]),
            "last_nm": float(knots[-1]),
            "wrap_mode": {"repeat": "repeat", "clip": "clamp", "extend": "clamp", "mirror": "mirror"}[paint.extension],
            "filter_type": "bilinear" if paint.interpolation == "linear" else "nearest",
            "u_row": mi.ScalarVector3f(paint.uv_from_mesh_uv[0]),
            "v_row": mi.ScalarVector3f(paint.uv_from_mesh_uv[1]),
        }
    )


def in_daylight(paint: SpectralImage) -> ImageTexture:
    """The colors of a spectral image under D65."""
    pixels = np.clip(paint.linear_rgb(white_light()), 0.0, 1.0)
    return ImageTexture(paint.name, pixels, "linear", paint.extension, paint.interpolation, paint.uv_from_mesh_uv)


def _emitting_image(context: Context, texture: ImageTexture, strength: float, subject: str) -> Any:
    name = f"emits image {texture.name!r} with colors"
    pixels = limits.without_negative(context, color_pixels(texture), subject, name)
    largest = float(pixels.max())
    if largest == 0:
        return context.load({"type": "uniform", "value": 0.0})
    share = np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels
    colors = bitmap(context, texture, share / largest, subject)
    white = constant_emission(context, Color(np.ones(3)), strength * largest)
    return context.load({"type": "product_paint", "color": colors, "amount": white, "colored": True})


def color_pixels(texture: ImageTexture) -> NDArray[np.float32]:
    """Linear pixels (height, width, 1 or 3), row 0 at the bottom, alpha left out."""
    pixels = texture.pixels[..., :3]
    if pixels.dtype == np.uint8:
        levels = np.arange(256) / 255.0
        levels = linear_from_display_rgb(levels) if texture.color_space == "srgb" else levels
        return levels.astype(np.float32)[pixels]
    if texture.color_space == "srgb":
        return linear_from_display_rgb(pixels).astype(np.float32)
    return pixels


def bitmap(context: Context, texture: ImageTexture, pixels: NDArray[np.float32], subject: str) -> Any:
    """Texture of pixels (height, width, 1 or 3) with the placement of an image: numbers, or colors that are
    upsampled.
    """
    mi = context.mitsuba
    uv = texture.uv_from_mesh_uv
    if texture.extension == "clip":  # a frame of zeros that the clamped borders then repeat
        height, width = pixels.shape[:2]
        pixels = np.pad(pixels, ((1, 1), (1, 1), (0, 0)))
        inward = np.array(
            [[width / (width + 2), 0, 1 / (width + 2)], [0, height / (height + 2), 1 / (height + 2)], [0, 0, 1]]
        )
        uv = inward @ uv
    if texture.interpolation == "cubic":
        context.note(subject, f"uses image {texture.name!r} with cubic interpolation, which is rendered as linear")
    wrap = {"repeat": "repeat", "clip": "clamp", "extend": "clamp", "mirror": "mirror"}[texture.extension]
    return context.load(
        {
            "type": "bitmap",
            # as a Bitmap, not as a tensor: only a Bitmap is upsampled to spectra in spectral transport
            "bitmap": mi.Bitmap(np.ascontiguousarray(pixels, dtype=np.float32)),
            "raw": pixels.shape[2] == 1 or not context.spectral,
            "wrap_mode": wrap,
            "filter_type": "nearest" if texture.interpolation == "nearest" else "bilinear",
            "to_uv": mi.ScalarTransform3f(uv),
        }
    )


def _mixed(context: Context, paint: MixedPaint, part: Any) -> Any:
    factor = scalar_texture(context, paint.factor, "")
    first, second = part(paint.first), part(paint.second)
    return context.load({"type": "mixed_paint", "factor": factor, "first": first, "second": second})
