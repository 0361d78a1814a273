# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixtures and fluorescence: how paint affects metamers, designed tints, and pairs that a dye makes distinguishable.

Tints are mixed into white paint of reflectance 0.9 (Kubelka-Munk), ΔE2000 between materials that should match. The
fluorescent pair is one material with a dye and one without, equal under D65; other lights have the power of D65, LEDs a
third of it.
"""

from __future__ import annotations

import time
from itertools import combinations
from typing import Any

import numpy as np

from benchmarks import Options
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.paint.fluorescence import led
from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
from spectral_core.palette.paint.mixtures import additive_mixture, tint_differences
from spectral_core.palette.paint.tints import TintCriterion, solve_with_tints
from spectral_core.palette.presets import hidden_mark, metamer_pair, most_distinct
from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid

LEVELS = (0.75, 0.5, 0.25)


def run(options: Options) -> dict[str, Any]:
    figures = {"tints": _tints(options), "additive": _additive(), "fluorescence": _fluorescence()}
    dyed = figures["fluorescence"]
    return figures | {
        "holds": {
            "additive mixtures of metamers match to 1e-14": figures["additive"]["largest_spread"] < 1e-14,
            "tints designed to match differ by ΔE2000 0.5 at most": all(
                max(row["with"]) <= 0.5 for row in figures["tints"]
            ),
            "no more photons return than arrive": dyed["largest_returned_share"] <= 1 + 1e-9,
            "the fluorescent pair is equal under D65 and differs by ΔE2000 60 under 405 nm": dyed["trusted"]
            and dyed["differences"]["D65"] < 1e-3
            and dyed["differences"]["405 nm LED"] > 60,
        }
    }


def _tints(options: Options) -> list[dict[str, Any]]:
    print("tints: ΔE2000 under the light where the materials match, at 75, 50 and 25 % paint")
    rows = []
    for make, light in ((metamer_pair, 1), (hidden_mark, 0))[: 1 if options.quick else 2]:
        problem = make()
        plain = solve_palette(problem)
        begun = time.perf_counter()
        tinted = solve_with_tints(problem, TintCriterion(levels=LEVELS))
        seconds = time.perf_counter() - begun
        found = {}
        for label, solution in (("without", plain), ("with", tinted)):
            pairs = list(combinations(range(len(solution.reflectances)), 2))
            found[label] = tint_differences(solution, pairs, levels=LEVELS)[:, :, light].max(axis=1)
            cells = float(np.nanmax(solution.delta_e_2000))
            numbers = ", ".join(f"{value:.3f}" for value in found[label])
            print(f"  {make.__name__:14} {label:8} tints {numbers};  largest error of a cell {cells:.2f}")
        print(f"  {'':14} {seconds:.2f} s")
        rows.append({"palette": make.__name__, "seconds": seconds, **found})
    return rows


def _additive() -> dict[str, float]:
    solution = solve_palette(most_distinct(5))
    surfaces = np.array([surface.values for surface in solution.reflectances])
    shares = np.random.default_rng(0).dirichlet(np.ones(5), size=1000)
    daylight = observer.linear_rgb_from_product(solution.illuminants[0], solution.problem.grid)
    spread = float(np.ptp(additive_mixture(shares, surfaces) @ daylight.T, axis=0).max())
    print(f"additive: 1000 random mixtures of 5 metamers differ by at most {spread:.1e} in linear RGB")
    return {"largest_spread": spread}


def _fluorescence() -> dict[str, Any]:
    grid = SpectralGrid.uniform(360, 780, 10)
    dye = FluorescentDye.gaussian("green", 400, 530)
    daylight = observer.normalized(catalogue.illuminant("D65"))
    points = np.arange(360.0, 781.0)
    power = float(daylight.at(points).sum())
    lamps = [catalogue.illuminant(name) for name in ("A", "HP1", "FL11", "LED-B5")]
    others = [lamp.scaled(power / float(lamp.at(points).sum())) for lamp in lamps]
    lights = [daylight, led(405, power=0.3 * power), led(445, power=0.3 * power), *others]
    free = [Cell.ignore()] * (len(lights) - 2)
    box = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    cells = (
        (Cell.free(box), Cell.black(), *free),
        (Cell.same_as((0, 0), exact=True), Cell.fixed((0.2, 0.9, 0.2)), *free),
    )
    rows = (PaletteReflectance("plain"), PaletteReflectance("fluorescent"))
    problem = PaletteProblem(grid, tuple(map(PaletteLight, lights)), rows, cells, smoothness=0.1)
    begun = time.perf_counter()
    solution = solve_fluorescent(problem, {1: [dye]})
    seconds = time.perf_counter() - begun
    lab = lab_from_linear_rgb(solution.actual_linear_rgb)
    differences = dict(zip([light.name for light in lights], delta_e_2000(lab[0], lab[1]).tolist(), strict=True))
    print("fluorescence: a plain and a fluorescent material, ΔE2000 between them")
    print("  " + ", ".join(f"{name} {value:.2f}" for name, value in differences.items()))
    print(
        f"  amount of dye {solution.surfaces[1].amounts[0]:.3f}, largest energy returned "
        f"{solution.largest_returned_share:.9f}, trusted {solution.trusted}, {seconds:.2f} s"
    )
    return {
        "differences": differences,
        "largest_returned_share": solution.largest_returned_share,
        "trusted": solution.trusted,
        "seconds": seconds,
    }
