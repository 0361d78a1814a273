# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of scenes whose emitted colors tint another white than daylight, as under the look of a lamp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storages import storage_named
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import ImageTexture, World
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum
from tests.relight.comparison import relative_error

pytest.importorskip("mitsuba")


@pytest.mark.parametrize("storage", ["bands121", "exact"])
def test_lights_of_a_scene_with_another_white_are_mixed_in_their_color(scene, storage) -> None:
    lamp = catalogue.illuminant("A")
    knots = SpectralGrid.uniform(380, 780, 10)
    white = Spectrum("smooth", knots, lamp.at(knots.wavelengths_nm))
    sky = ImageTexture("sky", np.full((2, 4, 3), (0.2, 0.4, 0.9), np.float32), "linear")
    scene = replace(scene, settings=scene.settings.in_spectra(white=white), world=World(sky, 0.5, group="Sky"))
    mixed = relight(record_transport(scene, storage_named(storage)))
    rendered = render_scene(scene, sampling_lights=SAMPLING_LIGHTS).pixels
    in_daylight = render_scene(replace(scene, settings=replace(scene.settings, white=None))).pixels
    assert relative_error(in_daylight, rendered) > 0.2
    assert mixed[..., :3].mean(axis=(0, 1)) == pytest.approx(rendered[..., :3].mean(axis=(0, 1)), rel=0.02)
