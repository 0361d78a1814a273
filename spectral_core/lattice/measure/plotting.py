# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of lattices: nested Voronoi cells, the cell in 3D, packing radii, and a sweep level by level.

They redraw Figs. 3.1 to 3.5 of the thesis from this code. matplotlib is imported where a picture is written.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, MissingDependencyError, UnknownNameError, counted
from spectral_core.files.whole import make_folder, whole_file
from spectral_core.lattice.catalogue import make_lattice
from spectral_core.lattice.congruence import are_similar
from spectral_core.lattice.construction import Lattice, all_lattices
from spectral_core.lattice.fill.progressive import progressive_fill
from spectral_core.lattice.fill.regions import unit_cube
from spectral_core.lattice.measure.figures import best_known, figures_of_merit, packing
from spectral_core.lattice.measure.voronoi import VoronoiCell, voronoi_cell

Matrix = NDArray[np.float64]

INK, PALE, ACCENTS = "#1b1f27", "#c9ced8", ("#2f6fdb", "#d2542b", "#2c9a6b", "#8a4fc7", "#c99a1b", "#4aa6b8")


def draw_all(folder: str | Path, rate: int = 2) -> dict[str, Path]:
    """Write every picture of a rate as PNG into a folder; picture name -> file."""
    folder = make_folder(folder)
    return {name: draw(name, folder / f"lattice_{name}_rate{rate}.png", rate) for name in PICTURES}


def draw(name: str, path: str | Path, rate: int = 2) -> Path:
    """Write one picture of ``PICTURES`` (nested, spiral, cell, radii, levels) as PNG."""
    if name not in PICTURES:
        raise UnknownNameError.among("lattice picture", name, PICTURES)
    if rate not in (2, 3):
        raise InvalidInputError(f"pictures are drawn for rates 2 and 3, not {rate}")
    figure = PICTURES[name](_pyplot(), rate)
    with whole_file(path) as unfinished:
        figure.savefig(unfinished, dpi=140, facecolor="white")
    _pyplot().close(figure)
    return Path(path)


def distinct_planar_lattices(rate: int) -> list[Lattice]:
    """The lattices of the plane with a rate that are not similar to each other: three for rate 2, four for rate 3."""
    found: list[Lattice] = []
    for lattice in all_lattices(2, rate):
        if not any(are_similar(lattice.generator, other.generator) for other in found):
            found.append(lattice)
    return found


def _nested(plt: Any, rate: int) -> Any:
    """Figs. 3.3 and 3.4: each planar lattice with the cells of three levels and the points that each level keeps."""
    lattices = distinct_planar_lattices(rate)
    figure, axes = plt.subplots(1, len(lattices), figsize=(3.6 * len(lattices), 4.0), constrained_layout=True)
    for axis, lattice in zip(axes, lattices, strict=True):
        _nested_cells(axis, lattice)
        angle = np.degrees(lattice.polynomial.angles[0])
        axis.set_title(
            f"{lattice.lattice_class}\nturn {angle:.1f}°, ρ = {packing(lattice.generator)[0]:.3f}", fontsize=9
        )
    figure.suptitle(f"All lattices of the plane that rotate into themselves at rate {rate}", fontsize=11)
    return figure


def _nested_cells(axis: Any, lattice: Lattice, extent: float = 3.2) -> None:
    from matplotlib.collections import PolyCollection

    for level in range(3):
        basis = np.linalg.matrix_power(lattice.rotation, level) @ lattice.generator
        sites = _sites_within(basis, 1.6 * extent)
        outline = _ring(voronoi_cell(basis).vertices)
        color, width = (PALE, *ACCENTS[:2])[level], 0.8 + 0.5 * level
        cells = [outline + site for site in sites]
        axis.add_collection(PolyCollection(cells, facecolors="none", edgecolors=color, linewidths=width, zorder=level))
        axis.scatter(*sites.T, s=(5, 22, 62)[level], color=(INK, *ACCENTS[:2])[level], zorder=8 - level, linewidths=0)
    _square(axis, extent)


def _spiral(plt: Any, rate: int) -> Any:
    """Fig. 3.1: fractional dilations move every point along a spiral to its point of the coarser level."""
    lattice = distinct_planar_lattices(rate)[1]
    figure, axis = plt.subplots(figsize=(5.2, 5.4), constrained_layout=True)
    sites = _sites_within(lattice.generator, 3.5)
    angle, alpha = lattice.polynomial.angles[0], lattice.dilation_factor
    parts = np.linspace(0.0, 1.0, 40)
    turned = np.exp((np.log(alpha) + 1j * angle) * parts)[:, None] * (sites[:, 0] + 1j * sites[:, 1])
    axis.plot(turned.real, turned.imag, color=ACCENTS[0], linewidth=0.7, alpha=0.7)
    axis.scatter(*sites.T, s=10, color=INK, zorder=3, linewidths=0)
    coarse = sites @ lattice.rotation.T
    axis.scatter(*coarse.T, s=46, color=ACCENTS[1], zorder=2, linewidths=0)
    axis.set_title(f"{lattice.lattice_class}: one dilation rotates by {np.degrees(angle):.1f}°", fontsize=10)
    _square(axis, 2.6)
    return figure


def _cell(plt: Any, rate: int) -> Any:
    """Fig. 3.2: the Voronoi cell of the best 3D lattice, one color per zone of parallel facets."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    lattice = make_lattice(3, rate)
    cell, merit = voronoi_cell(lattice.generator), figures_of_merit(lattice.generator)
    figure = plt.figure(figsize=(5.6, 5.6), constrained_layout=True)
    axis = figure.add_subplot(projection="3d")
    for number, polygon in enumerate(_facet_polygons(cell)):
        color = ACCENTS[(number // 2) % len(ACCENTS)]  # ± pairs follow each other
        axis.add_collection3d(Poly3DCollection([polygon], facecolors=color, edgecolors=INK, linewidths=1.0, alpha=0.9))
    reach = 0.5
    axis.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach), box_aspect=(1, 1, 1))
    axis.set_axis_off()
    axis.view_init(18, 35)
    assert merit.face_counts is not None
    vertices, _, facets = merit.face_counts
    axis.set_title(
        f"Best 3D lattice of rate {rate}: second moment {merit.second_moment.value:.6f}\n"
        f"{facets} faces, {vertices} vertices, kissing number {merit.kissing_number}",
        fontsize=10,
    )
    return figure


def _radii(plt: Any, rate: int) -> Any:
    """Fig. 3.5: packing radii by dimension, both rates, S = I against optimized scales and the densest known."""
    dimensions = np.arange(2, 11)
    figure, axis = plt.subplots(figsize=(7.2, 4.4), constrained_layout=True)
    axis.axhline(0.5, color=INK, linewidth=1.0, linestyle=":", label="Cartesian")
    known = [(n, packing(basis)[0]) for n in dimensions if n < 9 and (basis := best_known(int(n))) is not None]
    axis.plot(*zip(*known, strict=True), color=INK, marker="s", markersize=4, label="densest known")
    for number, one in enumerate((2, 3)):
        best = [packing(make_lattice(int(n), one, criterion="packing").generator)[0] for n in dimensions]
        plain = [
            max(packing(each.generator)[0] for each in all_lattices(int(n), one) if each.lattice_class.index == 0)
            for n in dimensions
        ]
        axis.plot(dimensions, best, color=ACCENTS[number], marker="o", label=f"rate {one}, optimized scales")
        axis.plot(dimensions, plain, color=ACCENTS[number], marker=".", linestyle="--", label=f"rate {one}, S = I")
    axis.set(xlabel="dimensions n", ylabel="packing radius at unit density")
    axis.legend(frameon=False, fontsize=8, ncols=2)
    axis.spines[["top", "right"]].set_visible(False)
    return figure


def _levels(plt: Any, rate: int) -> Any:
    """A sweep of the unit square level by level: new points in color, older ones unchanged."""
    points = progressive_fill(unit_cube(2), 32 * rate, rate=rate, seed=4)
    steps = [points]
    for _ in range(3 if rate == 2 else 2):
        steps.append(steps[-1].refine())
    figure, axes = plt.subplots(1, len(steps), figsize=(3.2 * len(steps), 3.6), constrained_layout=True)
    before = 0
    for axis, step in zip(axes, steps, strict=True):
        size = 2600 / len(step)
        axis.scatter(*step.points[:before].T, s=size, color=INK, linewidths=0)
        axis.scatter(*step.points[before:].T, s=size, color=ACCENTS[1 if before else 0], linewidths=0)
        axis.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=[], yticks=[])
        axis.set_title(f"{counted(len(step), 'point')}" + (f", {len(step) - before} new" if before else ""), fontsize=9)
        before = len(step)
    return figure


PICTURES = {"nested": _nested, "spiral": _spiral, "cell": _cell, "radii": _radii, "levels": _levels}
"""Picture name -> function of (pyplot, rate) that returns the figure."""


def _sites_within(basis: Matrix, extent: float) -> Matrix:
    steps = np.arange(-40, 41)
    k = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    sites = k @ basis.T
    return sites[(np.abs(sites) <= extent).all(axis=1)]


def _ring(corners: Matrix) -> Matrix:
    """Corners of a planar cell in order around it."""
    return corners[np.argsort(np.arctan2(corners[:, 1], corners[:, 0]))]


def _facet_polygons(cell: VoronoiCell) -> list[Matrix]:
    """Corners of each facet of a 3D cell, in order around the facet."""
    polygons = []
    for normal, facet in zip(cell.relevant, cell.facets, strict=True):
        corners = cell.vertices[sorted(facet)]
        plane = np.linalg.svd(normal[None])[2][1:]
        flat = (corners - corners.mean(axis=0)) @ plane.T
        polygons.append(corners[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))])
    return polygons


def _square(axis: Any, extent: float) -> None:
    axis.set(xlim=(-extent, extent), ylim=(-extent, extent), aspect="equal", xticks=[], yticks=[])
    axis.spines[:].set_color(PALE)


def _pyplot() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        raise MissingDependencyError.package("matplotlib", "Drawing lattices", "figures") from error
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
