# SPDX-License-Identifier: GPL-3.0-or-later
"""Voxels that are far longer along one axis: pictures and stated errors are those of an exact march."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("drjit", reason="needs Dr.Jit: pip install 'spectral-scene[render]'")

from benchmarks.volume.checks.exact import exact_amounts
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.device.voxels import opaque_doubles
from spectral_core.volume.march.loop import march
from spectral_core.volume.march.path import Placed, WorldRay, path_through
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

# Length of the long voxels, the axis along which they are 1 long, degrees of azimuth and elevation, and of the view.
CASES = [
    (1e6, 0, 77.0, 25.0, 60.0),
    (1e6, 2, 14.0, 5.0, 30.0),
    (1e8, 1, 200.0, 0.0, None),
    (1e8, 2, 128.0, 25.0, 30.0),
    (1e12, 0, 95.0, 12.0, None),
]

FINE = Stepping("cells", "preintegrated", 0.05)


def slab(long, short):
    """A field of long voxels and a function that shows all of it."""
    rng = np.random.default_rng(short)
    edges = np.where(np.arange(3) == short, 1.0, long)
    function = Material("some", [0.0, 0.3, 0.5, 0.6, 1.0], [0.0, 0.1, 0.7, 0.2, 0.4], [1.0, 1.0, 1.0])
    return ScalarVolume.from_spacing("long", rng.random((9, 8, 7)), edges), TransferFunction((function,))


@pytest.mark.parametrize(("long", "short", "azimuth", "elevation", "fov"), CASES)
def test_pictures_and_stated_errors_of_long_voxels(long, short, azimuth, elevation, fov):
    """Rays began millions of voxels outside of the field: 79 dB and more were stated where 16 to 59 were shown."""
    volume, transfer = slab(long, short)
    view = View.around(volume, azimuth, elevation, width=24, height=24, fov_deg=fov)
    exact = exact_amounts(volume, transfer, view, 64)
    assert np.count_nonzero(exact) > 20
    renderer = VolumeRenderer(volume)
    fine = renderer.render(view, transfer, FINE).amounts
    assert snr_db(exact, fine - exact) > 85.0
    made = plan(renderer, view, transfer, 60.0)
    measured = snr_db(exact, renderer.render(view, transfer, made.stepping).amounts - exact)
    assert made.estimate_db < measured + 2.0
    assert measured > 58.0


@pytest.mark.parametrize(("long", "short", "azimuth", "elevation", "fov"), [case for case in CASES if case[4]])
def test_rays_of_a_scene_through_long_voxels(long, short, azimuth, elevation, fov):
    """Rays in world coordinates, as Mitsuba passes them: those of the longest voxels missed the field."""
    import drjit.llvm as types

    volume, transfer = slab(long, short)
    view = View.around(volume, azimuth, elevation, width=24, height=24, fov_deg=fov)
    exact = exact_amounts(volume, transfer, view, 64)
    start, toward = (types.Array3f(part.reshape(-1, 3).T.astype(np.float32)) for part in view.rays_world())
    data = VolumeRenderer(volume).prepare(transfer).march_input(FINE)
    matrix = volume.index_from_world
    rows = tuple(opaque_doubles(types, row) for row in matrix[:3, :3])
    placed = Placed(data, rows, opaque_doubles(types, matrix[:3, 3]))
    endless = types.Float(np.full(24 * 24, 1e30, np.float32))
    found = march(path_through([placed], WorldRay(start, toward, endless))).amounts[0].numpy().reshape(exact.shape)
    assert snr_db(exact, found - exact) > 85.0
