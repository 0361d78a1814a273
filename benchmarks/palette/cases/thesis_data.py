# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that the thesis prints under Figure 5.2, and the computation of its code.

Plain sums of 31 samples (a "sampled" grid), lights of luminance 6 per 10 nm, ColorBrewer colors taken as linear RGB.
"""

from __future__ import annotations

import numpy as np

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.presets import SPLIT_COLORS, sine_light
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

GRID = SpectralGrid.uniform(400.0, 700.0, 10.0, interpolation="sampled")
PER_NM = 0.1
"""The printed lights are power per 10 nm."""

_PRINTED = """
d65 0.4702 0.5197 0.5304 0.4924 0.5958 0.6645 0.669 0.6525 0.6582 0.6179 0.6213 0.6122 0.5952 0.6117 0.5929 0.5906
    0.5679 0.5469 0.5441 0.5038 0.5111 0.5089 0.4981 0.4731 0.4754 0.4543 0.4555 0.4674 0.4447 0.3958 0.4066
split1 0.6678 1.102 1.107 0.6561 0.1297 0.043 0.4404 0.8899 0.9883 0.7145 0.273 0 0.2365 1.07 1.065 0.7561 0.292
    0.0444 0.1839 0.858 1.136 0.8329 0.288 0.05081 0.2354 0.5776 0.8495 0.959 0.8936 0.6813 0.3666
split2 0.5569 0.9856 1.172 1.064 0.7426 0.3406 0.03923 0 0.2016 0.6381 1.012 1.013 0.8544 0.8999 0.3158 0 0.01159
    0.3446 0.6981 1.119 1.049 0.8205 0.5588 0.2338 0 0.07294 0.4685 0.8727 1.039 0.9004 0.5156
refl1 0 0 0 0 0 0.1908 0.337 0.08154 0 0 0 0 0 0 0 0.1881 0.5014 0.1729 0 0 0.005627 0.1097 0 0 0 0.09737 0.524
    0.8975 1 0.8346 0.4686
refl2 0 0.006213 0.03533 0.0938 0.155 0.1646 0.1112 0.04728 0.0334 0.0771 0.1367 0.1579 0.1164 0.04379 0.005049
    0.03718 0.1136 0.1759 0.1892 0.1624 0.1227 0.08678 0.05953 0.04195 0.03305 0.02917 0.02617 0.02203 0.01681
    0.01118 0.005552
refl3 0.5278 0.7863 0.6334 0.2164 0.02129 0.01284 0.07832 0.09049 0 0 0 0 0.1197 0.5766 0 0 0 0 0 0.4177 0.1081 0 0
    0 0.3824 0.3816 0.03062 0 0 0 0
refl4 0.158 0.2753 0.3143 0.2531 0.1204 0.01347 0.01566 0.09516 0.1335 0.08491 0.02991 0.09995 0.2566 0.2573 0.07249
    0 0 0 0.141 0.1585 0.000607 0.001365 0.2275 0.3689 0.2555 0.0623 0 0 0.02455 0.04152 0.03065
refl5 0.1036 0.1798 0.2026 0.1579 0.07112 0.01515 0.04265 0.134 0.2162 0.2319 0.1768 0.1033 0.07003 0.08917 0.1286
    0.1434 0.1117 0.04218 0 0 0 0 0.07356 0.3759 0.5742 0.5092 0.2921 0.09508 0.003234 0 0
"""


def _read() -> dict[str, np.ndarray]:
    spectra: dict[str, list[float]] = {}
    name = ""
    for word in _PRINTED.split():
        if word[0].isalpha():
            name = word
            spectra[name] = []
        else:
            spectra[name].append(float(word))
    return {name: np.array(values) for name, values in spectra.items()}


PRINTED = _read()
"""Name -> the 31 printed values."""

PRINTED_COLORS_255 = np.array(
    [
        [(171, 140, 159), (223, 83, 81), (201, 1, 33)],
        [(169, 144, 161), (222, 83, 82), (245, 162, 129)],
        [(169, 152, 162), (246, 243, 246), (247, 243, 246)],
        [(169, 147, 162), (77, 161, 201), (145, 203, 223)],
        [(168, 144, 162), (75, 153, 196), (6, 113, 176)],
    ]
)
"""Linear RGB × 255 that the printed spectra give, (reflectance, light, 3); computed without this library."""


def light(name: str) -> Illuminant:
    """A printed light, per nm."""
    return Illuminant(name, GRID, PRINTED[name] * PER_NM, source="thesis, Figure 5.2")


def reflectance(name: str) -> Reflectance:
    """A printed reflectance."""
    return Reflectance(name, GRID, PRINTED[name], source="thesis, Figure 5.2")


def wanted_colors() -> np.ndarray:
    """(5, 3, 3): D65 their mean, split light 1 the means of pairs, split light 2 the five colors."""
    last = SPLIT_COLORS
    middle = np.stack([last[:2].mean(axis=0)] * 2 + [last[2]] + [last[3:].mean(axis=0)] * 2)
    return np.stack([np.tile(last.mean(axis=0), (5, 1)), middle, last], axis=1)


def lights_only() -> PaletteProblem:
    """Phase 2 of section 5.4.1: the printed reflectances, D65 given, both split lights to design."""
    wanted = wanted_colors()
    starts = (light("d65"), light("split1"), light("split2"))
    lights = tuple(PaletteLight(start, free=k > 0) for k, start in enumerate(starts))
    rows = tuple(PaletteReflectance(f"refl{i + 1}", reflectance(f"refl{i + 1}")) for i in range(5))
    cells = tuple(tuple(Cell.fixed(wanted[i, j]) for j in range(3)) for i in range(5))
    return PaletteProblem(GRID, lights, rows, cells, smoothness=1.0, smoothness_operator="thesis", rounds=1)


def from_scratch(rounds: int, smoothness: float, operator: str = "thesis") -> PaletteProblem:
    """All of section 5.4.1 from its sine lights on, with any number of rounds."""
    wanted = wanted_colors()
    starts = [light("d65"), *(sine_light(period, GRID, luminance=60 * PER_NM) for period in (62.0, 88.4))]
    lights = tuple(PaletteLight(start, free=k > 0) for k, start in enumerate(starts))
    rows = tuple(PaletteReflectance(f"refl{i + 1}") for i in range(5))
    cells = tuple(tuple(Cell.fixed(wanted[i, j], weight=1.0 if j else 4.0) for j in range(3)) for i in range(5))
    return PaletteProblem(
        GRID,
        lights,
        rows,
        cells,
        smoothness=smoothness,
        smoothness_operator=operator,  # type: ignore[arg-type]
        rounds=rounds,
    )


def random_palette(
    size: tuple[int, int], rng: np.random.Generator, grid: SpectralGrid = GRID, *, bounded: bool = True, rounds: int = 1
) -> PaletteProblem:
    """Section 5.4.2: random colors, random lights of luminance 6, ω_D = 0.001; (reflectances, lights)."""
    from spectral_core.spectra.observer import normalized

    starts = [normalized(Illuminant(f"L{j}", grid, rng.uniform(size=grid.size)), luminance=6.0) for j in range(size[1])]
    colors = rng.uniform(size=(*size, 3))
    infinite = (-np.inf, np.inf)
    positive = (0.0, np.inf)
    return PaletteProblem(
        grid,
        tuple(PaletteLight(start, free=True) for start in starts),
        tuple(PaletteReflectance(f"R{i}") for i in range(size[0])),
        tuple(tuple(Cell.fixed(colors[i, j]) for j in range(size[1])) for i in range(size[0])),
        smoothness=0.001,
        smoothness_operator="thesis",
        reflectance_bounds=positive if bounded else infinite,
        light_bounds=positive if bounded else infinite,
        rounds=rounds,
    )
