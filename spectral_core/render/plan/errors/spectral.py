# SPDX-License-Identifier: GPL-3.0-or-later
"""Bound on the difference between RGB and spectral transport: every surface under every light, computed in both ways.

RGB transport multiplies the colors of lights and surfaces, spectral transport their spectra; the difference is that
between an integral of a product and a product of integrals. It is computed for light that is reflected once, for light
that two surfaces reflect or transmit in turn, with direct light and without it, for the light in a closed room, and for
light that many surfaces of one color reflect or transmit in turn: the difference grows with the square of their number.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.paint import daylight_rgb, emitted_rgb, emitted_spectrum, unit_luminance
from spectral_core.render.plan.decision import LATER_BOUNCES, MOST_ERROR, USUAL_BOUNCES
from spectral_core.render.plan.errors.fluorescence import error_in_rgb
from spectral_core.render.plan.errors.spectral_media import lit_colors, media_surfaces, varies_in_color
from spectral_core.render.plan.errors.thin_film import film_surfaces
from spectral_core.render.plan.inventory import shown_materials
from spectral_core.render.plan.light.sizes import in_a_room, paint_parts
from spectral_core.scene import (
    Color,
    Computed,
    ImageTexture,
    Material,
    Paint,
    ScatteringMedium,
    Scene,
    SpectralImage,
    emissions_of,
    values_of,
)
from spectral_core.scene.paint import some_colors, some_texels
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import (
    RGB_FROM_XYZ,
    delta_e_2000,
    lab_from_linear_rgb,
    luminance_from_linear_rgb,
)
from spectral_core.spectra.observer import STANDARD, integration_points, observer
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import upsampled

Array = NDArray[np.float64]

SECOND_BOUNCE = 0.5
"""Light from a second surface, relative to that of a lamp: as in an ordinary room."""
IN_A_ROW = (3, 7, 15, 31)
"""Numbers of further surfaces of one color that light meets in turn."""
MOST_REFLECTIONS = USUAL_BOUNCES + 1
"""Reflections that are compared where the light after each is not known."""
MOST_SURFACES, MOST_LIGHTS, TEXELS = 48, 24, 24
HUES = 12
_PRIMARIES = np.array([[0.8, 0.05, 0.05], [0.05, 0.8, 0.05], [0.05, 0.05, 0.8], [0.8, 0.8, 0.05]])


def rgb_transport_error(scene: Scene, reflections: int = MOST_REFLECTIONS) -> float:
    """Largest ΔE2000 of RGB transport in ``scene`` at the exposure of white, over all pairs of surfaces.

    ``reflections``: most surfaces that reflect or transmit visible light in turn, 1 if none is lit by another. Infinite
    if a spectrum occurs where nothing is compared, in the extinction of a medium or a sampled volume, and if the voxels
    of a medium have colors.
    """
    shown = shown_materials(scene)
    materials = [material for material in scene.materials if material.name in shown]
    for medium in _media(scene, materials):
        if varies_in_color(medium) or any(isinstance(each, Spectrum) for each in (medium.color, medium.extinction)):
            return float("inf")
    if any(volume.transfer.wavelengths_nm is not None for volume in scene.volumes):
        return float("inf")
    white = None if scene.settings.white is None else unit_luminance(scene.settings.white)
    lights: list[tuple[Color | Spectrum, Color | None]] = [(light, None) for light in distinct_lights(scene)]
    lights += _patterned(scene)
    paints = [part for material in materials for part in _reflecting(material)]
    surfaces = list(_surfaces(paints + lit_colors(scene)))
    surfaces += film_surfaces(materials) + media_surfaces(scene, materials)
    if len(surfaces) > MOST_SURFACES or len(lights) > MOST_LIGHTS:
        # at most as many as the comparison can hold: the most saturated surfaces, which differ most
        surfaces.sort(key=lambda item: (not item[2], -_saturation(item[0])))
        lights.sort(key=lambda item: (isinstance(item[0], Color), -_saturation(_shone_rgb(*item))))
        surfaces, lights = surfaces[:MOST_SURFACES], lights[:MOST_LIGHTS]
    dyes = error_in_rgb(scene, materials, [light for light, pattern in lights if pattern is None], reflections)
    return min(max(dyes, *(_error_under(light, white, surfaces, reflections) for light in lights)), MOST_ERROR)


def _saturation(rgb: Array) -> float:
    return float(np.ptp(rgb) / max(float(rgb.max()), 1e-6))


def _shone_rgb(light: Color | Spectrum, pattern: Color | None) -> Array:
    """Linear RGB of a light times the color of a pattern."""
    return emitted_rgb(light) if pattern is None else emitted_rgb(light) * pattern.linear_rgb


def _error_under(
    shone: tuple[Color | Spectrum, Color | None],
    white: Spectrum | None,
    surfaces: list[tuple[Array, Any, bool]],
    reflections: int,
) -> float:
    """Largest ΔE2000 over surfaces, each alone and after others. ``shone``: a light, and a color of its pattern."""
    light, pattern = shone
    spectrum = emitted_spectrum(light, white)
    if not np.any(spectrum.values) or not surfaces:
        return 0.0
    points, weights = integration_points(WAVELENGTHS_NM, spectrum.grid.wavelengths_nm)
    viewer = observer(STANDARD)
    cmfs = np.stack([np.interp(points, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])
    passed = spectrum.at(points) if pattern is None else spectrum.at(points) * upsampled(pattern.linear_rgb, points)
    measure = RGB_FROM_XYZ @ (cmfs * (weights * passed))
    size = max(float(luminance_from_linear_rgb(measure.sum(axis=1))), 1e-30)  # scaled to a luminance of 1
    rgb = np.stack([item[0] for item in surfaces])
    spectra = np.stack([item[1](points) for item in surfaces])
    weighted, plain = spectra * (measure / size)[:, None], rgb * (_shone_rgb(light, pattern) / size)

    def error(exact: Array, simple: Array) -> float:
        """Of colors (..., 3); no picture is exposed brighter than white and half of it."""
        bright = np.maximum(luminance_from_linear_rgb(exact) / (1 + SECOND_BOUNCE), 1.0)[..., None]
        return float(np.max(delta_e_2000(lab_from_linear_rgb(exact / bright), lab_from_linear_rgb(simple / bright))))

    def after_each(others: Array, other_rgb: Array) -> float:
        """After all ``others`` (k, n wavelengths), ``other_rgb`` (k, 3)."""
        return error(np.moveaxis(weighted @ others.T, 0, 2), other_rgb * plain[:, None])

    alone = after_each(np.ones((1, points.size)), np.ones((1, 3)))
    if reflections <= 1:
        return alone
    again = LATER_BOUNCES * max(alone, after_each(1 + SECOND_BOUNCE * spectra, 1 + SECOND_BOUNCE * rgb))
    behind = after_each(spectra, rgb)  # a filter before another one, or a corner without direct light
    room = after_each(in_a_room(spectra, reflections), in_a_room(rgb, reflections))
    # filters or mirrors of one color, one behind another
    rows = [
        error(np.sum(weighted * spectra**count, axis=2).T, plain * rgb**count)
        for count in IN_A_ROW if count < reflections
    ]  # fmt: skip
    return max(again, behind, room, *rows)


def _patterned(scene: Scene) -> list[tuple[Color | Spectrum, Color | None]]:
    """Lights of lamps whose patterns color them, each with the colors that a pattern may have anywhere: where it is
    red, a lamp of one line is as dark or as bright as that line behind a red filter.
    """
    found: dict[Any, tuple[Color | Spectrum, Color | None]] = {}
    for light in scene.lights:
        if light.pattern is None or light.pattern.program.width != 3:
            continue
        color = Color(_planck_rgb(light.color)) if light.is_planckian else light.color
        own = np.maximum(light.pattern.typical, 0.0)
        patterns = [*_PRIMARIES, *([own / own.max()] if own.any() else [])]
        for usable in (each for part in paint_parts(color) for each in _lights(part)):
            for pattern in patterns:
                found.setdefault((_key(usable), tuple(np.round(pattern, 4))), (usable, Color(pattern)))
    return list(found.values())


def distinct_lights(scene: Scene) -> list[Color | Spectrum]:
    """Colors and spectra of all lights, each once, without regard to brightness."""
    paints: list[Any] = [
        Color(_planck_rgb(light.color)) if light.is_planckian else light.color for light in scene.lights
    ]
    paints += [Color(_planck_rgb(w.color)) if w.is_planckian else w.color for w in scene.world.parts]
    shown = shown_materials(scene)
    materials = [material for material in scene.materials if material.name in shown]
    paints += [color for material in materials for color, _ in emissions_of(material.surface)]
    emitted = [medium.emission_color for medium in _media(scene, materials) if medium.emission_strength != 0]
    paints += [Color(_planck_rgb(e)) if getattr(e, "source", "") == catalogue.PLANCK else e for e in emitted]
    found: dict[Any, Color | Spectrum] = {}
    for paint in paints:
        for part in paint_parts(paint):
            for usable in _lights(part):
                found.setdefault(_key(usable), usable)
    return list(found.values()) or [Color(np.ones(3))]


def _key(light: Color | Spectrum) -> Any:
    """What distinguishes lights, without regard to the brightness of colors, which does not change differences."""
    if isinstance(light, Spectrum):
        return light.grid.wavelengths_nm.tobytes(), light.values.tobytes()
    return tuple(np.round(light.linear_rgb / max(float(np.max(light.linear_rgb)), 1e-30), 4))


def _lights(paint: Any) -> Iterator[Color | Spectrum]:
    """Colors that an emission may have."""
    if isinstance(paint, (Color, Spectrum)):
        yield paint
        return
    yield Color(np.ones(3))
    if isinstance(paint, ImageTexture):
        rows = np.maximum(some_colors(paint.pixels, paint.color_space), 0.0)
        yield from (Color(rows[each]) for each in _most_colorful(rows) if rows[each].any())
    elif isinstance(paint, Computed) and paint.program.width == 3:
        yield from map(Color, _PRIMARIES)


def _media(scene: Scene, materials: list[Material]) -> list[ScatteringMedium]:
    """Media of these materials, and of the world."""
    return [medium for medium in (*(each.medium for each in materials), scene.world.medium) if medium is not None]


def _planck_rgb(paint: Any) -> Array:
    if not isinstance(paint, Spectrum):
        return np.clip(emitted_rgb(paint), 0.0, None) if isinstance(paint, Color) else np.ones(3)
    return np.clip(_planck_of(paint.grid.wavelengths_nm.tobytes(), paint.values.tobytes()), 0.0, None)


@lru_cache(64)
def _planck_of(wavelengths_nm: bytes, values: bytes) -> Array:
    """Linear RGB of a blackbody's light: thousands of lamps may have one temperature, each with its own spectrum."""
    return emitted_rgb(Illuminant("blackbody", SpectralGrid(np.frombuffer(wavelengths_nm)), np.frombuffer(values)))


def _reflecting(material: Any) -> Iterator[Any]:
    """Paints of a material that are reflectances, and its indices of refraction; no spectra that it emits."""
    values = list(values_of(material.surface))
    for emitted in (color for color, _ in emissions_of(material.surface) if isinstance(color, Spectrum)):
        same = [number for number, value in enumerate(values) if value is emitted]
        values = [value for number, value in enumerate(values) if number not in same[:1]]  # a paint may be both
    for value in values:
        yield from (part for part in paint_parts(value) if isinstance(part, Paint))
    if material.medium is not None and isinstance(material.medium.color, Color):
        yield material.medium.color


def _surfaces(paints: list[Any]) -> Iterator[tuple[Array, Any, bool]]:
    """Color under D65, spectrum by wavelength, and True for a measured spectrum, of each paint."""
    for paint in paints:
        if isinstance(paint, Color):
            yield from _colors(np.atleast_2d(paint.linear_rgb))
        elif isinstance(paint, Spectrum):
            if isinstance(paint, Illuminant):  # as a paint it stands for its color
                yield from _colors(np.atleast_2d(emitted_rgb(paint)))
            elif float(paint.values.min()) < 1.0:  # an index of refraction is not a reflectance
                held = Spectrum(paint.name, paint.grid, np.clip(paint.values, 0.0, 1.0))
                yield np.clip(daylight_rgb(held), 0.0, 1.0), held.at, True  # as both kinds of transport have it
        elif isinstance(paint, ImageTexture):
            rows = some_colors(paint.pixels, paint.color_space)
            yield from _colors(np.concatenate([rows[:: max(1, len(rows) // TEXELS)], rows[_most_colorful(rows)]]))
        elif isinstance(paint, SpectralImage):
            weights = some_texels(np.moveaxis(paint.weights, 0, 2)).astype(np.float64)
            rows = weights @ np.stack([daylight_rgb(Spectrum("part", paint.grid, each)) for each in paint.spectra])
            chosen = np.concatenate([weights[:: max(1, len(weights) // TEXELS)], weights[_most_colorful(rows)]])
            for values in chosen @ paint.spectra:
                spectrum = Spectrum("texel", SpectralGrid(paint.grid.wavelengths_nm), values)
                yield np.clip(daylight_rgb(spectrum), 0.0, 1.0), spectrum.at, True
        elif isinstance(paint, Computed):
            yield from _colors(_PRIMARIES if paint.program.width == 3 else np.full((1, 3), 0.5))


def _most_colorful(rows: Array) -> list[int]:
    """Numbers of the colors (n, 3) that reach farthest from gray, one for each of ``HUES``: a small letter of an image
    may be its only color.
    """
    held = np.maximum(rows, 0.0)
    own = held.max(axis=1, keepdims=True)
    relative = held / np.maximum(own + own.mean(), 1e-30)  # dark noise counts little, very bright pixels are compared
    around = np.linspace(0, 2 * np.pi, HUES, endpoint=False)[:, None] + np.array([0.0, -2 * np.pi / 3, 2 * np.pi / 3])
    return [int(each) for each in np.argmax(relative @ np.cos(around).T, axis=0)]


def _colors(rows: Array) -> Iterator[tuple[Array, Any, bool]]:
    for row in np.clip(rows, 0.0, 1.0):
        if np.ptp(row) < 1e-6:
            yield row, (lambda points, level=float(row[0]): np.full(points.shape, level)), False
        else:
            yield row, (lambda points, color=row: _upsampled(color.tobytes(), points.tobytes())), False


@lru_cache(256)
def _upsampled(color: bytes, points: bytes) -> Array:
    """Spectrum of a color; scenes that differ by an edit have most colors in common."""
    return upsampled(np.frombuffer(color), np.frombuffer(points))
