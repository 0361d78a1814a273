# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear light models: color error against the number of coefficients, multiplications and time.

All of colour-science's lights on the color checker and the CFI materials, ΔE2000 under each light's own white, for
light reflected once and twice. The table is on the thesis' 31 bins, where the full spectrum is the truth; the node
model is also held against 1 nm integrals of the published tables.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.palette.cases.measured import light_group, measured_reflectances, unique_lights
from benchmarks.palette.cases.thesis_data import GRID, PRINTED
from benchmarks.palette.pictures.light_models import draw_errors
from spectral_core.light_models import (
    NATURAL_NODES_NM,
    BasisModel,
    FactorModel,
    LightModel,
    NodeModel,
    RgbModel,
    principal_components,
    representative_spectra,
)
from spectral_core.light_models.factor import optimized_edges
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_xyz
from spectral_core.spectra.observer import xyz_from_product
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Catalogue:
    """Data for the comparison of the models. ``reflectances``: (r, n), the color checker's first."""

    grid: SpectralGrid
    lights: list[Illuminant]
    reflectances: Array
    checkers: int

    def training(self) -> tuple[list[Illuminant], Array]:
        """Every third light and every second material, for the models that learn a basis."""
        rest = self.reflectances[self.checkers :]
        return self.lights[::3], rest[::2] if len(rest) else self.reflectances[::2]


def errors(model: LightModel, catalogue: Catalogue, bounces: int = 1) -> Array:
    """ΔE2000 (lights, surfaces) after one reflection, or two with each surface's seventh neighbor as the second."""
    spectra, coefficients = catalogue.reflectances, model.surface_coefficients(catalogue.reflectances)
    if bounces == 2:
        spectra = spectra * np.roll(spectra, 7, axis=0)
        coefficients = model.reflect(coefficients, np.roll(coefficients, 7, axis=0))
    found = []
    for light in catalogue.lights:
        true_matrix = xyz_from_product(light, model.grid)
        white = true_matrix.sum(axis=1)
        shown = coefficients @ model.xyz_from_coefficients(light).T
        found.append(delta_e_2000(lab_from_xyz(spectra @ true_matrix.T, white), lab_from_xyz(shown, white)))
    return np.array(found)


def nanoseconds(model: LightModel, light: Illuminant, pixels: int) -> float:
    """Time for a second reflection and the color of one pixel, best of twenty over an image of ``pixels``."""
    first = np.random.default_rng(0).uniform(size=(pixels, model.size))
    matrix = model.xyz_from_coefficients(light).T
    second = first[0].copy()
    # One surface reflects the whole image, so R of Eq. 5.7 is formed once and applied to every pixel.
    reflection = None
    if isinstance(model, BasisModel) and not isinstance(model, FactorModel):
        reflection = model.illumination_matrix(second).T
    times = []
    for _ in range(20):
        start = time.perf_counter()
        (first @ reflection if reflection is not None else first * second) @ matrix
        times.append(time.perf_counter() - start)
    return min(times) / pixels * 1e9


def row(label: str, model: LightModel, catalogue: Catalogue, pixels: int) -> dict[str, Any]:
    """Figures of one model, printed as one line of the table."""
    once, twice = errors(model, catalogue), errors(model, catalogue, bounces=2)
    figures = {
        "model": label,
        "m": model.size,
        "mean": float(once.mean()),
        "p95": float(np.percentile(once, 95)),
        "max": float(once.max()),
        "mean_twice": float(twice.mean()),
        "multiplications": model.multiplications_per_reflection + 3 * model.size,
        "ns": nanoseconds(model, catalogue.lights[0], pixels),
    }
    print(
        f"{label:34} {model.size:3d} {figures['mean']:9.3g} {figures['p95']:8.3g} {figures['max']:8.3g} "
        f"{figures['mean_twice']:9.3g} {figures['multiplications']:9d} {figures['ns']:8.0f}"
    )
    return figures


def learned_models(size: int, catalogue: Catalogue) -> list[tuple[str, LightModel]]:
    """PCA with the full R, and factor models with equal and with searched intervals, for one m."""
    lights, surfaces = catalogue.training()
    grid = catalogue.grid
    basis = principal_components(representative_spectra(lights, surfaces, grid), size)
    edges = optimized_edges([(light, surfaces[::2]) for light in lights[::2]], basis, grid)
    return [
        ("PCA, full R", BasisModel(grid, basis)),
        ("factor, equal intervals", FactorModel(grid, basis)),
        ("factor, searched intervals", FactorModel(grid, basis, edges=edges)),
    ]


def table(catalogue: Catalogue, sizes: tuple[int, ...], pixels: int) -> list[dict[str, Any]]:
    """Print and return the rows of all models on one catalogue."""
    print(f"\n{len(catalogue.lights)} lights × {len(catalogue.reflectances)} reflectances")
    print(f"{'model':34} {'m':>3} {'mean':>9} {'p95':>8} {'max':>8} {'2 bounces':>9} {'multipl.':>9} {'ns/pixel':>8}")
    grid = catalogue.grid
    rows = [row("RGB of D65", RgbModel(grid, illuminant("D65")), catalogue, pixels)]
    for size in sizes:
        rows += [row(label, model, catalogue, pixels) for label, model in learned_models(size, catalogue)]
        if size in NATURAL_NODES_NM:
            rows.append(row("nodes, natural", NodeModel.natural(size, grid), catalogue, pixels))
    full = NodeModel(grid, grid.wavelengths_nm, np.eye(grid.size))
    rows.append(row("full spectrum", full, catalogue, pixels))
    return rows


def run(options: Options) -> dict[str, Any]:
    print("ΔE2000; multiplications and time are for one more reflection and the color of a pixel")
    pixels = 2_000 if options.quick else 200_000
    lights = unique_lights()[:: 8 if options.quick else 1]
    fine = SpectralGrid.uniform(380, 780, 5)
    reflectances, checkers = measured_reflectances(fine)
    binned = _in_thesis_bins(lights, reflectances, checkers)
    smooth = replace(binned, lights=[light for light in binned.lights if light_group(light.name) == "smooth"])
    rows = table(binned, (5, 8) if options.quick else (3, 5, 6, 7, 8, 9, 10), pixels)
    smooth_rows = table(smooth, (8,) if options.quick else (5, 6, 7, 8, 9), pixels)
    exact = Catalogue(fine, lights, reflectances, checkers)
    draw_errors({"all lights": rows, "smooth lights": smooth_rows}, options.out / "light_models.png")
    figures = {
        "rows": rows,
        "smooth_rows": smooth_rows,
        "designed_rows": designed_table(pixels),
        **node_figures(exact),
        **scene_figures(exact),
    }
    return figures | {"holds": holds(figures)}


def holds(figures: dict[str, Any]) -> dict[str, bool]:
    """Claims of docs/light_models.md."""
    mean = {(row["model"], row["m"]): row["mean"] for row in figures["rows"]}
    eight = mean["nodes, natural", 8]
    return {
        "eight nodes have a mean ΔE2000 of at most 0.35": max(eight, figures["node_8_mean"]) <= 0.35,
        "eight nodes have a fifth of the error of the other models of eight numbers": all(
            5 * eight < each for (model, size), each in mean.items() if size == 8 and not model.startswith("nodes")
        ),
        "as many nodes as surfaces of a scene are exact": all(
            error < 1e-9
            for error in (
                figures["scene_checker_24_nodes_24_max"],
                figures["scene_noise_5_nodes_5_max"],
                figures["designed_rows"][-1]["max"],
            )
        ),
    }  # fmt: skip


def designed_table(pixels: int) -> list[dict[str, Any]]:
    """The palette of Figure 5.2: bases made for it alone against natural and scene nodes."""
    lights = [PRINTED[name] for name in ("d65", "split1", "split2")]
    surfaces = np.array([PRINTED[f"refl{number}"] for number in range(1, 6)])
    names = ("D65", "split light 1", "split light 2")
    illuminants = [Illuminant(name, GRID, values) for name, values in zip(names, lights, strict=True)]
    catalogue = Catalogue(GRID, illuminants, surfaces, 0)
    print("\nthe designed palette of Figure 5.2: 3 lights × 5 reflectances")
    spectra = representative_spectra(illuminants, surfaces, GRID)
    rows = []
    for size in (5, 7, 10):
        basis = principal_components(spectra, size)
        edges = optimized_edges([(light, surfaces) for light in illuminants], basis, GRID)
        rows.append(row("PCA of the palette, full R", BasisModel(GRID, basis), catalogue, pixels))
        rows.append(row("factor of the palette", FactorModel(GRID, basis, edges=edges), catalogue, pixels))
    rows.append(row("nodes, natural", NodeModel.natural(8, GRID), catalogue, pixels))
    for size in (3, 4, 5):
        rows.append(row("nodes, scene", NodeModel.scene(surfaces, GRID, size=size), catalogue, pixels))
    return rows


def _in_thesis_bins(lights: list[Illuminant], reflectances: Array, checkers: int) -> Catalogue:
    """Everything averaged over bins of 10 nm from 400 to 700 nm, integrated by plain sums."""
    bins = SpectralGrid.uniform(400, 700, 10, interpolation="sampled")
    fine = SpectralGrid.uniform(380, 780, 5)
    surfaces = [Spectrum("", fine, values).resampled(bins, average=True).values for values in reflectances]
    return Catalogue(bins, [light.resampled(bins, average=True) for light in lights], np.array(surfaces), checkers)


def node_figures(catalogue: Catalogue) -> dict[str, Any]:
    """Eight natural nodes against 1 nm integrals of spectra that are linear between their 5 nm samples."""
    found = errors(NodeModel.natural(8, catalogue.grid), catalogue)
    groups = np.array([light_group(light.name) for light in catalogue.lights])
    figures = {
        "node_8_mean": float(found.mean()),
        "node_8_p95": float(np.percentile(found, 95)),
        "node_8_color_checker_mean": float(found[:, : catalogue.checkers].mean()),
        **{f"node_8_{group}_mean": float(found[groups == group].mean()) for group in sorted(set(groups))},
    }
    print("\n8 natural nodes against 1 nm integrals: " + ", ".join(f"{k} {v:.3f}" for k, v in figures.items()))
    return figures


def scene_figures(catalogue: Catalogue) -> dict[str, Any]:
    """Scene nodes on measured surfaces and on white noise, which no natural nodes can hold."""
    noise = np.random.default_rng(7).uniform(size=(5, catalogue.grid.size))
    figures = {}
    print("\nscene nodes: number of surfaces, of nodes, largest and mean ΔE2000 (twice: mean after two reflections)")
    for label, surfaces in (("checker", catalogue.reflectances[: catalogue.checkers]), ("noise", noise)):
        scene = Catalogue(catalogue.grid, catalogue.lights, surfaces, 0)
        for size in sorted({3, 5, 8, len(surfaces)}):
            model = NodeModel.scene(surfaces, catalogue.grid, size=size)
            once, twice = errors(model, scene), errors(model, scene, bounces=2)
            print(
                f"  {label:8} K={len(surfaces):2d} m={size:2d}  max {once.max():.2g}  mean {once.mean():.2g}  "
                f"twice {twice.mean():.2g}"
            )
            figures[f"scene_{label}_{len(surfaces)}_nodes_{size}_max"] = float(once.max())
    return figures
