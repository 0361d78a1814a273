# SPDX-License-Identifier: GPL-3.0-or-later
"""Thesis Figs. 4.5, 4.7 and 5.6 as pictures; Fig. 4.6 is `volume-thesis`, Figs. 4.1 to 4.4 are `volume-analysis`.

Fig. 4.5: HIPIP uniform at step 0.5 and the thesis rule at the same SNR. Fig. 4.7: uniform at step 1 and adaptive
stepping with no more samples on an acquired set, with crops. Fig. 5.6: our engine, marched once, under three designed
lights: block and liners equal, split, and the smoke in sight.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, colors_of, reference, shared_data
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.presets import design_grid, sine_light
from spectral_core.spectra.color import WHITE_XYZ
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, VolumeImage, combine
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View


def run(options: Options) -> dict[str, Any]:
    figures = fig_4_5(options) | fig_4_7(options) | fig_5_6(options)
    for name, value in figures.items():
        print(f"{name:32} {value if isinstance(value, str) else round(float(value), 3)}")
    return figures | {
        "holds": {
            "Fig. 4.5: the thesis rule takes fewer samples for the SNR of uniform steps": (
                figures["4.5 thesis samples fewer %"] > 0
                and figures["4.5 thesis SNR dB"] >= figures["4.5 uniform SNR dB"]
            ),
            "Fig. 4.7: steps of equal error have a higher SNR than as many uniform ones": (
                figures["4.7 error SNR dB"] > figures["4.7 uniform SNR dB"]
                and figures["4.7 error samples"] <= figures["4.7 uniform samples"]
            ),
            "Fig. 5.6: block and liner are equal, then split, then the smoke appears": (
                figures["5.6 block to liner, equal"] < 0.01
                and figures["5.6 block to liner, split"] > 0.1
                and figures["5.6 smoke under equal and split"] < 0.01
                and figures["5.6 smoke under smoke"] > 0.1
            ),
        }
    }


def _fields(options: Options, real: str, own: str) -> ScalarVolume:
    return next(all_volumes(options.quick, [real if shared_data() and not options.quick else own]))


def fig_4_5(options: Options) -> dict[str, Any]:
    """Uniform at step 0.5, and the thesis rule at the same SNR: samples of non-zero opacity."""
    volume = _fields(options, "hipip", "gaussians")
    renderer, transfer = VolumeRenderer(volume), preset("wide", volume)
    view = View.around(volume, 20.0, 25.0, zoom=1.2, width=_size(options), height=_size(options))
    exact = reference(renderer, view, transfer)
    uniform = renderer.render(view, transfer, Stepping("uniform", "midpoint", 0.5), counts=True)
    wanted = snr_db(exact, colors_of(uniform, transfer) - exact)
    adaptive = matched(renderer, view, transfer, exact, wanted)
    save(options.out / "fig-4-5.png", [picture(uniform, 0.8), picture(adaptive, 0.8)])
    return {
        "4.5 uniform SNR dB": wanted,
        "4.5 thesis SNR dB": snr_db(exact, colors_of(adaptive, transfer) - exact),
        "4.5 thesis samples fewer %": 100 * (1 - (adaptive.samples or 0) / (uniform.samples or 1)),
    }


def matched(
    renderer: VolumeRenderer, view: View, transfer: TransferFunction, exact: np.ndarray, wanted_db: float
) -> VolumeImage:
    """The thesis rule with the coarsest steps that reach ``wanted_db`` on the whole picture."""
    scale = plan(renderer, view, transfer, wanted_db, rule="thesis", quadrature="midpoint").stepping.scale
    for factor in np.geomspace(1.3, 0.6, 24):
        image = renderer.render(view, transfer, Stepping("thesis", "midpoint", scale * factor), counts=True)
        if snr_db(exact, colors_of(image, transfer) - exact) >= wanted_db:
            break
    return image


def fig_4_7(options: Options) -> dict[str, Any]:
    """Uniform at step 1 against adaptive stepping with at most as many samples; a crop shows the wood grain."""
    volume = _fields(options, "vase", "shells")
    renderer, transfer = VolumeRenderer(volume), preset("opaque", volume, 2.0)
    view = View.around(volume, 30.0, 20.0, zoom=2.2, width=_size(options), height=_size(options))
    exact = reference(renderer, view, transfer)
    uniform = renderer.render(view, transfer, Stepping("uniform", "midpoint", 1.0), counts=True)
    images = {}
    for rule, start in (("thesis", 0.05), ("error", 0.05)):
        for scale in np.geomspace(start, 200.0, 120):
            image = renderer.render(view, transfer, Stepping(rule, "midpoint", float(scale)), counts=True)  # type: ignore[arg-type]
            if (image.samples or 0) <= (uniform.samples or 0):
                break
        images[rule] = image
    everything = {"uniform": uniform, **images}
    save(options.out / "fig-4-7.png", [picture(image, 1.2) for image in everything.values()])
    return {
        f"4.7 {name} {what}": value
        for name, image in everything.items()
        for what, value in (
            ("SNR dB", snr_db(exact, colors_of(image, transfer) - exact)),
            ("samples", image.samples or 0),
        )
    }


def fig_5_6(options: Options) -> dict[str, Any]:
    """One march, three lights: the block keeps its green, the liners part from it, the smoke comes last."""
    solution = solve_palette(engine_palette())
    grid = solution.problem.grid
    volume = sample_volume("engine", 32 if options.quick else 128)
    transfer = engine_function([r.values for r in solution.reflectances], grid.wavelengths_nm)
    view = View.around(volume, 48.0, 32.0, zoom=1.55, width=_size(options), height=_size(options))
    renderer = VolumeRenderer(volume)
    image = renderer.render(view, transfer, plan(renderer, view, transfer, 55.0).stepping)
    shown = [combine(image.amounts, display_matrix(transfer, light)) for light in solution.illuminants]
    save(options.out / "fig-5-6.png", [2.0 * each for each in shown])
    colors = solution.actual_linear_rgb
    return {
        "5.6 block to liner, equal": float(np.abs(colors[0, 0] - colors[1, 0]).max()),
        "5.6 block to liner, split": float(np.abs(colors[0, 1] - colors[1, 1]).max()),
        "5.6 smoke under equal and split": float(colors[2, :2].max()),
        "5.6 smoke under smoke": float(colors[2, 2].max()),
        "5.6 worst ΔE2000": solution.max_delta_e_2000,
    }


def engine_palette() -> PaletteProblem:
    """Rows block, liner, smoke; columns the lights equal, split, smoke; all spectra are designed."""
    grid = design_grid()
    lights = tuple(
        PaletteLight(
            replace(sine_light(period, grid, luminance=3.0), name=name), free=True, white_xyz=WHITE_XYZ, luminance=3.0
        )
        for name, period in (("equal", 62.0), ("split", 75.0), ("smoke", 88.4))
    )
    green, orange, haze = (0.16, 0.34, 0.14), (0.62, 0.24, 0.05), (0.34, 0.38, 0.44)
    cells = (
        (Cell.fixed(green), Cell.constant((0, 0)), Cell.constant((0, 0))),
        (Cell.same_as((0, 0), weight=4.0), Cell.fixed(orange), Cell.constant((1, 1))),
        (Cell.black(weight=4.0), Cell.black(weight=4.0), Cell.fixed(haze)),
    )
    rows = tuple(PaletteReflectance(name) for name in ("block", "liner", "smoke"))
    return PaletteProblem(grid, lights, rows, cells)


def engine_function(spectra: list[np.ndarray], wavelengths_nm: np.ndarray) -> TransferFunction:
    """Block at 110, liner at 215, and the haze of noise as a smoke that adds light and takes none (5.4.4)."""
    block = Material("block", [70, 100, 130, 165], [0, 0.25, 0.25, 0], spectra[0])
    liner = Material("liner", [140, 190, 255], [0, 0.8, 0.8], spectra[1])
    smoke = Material("smoke", [6, 16, 30, 45], [0, 0, 0, 0], spectra[2], emission=[0, 0.008, 0.012, 0])
    return TransferFunction((block, liner, smoke), wavelengths_nm)


def picture(image: VolumeImage, exposure: float) -> np.ndarray:
    return exposure * image.picture()


def save(path: Path, pictures: list[np.ndarray]) -> None:
    """Side by side, sRGB, as PNG; needs matplotlib."""
    try:
        import matplotlib.image
    except ImportError:
        print("matplotlib is not installed, so no picture was written")
        return
    from spectral_core.spectra.color import display_rgb_from_linear

    gap = np.ones((pictures[0].shape[0], 6, 3))
    row = [part for each in pictures for part in (np.clip(display_rgb_from_linear(np.clip(each, 0, 1)), 0, 1), gap)][
        :-1
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    matplotlib.image.imsave(path, np.hstack(row))


def _size(options: Options) -> int:
    return 64 if options.quick else 400
