# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples that are not finite are counted and reported."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_effects
from spectral_core.scene import Film, PointLight
from tests.render.scenes import lit_plane, looking_down, matrix

pytest.importorskip("mitsuba")


def _scene():
    light = PointLight(name="point", world_from_light=matrix((0, 0, 3)), power_w=50.0)
    return lit_plane(light, camera=looking_down(8, 0.5), film=Film(4, 4, samples=2))


class _Overflowing:
    """An integrator with the value Inf for every sample."""

    def aov_names(self) -> list[str]:
        return []

    def sample(self, scene, sampler, ray, medium, active):
        import mitsuba

        return mitsuba.Spectrum(np.inf), mitsuba.Bool(True), []


def test_an_ordinary_scene_has_no_note() -> None:
    assert render_scene(_scene()).notes == ()


def test_samples_that_are_not_finite_are_counted_and_the_picture_is_finite() -> None:
    """16 pixels with 2 samples each, all of them lost."""
    job = RenderJob(_scene(), plan_effects(_scene()))
    job._integrators = {"": _Overflowing()}
    job.trace(2)

    assert np.isfinite(job.picture()).all()
    assert [note.message for note in job.notes] == [
        "32 samples were not finite numbers and count as black; look for extreme lights or materials"
    ]
