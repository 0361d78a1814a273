# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling lattices with low-rate rotational dilation (thesis chapter 3): even points for any convex region.

Usual calls: ``progressive_fill(region, count)`` for points, ``make_lattice(n, rate)`` for a lattice and
``figures_of_merit(basis)`` for its figures of merit. ``spectral_core.lattice.engine.LatticeEngine`` is the same as a
SciPy sampler, ``plotting`` draws. Advice on the choice: docs/lattice.md.
"""

from spectral_core.lattice.catalogue import CRITERIA, FrozenScales, frozen_scales, make_lattice
from spectral_core.lattice.classes import Enumeration, LatticeClass, lattice_classes
from spectral_core.lattice.congruence import are_congruent, are_similar, isometry
from spectral_core.lattice.construction import Lattice, all_lattices, build_lattice, class_of
from spectral_core.lattice.fill.filling import fill_exactly, level_for
from spectral_core.lattice.fill.frame import MAX_POINTS, Frame
from spectral_core.lattice.fill.progressive import ProgressivePoints, progressive_fill, progressive_points
from spectral_core.lattice.fill.regions import Region, ball, box, corner_simplex, halfspaces, unit_cube
from spectral_core.lattice.measure.covering import optimize_covering
from spectral_core.lattice.measure.figures import (
    FiguresOfMerit,
    best_known,
    covering_radius,
    figures_of_merit,
    packing,
    second_moment,
)
from spectral_core.lattice.measure.measures import Evenness, evenness, latinized, prefix_separations, separation
from spectral_core.lattice.measure.voronoi import VoronoiCell, relevant_vectors, voronoi_cell
from spectral_core.lattice.optimization import Search, optimize_packing, optimize_second_moment, whiteness
from spectral_core.lattice.polynomials import CharacteristicPolynomial, characteristic_polynomials
from spectral_core.lattice.reduction import closest_vectors, lll, shortest_vectors

__all__ = [
    "CRITERIA",
    "MAX_POINTS",
    "CharacteristicPolynomial",
    "Enumeration",
    "Evenness",
    "FiguresOfMerit",
    "Frame",
    "FrozenScales",
    "Lattice",
    "LatticeClass",
    "ProgressivePoints",
    "Region",
    "Search",
    "VoronoiCell",
    "all_lattices",
    "are_congruent",
    "are_similar",
    "ball",
    "best_known",
    "box",
    "build_lattice",
    "characteristic_polynomials",
    "class_of",
    "closest_vectors",
    "corner_simplex",
    "covering_radius",
    "evenness",
    "figures_of_merit",
    "fill_exactly",
    "frozen_scales",
    "halfspaces",
    "isometry",
    "latinized",
    "lattice_classes",
    "level_for",
    "lll",
    "make_lattice",
    "optimize_covering",
    "optimize_packing",
    "optimize_second_moment",
    "packing",
    "prefix_separations",
    "progressive_fill",
    "progressive_points",
    "relevant_vectors",
    "second_moment",
    "separation",
    "shortest_vectors",
    "unit_cube",
    "voronoi_cell",
    "whiteness",
]
