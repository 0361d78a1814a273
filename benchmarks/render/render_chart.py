# SPDX-License-Identifier: GPL-3.0-or-later
"""A chart of 24 designed reflectances under 3 designed lights: rendered colors against designed ones, in ΔE2000.

Everything is designed at once by the palette solver on the default grid, then each light in turn shines on the chart
and the means of the patches are compared with the colors that the palette promised. Also printed: how far single
pixels are off at few samples, which is the color noise that an artist sees.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.presets import sine_light
from spectral_core.palette.solution import PaletteSolution
from spectral_core.render import render_scene
from spectral_core.scene import Camera, Diffuse, Film, Instance, Material, Mesh, RenderSettings, Scene, SunLight
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import delta_e_2000, display_rgb_from_linear, lab_from_linear_rgb, linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import SpectralGrid

COLUMNS, ROWS, LIGHTS = 6, 4, 3
WHITE_LUMINANCE = 4.0
"""Luminance of the lights: 1/4 of a perfect white is then a full color, which leaves the spectra room to differ."""


def run(options: Options) -> dict[str, Any]:
    """Design, render, compare; writes one picture per light."""
    solution = designed_chart(seed=3)
    samples, few = (64, 16) if options.quick else (4096, 64)
    figures: dict[str, Any] = {"samples": samples, "palette_status": str(solution.status), "lights": {}}
    print(f"palette: {solution.status}; {COLUMNS * ROWS} reflectances, {LIGHTS} lights, {samples} samples per pixel")
    print(f"{'light':12} {'mean ΔE':>8} {'max ΔE':>8} {'pixel ΔE at ' + str(few):>16} {'seconds':>8}")
    everything = []
    for number, light in enumerate(solution.illuminants):
        start = time.perf_counter()
        errors, picture = chart_errors(solution, number, samples)
        seconds = time.perf_counter() - start
        single, _ = chart_errors(solution, number, few, each_pixel=True)
        everything.append(errors)
        row = {"mean": errors.mean(), "max": errors.max(), f"pixel_mean_at_{few}": single.mean(), "seconds": seconds}
        figures["lights"][light.name] = {name: float(value) for name, value in row.items()}
        print(f"{light.name:12} {errors.mean():8.4f} {errors.max():8.4f} {single.mean():16.3f} {seconds:8.1f}")
        _save(picture, options.out / f"{light.name.replace(' ', '_')}.png")
    figures["mean_delta_e"] = float(np.mean(everything))
    figures["max_delta_e"] = float(np.max(everything))
    print(f"all: mean {figures['mean_delta_e']:.4f}, max {figures['max_delta_e']:.4f}")
    figures["holds"] = {
        "rendered colors are the designed ones, mean ΔE2000 below 0.3": figures["mean_delta_e"] < 0.3,
        "no rendered color is off by ΔE2000 1": figures["max_delta_e"] < 1,
    }
    return figures


def designed_chart(seed: int) -> PaletteSolution:
    """24 reflectances and 3 lights, all free: color checker colors under the first light, others under the rest."""
    rng = np.random.default_rng(seed)
    grid = SpectralGrid.uniform(400, 700, 10)
    daylight = catalogue.illuminant("D65").resampled(grid)
    starts = [normalized(daylight, luminance=WHITE_LUMINANCE)]
    starts += [sine_light(period, grid, luminance=WHITE_LUMINANCE) for period in (62.0, 105.0)]
    names = catalogue.reflectance_names()
    white = normalized(catalogue.illuminant("D65"))
    checker = np.clip([linear_rgb_from_xyz(xyz_of(white, catalogue.reflectance(n))) for n in names], 0.01, 0.9)
    others = [checker[rng.permutation(len(names))] * 0.5 + 0.15 for _ in range(LIGHTS - 1)]
    cells = tuple(
        (Cell.fixed(checker[i]), *(Cell.fixed(0.5 * checker[i] + 0.5 * other[i]) for other in others))
        for i in range(len(names))
    )
    problem = PaletteProblem(
        grid,
        tuple(PaletteLight(start, free=True, luminance=WHITE_LUMINANCE) for start in starts),
        tuple(PaletteReflectance(name) for name in names),
        cells,
    )
    return solve_palette(problem)


def chart_errors(
    solution: PaletteSolution, light: int, samples: int, *, each_pixel: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """ΔE2000 of every patch (of its mean, or of each of its pixels), and the picture."""
    patch = 8
    picture = render_scene(_chart_scene(solution, light, samples, patch)).pixels
    patches = picture[..., :3].reshape(ROWS, patch, COLUMNS, patch, 3).transpose(0, 2, 1, 3, 4)
    colors = patches.reshape(ROWS * COLUMNS, patch * patch, 3).astype(np.float64)
    if not each_pixel:
        colors = colors.mean(axis=1, keepdims=True)
    promised = solution.actual_linear_rgb[:, light][:, None]
    return delta_e_2000(lab_from_linear_rgb(colors), lab_from_linear_rgb(promised)), picture


def _chart_scene(solution: PaletteSolution, light: int, samples: int, patch: int) -> Scene:
    """The patches side by side on a table, under one sun, seen straight from above."""
    illuminant = solution.illuminants[light]
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    cells = [(column, row) for row in range(ROWS) for column in range(COLUMNS)]
    positions = np.concatenate([corners + np.array([*cell, 0], np.float32) for cell in cells])
    triangles = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(len(cells))])
    mesh = Mesh("chart", positions, triangles, material_indices=np.repeat(np.arange(len(cells)), 2))
    names = tuple(reflectance.name for reflectance in solution.reflectances)
    camera = np.eye(4)
    camera[:3, 3] = (COLUMNS / 2, ROWS / 2, 5)
    irradiance = np.pi * float(xyz_of(illuminant)[1])  # a white patch is then as bright as the light's luminance
    return Scene(
        camera=Camera(world_from_camera=camera, kind="orthographic", orthographic_scale=COLUMNS, sensor_fit="width"),
        film=Film(COLUMNS * patch, ROWS * patch, samples=samples, filter_kind="box", filter_width=1.0),
        meshes=(mesh,),
        materials=tuple(Material(n, Diffuse(r)) for n, r in zip(names, solution.reflectances, strict=True)),
        instances=(Instance("chart", "chart", np.eye(4), names),),
        lights=(
            SunLight(name="sun", world_from_light=np.eye(4), irradiance=irradiance, angle_rad=0, color=illuminant),
        ),
        settings=RenderSettings(max_bounces=0),
    )


def _save(picture: NDArray[np.float32], path: Any) -> None:
    import mitsuba

    shown = np.clip(display_rgb_from_linear(picture[::-1, :, :3]), 0, 1) * 255
    large = np.repeat(np.repeat(np.rint(shown).astype(np.uint8), 12, axis=0), 12, axis=1)
    mitsuba.util.write_bitmap(str(path), large, write_async=False)
