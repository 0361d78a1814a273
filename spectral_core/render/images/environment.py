# SPDX-License-Identifier: GPL-3.0-or-later
"""An environment image as Mitsuba's emitter, and its pixels as Mitsuba reads them."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import paint
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.scene import DrawnPattern, ImageTexture, World
from spectral_core.spectra.color import luminance_from_linear_rgb

ENVIRONMENT_AXES = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Mitsuba's environment has +y up and -z at its left edge; Blender's +z up and -x there."""
BRIGHTER, LEAST = 4.0, 1e-7
"""Ratio of a neighbor's brightness to a pixel's from which on the neighbor determines the pixel's hue, and brightness
of a black pixel beside it, relative to it.
"""
MOST_ROWS, FINEST = 256, 9
"""Rows of an environment whose pixels are divided, at most, and parts of a pixel's side."""


def rows_from_pole_to_pole(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same image with its first and last row at the poles, as Mitsuba reads it.

    An image's rows are centers of equal bands. Twice as many rows and one hold a linear interpolation between them
    exactly; an image of 1024 rows or more is fine enough to keep its size.
    """
    height, width = rows.shape[:2]
    nodes = 2 * height + 1 if height < 1024 else height
    place = np.clip(np.linspace(0, height, nodes) - 0.5, 0, height - 1)
    low = np.minimum(place.astype(int), max(height - 2, 0))
    high = np.minimum(low + 1, height - 1)
    share = (place - low)[:, None, None].astype(np.float32)
    resampled = rows[low] * (1 - share) + rows[high] * share
    if width < 2:
        resampled = np.repeat(resampled, 2, axis=1)
    return np.ascontiguousarray(resampled, dtype=np.float32)


def divided(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same image, interpolated linearly, with divided pixels; at most ``MOST_ROWS`` rows, twice as many columns.

    In spectral transport Mitsuba interpolates the spectra of neighboring pixels and their brightness apart, and
    multiplies the two: between pixels that differ in both, the color is not that between them. Its error falls with
    the square of the number of parts. An odd number keeps the centers of the pixels.
    """
    height, width = pixels.shape[:2]
    parts = min(FINEST, (MOST_ROWS // max(height, -(-width // 2)) - 1) // 2 * 2 + 1)
    if parts < 2:
        return pixels
    modes: tuple[Literal["clip", "wrap"], ...] = ("clip", "wrap")  # the last column lies beside the first one
    for axis, size, mode in zip((0, 1), (height, width), modes, strict=True):
        place = (np.arange(size * parts) + 0.5) / parts - 0.5
        low = np.floor(place).astype(int)
        share = (place - low).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        first, second = (pixels.take(each, axis=axis, mode=mode) for each in (low, low + 1))
        pixels = first * (1 - share) + second * share
    return np.ascontiguousarray(pixels, dtype=np.float32)


def with_hues_of_brighter_neighbors(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same image, in which a pixel beside a much brighter one has the hue of that one.

    Between them Mitsuba multiplies a mean of hues by a mean of brightness (``divided``): a sun of one pixel in a black
    sky lost a third of its light, and one in a blue sky a part of its red. With equal hues the product is exact. The
    hue that the dim pixel loses is that of little light.
    """
    from scipy.ndimage import maximum_filter

    brightness = pixels.max(axis=2)
    most = maximum_filter(brightness, size=3, mode=("nearest", "wrap"))
    # lists, not images: such pixels are few, and an image may have a hundred million
    rows, columns = np.nonzero(BRIGHTER * brightness < most)
    if not rows.size:
        return pixels
    height, width = brightness.shape
    own, brightest = pixels[rows, columns].astype(np.float64), np.zeros((rows.size, 3))
    for down, across in ((d, a) for d in (-1, 0, 1) for a in (-1, 0, 1) if d or a):
        near = pixels[np.clip(rows + down, 0, height - 1), (columns + across) % width].astype(np.float64)
        brightest = np.where((near.max(axis=1) > brightest.max(axis=1))[:, None], near, brightest)
    light, other = (luminance_from_linear_rgb(each)[:, None] for each in (own, brightest))
    share = BRIGHTER * own.max(axis=1, keepdims=True) / brightest.max(axis=1, keepdims=True)
    hue = share * own / np.maximum(light, 1e-30) + (1 - share) * brightest / np.maximum(other, 1e-30)
    hue /= np.maximum(luminance_from_linear_rgb(hue)[:, None], 1e-30)
    changed = pixels.copy()
    changed[rows, columns] = hue * np.maximum(light, LEAST * other)
    return changed


def environment(context: Context, world: World, image: ImageTexture) -> Any | None:
    """Mitsuba's environment of an image, or None for a black one."""
    pixels = paint.color_pixels(image)
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    if isinstance(image, DrawnPattern) and not pixels.any():  # its details may lie between the pixels
        pixels = np.full_like(pixels, 1e-20)
    made = _signed(context, world, pixels)
    if made is None or not isinstance(image, DrawnPattern):
        return made
    radiance = paint.emission(context, image.pattern, float(world.strength), "World")
    turn = context.mitsuba.ScalarTransform4f(world.world_from_environment)
    parts = {"environment": made, "pattern": context.switched(radiance, world.group), "to_world": turn}
    rays = {"tells_rays": image.tells_rays, "is_only_met": image.is_only_met}
    return context.load({"type": "patterned_environment", **rays, **parts})


def _signed(context: Context, world: World, pixels: NDArray[np.float32]) -> Any | None:
    """An environment whose pixels may be below zero; None for a black one."""
    if pixels.min() >= 0:
        return _environment_of(context, world, pixels) if pixels.any() else None
    # without a pixel above 0 Mitsuba would refuse a part
    parts = {"bright": np.maximum(pixels, 1e-20), "dark": np.maximum(-pixels, 1e-20), "magnitude": np.abs(pixels)}
    made = {name: _environment_of(context, world, part) for name, part in parts.items()}
    return context.load({"type": "signed_environment", **made})


def _environment_of(context: Context, world: World, pixels: NDArray[np.float32]) -> Any:
    mi = context.mitsuba
    rows_from_top = rows_from_pole_to_pole((divided(pixels) if context.spectral else pixels)[::-1])
    if context.spectral:
        rows_from_top = with_hues_of_brighter_neighbors(rows_from_top)
    # Mitsuba's own D65 has Y = 1 after its film divides by the integral of ȳ; ours has Y = 1 as it is
    unit = float(mi.MI_CIE_Y_NORMALIZATION) if context.spectral else 1.0
    scale = float(world.strength) * unit
    turn = mi.ScalarTransform4f(world.world_from_environment @ ENVIRONMENT_AXES)
    emitter = context.load({"type": "envmap", "bitmap": mi.Bitmap(rows_from_top), "scale": scale, "to_world": turn})
    if context.movable:
        context.read_numbers(emitter, ["scale"])
    if context.switches is not None:
        import drjit

        parameters = mi.traverse(emitter)

        def switch(on: bool) -> None:
            parameters["scale"] = drjit.opaque(mi.Float, scale if on else 0.0)
            parameters.update()

        context.switches.setdefault(world.group, []).append(switch)
    if context.spectral and (context.white is not None or context.has_dyes):  # Mitsuba's D65 begins at 360 nm
        daylight = context.load({"type": "d65", "scale": unit})
        white = paint.sampled_spectrum(context, context.white or paint.white_light())
        parts = {"environment": emitter, "white": white, "daylight": daylight}
        return context.load({"type": "tinted_environment", **parts})
    return emitter
