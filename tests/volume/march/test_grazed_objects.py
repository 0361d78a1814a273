# SPDX-License-Identifier: GPL-3.0-or-later
"""An object that a ray grazes inside a cell, between the ends of two steps: the reference must not miss it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.volume.checks.exact import exact_amounts
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import REFERENCE
from spectral_core.volume.pilot.rays import Pilot, snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

EXTINCTION = 100.0
HALF_WIDTH = 0.007
"""Half of the visible way, in voxels along x; the ray rises as much along y."""


def grazing() -> tuple[ScalarVolume, TransferFunction, View, float]:
    """A ray whose data are a parabola inside one cell, a function that shows its tip alone, and the exact opacity.

    The corners of the cell in x and y are 0, 1, 0.6 and 0.2; on the ray y = x + 0.3 the field is therefore
    -1.4 x² + 1.18 x + 0.18.
    """
    corners = np.array([[0.0, 0.6], [1.0, 0.2]], np.float32)
    volume = ScalarVolume("saddle", np.repeat(corners[:, :, None], 2, axis=2))
    tip = 1.18 / 2.8
    cut = 0.18 + 1.4 * tip**2 - 1.4 * HALF_WIDTH**2
    transfer = TransferFunction(
        (Material("wall", np.array([cut, cut, 1.0]), np.array([0.0, EXTINCTION, EXTINCTION]), np.ones(3)),)
    )
    origin = volume.world_from_index[:3, 3]
    aim = origin + np.array([tip, tip + 0.3, 0.5])
    view = View.looking(aim - np.array([5.0, 5.0, 0.0]), aim, width=1, height=1, fov_deg=None, ortho_width=0.01)
    chord = 2 * HALF_WIDTH * np.sqrt(2.0)
    return volume, transfer, view, 1.0 - np.exp(-EXTINCTION * chord)


@pytest.mark.parametrize("quality_db", [40.0, 60.0])
def test_a_reference_finds_an_object_of_a_fiftieth_of_a_voxel(quality_db):
    volume, transfer, view, opacity = grazing()
    pilot = Pilot(VolumeRenderer(volume), view, transfer, quality_db)
    assert pilot.reference[0, 0] == pytest.approx(opacity, rel=0.02)


def test_a_plan_states_the_error_of_a_picture_that_misses_it():
    volume, transfer, view, opacity = grazing()
    renderer = VolumeRenderer(volume)
    made = plan(renderer, view, transfer, 40.0)
    shown = renderer.render(view, transfer, made.stepping).amounts[0, 0, 0]
    measured = 20.0 * np.log10(opacity / max(abs(shown - opacity), 1e-9))
    assert made.estimate_db < measured + 6.0


@pytest.mark.parametrize("step", [1 / 16, 1 / 64])
def test_even_steps_of_a_reference_end_at_the_tip(step):
    """Two marches by even steps agreed that nothing was there, so that 55 dB were stated for a picture of 41."""
    volume, transfer, view, opacity = grazing()
    way = Stepping("uniform", "preintegrated", step)
    shown = VolumeRenderer(volume).render(view, transfer, way, limits=REFERENCE).amounts[0, 0, 0]
    assert shown == pytest.approx(opacity, rel=0.1)


@pytest.mark.parametrize("half_width", [2e-4, 2e-5])
def test_no_reference_is_stated_to_be_better_than_rounding_allows(half_width):
    """A peak so narrow that single precision of a ray's position changes what the ray sees: 90 dB were stated.

    The field rises along y alone and the rays run along x, so that each ray sees one value: y, to double precision.
    """
    count, start, pixels = 32, 27.3, 24
    data = np.broadcast_to(np.arange(count, dtype=np.float64)[None, :, None], (8, count, 8))
    volume = ScalarVolume("rise", data)
    knots = start + half_width * np.array([-1.0, 0.0, 1.0])
    transfer = TransferFunction((Material("peak", knots, np.array([0.0, 0.3, 0.0]), np.ones(3)),))
    across = 1.8 * half_width
    view = View.looking(
        [-20.0, start, 3.4], [0.0, start, 3.4], width=pixels, height=1, fov_deg=None, ortho_width=across
    )
    y = start + across * (0.5 - (np.arange(pixels) + 0.5) / pixels)
    exact = 1.0 - np.exp(-8.0 * 0.3 * (1.0 - np.abs(y - start) / half_width))

    renderer = VolumeRenderer(volume)
    pilot = Pilot(renderer, view, transfer, 50.0)
    made = plan(renderer, view, transfer, 50.0)
    shown = renderer.render(view, transfer, made.stepping).amounts[0, :, 0]
    error = np.sum((shown - exact) ** 2)
    measured = 10.0 * np.log10(np.sum(exact**2) / error)
    assert measured < 85.0
    assert pilot.is_rounded
    assert pilot.reference_db < measured + 6.0
    assert made.estimate_db < measured + 6.0


@pytest.mark.parametrize("number", [0, 4, 11])
def test_the_error_of_few_rays_among_many_is_stated(number):
    """An opaque corner of a box: some rays of 22,500 pass through its edges, and are seldom among the pilot rays."""
    rng = np.random.default_rng(number)
    slopes, shape = rng.normal(size=3), (9, 6, 20)
    field = np.tensordot(slopes, np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij"), 1)
    field = (field - field.min()) / np.ptp(field)
    cut = 0.2 + 0.6 * rng.random()
    transfer = TransferFunction((Material("solid", [cut, cut, 2.0], [0.0, 1e6, 1e6], np.ones(3)),))
    volume = ScalarVolume("slope", field)
    renderer, view = VolumeRenderer(volume), View.around(volume, 30.0 * number, 20.0, width=150, height=150)
    made = plan(renderer, view, transfer, 50.0)
    image = renderer.render(view, transfer, made.stepping)
    # a visible way of a thousandth of a voxel is opaque, so that a ray is either opaque or clear
    exact = exact_amounts(volume, transfer, view, 8)
    assert snr_db(exact, image.amounts - exact) > made.estimate_db - 3.0
    assert made.is_reached
