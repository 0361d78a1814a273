# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays that an object or a cache keeps are read-only: a script that scales one must not change later calls."""

from __future__ import annotations

import copy
import functools
import pickle
from typing import Any

import numpy as np
import pytest

from spectral_core.lattice import make_lattice, progressive_fill, unit_cube
from spectral_core.palette.recipe import white
from spectral_core.spectra import catalogue, observer
from spectral_core.volume.samples import sample_volume


def kept_arrays(item: Any) -> dict[str, np.ndarray]:
    """Arrays among the cached properties of an object."""
    names = [name for name in dir(type(item)) if isinstance(getattr(type(item), name), functools.cached_property)]
    values = {name: getattr(item, name) for name in names}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


@pytest.mark.parametrize("item", [make_lattice(3, 2), sample_volume("shells", 8)], ids=["lattice", "volume"])
def test_what_an_object_computes_once_cannot_be_written(item: Any) -> None:
    kept = kept_arrays(item)
    assert len(kept) >= 3
    assert [name for name, array in kept.items() if array.flags.writeable] == []


def test_a_scaled_basis_does_not_change_the_points_of_later_calls() -> None:
    before = progressive_fill(unit_cube(3), 20).points
    basis = make_lattice(3, 2, criterion="packing").reduced
    with pytest.raises(ValueError, match="read-only"):
        basis *= 2.0
    np.testing.assert_array_equal(progressive_fill(unit_cube(3), 20).points, before)


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda item: pickle.loads(pickle.dumps(item))])
def test_copies_of_a_lattice_are_read_only_too(copied: Any) -> None:
    lattice = make_lattice(3, 2)
    assert not lattice.reduced.flags.writeable
    again = copied(lattice)
    assert not any(each.flags.writeable for each in (again.generator, again.rotation, again.log_scales, again.reduced))
    assert again.residuals() == lattice.residuals()


def test_cached_spectra_are_read_only() -> None:
    spectra = [white.xyz_from_spd(), white.reference_spd(3000.0), observer.observer().cmfs]
    spectra += [catalogue.illuminant("D65").values, catalogue.reflectance("dark skin").values]
    assert not any(each.flags.writeable for each in spectra)
