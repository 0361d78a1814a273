# SPDX-License-Identifier: GPL-3.0-or-later
"""Black smoke shows by what it hides: its opacity has the wanted quality, against the marcher of the benchmarks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from benchmarks.volume.checks.oracle import march_oracle
from spectral_core.cli.shared import volume_report
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, VolumeImage
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

NARROW = [0.45, 0.5, 0.55], [0.0, 8.0, 0.0]


def noise() -> ScalarVolume:
    values = gaussian_filter(np.random.default_rng(5).normal(size=(14, 14, 14)), 2.0)
    return ScalarVolume("noise", ((values - values.min()) / np.ptp(values)).astype(np.float32))


def soot(color: float) -> Material:
    return Material("soot", *NARROW, np.full(3, color))


GLOW = Material("glow", [0.9, 1.0], [0.0, 0.0], [1.0, 0.8, 0.5], emission=[0.0, 0.5], lit=False)


@pytest.mark.parametrize(
    "materials", [(soot(0.0),), (soot(0.0), GLOW), (soot(0.005), GLOW)], ids=["soot", "fire", "dim"]
)
def test_the_opacity_of_black_smoke_has_the_wanted_quality(materials):
    """No error was expected, and steps of four voxels were taken: the opacity had 3 dB."""
    volume, transfer = noise(), TransferFunction(materials)
    view = View.around(volume, width=32, height=32)
    made = plan(VolumeRenderer(volume), view, transfer, 45.0)
    shown = VolumeRenderer(volume).render(view, transfer, made.stepping)
    exact = 1.0 - march_oracle(volume, transfer, view.rays_world(), 0.02).transmittance
    error = 1.0 - shown.transmittance.astype(np.float64).ravel() - exact
    measured = 10.0 * math.log10(np.sum(exact**2) / np.sum(error**2))
    assert made.is_reached and measured > 43.0
    assert measured > made.estimate_db - 1.0


def test_materials_are_dark_if_they_are_black_beside_others_or_alone():
    gray = Material("gray", *NARROW, np.full(3, 0.2))
    assert TransferFunction((soot(0.0),)).has_dark and TransferFunction((soot(0.005), GLOW)).has_dark
    assert not TransferFunction((soot(0.005),)).has_dark
    assert not TransferFunction((gray, GLOW)).has_dark
    unseen = Material("unseen", [0, 1], [0, 0], [0, 0, 0], emission=[1, 1])
    assert not TransferFunction((gray, unseen)).has_dark


def test_a_black_volume_under_a_lamp_has_the_steps_that_its_opacity_needs():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("llvm_ad_rgb")
    from spectral_core.volume.mitsuba_integrator.scene_fields import SceneFields
    from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, VolumeSettings

    volume, transfer = noise(), TransferFunction((soot(0.0),))
    fields = SceneFields([SceneVolume(volume, transfer)], VolumeSettings(quality=45.0, shading=True))
    lamp = {"type": "point", "position": [30.0, 20.0, 40.0]}
    fields.prepare(View.around(volume, width=16, height=16), mi.load_dict({"type": "scene", "lamp": lamp}))
    assert math.isfinite(fields.plans[0].estimate_db) and fields.plans[0].is_reached


def test_a_report_measures_what_black_smoke_hides():
    """Its light is 0 in every picture, so that any step was said to be equal to the reference."""
    images = [
        VolumeImage(TransferFunction((soot(0.0),)), Stepping(), np.zeros((2, 2, 1)), np.full((2, 2), passed), 0.0)
        for passed in (0.5, 0.6)
    ]
    judged = [volume_report._judged(each) for each in images]
    assert volume_report._snr(*judged) == pytest.approx(10.0 * math.log10(0.5**2 / 0.1**2))
    assert volume_report._snr(judged[0], judged[0]) == math.inf


def test_an_empty_picture_is_explained():
    """Rays beside a thin field were said to be a function that shows nothing of its values."""
    volume = noise()
    assert "no ray" in volume_report.why_empty(volume, TransferFunction((soot(0.0),)))
    above = TransferFunction((Material("above", [2.0, 3.0], [0.0, 1.0], np.ones(3)),))
    assert "shows nothing of values from 0 to 1" in volume_report.why_empty(volume, above)
