# SPDX-License-Identifier: GPL-3.0-or-later
"""A live view of a fluorescent scene equals a new render, before and after a change of its dye."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.palette.paint.fluorescence import led
from spectral_core.render.live.link import LiveLink
from spectral_core.scene import Fluorescent, RenderSettings, gray
from spectral_core.spectra.fluorescence import FluorescentDye
from tests.live.test_live_session import Looker, fresh, scene, with_surface

__all__ = ["scene"]  # the fixture


def test_a_dye_and_its_change_are_visible(scene):
    dye = FluorescentDye.gaussian("green", 405, 530)
    dyed = [
        replace(m, surface=Fluorescent(gray(0.2), (dye,), (0.5,))) if m.name == "red" else m for m in scene.materials
    ]
    lamps = tuple(replace(lamp, color=led(405)) for lamp in scene.lights)
    glowing = replace(scene, materials=tuple(dyed), lights=lamps, settings=RenderSettings(transport="spectral"))
    link = LiveLink()
    try:
        looker = Looker(link)
        shown = looker.settled(glowing)
        np.testing.assert_allclose(shown, fresh(glowing), rtol=1e-3, atol=2e-3)
        weaker = with_surface(glowing, "red", amounts=(0.1,))
        less = looker.settled(weaker)
        np.testing.assert_allclose(less, fresh(weaker), rtol=1e-3, atol=2e-3)
        assert shown[..., 1].sum() > 1.02 * less[..., 1].sum()
    finally:
        link.close()
