# SPDX-License-Identifier: GPL-3.0-or-later
"""A car paint that is blue-gray by day and brown under sodium street lamps, from paints that exist.

The palette designs the reflectance, a recipe of measured paint chips approximates it, and the car has the recipe's
reflectance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from examples.more_scenes.shapes import body, box, divided, looking, scene_of, wheel
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.recipe.library import paint_chips
from spectral_core.palette.recipe.material import Colorants, MaterialRecipe, material_recipe
from spectral_core.scene import AreaLight, Diffuse, Film, Mesh, MixSurface, Scene, Surface, gray
from spectral_core.scene.surface import Glossy
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

GRID = SpectralGrid.uniform(400, 700, 10)


def paint() -> tuple[Reflectance, MaterialRecipe]:
    """The designed reflectance, and the recipe that comes nearest to it under both lamps."""
    lights = tuple(PaletteLight(normalized(illuminant(name), luminance=2.0)) for name in ("D65", "HP1"))
    cells = (Cell.fixed([0.15, 0.26, 0.36], exact=True), Cell.fixed([0.52, 0.21, 0.05]))
    solution = solve_palette(PaletteProblem(GRID, lights, (PaletteReflectance("car"),), (cells,)))
    wanted = solution.reflectances[0]
    assert isinstance(wanted, Reflectance)
    chips = paint_chips()
    spectra = np.stack([chip.at(GRID.wavelengths_nm) for chip in chips])
    colorants = Colorants("paints", tuple(chip.name for chip in chips), GRID, spectra)
    return wanted, material_recipe(colorants, wanted, [illuminant("D65"), illuminant("HP1")], most_colorants=4)


def _window(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positive where points (n, 3) of the body are glass: a band below the roof, with a pillar on either side."""
    x, y, z = points.T
    beside_pillar = np.maximum(0.3 - np.abs(y), np.abs(x + 0.25) - 0.05)
    return np.asarray(np.minimum(np.minimum(z - 1.06, 1.33 - z), beside_pillar))


def car(reflectance: Reflectance, light: Illuminant, film: Film) -> Scene:
    """The car under one lamp."""
    lacquer = MixSurface(0.05, Diffuse(reflectance), Glossy(gray(1.0), roughness=0.32))
    painted, glass = divided(body(columns=960, rows=480), _window)
    tire = Diffuse(gray(0.03))
    parts: list[tuple[Mesh, Surface]] = [
        (painted, lacquer),
        (glass, MixSurface(0.08, Diffuse(gray(0.02)), Glossy(gray(1.0), roughness=0.32))),
        *((wheel(f"wheel {x:g} {y:g}", (x, y, 0.34), 0.34, 0.24), tire) for x in (-1.2, 1.2) for y in (-0.74, 0.74)),
        *((wheel(f"hub {x:g}", (x, -0.77, 0.34), 0.17, 0.25), Diffuse(gray(0.3))) for x in (-1.2, 1.2)),
        (box("floor", (-9, -9, -0.1), (9, 9, 0.0)), Diffuse(gray(0.35))),
        (box("wall", (-9, 5, 0), (9, 5.2, 6)), Diffuse(gray(0.5))),
    ]
    lamp = AreaLight(
        name="lamp", world_from_light=looking((-0.5, -3.0, 5.0), (0.0, 0.0, 0.4)), color=light, power_w=750.0,
        size=(6.0, 2.5), shape="rectangle",
    )  # fmt: skip
    return scene_of(parts, [lamp], (looking((3.2, -5.6, 2.0), (0.0, 0.1, 0.65)), 0.72), film)
