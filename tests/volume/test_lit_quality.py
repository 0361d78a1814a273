# SPDX-License-Identifier: GPL-3.0-or-later
"""The wanted quality of volumes that lamps light, against an integration in NumPy of the light along each ray."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from benchmarks.volume.checks.lit_light import Lamp, LitScene, lit_light
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.arithmetic import mean_place
from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, integrator_dict
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View
from tests.volume.march.test_integrator import load

pytest.importorskip("mitsuba")
SIZE, ASKED_DB = 20, 45.0
SUN = Lamp(np.array([-0.3, 0.5, -0.8]), np.array([3.0, 2.0, 1.0]), is_sun=True)
NEAR = Lamp(np.array([13.0, -3.0, 12.0]), np.array([300.0, 200.0, 90.0]), is_sun=False)


@pytest.fixture(scope="module")
def field() -> ScalarVolume:
    rough = gaussian_filter(np.random.default_rng(5).normal(size=(12, 11, 10)), 1.4)
    values = ((rough - rough.min()) / np.ptp(rough)).astype(np.float32)
    placed = np.array([[1.0, 0.3, 0, 0], [0, 0.8, 0, 1], [0, 0, 1.5, -2], [0, 0, 0, 1]])
    return ScalarVolume("noise", values, placed)


def soft() -> TransferFunction:
    haze = Material("haze", [0.2, 0.5, 0.8], [0.0, 0.25, 0.0], np.array([0.9, 0.5, 0.2]))
    glow = Material("glow", [0.7, 1.0], [0.0, 0.1], np.array([0.1, 0.2, 0.4]), lit=False)
    return TransferFunction((haze, glow))


def thin() -> TransferFunction:
    return TransferFunction((Material("shell", [0.48, 0.5, 0.52], [0.0, 3.0, 0.0], np.array([0.9, 0.5, 0.2])),))


def solid() -> TransferFunction:
    return TransferFunction((Material("solid", [0.4, 0.6], [0.0, 3.0], np.array([0.3, 0.5, 0.8])),))


def lit(volume: ScalarVolume, transfer: TransferFunction, lamp: Lamp, **settings: Any) -> LitScene:
    load("llvm_ad_rgb")
    return LitScene.of(volume, transfer, lamp, View.around(volume, 30.0, 25.0, width=SIZE, height=SIZE), **settings)


def shown(
    volume: ScalarVolume, transfer: TransferFunction, lamp: Lamp, made: LitScene, exact: np.ndarray | None = None
) -> tuple[float, np.ndarray]:
    """SNR of the integrator's picture against that of NumPy, and the latter, which may be given."""
    picture, eye, along = made.at_centers()
    exact = lit_light(volume, transfer, lamp, eye, along) if exact is None else exact
    return snr_db(exact, picture - exact), exact


@pytest.mark.parametrize(("function", "lamp"), [(soft, NEAR), (thin, SUN), (solid, SUN)])
def test_a_lit_picture_has_the_wanted_quality(field, function, lamp):
    transfer = function()
    made = lit(field, transfer, lamp, quality=ASKED_DB)
    measured, exact = shown(field, transfer, lamp, made)
    fields = made.integrator.fields
    (chosen,) = fields.plans
    assert chosen.is_reached
    assert measured > ASKED_DB - 1.5
    assert measured == pytest.approx(chosen.estimate_db, abs=2.0)
    # Steps for even light, which were taken before, are too long for it.
    fields.prepare(View.around(field, 10.0, 25.0, width=SIZE, height=SIZE))
    (even,) = fields.plans
    way = {"rule": even.stepping.rule, "quadrature": even.stepping.quadrature, "scale": even.stepping.scale}
    assert shown(field, transfer, lamp, lit(field, transfer, lamp, **way), exact)[0] < ASKED_DB - 3.0


def test_the_steps_of_a_volume_without_lamps_or_lit_materials_are_those_of_even_light(field):
    glow = Material("glow", [0.3, 1.0], [0.0, 0.5], np.array([0.1, 0.2, 0.4]), lit=False)
    own = lit(field, TransferFunction((glow,)), SUN, quality=ASKED_DB).integrator.fields
    mi = load("llvm_ad_rgb")
    made = integrator_dict([SceneVolume(field, TransferFunction((glow,)))], quality=ASKED_DB)
    even = mi.load_dict(made).fields
    even.prepare(View.around(field, 30.0, 25.0, width=SIZE, height=SIZE))
    found, expected = own.plans[0].stepping, even.plans[0].stepping
    assert (found.rule, found.quadrature) == (expected.rule, expected.quadrature)
    assert found.scale == pytest.approx(expected.scale, rel=1e-4)  # the sensor's matrix is in single precision


def test_a_thin_surface_is_lit_where_it_is(field):
    """It lies anywhere in a step; the middle of the step is up to half a step beside it, and lit otherwise."""
    made = lit(field, thin(), SUN, rule="cells", quadrature="preintegrated", scale=0.4)
    assert shown(field, thin(), SUN, made)[0] > 35.0


def test_the_mean_place_of_light_in_an_even_step():
    import drjit.llvm as llvm

    depths = np.array([0.0, 1e-4, 0.05, 0.0999, 0.1001, 1.0, 8.0, 60.0])
    places = (np.arange(200_000) + 0.5) / 200_000
    weights = np.exp(-depths[:, None] * places)
    expected = (weights * places).sum(-1) / weights.sum(-1)
    found = mean_place(llvm.Float(depths), llvm.Float(np.exp(-depths))).numpy()
    np.testing.assert_allclose(found, expected, atol=2e-5)
