# SPDX-License-Identifier: GPL-3.0-or-later
"""This project's camera, filter, film and wavelengths compared with Mitsuba's on the same scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from spectral_core.render import Bands, render_scene
from spectral_core.render.mitsuba_scene import load_scene
from spectral_core.render.mitsuba_scene.traced_spectra import light_spectra
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.wavelengths import plan_wavelengths
from spectral_core.render.variant import activate, choose_backend
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Film,
    ImageTexture,
    Instance,
    Material,
    PointLight,
    RenderSettings,
    World,
)
from spectral_core.spectra import catalogue
from tests.render.mitsuba_film import FilmSums
from tests.render.scenes import lit_plane, matrix, plane, sphere_mesh

pytest.importorskip("mitsuba")
CHECKERS = (np.indices((16, 16)).sum(axis=0) % 2)[..., None] * np.array([0.7, 0.5, 0.2]) + 0.1


def _camera(**changes):
    tilted = np.eye(4)
    turn = 0.6
    tilted[1:3, 1:3] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    tilted[:3, 3] = (0.3, -3, 4)
    return Camera(world_from_camera=tilted, field_of_view_rad=0.9, **changes)


def _scene(camera, film, spectral):
    lamp = catalogue.illuminant("FL11") if spectral else Color([1, 0.9, 0.7])
    paper = Diffuse(ImageTexture("checkers", CHECKERS.astype(np.float32), "linear", interpolation="nearest"))
    scene = lit_plane(
        PointLight(name="lamp", world_from_light=matrix((1, -1, 4)), power_w=200, color=lamp),
        surface=paper,
        camera=camera,
        film=film,
        world=World(Color([0.1, 0.15, 0.2])),
        settings=RenderSettings(max_bounces=2),
    )
    red = Material("red", Diffuse(Color([0.7, 0.1, 0.1])))
    return replace(
        scene,
        meshes=(plane(4.0), sphere_mesh(16)),
        materials=(*scene.materials, red),
        instances=(*scene.instances, Instance("ball", "sphere", matrix((0.2, 0.1, 0.5), 0.8), ("red",))),
    )


CASES = {
    "plain": (_camera(), Film(40, 24, samples=256)),
    "shifted": (_camera(shift=(0.2, -0.15)), Film(40, 20, samples=256)),
    "fit to height": (_camera(sensor_fit="height"), Film(40, 24, samples=256)),
    "portrait crop": (_camera(), Film(24, 40, samples=2048, crop=(4, 8, 16, 24))),
    "out of focus": (_camera(aperture_radius=0.3, focus_distance=4.0), Film(32, 32, samples=512)),
    "orthographic": (
        _camera(kind="orthographic", orthographic_scale=5.0, shift=(0.1, 0.2)),
        Film(40, 20, samples=256),
    ),
    "clipped": (_camera(near=3.6, far=6.0), Film(32, 32, samples=256)),
}


def _block_error(first, second):
    """Root mean square difference of 4×4 pixel means, relative to the mean."""
    height, width = first.shape[:2]
    blocks = (first - second)[..., :3].reshape(height // 4, 4, width // 4, 4, 3).mean(axis=(1, 3))
    return float(np.sqrt(np.square(blocks).mean()) / second[..., :3].mean())


@dataclass
class Picture:
    """Quantities that are compared between renders."""

    pixels: np.ndarray
    band_pixels: np.ndarray


def by_mitsuba(scene, bands):
    """The picture of the loaded scene by Mitsuba's camera, film and path tracer."""
    spectral = bands is not None
    scene = replace(scene, settings=replace(scene.settings, transport="spectral" if spectral else "rgb"))
    mi = activate(choose_backend("spectral" if spectral else "rgb"))
    loaded = load_scene(scene, mi, spectral=spectral)
    wavelengths = (
        plan_wavelengths(light_spectra(scene), bands, disperses=False, follow_bands=True) if spectral else None
    )
    sums = FilmSums(mi, scene.camera, scene.film, wavelengths)
    integrator = mi.load_dict({"type": "path", "max_depth": scene.settings.max_bounces + 2})
    for _ in sums.add(FirstHit(mi, loaded.scene, False), integrator, scene.film.samples):
        pass
    return Picture(sums.picture(), sums.band_picture())


@pytest.mark.parametrize(
    ("name", "spectral"),
    # wavelengths and bands meet the film in whole pictures, in parts of it and in samples outside of the pinhole
    [*((name, False) for name in CASES), *((name, True) for name in ("plain", "portrait crop", "out of focus"))],
)
def test_both_agree(name, spectral):
    camera, film = CASES[name]
    scene = _scene(camera, replace(film, filter_kind="box", filter_width=1.0), spectral)
    bands = Bands.uniform(400, 700, 4) if spectral else None
    fast = render_scene(scene, bands=bands)
    slow = by_mitsuba(scene, bands)
    assert fast.pixels.shape == slow.pixels.shape
    scale = slow.pixels[..., :3].mean()
    difference = (fast.pixels - slow.pixels)[..., :3]
    assert abs(difference.mean()) < (0.012 if spectral else 0.005) * scale
    error = _block_error(fast.pixels, slow.pixels)
    # above the noise, and far below the effect of a shift by one pixel
    assert error < (0.06 if spectral else 0.035)
    assert error < 0.7 * min(_block_error(np.roll(fast.pixels, 1, axis), slow.pixels) for axis in (0, 1))
    if spectral:
        np.testing.assert_allclose(
            fast.band_pixels.mean(axis=(0, 1)), slow.band_pixels.mean(axis=(0, 1)), rtol=0.02, atol=1e-5
        )
