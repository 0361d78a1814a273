# SPDX-License-Identifier: GPL-3.0-or-later
"""The fast march against the NumPy oracle and against closed forms."""

import math

import numpy as np
import pytest

from benchmarks.volume.checks.oracle import gaussian_transmittance, march_oracle, ramp_transmittance, slab
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import REFERENCE, USUAL
from spectral_core.volume.march.rules import RULES
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View
from tests.volume.cases import across, against_oracle, blob, two_tents

pytest.importorskip("drjit")
WAYS = [(rule, quadrature) for rule in RULES for quadrature in ("midpoint", "preintegrated")]


@pytest.mark.parametrize(("rule", "quadrature"), WAYS)
@pytest.mark.parametrize("fov", [30.0, None])
def test_every_rule_and_quadrature_converges_to_the_oracle(rule, quadrature, fov):
    volume = blob()
    view = View.around(volume, 25.0, 20.0, width=12, height=10, fov_deg=fov)
    scale = 0.05 if rule == "uniform" else 0.1
    error, away, _ = against_oracle(volume, two_tents(), view, Stepping(rule, quadrature, scale))
    assert error < 1e-3 and away < 1e-3


def test_error_falls_with_the_square_of_the_step():
    volume, transfer = blob(32, np.float32), two_tents()
    view = View.around(volume, 25.0, 20.0, width=20, height=20)
    exact = march_oracle(volume, transfer, view.rays_world(), 0.04).amounts.reshape(20, 20, 2)
    renderer = VolumeRenderer(volume)
    for rule in ("uniform", "error"):
        errors = [np.linalg.norm(renderer.render(view, transfer, Stepping(rule, "midpoint", s)).amounts - exact)
                  for s in (1.6, 0.4)]  # fmt: skip
        assert errors[0] / errors[1] > 8  # second order gives 16


@pytest.mark.parametrize(("extinction", "emission"), [(0.3, 0.0), (0.0, 0.2), (0.05, 0.1), (1e8, 0.0), (1e-8, 0.0)])
@pytest.mark.parametrize("slices", [1, 2, 7])
def test_a_slab_is_exact_for_any_number_of_slices(extinction, emission, slices):
    volume = ScalarVolume.from_spacing("slab", np.full((slices, 3, 3), 5, np.uint8), (0.5, 1, 1))
    transfer = TransferFunction((Material("m", [0, 10], [extinction] * 2, [1, 1, 1], [emission] * 2),))
    image = VolumeRenderer(volume).render(across(volume), transfer, Stepping("uniform", "midpoint", 0.3))
    amount, passed = slab(extinction, emission, 0.5 * slices)
    assert image.amounts[0, 0, 0] == pytest.approx(amount, rel=1e-5, abs=1e-12)
    assert image.transmittance[0, 0] == pytest.approx(passed, abs=2e-5)  # the march ends at 1e-5


@pytest.mark.parametrize("quadrature", ["midpoint", "preintegrated"])
def test_a_linear_ramp_has_its_closed_form(quadrature):
    data = np.repeat(np.arange(9, dtype=np.float32)[:, None, None], 3, 1).repeat(3, 2)
    transfer = TransferFunction((Material("m", [0, 8], [0, 0.5], [1, 1, 1]),))
    image = VolumeRenderer(ScalarVolume("ramp", data)).render(
        across(ScalarVolume("ramp", data)), transfer, Stepping("uniform", quadrature, 0.1)
    )
    # The ramp runs over 8 voxels; the outer half voxels keep 0 and 0.5.
    assert image.transmittance[0, 0] == pytest.approx(ramp_transmittance(0.5, 8.0) * math.exp(-0.25), rel=1e-4)


@pytest.mark.parametrize("offset", [0, 4])
def test_a_gaussian_has_its_closed_form(offset):
    line = np.arange(65) - 32.0
    x, y, z = np.meshgrid(line, line[22:43], line[22:43], indexing="ij")
    sigma = 6.0
    blob_ = ScalarVolume("gauss", np.exp(-(x**2 + (y - offset) ** 2 + z**2) / (2 * sigma**2)))
    transfer = TransferFunction((Material("m", [0, 1], [0, 0.1], [1, 1, 1]),))
    image = VolumeRenderer(blob_).render(across(blob_), transfer, Stepping("error", "midpoint", 0.2))
    # Voxels make the blob piecewise linear, wider by a sixth of a voxel² in variance at most.
    assert image.transmittance[0, 0] == pytest.approx(gaussian_transmittance(0.1, sigma, offset), rel=6e-3)


def test_a_camera_inside_shows_only_the_part_in_front():
    volume = blob()
    view = View.looking([12, 12, 12], [30, 13, 14], width=8, height=8, fov_deg=60.0)
    error, away, _ = against_oracle(volume, two_tents(), view, Stepping("error", "midpoint", 0.1))
    assert error < 1e-3 and away < 1e-3


def test_two_dimensional_function_matches_the_oracle():
    volume = blob()
    steep = Material("edge", [10, 200], [0.4, 0.4], [1, 1, 1], gradient_values=[5, 20], gradient_weights=[0, 1])
    view = View.around(volume, width=10, height=10)
    error, away, _ = against_oracle(volume, TransferFunction((steep,)), view, Stepping("error", "midpoint", 0.1))
    assert error < 2e-3 and away < 1e-3


def test_preintegration_does_not_miss_a_narrow_peak():
    volume = blob(24, np.float32)
    peak = TransferFunction((Material("shell", [99.0, 100.0, 101.0], [0, 5.0, 0], [1, 1, 1]),))
    view = View.around(volume, width=16, height=16)
    exact = march_oracle(volume, peak, view.rays_world(), 0.008).amounts.reshape(16, 16, 1)
    fine, missed = (
        np.linalg.norm(VolumeRenderer(volume).render(view, peak, Stepping("uniform", way, 0.5)).amounts - exact)
        / np.linalg.norm(exact)
        for way in ("preintegrated", "midpoint")
    )
    assert fine < 0.06 and missed > 4 * fine


def test_empty_space_skipping_saves_iterations_and_changes_no_picture():
    data = np.zeros((40, 40, 40), np.uint8)
    data[18:22, 18:22, 18:22] = 150
    volume, view = ScalarVolume("speck", data), View.around(ScalarVolume("speck", data), width=32, height=32)
    error, _, image = against_oracle(volume, two_tents(), view, Stepping("uniform", "preintegrated", 0.1))
    assert error < 2e-3
    assert image.steps < 0.05 * 32 * 32 * 40 / 0.1
    assert 0 < image.samples <= image.steps


def _bright_voxel():
    """A voxel of 1 in a field of 0, hard-edged at 0.97, and rays along x beside it: 0.01 voxels off, and mirrored."""
    data = np.zeros((9, 5, 5), np.float32)
    data[4, 2, 2] = 1.0
    solid = TransferFunction((Material("solid", [0, 0.97, 0.97, 1.0], [0, 0, 30.0, 30.0], [1, 1, 1]),))
    return ScalarVolume("voxel", data), solid


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("phase", [0.0, 0.13, 0.31])
def test_steps_that_end_at_faces_see_the_tip_of_a_grazed_object(side, phase):
    volume, solid = _bright_voxel()
    origin, target = np.array([4.0 - side * (12.0 + phase), 2.01, 2.0]), np.array([4.0, 2.01, 2.0])
    view = View.looking(origin, target, (0, 0, 1), width=1, height=1, fov_deg=None, ortho_width=1e-3)
    # Along the ray the field is 0.99·(1 - |x - 4|), a tip that is above 0.97 over a fiftieth of a voxel.
    depth = 30.0 * 2.0 * (1.0 - 0.97 / 0.99)
    renderer = VolumeRenderer(volume)
    for stepping, limits in (
        (Stepping("cells", "preintegrated", 8.0), USUAL),
        (Stepping("uniform", "preintegrated", 0.7), REFERENCE),
    ):
        image = renderer.render(view, solid, stepping, limits=limits)
        assert image.transmittance[0, 0] == pytest.approx(np.exp(-depth), abs=2e-3)
    # Steps of a tenth of a voxel that end anywhere have it between their ends.
    missed = renderer.render(view, solid, Stepping("uniform", "preintegrated", 0.0917))
    assert abs(missed.transmittance[0, 0] - np.exp(-depth)) > 0.02


def test_steps_that_end_at_faces_are_no_longer_than_a_cell():
    volume = blob()
    view = View.around(volume, 25.0, 20.0, width=12, height=10)
    everywhere = TransferFunction((Material("fog", [-1, 256], [0.01, 0.01], [1, 1, 1]),))
    renderer = VolumeRenderer(volume)
    counts = {
        rule: renderer.render(view, everywhere, Stepping(rule, "preintegrated", 50.0), counts=True).samples
        for rule in ("error", "cells")
    }
    assert counts["cells"] > 3 * counts["error"]


@pytest.mark.parametrize(("scale", "steps"), [(0.9, 1), (0.72, 1), (0.7, 2), (0.55, 2), (0.5, 2), (0.35, 3)])
def test_the_way_to_the_next_face_is_divided_evenly(scale, steps):
    """One step where 1.4 of the planned ones fit: a step of 0.72 and a rest of 0.28 erred more than two halves."""
    volume = ScalarVolume("ramp", np.tile(np.arange(9.0)[:, None, None], (1, 5, 5)).astype(np.float32))
    everywhere = TransferFunction((Material("fog", [-1, 10], [0.01, 0.01], [1, 1, 1]),))
    target = np.array([4.0, 2.01, 2.0])
    view = View.looking(target - [20.0, 0, 0], target, (0, 0, 1), width=1, height=1, fov_deg=None, ortho_width=1e-3)
    way = Stepping("uniform", "preintegrated", scale)
    image = VolumeRenderer(volume).render(view, everywhere, way, limits=REFERENCE, counts=True)
    # Eight cells between the nine voxels; and half a voxel at either end, which the planned step decides.
    assert image.samples == 8 * steps + 2 * max(1, int(0.5 / scale + 0.6))
