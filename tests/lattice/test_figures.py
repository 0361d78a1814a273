# SPDX-License-Identifier: GPL-3.0-or-later
"""Reduction, nearest vectors, Voronoi cells and figures of merit compared with closed forms and brute force."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.lattice import (
    are_congruent,
    are_similar,
    best_known,
    closest_vectors,
    covering_radius,
    figures_of_merit,
    isometry,
    lll,
    make_lattice,
    packing,
    relevant_vectors,
    second_moment,
    shortest_vectors,
    voronoi_cell,
)
from spectral_core.lattice.fill.frame import random_rotation


def test_the_best_3d_lattice_of_rate_2_is_that_of_the_thesis() -> None:
    merit = figures_of_merit(make_lattice(3, 2).generator)
    assert merit.second_moment.value == pytest.approx(0.0819044, abs=1e-6)
    assert merit.face_counts == (24, 36, 14)
    assert (merit.relevant_vectors, merit.kissing_number) == (14, 2)


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_nearest_and_shortest_vectors_equal_brute_force(dimensions: int) -> None:
    rng = np.random.default_rng(dimensions)
    basis = rng.normal(size=(dimensions, dimensions)) @ np.diag(np.exp(rng.uniform(-1, 1, dimensions)))
    reduced = basis @ lll(basis)
    k = np.array(list(itertools.product(range(-6, 7), repeat=dimensions)))
    every = k @ reduced.T
    targets = (rng.random((50, dimensions)) - 0.5) @ reduced.T
    brute = ((targets[:, None] - every[None]) ** 2).sum(axis=2).min(axis=1)
    coefficients, squared = closest_vectors(reduced, targets)
    assert np.allclose(squared, brute, rtol=1e-12, atol=0)
    assert np.allclose(((targets - coefficients @ reduced.T) ** 2).sum(axis=1), squared, rtol=1e-9)
    lengths = np.linalg.norm(every, axis=1)
    found = shortest_vectors(reduced)[1]
    assert np.linalg.norm(found[0]) == pytest.approx(np.sort(lengths)[1], rel=1e-12)
    assert len(found) == (np.abs(lengths - np.sort(lengths)[1]) < 1e-9).sum()


def test_lll_keeps_the_lattice_and_shortens_a_skewed_basis() -> None:
    rng = np.random.default_rng(1)
    basis = best_known(6)
    skew = np.triu(rng.integers(-9, 10, (6, 6)), 1) + np.eye(6)
    change = lll(basis @ skew)
    assert abs(round(np.linalg.det(change))) == 1
    reduced = basis @ skew @ change
    assert np.linalg.norm(reduced, axis=0).max() < 1.5 * np.linalg.norm(basis, axis=0).max()


@pytest.mark.parametrize(
    ("dimensions", "moment", "kissing", "vertices", "facets"),
    [(2, 0.0801875, 6, 6, 6), (3, 0.0787451, 12, 14, 12), (4, 0.0766032, 24, 24, 24)],
)
def test_classical_lattices(dimensions: int, moment: float, kissing: int, vertices: int, facets: int) -> None:
    merit = figures_of_merit(best_known(dimensions))
    assert merit.second_moment.value == pytest.approx(moment, abs=1e-7)
    assert merit.kissing_number == kissing
    assert merit.face_counts is not None
    assert (merit.face_counts[0], merit.face_counts[-1]) == (vertices, facets)
    assert sum((-1) ** i * f for i, f in enumerate(merit.face_counts)) == 1 - (-1) ** dimensions  # Euler


def test_figures_of_body_centered_cubic_and_e8() -> None:
    bcc = np.array([[-1.0, 1, 1], [1, -1, 1], [1, 1, -1]])
    assert second_moment(bcc).value == pytest.approx(0.0785433, abs=1e-7)
    assert voronoi_cell(bcc).face_counts == (24, 36, 14)
    eight = second_moment(best_known(8), samples=16384)
    assert abs(eight.value - 0.071682) < 5 * eight.standard_error
    assert packing(best_known(8))[1] == 240


def test_figures_of_the_cubic_lattice_in_every_dimension() -> None:
    for n in range(1, 7):
        cell = voronoi_cell(np.eye(n))
        assert len(cell.vertices) == 2**n
        assert len(relevant_vectors(np.eye(n))) == 2 * n
        assert covering_radius(np.eye(n)).upper == pytest.approx(0.5 * np.sqrt(n))
    assert voronoi_cell(np.eye(4)).face_counts == (16, 32, 24, 8)


def test_face_lattice_of_the_permutohedron() -> None:
    """A generic 5D lattice has the face numbers of the permutohedron of order 6: ordered set partitions."""
    basis = np.linalg.cholesky(6.0 * np.eye(5) - 1.0)  # A5*: its cell is the permutohedron
    assert voronoi_cell(basis).face_counts == (720, 1800, 1560, 540, 62)


def test_congruent_lattices_are_recognized() -> None:
    rng = np.random.default_rng(3)
    basis = make_lattice(5, 2).generator
    skew = np.triu(rng.integers(-3, 4, (5, 5)), 1) + np.eye(5)
    turned = random_rotation(5, rng) @ basis @ skew
    assert are_congruent(basis, turned)
    assert not are_congruent(basis, 1.01 * turned)
    assert are_similar(basis, 1.01 * turned)
    change = isometry(basis, turned)
    assert change is not None
    assert abs(round(np.linalg.det(change))) == 1
    assert not are_similar(basis, make_lattice(5, 3).generator)


def test_covering_above_six_dimensions_is_bounded_from_both_sides() -> None:
    bounds = covering_radius(best_known(8))
    assert bounds.lower == pytest.approx(1.0, abs=1e-9)  # the deep holes of E8
    assert bounds.upper > bounds.lower
    assert not bounds.exact


def test_sixteen_dimensions() -> None:
    lattice = make_lattice(16, 2, criterion="unit")
    radius, kissing = packing(lattice.generator)
    assert radius == pytest.approx(0.4296548, abs=1e-6)
    assert kissing == 4


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: packing(np.ones((3, 3))), "linearly"),
        (lambda: packing(np.ones((2, 3))), "expected n×n"),
        (lambda: packing([[1.0, np.inf], [0.0, 1.0]]), "not finite"),
        (lambda: voronoi_cell(np.eye(7)), "dimension 7"),
        (lambda: relevant_vectors(np.eye(13)), "8191 searches"),
        (lambda: second_moment(np.eye(5), samples=10), "power of two"),
    ],
)
def test_an_error_names_wrong_input(call: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        call()  # type: ignore[operator]
