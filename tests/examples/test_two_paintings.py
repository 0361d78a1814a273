# SPDX-License-Identifier: GPL-3.0-or-later
"""The finished scene "Two white lights, two paintings": each lamp shows its own painting."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from examples.two_paintings.gallery import gallery
from examples.two_paintings.paintings import circles, hills
from spectral_core.palette.texture.lights import design_lights
from spectral_core.palette.texture.texture import Picture, design_texture
from spectral_core.render import render_scene
from spectral_core.scene import Film


def test_each_lamp_shows_its_painting_on_a_gray_wall() -> None:
    lights = design_lights(iterations=2).lights
    pictures = [Picture("hills", hills(96)), Picture("circles", circles(96))]
    design = design_texture(pictures, lights)
    assert all(loss.mean < 0.2 and loss.ghost < 0.02 for loss in design.losses)
    renders = [
        render_scene(gallery(design.texture, light, Film(48, 36, samples=64))).pixels[::-1, :, :3] for light in lights
    ]
    # The painting fills this part of the picture; the wall beside it is gray.
    painted = [render[4:20, 15:32].mean(axis=(0, 1)) for render in renders]
    walls = [render[4:20, 2:8].mean(axis=(0, 1)) for render in renders]
    assert np.abs(painted[0] / painted[0].mean() - painted[1] / painted[1].mean()).max() > 0.15
    for wall in walls:
        np.testing.assert_allclose(wall / wall.mean(), 1.0, atol=0.08)
