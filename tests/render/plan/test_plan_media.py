# SPDX-License-Identifier: GPL-3.0-or-later
"""The bound on the error of omitting a thin medium, against light that is scattered along single rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import plan_from_data
from spectral_core.render.plan import bounds
from spectral_core.render.plan.light.reflections import reflected_radiance, ways_of_light
from spectral_core.scene import Diffuse, Emission, Instance, Material, PointLight, ScatteringMedium, gray
from spectral_core.scene.geometry import VolumeObject, unit_box
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.volume import transfer
from spectral_core.volume.transfer import TransferFunction
from tests.render.scenes import lit_plane, matrix, sphere_mesh

RADIUS, RADIANCE = 0.03, 4000.0


def _ember(medium):
    """A small bright ball inside a box of a medium above a dark plane."""
    haze, ember = Material("haze", None, medium), Material("ember", Emission(gray(1.0), RADIANCE))
    place = np.diag([5.0, 5.0, 3.0, 1.0])
    place[:3, 3] = (-2.5, -2.5, 0.05)
    ball = np.diag([RADIUS, RADIUS, RADIUS, 1.0])
    ball[:3, 3] = (0, 0, 1.2)
    base = lit_plane(surface=Diffuse(gray(0.03)))
    return replace(
        base,
        meshes=(*base.meshes, sphere_mesh(), replace(unit_box(), name="box")),
        materials=(*base.materials, haze, ember),
        instances=(
            *base.instances,
            Instance("haze", "box", place, ("haze",)),
            Instance("ember", "sphere", ball, ("ember",)),
        ),
    )


def test_haze_around_an_emissive_surface_is_bounded_by_its_glow():
    """At least distance h of a ray, light of intensity π r² L that scatters evenly adds up to σ L r² π / (4 h)."""
    haze = ScatteringMedium(0.0012, gray(0.95))
    scene = _ember(haze)
    stated = bounds.error_of_medium(scene, scene.materials[1])
    glow = 0.0012 * 0.95 * RADIANCE * RADIUS**2 * np.pi / (4 * np.array([1.1, 2.0, 10.0]) * RADIUS)
    dark, lit = (lab_from_linear_rgb(np.repeat(light[:, None], 3, axis=1)) for light in (0 * glow, glow))
    seen = delta_e_2000(dark, lit)
    assert seen.max() > 1.0 and stated >= seen.max()
    assert plan_from_data(scene, 1.0)["media"].value == "on"
    faint = _ember(replace(haze, density=1e-9))
    assert plan_from_data(faint, 1.0)["media"].value == "off"


def test_the_bound_follows_the_phase_functions_that_are_added():
    bound = lambda **medium: bounds.error_of_medium(  # noqa: E731
        scene := _ember(ScatteringMedium(1e-5, gray(0.95), **medium)), scene.materials[1]
    )
    assert bound(lobes=((1.0, 0.6, 0.0),)) == pytest.approx(bound(anisotropy=0.6))
    assert bound(lobes=((0.5, 0.6, 0.0), (0.5, 0.6, 0.0))) == pytest.approx(bound(anisotropy=0.6))
    assert bound(lobes=((4.0, 0.6, 0.0),)) > bound(anisotropy=0.6) > bound(anisotropy=0.0)


def test_lamps_brighter_than_white_scatter_more():
    haze = ScatteringMedium(1e-5, gray(0.95))
    scene = _ember(haze)
    lamps = lambda size: replace(scene, instances=scene.instances[:2], lights=(_lamp(size),))  # noqa: E731
    errors = [bounds.error_of_medium(lamps(size), scene.materials[1]) for size in (1.0, 8.0)]
    assert errors[1] > 2 * errors[0] > 0


def _lamp(size):
    return PointLight(name="lamp", world_from_light=matrix((0, 0, 6)), power_w=1000, color=gray(size))


@pytest.mark.parametrize("kept", [0.5, 0.8])
def test_haze_far_from_a_lamp_is_lit_by_the_walls(kept):
    """In a closed room of area A, walls of reflectance ρ have a radiance of Φ ρ / (π A (1 - ρ)) in the mean.

    A thin box of haze before black cloth, far from the lamp, showed ΔE 0.33 where 0.06 was stated.
    """
    radiance, depth = 10.0, 5e-5
    flux = radiance * np.pi * 600 * (1 - kept) / kept
    scene = replace(
        lit_plane(),
        meshes=(replace(unit_box(), name="box"),),
        materials=(Material("wall", Diffuse(gray(kept))), Material("haze", None, ScatteringMedium(depth, gray(1.0)))),
        instances=(
            Instance("room", "box", matrix((-5, -5, -5), 10.0), ("wall",)),
            Instance("haze", "box", matrix((-0.5, -0.5, -0.5)), ("haze",)),
        ),
        lights=(PointLight(name="lamp", world_from_light=matrix((4, 4, 4)), power_w=flux),),
    )
    shown = lab_from_linear_rgb(np.array([[0.0] * 3, [depth * radiance] * 3]))
    stated = plan_from_data(scene, 0.0)["media"].error
    assert stated >= delta_e_2000(*shown) > 0.25
    assert bounds.error_of_medium(scene, scene.materials[1], ways_of_light(scene.materials)) < delta_e_2000(*shown)
    # a border of haze that touches the lamp is no surface that the lamp lights
    near = replace(scene.instances[1], world_from_object=matrix((3.9, 3.9, 3.9)))
    moved = replace(scene, instances=(scene.instances[0], near))
    walls = [reflected_radiance(each, list(each.materials)) for each in (scene, moved)]
    assert walls[0] == walls[1] > radiance


def test_a_thin_volume_among_media_is_lit_by_the_walls():
    """Volumes beside fog are media, into which a white room sends its light: ΔE 0.5, where 0.3 was stated."""
    kept, depth, radiance = 0.95, 5e-5, 10.0
    flux = radiance * np.pi * 600 * (1 - kept) / kept
    thin = transfer.Material("thin", np.array([0.0, 1.0]), np.full(2, depth), np.ones(3))
    volume = VolumeObject("puff", np.ones((2, 2, 2), np.float32), matrix((-1, -1, -1)), TransferFunction((thin,)))
    scene = replace(
        lit_plane(), volumes=(volume,), meshes=(replace(unit_box(), name="box"),),
        materials=(Material("wall", Diffuse(gray(kept))), Material("fog", None, ScatteringMedium(1.0, gray(0.0)))),
        instances=(
            Instance("room", "box", matrix((-5, -5, -5), 10.0), ("wall",)),
            Instance("fog", "box", matrix((2, 2, 2)), ("fog",)),
        ),
        lights=(PointLight(name="lamp", world_from_light=matrix((4, 4, 4)), power_w=flux),),
    )  # fmt: skip
    shown = lab_from_linear_rgb(np.array([[0.0] * 3, [2 * depth * radiance] * 3]))  # a box of 2 × 2 × 2
    alone = replace(scene, instances=scene.instances[:1])
    errors = [plan_from_data(each, 0.0)["volumes"].error for each in (scene, alone)]
    assert errors[0] >= delta_e_2000(*shown) > 1.5 * errors[1]
