# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral lines of half width 0.01 to 2 nm anywhere: luminance and chromaticity of design, normalization and render.

Each is compared with the integral in rational arithmetic: between neighboring knots light, surface and observer are
polynomials, whose product is integrated term by term without rounding.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.render import render_scene
from spectral_core.scene import Camera, Diffuse, Film, Instance, Material, Mesh, RenderSettings, Scene, SunLight
from spectral_core.spectra.color import RGB_FROM_XYZ, xyz_from_linear_rgb
from spectral_core.spectra.observer import normalized, observer, xyz_from_product, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

Array = NDArray[np.float64]
HALF_WIDTHS_NM = (0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0)
LIMIT = 1e-4
SAMPLES = 16384
"""Of each pixel: at a sixteenth of them noise alone reached 1.8e-4 of luminance."""


def run(options: Options) -> dict[str, Any]:
    """Print the worst relative error of luminance and the worst error of chromaticity, by half width."""
    rng = np.random.default_rng(11)
    figures: dict[str, Any] = {}
    places = 2 if options.quick else 6
    print("half width  design Y   design xy  norm. Y    render Y   render xy")
    for half in HALF_WIDTHS_NM[:: 3 if options.quick else 1]:
        worst = np.zeros(5)
        for _ in range(places):
            light, surface = _lamp(half, rng), _filter(rng)
            worst = np.maximum(worst, _errors(light, surface, render=True))
        figures[f"{half:g}"] = worst.tolist()
        print(f"{half:7g} nm  " + "  ".join(f"{value:9.1e}" for value in worst))
    everything = np.array([figures[f"{half:g}"] for half in HALF_WIDTHS_NM[:: 3 if options.quick else 1]])
    holds = {
        "lines: design within 1e-4": bool(everything[:, :2].max() < LIMIT),
        "lines: normalization within 1e-4": bool(everything[:, 2].max() < LIMIT),
        "lines: render within 1e-4": bool(everything[:, 3:].max() < LIMIT),
    }
    return {**figures, "holds": holds}


def _lamp(half: float, rng: np.random.Generator) -> Illuminant:
    """One to three lines of random power, anywhere from 430 to 670 nm."""
    places = np.sort(rng.uniform(430, 670, rng.integers(1, 4)))
    while len(places) > 1 and np.diff(places).min() <= 2 * half:
        places = np.sort(rng.uniform(430, 670, len(places)))
    knots, values = [300.0], [0.0]
    for place in places:
        knots += [place - half, place, place + half]
        values += [0.0, float(rng.uniform(0.3, 1)) / half, 0.0]
    return Illuminant("lines", SpectralGrid(np.array([*knots, 900.0])), np.array([*values, 0.0]))


def _filter(rng: np.random.Generator) -> Reflectance:
    grid = SpectralGrid(np.array([300.0, *np.arange(400.0, 701, 20), 900]))
    return Reflectance("filter", grid, rng.uniform(0.2, 1, grid.size))


def _errors(light: Illuminant, surface: Reflectance, *, render: bool) -> Array:
    exact, white = _exact_xyz(light, surface), _exact_xyz(light)
    unit = normalized(light)
    matrix = xyz_from_product(light, surface.grid) @ surface.values
    kernel = color_kernel(surface.grid)
    designed = np.linalg.solve(RGB_FROM_XYZ, kernel.matrix_of(light)[0] @ surface.values)
    shown_in_table = np.linalg.solve(RGB_FROM_XYZ, kernel.color_of(light, surface)[0])
    ways = [xyz_of(light, surface), matrix, designed, shown_in_table]
    luminance = max(abs(found[1] / exact[1] - 1) for found in ways)
    chroma = max(np.abs(found[:2] / found.sum() - exact[:2] / exact.sum()).max() for found in ways)
    norm = abs(_exact_xyz(unit)[1] - 1)
    shown = _rendered(light, surface) if render else exact / white[1]
    return np.array([
        luminance, chroma, norm, abs(shown[1] / (exact[1] / white[1]) - 1),
        np.abs(shown[:2] / shown.sum() - exact[:2] / exact.sum()).max(),
    ])  # fmt: skip


def _rendered(light: Illuminant, surface: Reflectance) -> Array:
    """XYZ of a plane under a sun of irradiance π from straight above."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * 9
    high = np.eye(4)
    high[2, 3] = 3.0
    scene = Scene(
        camera=Camera(world_from_camera=high, field_of_view_rad=0.05),
        film=Film(16, 16, samples=SAMPLES),
        meshes=(Mesh("plane", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)),),
        materials=(Material("filter", Diffuse(surface)),),
        instances=(Instance("plane", "plane", np.eye(4), ("filter",)),),
        lights=(SunLight(name="sun", world_from_light=high, irradiance=np.pi, angle_rad=0.0, color=light),),
        settings=replace(RenderSettings(), transport="spectral"),
    )
    return xyz_from_linear_rgb(render_scene(scene).pixels[..., :3].reshape(-1, 3).astype(np.float64).mean(axis=0))


def _exact_xyz(*spectra: Spectrum) -> Array:
    viewer = observer()
    lit = spectra[0].grid.wavelengths_nm[np.flatnonzero(spectra[0].values > 0)]
    near = np.any(np.abs(viewer.wavelengths_nm[:, None] - lit) < 5, axis=1)
    return np.array([_exact((viewer.wavelengths_nm, row), spectra, near) for row in viewer.cmfs])


def _exact(response: tuple[Array, Array], spectra: tuple[Spectrum, ...], near: NDArray[np.bool_]) -> float:
    """∫ response · spectra: the cells of the response that a line touches, cut at all knots within."""
    knots, values = response
    total = Fraction(0)
    for cell in np.flatnonzero(near[:-1]):
        low, high = knots[cell], knots[cell + 1]
        inner = {float(k) for s in spectra for k in s.grid.wavelengths_nm if low < k < high}
        for start, end in pairwise(sorted({float(low), float(high), *inner})):
            factors = [_line(knots[cell : cell + 2], values[cell : cell + 2], start)]
            for s in spectra:
                j = int(np.clip(np.searchsorted(s.grid.wavelengths_nm, start, side="right") - 1, 0, s.grid.size - 2))
                factors.append(_line(s.grid.wavelengths_nm[j : j + 2], s.values[j : j + 2], start))
            product = [Fraction(1)]
            for offset, slope in factors:
                longer = [c * offset for c in product] + [Fraction(0)]
                for power, c in enumerate(product):
                    longer[power + 1] += c * slope
                product = longer
            width = Fraction(end) - Fraction(start)
            total += sum((c * width ** (power + 1) / (power + 1) for power, c in enumerate(product)), Fraction(0))
    return float(total)


def _line(knots: Array, values: Array, at: float) -> tuple[Fraction, Fraction]:
    """Value at ``at`` and slope of a segment."""
    first, last = (Fraction(float(k)) for k in knots)
    low, high = (Fraction(float(v)) for v in values)
    slope = (high - low) / (last - first)
    return low + slope * (Fraction(at) - first), slope
