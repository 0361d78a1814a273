# SPDX-License-Identifier: GPL-3.0-or-later
"""The construction: polynomials, classes, QG = GK, and the stated figures of the shipped scales."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.lattice import (
    CharacteristicPolynomial,
    all_lattices,
    are_similar,
    best_known,
    build_lattice,
    characteristic_polynomials,
    class_of,
    frozen_scales,
    lattice_classes,
    make_lattice,
    packing,
    second_moment,
    whiteness,
)
from spectral_core.lattice.construction import MAX_LOG_SCALE

PACKING = {  # of an earlier search, which found 0.516484 for (5, 3), a local optimum: see docs/lattice.md
    2: (0.500000, 0.537285), 3: (0.482535, 0.482911), 4: (0.524091, 0.547386), 5: (0.525590, 0.517236),
    6: (0.562464, 0.574755), 7: (0.566882, 0.569270), 8: (0.601126, 0.619160), 9: (0.600738, 0.603955),
    10: (0.638897, 0.641870),
}  # fmt: skip


@pytest.mark.parametrize("dimensions", range(1, 17))
@pytest.mark.parametrize("rate", [2, 3, 5, 6])
def test_every_construction_is_a_scaled_rotation_of_itself(dimensions: int, rate: int) -> None:
    rng = np.random.default_rng(dimensions)
    for one in lattice_classes(dimensions, rate, improper=None).classes:
        sizes = one.polynomial.block_sizes
        edge = rng.normal(size=len(sizes))
        edge -= sizes @ edge / sizes.sum()
        edge *= MAX_LOG_SCALE / max(np.abs(edge).max(), 1e-9) if len(edge) > 1 else 0.0
        for scales in (None, edge):
            lattice = build_lattice(one, scales)
            assert max(lattice.residuals()) < 1e-12
            assert abs(np.linalg.slogdet(lattice.generator)[1]) < 1e-9
            assert round(np.linalg.det(lattice.dilation)) == (-1) ** dimensions * one.polynomial.coefficients[0]
            assert (np.linalg.det(lattice.rotation) < 0) == one.polynomial.improper


def test_roots_lie_on_one_circle_and_solve_the_polynomial() -> None:
    for n, rate in itertools.product(range(1, 17), (2, 3, 7)):
        for polynomial in characteristic_polynomials(n, rate, improper=None):
            roots = polynomial.roots
            values = np.polyval(polynomial.coefficients[::-1], roots)
            assert np.abs(values).max() < 1e-12 * rate * n
            assert np.allclose(np.abs(roots), polynomial.dilation_factor, rtol=1e-14)
            assert polynomial.block_sizes.sum() == n
            assert len(polynomial.block_sizes) - 1 == ((n - 1) // 2 if n % 2 else n // 2 - 1 + int(polynomial.improper))


@pytest.mark.parametrize(("rate", "count"), [(2, 3), (3, 4)])
def test_the_plane_has_the_lattices_of_figures_3_3_and_3_4(rate: int, count: int) -> None:
    found: list[np.ndarray] = []
    for lattice in all_lattices(2, rate):
        if not any(are_similar(lattice.generator, other) for other in found):
            found.append(lattice.generator)
    assert len(found) == count


def test_class_counts_of_the_complete_enumeration() -> None:
    counts = {(n, b): len(lattice_classes(n, b).classes) for n in range(2, 11) for b in (2, 3)}
    even = {2: (5, 8), 4: (6, 9), 6: (5, 10), 8: (7, 11), 10: (5, 10)}
    assert counts == {(n, b): even[n][b - 2] if n % 2 == 0 else 1 for n in range(2, 11) for b in (2, 3)}
    assert all(lattice_classes(n, b).complete for n, b in counts)
    assert not lattice_classes(4, 5).complete
    assert "square factor" in lattice_classes(3, 4).reason


def test_extra_classes_have_their_polynomial_and_are_not_companion() -> None:
    for n, rate in itertools.product(range(2, 11, 2), (2, 3)):
        for one in lattice_classes(n, rate).classes:
            assert np.round(np.poly(one.dilation)).astype(int)[::-1].tolist() == list(one.polynomial.coefficients)


@pytest.mark.parametrize("dimensions", range(2, 17))
@pytest.mark.parametrize("rate", [2, 3])
def test_packing_radii_of_the_table(dimensions: int, rate: int) -> None:
    lattice = make_lattice(dimensions, rate, criterion="packing")
    radius, kissing = packing(lattice.generator)
    if dimensions in PACKING:
        assert abs(radius - PACKING[dimensions][rate - 2]) < 1e-6
    assert abs(radius - frozen_scales(dimensions, rate, "packing").value) < 1e-9
    assert kissing >= 2 * len(
        lattice.polynomial.block_sizes
    )  # an exact vertex: at least as many ± pairs of shortest vectors as scales


def test_the_5_3_packing_beats_the_table_by_brute_force() -> None:
    basis = make_lattice(5, 3, criterion="packing").reduced
    k = np.array(list(itertools.product(range(-4, 5), repeat=5)))
    # |k_i| <= |v| / (height of the cell over axis i): below 4 for any vector shorter than 1.1
    assert (1.1 * np.linalg.norm(np.linalg.inv(basis), axis=1) < 4).all()
    lengths = np.linalg.norm(k @ basis.T, axis=1)
    assert 0.5 * np.sort(lengths)[1] == pytest.approx(0.51723625, abs=1e-7)


@pytest.mark.parametrize(("dimensions", "rate"), [(n, b) for n in range(3, 9) for b in (2, 3)])
def test_shipped_scales_have_white_error(dimensions: int, rate: int) -> None:
    lattice = make_lattice(dimensions, rate)
    assert whiteness(lattice, samples=16384) < 0.02
    moment = second_moment(lattice.generator, samples=16384)
    assert abs(moment.value - frozen_scales(dimensions, rate, "second_moment").value) < 6 * moment.standard_error + 1e-6
    assert moment.value < 1.0 / 12.0


def test_no_rate_2_lattice_is_a_classical_one() -> None:
    """α² would have to be rational (docs/lattice.md): D4 and FCC never rotate into themselves at rate 2."""
    for lattice in all_lattices(4, 2):
        assert not are_similar(lattice.generator, best_known(4))
    assert not are_similar(make_lattice(3, 2, criterion="packing").generator, best_known(3))


def test_a_unit_shifts_the_scales_to_the_same_lattice() -> None:
    """θ - 1 has norm 1 for θ³ = 2, so its conjugates are a period of the scales."""
    one = class_of(3, 2)
    unit = np.abs(one.polynomial.roots - 1.0)
    assert np.prod(unit**one.polynomial.block_sizes) == pytest.approx(1.0)
    lattice = make_lattice(3, 2)
    shifted = build_lattice(one, lattice.log_scales + 2.0 * np.log(unit))
    assert are_similar(lattice.generator, shifted.generator)
    assert not are_similar(lattice.generator, build_lattice(one, lattice.log_scales + np.log(unit)).generator)


def test_a_shipped_lattice_is_the_same_object_at_each_call() -> None:
    assert make_lattice(7, 3) is make_lattice(7, 3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: make_lattice(0, 2), "dimensions is 0"),
        (lambda: make_lattice(17, 2), "from 1 to 16"),
        (lambda: make_lattice(3, 1), "rate is 1"),
        (lambda: make_lattice(12, 2), "no lattice of"),
        (lambda: make_lattice(3, 5), "no lattice of"),
        (lambda: make_lattice(4, 2, middle=3), "C² < 4β = 8"),
        (lambda: make_lattice(3, 2, middle=1), "is odd"),
        (lambda: make_lattice(4, 2, log_scales=[1.0]), "log_scales has shape"),
        (lambda: make_lattice(4, 2, log_scales=[40.0, -40.0]), "at most 12"),
        (lambda: make_lattice(4, 2, log_scales=[np.nan, 0.0]), "not finite"),
        (lambda: class_of(4, 2, 1, index=5), "class index is 5"),
        (lambda: CharacteristicPolynomial(4, 2, 1, improper=True), "middle coefficient 0"),
    ],
)
def test_an_error_names_wrong_input(call: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        call()  # type: ignore[operator]


def test_an_error_names_an_unknown_criterion() -> None:
    with pytest.raises(UnknownNameError, match="packing"):
        make_lattice(3, 2, criterion="packin")
