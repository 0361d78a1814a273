# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that vary, written for Mitsuba: its own heterogeneous media are an independent check of ours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.mitsuba_export import write_mitsuba
from spectral_core.scene import (
    Camera,
    Color,
    Film,
    Instance,
    Material,
    MediumGrid,
    RenderSettings,
    ScatteringMedium,
    Scene,
    World,
    gray,
)
from spectral_core.scene.geometry import unit_box
from tests.render.pictures.test_mitsuba_export import plain_picture, tiles, turned

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def test_a_medium_that_varies_looks_the_same_in_mitsuba(tmp_path: Path) -> None:
    """A cloud of colored albedo before a bright world, and a note where its extinction differs by color."""
    x = np.linspace(-1, 1, 12)
    density = np.exp(-2 * (x[:, None, None] ** 2 + x[:, None] ** 2 + x**2)).astype(np.float32)
    place = np.diag([1 / 6, 1 / 6, 1 / 6, 1.0])
    place[:3, 3] = -1 + 1 / 12
    around = np.diag([2.0, 2.0, 2.0, 1.0])
    around[:3, 3] = -1
    cloud = ScatteringMedium(
        3.0, Color(np.array([0.9, 0.6, 0.3])), anisotropy=0.3,
        grid=MediumGrid(place, scattering=density, absorption=density),
    )  # fmt: skip
    scene = Scene(
        camera=Camera(world_from_camera=turned(0, 90, (0.3, -4, 0.2)), field_of_view_rad=0.6),
        film=Film(24, 24, samples=512),
        meshes=(replace(unit_box(), name="box"),),
        materials=(Material("cloud", None, cloud),),
        instances=(Instance("cloud", "box", around, ("cloud",)),),
        world=World(gray(0.8)),
        settings=RenderSettings(transport="rgb", max_bounces=16),
    )  # fmt: skip
    theirs = plain_picture(scene, tmp_path / "scene", variant="scalar_rgb", samples=1024)
    ours = render_scene(scene).pixels[..., :3]
    np.testing.assert_allclose(theirs.mean(axis=(0, 1)), ours.mean(axis=(0, 1)), rtol=0.015)
    np.testing.assert_allclose(tiles(theirs), tiles(ours), rtol=0.05)
    colored = replace(cloud, extinction=Color(np.array([1.0, 0.5, 0.2])))
    made = write_mitsuba(replace(scene, materials=(Material("cloud", None, colored),)), tmp_path / "colored")
    assert any("one extinction" in note.message for note in made.notes)
