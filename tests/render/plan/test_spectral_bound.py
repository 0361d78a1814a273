# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of RGB transport, against every pair of surfaces computed on its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.mitsuba_scene.paint import emitted_rgb, emitted_spectrum, white_light
from spectral_core.render.plan.decision import LATER_BOUNCES
from spectral_core.render.plan.effects import plan_effects
from spectral_core.render.plan.errors.spectral import SECOND_BOUNCE, rgb_transport_error
from spectral_core.scene import Camera, Color, Diffuse, Film, Instance, Material, Mesh, PointLight, Scene, World
from spectral_core.scene.surface import ScatteringMedium
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import STANDARD, integration_points, observer, xyz_of
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, Reflectance, SpectralGrid
from spectral_core.spectra.upsample import upsampled

GRID = SpectralGrid(np.arange(400.0, 701.0, 20.0))


def _scene(paints: list[object], light: object) -> Scene:
    mesh = Mesh("mesh", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32))
    return Scene(
        camera=Camera(world_from_camera=np.eye(4)),
        film=Film(8, 8),
        meshes=(mesh,),
        materials=tuple(Material(f"m{k}", Diffuse(paint)) for k, paint in enumerate(paints)),
        instances=tuple(Instance(f"i{k}", "mesh", np.eye(4), (f"m{k}",)) for k in range(len(paints))),
        lights=(PointLight(name="lamp", world_from_light=np.eye(4), power_w=10.0, color=light),),
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_bound_is_the_worst_pair(seed: int) -> None:
    rng = np.random.default_rng(seed)
    measured = Reflectance("paint", GRID, rng.uniform(0.05, 0.95, len(GRID.wavelengths_nm)))
    colors = [Color(rng.uniform(0.1, 0.9, 3)) for _ in range(3)]
    light = Illuminant("lamp", GRID, rng.uniform(0.2, 1.0, len(GRID.wavelengths_nm)))
    found = rgb_transport_error(_scene([measured, *colors], light), 2)

    lamp = emitted_spectrum(light, None)
    points, weights = integration_points(WAVELENGTHS_NM, lamp.grid.wavelengths_nm)
    viewer = observer(STANDARD)
    cmfs = np.stack([np.interp(points, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])
    spectra = [measured.at(points), *(upsampled(color.linear_rgb, points) for color in colors)]
    rgb = [RGB_FROM_XYZ @ xyz_of(white_light(), measured), *(color.linear_rgb for color in colors)]
    size = cmfs[1] @ (weights * lamp.at(points))  # Y
    worst = 0.0
    for first, first_rgb in zip(spectra, rgb, strict=True):
        for second, second_rgb in zip([0 * points, *spectra], [np.zeros(3), *rgb], strict=True):
            reflected = first * (1 + SECOND_BOUNCE * second)
            exact = RGB_FROM_XYZ @ (cmfs @ (weights * lamp.at(points) * reflected)) / size
            simple = emitted_rgb(light) * first_rgb * (1 + SECOND_BOUNCE * second_rgb) / size
            worst = max(worst, float(delta_e_2000(lab_from_linear_rgb(exact), lab_from_linear_rgb(simple))))
    assert worst > 1.0
    assert found == pytest.approx(LATER_BOUNCES * worst, rel=1e-9)


def test_colors_beside_a_spectrum_are_compared_too() -> None:
    """Spectral transport for one material renders all others with spectra as well."""
    even = Reflectance("even", GRID, np.full(len(GRID.wavelengths_nm), 0.5))
    white, blue = Color(np.ones(3)), Color(np.array([0.1, 0.2, 0.7]))
    assert rgb_transport_error(_scene([even, blue], white)) > 1.0
    assert rgb_transport_error(_scene([even], white)) < 0.5 * rgb_transport_error(_scene([even, blue], white))


FLAME = Illuminant("flame", SpectralGrid(np.array([586.0, 589.0, 592.0])), np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize("place", ["world", "object"])
@pytest.mark.parametrize(
    "medium",
    [
        ScatteringMedium(density=0.1, emission_color=FLAME, emission_strength=1.0),
        ScatteringMedium(density=0.1, color=Reflectance("fog", GRID, np.linspace(0.1, 0.9, len(GRID.wavelengths_nm)))),
    ],
    ids=["shining", "colored"],
)
def test_spectra_of_media_need_spectral_transport(place: str, medium: ScatteringMedium) -> None:
    """Those of the world, and the light that a medium sends to colored surfaces, were rendered in three channels."""
    scene = _scene([Color((0.8, 0.1, 0.1)), Color((0.1, 0.8, 0.1))], Color(np.ones(3)))
    if place == "world":
        scene = replace(scene, world=World(medium=medium))
    else:
        body = Material("body", None, medium)
        scene = replace(scene, materials=(*scene.materials, body),
                        instances=(*scene.instances, Instance("cloud", "mesh", np.eye(4), ("body",))))  # fmt: skip
    assert plan_effects(scene, pilot=False).is_spectral
