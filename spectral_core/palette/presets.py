# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes to start from: functions that return a ``PaletteProblem``.

Colors are linear sRGB unless stated otherwise. Every preset designs on 380 to 780 nm with linear interpolation, so that
the colors hold when rendered.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.problem import Cell, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import WHITE_XYZ, luminance_from_linear_rgb
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from spectral_core.spectra.start_lights import sine_light

Array = NDArray[np.float64]

SPLIT_COLORS = np.array([(202, 0, 32), (244, 165, 130), (247, 247, 247), (146, 197, 222), (5, 113, 176)]) / 255
"""ColorBrewer RdBu-5, taken as linear RGB as the thesis did (Figure 5.2)."""


def design_grid(step_nm: float = 10.0) -> SpectralGrid:
    """The grid of the presets: 380 to 780 nm."""
    return SpectralGrid.uniform(380.0, 780.0, require_range("the step of a grid", step_nm, 0.0, np.inf, " nm"))


def _grid_or_default(grid: SpectralGrid | None, step_nm: float = 10.0) -> SpectralGrid:
    if grid is None:
        return design_grid(step_nm)
    require_kind("the grid of a palette", grid, SpectralGrid, "such as design_grid()")
    return grid


def light_color(light: Illuminant) -> Array:
    """Linear RGB (3,) of a perfect white under the light."""
    return color_kernel(light.grid).color_of(light)[0]


def hidden_mark(
    *,
    conceal: str = "D65",
    reveal: str = "HP1",
    color: ArrayLike = (0.26, 0.235, 0.19),
    contrast: float = 3.0,
    grid: SpectralGrid | None = None,
) -> PaletteProblem:
    """Two paints, "mark" and "ground", equal under ``conceal`` and far apart under ``reveal`` (section 5.4.3).

    ``color``: color of both under ``conceal``, linear RGB. ``contrast``: wanted ratio of brightness between mark and
    ground under ``reveal``; the solution contains the contrast that [0, 1] and the exact match allow.
    """
    grid = _grid_or_default(grid, 5.0)
    wanted = frozen_array("color", color, (3,))
    if not require_range("contrast", contrast, -np.inf, np.inf) > 1:
        raise InvalidInputError(f"contrast is {contrast}; the mark must be more than 1 time as bright as the ground")
    lights = [normalized(illuminant(name)) for name in (conceal, reveal)]
    middle = float(luminance_from_linear_rgb(wanted)) * light_color(lights[1])
    bright, dark = middle * np.sqrt(contrast), middle / np.sqrt(contrast)
    cells = (
        (Cell.fixed(wanted, exact=True), Cell.fixed(bright)),
        (Cell.fixed(wanted, exact=True), Cell.fixed(dark)),
    )
    materials = (PaletteReflectance("mark"), PaletteReflectance("ground"))
    return PaletteProblem(grid, tuple(map(PaletteLight, lights)), materials, cells, smoothness=0.2)


def metamer_pair(
    *,
    match: str = "D65",
    split: str = "HP1",
    colors: ArrayLike = ((0.55, 0.30, 0.02), (0.30, 0.28, 0.05)),
    box: tuple[ArrayLike, ArrayLike] = ((0.05, 0.10, 0.25), (0.35, 0.45, 0.9)),
    grid: SpectralGrid | None = None,
) -> PaletteProblem:
    """Two reflectances that look the same under one light and have given colors under another (Figure 5.1).

    Their common color under ``match`` is free inside ``box`` (by default a blue, as in the figure); ``colors``: (2, 3)
    under ``split``.
    """
    grid = _grid_or_default(grid)
    apart = frozen_array("colors", colors, (2, 3))
    lights = [normalized(illuminant(name)) for name in (split, match)]
    cells = (
        (Cell.fixed(apart[0]), Cell.free(box, exact=True)),
        (Cell.fixed(apart[1]), Cell.same_as((0, 1), exact=True)),
    )
    materials = (PaletteReflectance("reflectance 1"), PaletteReflectance("reflectance 2"))
    return PaletteProblem(grid, tuple(map(PaletteLight, lights)), materials, cells)


def split_light(
    colors: ArrayLike = SPLIT_COLORS, *, luminance: float = 6.0, weight: float = 4.0, grid: SpectralGrid | None = None
) -> PaletteProblem:
    """Five reflectances: one color under D65, three under a first designed light, five under a second (Figure 5.2).

    ``colors``: (5, 3), those under the last light; the others are their means. ``luminance``: of all lights, 6 in the
    thesis, as narrow-band reflectances need. ``weight``: of the D65 cells.
    """
    grid = _grid_or_default(grid)
    last = frozen_array("colors", colors, (5, 3))
    middle = np.stack([last[:2].mean(axis=0)] * 2 + [last[2]] + [last[3:].mean(axis=0)] * 2)
    first = last.mean(axis=0)
    daylight = normalized(illuminant("D65"), luminance=luminance)
    # 62 and 88.4 nm produced the printed spectra, not the 60 and 85 nm of the text.
    starts = [sine_light(period, grid, luminance=luminance) for period in (62.0, 88.4)]
    lights = (PaletteLight(daylight), *(PaletteLight(start, free=True) for start in starts))
    cells = tuple(
        (Cell.fixed(first, weight=weight), Cell.fixed(middle[i]), Cell.fixed(last[i])) for i in range(len(last))
    )
    return PaletteProblem(grid, lights, tuple(PaletteReflectance(f"reflectance {i + 1}") for i in range(5)), cells)


def color_constancy(
    *,
    constant_color: ArrayLike = (0.10, 0.32, 0.12),
    changing: Sequence[ArrayLike] = ((0.35, 0.10, 0.08), (0.08, 0.16, 0.38)),
    grid: SpectralGrid | None = None,
) -> PaletteProblem:
    """One material keeps its color under both lights, the other changes (Figure 5.6): a green block with a constant
    color.

    Daylight and a designed light; ``changing``: the second material's color under each.
    """
    grid = _grid_or_default(grid)
    daylight = normalized(illuminant("D65"), luminance=2.0)
    lights = (PaletteLight(daylight), PaletteLight(sine_light(88.4, grid, luminance=2.0), free=True))
    kept = frozen_array("constant_color", constant_color, (3,))
    under_both = frozen_array("changing", changing, (2, 3))  # type: ignore[arg-type]
    cells = (
        (Cell.fixed(kept), Cell.constant((0, 0), exact=True)),
        (Cell.fixed(under_both[0]), Cell.fixed(under_both[1])),
    )
    return PaletteProblem(grid, lights, (PaletteReflectance("constant"), PaletteReflectance("changing")), cells)


def xray_smoke(
    *,
    solid_color: ArrayLike = (0.30, 0.26, 0.20),
    smoke_color: ArrayLike = (0.20, 0.32, 0.38),
    grid: SpectralGrid | None = None,
) -> PaletteProblem:
    """A smoke that is black, and therefore invisible, under two lights, and visible under a third (section 5.4.4,
    Figure 5.6).

    All three lights are designed and look white by themselves; a solid keeps its color under all of them.
    """
    grid = _grid_or_default(grid)
    lights = tuple(
        PaletteLight(sine_light(period, grid, luminance=3.0), free=True, white_xyz=WHITE_XYZ, luminance=3.0)
        for period in (62.0, 75.0, 88.4)
    )
    solid = Cell.fixed(solid_color)
    cells = (
        (solid, solid, solid),
        (Cell.black(weight=4.0), Cell.black(weight=4.0), Cell.fixed(smoke_color)),
    )
    return PaletteProblem(grid, lights, (PaletteReflectance("solid"), PaletteReflectance("smoke")), cells)


def most_distinct(
    count: int = 5,
    *,
    conceal: str = "D65",
    reveal: str = "HP1",
    color: ArrayLike | None = None,
    luminance: float = 2.0,
    grid: SpectralGrid | None = None,
) -> PaletteProblem:
    """``count`` materials, exact metamers under one light and as different as possible under another.

    ``color``: their color under ``conceal``; None leaves it free. ``luminance``: of both lights; the larger it is, the
    more smooth reflectances can differ below 1.
    """
    grid = _grid_or_default(grid)
    if require_whole("count", count, -1 << 31, 1 << 31) < 2:
        raise InvalidInputError(f"count is {count}; at least 2 materials are needed to be different")
    lights = tuple(PaletteLight(normalized(illuminant(name), luminance=luminance)) for name in (conceal, reveal))
    rows = []
    for i in range(count):
        if color is not None:
            match = Cell.fixed(color, exact=True)
        else:
            match = Cell.same_as((0, 0), exact=True) if i else Cell.free()
        others = [(other, 1) for other in range(count) if other != i]
        rows.append((match, Cell.distinct_from(*others)))
    materials = tuple(PaletteReflectance(f"material {i + 1}") for i in range(count))
    return PaletteProblem(grid, lights, materials, tuple(rows), smoothness=0.5)


PRESETS: dict[str, Callable[..., PaletteProblem]] = {
    "Metamer pair": metamer_pair,
    "Split light": split_light,
    "Hidden mark": hidden_mark,
    "Color constancy": color_constancy,
    "X-ray smoke": xray_smoke,
    "Most distinct": most_distinct,
}
"""Name shown to the artist -> function."""
