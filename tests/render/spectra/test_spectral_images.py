# SPDX-License-Identifier: GPL-3.0-or-later
"""Images on surfaces are upsampled in spectral transport, with the right orientation."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Diffuse,
    Film,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    RenderSettings,
    Scene,
    World,
    gray,
)

CORNERS = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_four_colors_render_at_their_positions(transport: str) -> None:
    """A furnace shows the colors of a diffuse square, red and green below blue and gray, to 1.5 % of white."""
    painted = np.array([[[0.5, 0.1, 0.1], [0.1, 0.4, 0.15]], [[0.1, 0.15, 0.5], [0.3, 0.3, 0.3]]], np.float32)
    camera = np.eye(4)
    camera[2, 3] = 2
    scene = Scene(
        camera=Camera(world_from_camera=camera, kind="orthographic", orthographic_scale=2.0),
        film=Film(2, 2, samples=512, filter_width=0.01),
        meshes=(Mesh("square", CORNERS, [[0, 1, 2], [0, 2, 3]], uvs=(CORNERS[:, :2] + 1) / 2),),
        materials=(Material("painted", Diffuse(ImageTexture("four", painted, "linear", interpolation="nearest"))),),
        instances=(Instance("square", "square", np.eye(4), ("painted",)),),
        world=World(color=gray(1.0)),
        settings=RenderSettings(transport=transport),  # type: ignore[arg-type]
    )

    pixels = render_scene(scene).pixels
    np.testing.assert_allclose(pixels[..., :3], painted, atol=0.015)
