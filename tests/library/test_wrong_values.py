# SPDX-License-Identifier: GPL-3.0-or-later
# mypy: disable-error-code="arg-type,list-item"
"""Values that a caller may get wrong: each is refused by this project's error, which names the argument."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from spectral_core import lattice
from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.sweep import Sweep
from spectral_core.light_models import RgbModel, principal_components, representative_spectra, sharpened_basis
from spectral_core.palette.presets import design_grid
from spectral_core.render.relight.dial import bulbs_on_polygon
from spectral_core.render.relight.storages import storage_named
from spectral_core.scene import Camera, Film, RenderSettings, Scene
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.volume.files import write_volume
from spectral_core.volume.presets import preset
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.view import View

POINTS = np.random.default_rng(5).random((9, 2))
NAN = float("nan")
GRID = design_grid()
FILM = Film(4, 4)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: lattice.make_lattice(2.5), "dimensions is 2.5"),  # was cut to 2
        (lambda: lattice.make_lattice("3"), "dimensions is 3, a text"),
        (lambda: lattice.make_lattice(3, NAN), "rate is nan"),
        (lambda: lattice.unit_cube(2.5), "2.5 dimensions"),
        (lambda: lattice.ball([0, 0], "wide"), "radii is wide"),
        (lambda: lattice.ball([0, 0], 1, p=[2]), "p is"),
        (lambda: lattice.corner_simplex(2, NAN), "size is nan"),
        (lambda: lattice.separation(POINTS, volume=0), "volume is 0"),  # was a ZeroDivisionError
        (lambda: lattice.separation(POINTS, volume=-1), "volume is -1"),  # was a complex number, or NaN
        (lambda: lattice.prefix_separations(POINTS, volume=NAN), "volume is nan"),
        (lambda: lattice.evenness(POINTS, samples=-1), "samples is -1"),
        (lambda: lattice.shortest_vectors(np.full((2, 2), NAN)), "basis"),
        (lambda: lattice.closest_vectors(np.eye(3)[:, :2], POINTS), "square"),
        (lambda: lattice.closest_vectors(np.eye(2), [NAN, 0.0]), "targets"),
        (lambda: lattice.lll("basis"), "basis"),
        (lambda: lattice.fill_exactly("box", lattice.unit_cube(2), 5), "the lattice is 'box'"),
        (lambda: lattice.fill_exactly(lattice.make_lattice(2), [0, 1], 5), "the region is"),
        (lambda: lattice.whiteness("Z2"), "the lattice is 'Z2'"),
        (lambda: lattice.build_lattice((2, 2)), "lattice_class"),
        (lambda: principal_components(np.eye(4), 1.5), "size is 1.5"),
        (lambda: RgbModel(GRID, "D65"), "reference light is 'D65'.*illuminant"),
        (lambda: representative_spectra(["HP1"], np.ones((1, GRID.size)), GRID), "the spectrum is 'HP1'"),
        (lambda: sharpened_basis([1.0, 2.0]), "basis"),
        (lambda: FluorescentDye("dye", "D65", illuminant("D65")), "excitation of dye 'dye' is 'D65'"),
        (lambda: bulbs_on_polygon(2.5), "2 to 64 lights; got 2.5"),
        (lambda: storage_named(31), "storage"),
        (lambda: View(np.eye(4), width=NAN), "width of a view is nan"),
        (lambda: View(np.eye(4), height=7.5), "height of a view is 7.5"),
        (lambda: sample_volume("engine", -1), "size is -1"),
        (lambda: preset("wide", "head.nrrd"), "the volume is 'head.nrrd'.*read_volume"),
        (lambda: RenderSettings(transport="spectrum"), "did you mean 'spectral'"),
        (lambda: RenderSettings(max_bounces=-1), "max_bounces is -1"),
        (lambda: Scene(camera=None, film=FILM), "camera of the scene is 'None'"),
        (lambda: Scene(camera=Camera(world_from_camera=np.eye(4)), film=(4, 4)), "film of the scene"),
    ],
)
def test_a_wrong_value_is_named(call: Callable[[], object], named: str) -> None:
    with pytest.raises(InvalidInputError, match=named):
        call()


def test_a_path_or_a_single_object_in_place_of_data_to_write_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match=r"the sweep is 'sweep\.toml'.*read_sweep"):
        Sweep("sweep.toml", tmp_path / "sweep.cdb")
    with pytest.raises(InvalidInputError, match=r"the volume is 'head\.nrrd'"):
        write_volume("head.nrrd", tmp_path / "head.vdb")
    with pytest.raises(InvalidInputError, match="one spectrum, 'D65'.*expected a list of spectra"):
        write_spectra(tmp_path / "light.csv", illuminant("D65"))
    with pytest.raises(InvalidInputError, match="one of the spectra is 'HP1'"):
        write_spectra(tmp_path / "light.csv", ["HP1"])
    assert not list(tmp_path.iterdir())
