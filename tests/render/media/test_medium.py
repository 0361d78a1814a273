# SPDX-License-Identifier: GPL-3.0-or-later
"""Homogeneous media compared with Beer-Lambert and the white furnace; dispersion compared with Snell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Color,
    Emission,
    Film,
    Glass,
    Instance,
    LightPaths,
    Material,
    Mesh,
    PointLight,
    Rays,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    World,
    gray,
)
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum
from tests.render.scenes import lit_plane, matrix, plane, sphere_mesh

pytest.importorskip("mitsuba")


def box(name="box"):
    """A closed unit cube around the origin with outward faces."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], np.float32)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Mesh(name, corners, np.array(triangles, np.uint32))


def _in_white_world(medium, camera_height=4.0, transport="rgb", surface=None):
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, camera_height)), field_of_view_rad=0.02, near=0.01),
        film=Film(8, 8, samples=256),
        meshes=(box(),),
        materials=(Material("fog", surface, medium),),
        instances=(Instance("cube", "box", np.diag([4.0, 4.0, 2.0, 1.0]), ("fog",)),),
        world=World(gray(1.0)),
        settings=RenderSettings(transport=transport, max_bounces=200),
    )


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_scattered_light_of_the_world_is_not_behind_glass(transport):
    """On a transparent film with transparent glass it was subtracted, and the coverage was too small."""
    scene = _in_white_world(ScatteringMedium(density=0.7, color=gray(1.0)), transport=transport)
    scene = replace(scene, film=replace(scene.film, transparent=True, transparent_glass=True))
    pixel = render_scene(scene).pixels.mean(axis=(0, 1))
    assert pixel == pytest.approx([1.0 - np.exp(-0.7 * 2)] * 4, rel=0.01)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_an_absorbing_slab_follows_beer_and_lambert(transport):
    scene = _in_white_world(ScatteringMedium(density=0.7, color=gray(0.0)), transport=transport)
    color = render_scene(scene).pixels[..., :3].mean(axis=(0, 1))
    assert color == pytest.approx([np.exp(-0.7 * 2)] * 3, rel=0.03)


def test_a_medium_absorbs_a_line_between_two_whole_nm():
    """Media had the values of their spectra at whole nm alone: this one was clear, and its object black."""
    nm = 532.5 + np.array([-0.4, 0.0, 0.4])
    absorbs = Spectrum("line", SpectralGrid(nm), np.array([0.0, 1.0, 0.0]))
    laser = Illuminant("laser", SpectralGrid(532.5 + np.array([-0.2, 0.0, 0.2])), np.array([0.0, 1.0, 0.0]))
    pictures = [
        render_scene(replace(_in_white_world(medium, transport="spectral"), world=World(laser))).pixels[..., 1].mean()
        for medium in (None, ScatteringMedium(1.0, gray(0.0), absorbs))
    ]
    away = np.linspace(0.0, 0.2, 2001)  # nm from the middle of both lines
    share = np.average(np.exp(-2.0 * (1.0 - away / 0.4)), weights=1.0 - away / 0.2)
    assert pictures[1] / pictures[0] == pytest.approx(share, rel=0.01)


@pytest.mark.parametrize("fog", [None, ScatteringMedium(0.0)], ids=["alone", "in empty fog"])
def test_an_object_whose_medium_shows_nothing_is_clear(fog):
    """Where no medium of a scene showed anything, objects without a surface were black."""
    infrared = Spectrum("infrared", SpectralGrid(np.array([900.0, 1000.0])), np.ones(2))
    sun = SunLight(name="sun", world_from_light=matrix((0, 0, 5)), irradiance=np.pi, angle_rad=0.0)
    scene = lit_plane(sun, camera=Camera(world_from_camera=matrix((0, 0, 0.5)), field_of_view_rad=0.05, near=0.01))
    scene = replace(
        scene,
        meshes=(*scene.meshes, box()),
        materials=(*scene.materials, Material("clear", None, ScatteringMedium(1.0, gray(0.0), infrared))),
        instances=(*scene.instances, Instance("cube", "box", matrix((0, 0, 2)), ("clear",))),
        world=World(medium=fog),
    )
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(0.5, rel=0.01)


def test_a_camera_inside_the_medium_sees_through_the_rest_of_it():
    scene = _in_white_world(ScatteringMedium(density=0.7, color=gray(0.0)), camera_height=0.5)
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(np.exp(-0.7 * 1.5), rel=0.03)


@pytest.mark.parametrize("anisotropy", [-0.5, 0.0, 0.7])
def test_a_white_cloud_in_a_white_world_is_invisible(anisotropy):
    scene = _in_white_world(ScatteringMedium(density=2.0, color=gray(1.0), anisotropy=anisotropy))
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(1.0, abs=0.01)


def test_a_plan_without_media_omits_the_fog():
    scene = _in_white_world(ScatteringMedium(density=5.0, color=gray(0.0)))
    clear = replace(scene, settings=replace(scene.settings, overrides=(("media", "off"),)))
    assert render_scene(clear).pixels[..., :3].mean() == pytest.approx(1.0, abs=1e-4)


def test_a_light_hidden_from_media_does_not_light_the_fog():
    lamp = PointLight(name="lamp", world_from_light=matrix((3, 0, 0)), power_w=500.0)
    dark = replace(_in_white_world(ScatteringMedium(density=1.0)), world=World(), lights=(lamp,))
    lit = render_scene(dark).pixels[..., :3].mean()
    hidden = replace(dark, lights=(replace(lamp, hidden_from=Rays.VOLUME),))
    assert lit > 0.02 and render_scene(hidden).pixels[..., :3].max() == 0


def test_bounces_in_media_have_a_separate_limit():
    """With a limit of one bounce, a white cloud in a white world shows single scattering and unscattered light."""
    scene = _in_white_world(ScatteringMedium(density=1.0, color=gray(1.0)))
    values = []
    for most in (0, 1, 1000):
        limited = replace(scene, settings=replace(scene.settings, light_paths=LightPaths(volume=most)))
        values.append(float(render_scene(limited).pixels[..., :3].mean()))
    assert np.exp(-2) + 0.05 < values[0] < values[1] - 0.05 and values[2] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("density", [0.0, 0.8])
def test_an_emissive_medium_adds_light_along_the_path(density):
    medium = ScatteringMedium(density=density, color=gray(0.0), emission_strength=0.3)
    scene = replace(_in_white_world(medium), world=World())
    length = 2.0 if density == 0 else (1 - np.exp(-density * 2)) / density
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(0.3 * length, rel=0.01)


def test_rays_that_meet_nothing_more_have_left_the_medium_of_an_open_mesh():
    """As in Cycles: a ray entered through the one wall and is in the world's medium alone behind it."""
    medium = ScatteringMedium(density=0.0, color=gray(0.0), emission_strength=0.3)
    scene = replace(_in_white_world(medium), meshes=(replace(plane(0.5), name="box"),))
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(1.0, rel=1e-3)


def test_a_world_medium_dims_by_the_distance_to_the_camera():
    glow = Material("glow", Emission(gray(1.0), 1.0))
    scene = replace(
        _in_white_world(None), meshes=(plane(50.0, "box"),), materials=(glow,), world=World(
            gray(1.0), medium=ScatteringMedium(density=0.4, color=gray(0.0))),
        instances=(Instance("cube", "box", np.eye(4), ("glow",)),),
    )  # fmt: skip
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(np.exp(-0.4 * 4), rel=0.01)
    nothing = replace(scene, instances=())  # no light arrives from beyond unlimited fog
    assert render_scene(nothing).pixels[..., :3].max() < 1e-6


def test_an_inner_medium_adds_to_the_outer_one():
    """A clear core in a dark cube: the cube's medium goes on in it, as in Cycles."""
    outer, inner = ScatteringMedium(density=1.0, color=gray(0.0)), ScatteringMedium(density=1e-6, color=gray(0.0))
    scene = _in_white_world(outer)
    core = Instance("core", "box", np.diag([2.0, 2.0, 1.0, 1.0]), ("core",))
    scene = replace(
        scene, materials=(*scene.materials, Material("core", None, inner)), instances=(*scene.instances, core)
    )
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(np.exp(-2.0), rel=0.02)


@pytest.mark.parametrize("lobes", [((1.0, 0.5, 3.0),), ((0.7, 0.9, 0.0), (0.3, -0.2, 2.0))])
def test_phase_functions_of_media_conserve_energy(lobes):
    cloud = ScatteringMedium(density=2.0, color=gray(1.0), lobes=lobes)
    assert render_scene(_in_white_world(cloud)).pixels[..., :3].mean() == pytest.approx(1.0, abs=0.02)


def _prism(transport=None, dispersive=True):
    """A glass wedge over a thin bright line: the visible part of the line depends on the wavelength."""
    grid = SpectralGrid.uniform(360, 830, 10)
    cauchy = Spectrum("glass", grid, 1.4 + 4e4 / grid.wavelengths_nm**2)
    glass = Glass(gray(1.0), 0.0, cauchy if dispersive else float(cauchy.at(589.3)))
    sky = np.zeros((64, 512, 3), np.float32)
    sky[:, 380:388] = 1.0  # a bright line of longitude
    from spectral_core.scene import ImageTexture

    wedge = Mesh(
        "wedge",
        np.array([[-2, 0, -1], [2, 0, -1], [0, 0, 1.5], [-2, 3, -1], [2, 3, -1], [0, 3, 1.5]], np.float32) * 3,
        np.array([[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]], np.uint32),
    )
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 4, 9)), field_of_view_rad=0.3),
        film=Film(32, 8, samples=512),
        meshes=(wedge, sphere_mesh(32)),
        materials=(Material("glass", glass),),
        instances=(Instance("ball", "sphere", matrix((0, 4, 4), 1.0), ("glass",)),),
        world=World(ImageTexture("line", sky, "linear")),
        settings=RenderSettings(transport=transport),
    )


def test_a_dispersive_ball_is_colored_and_a_plain_one_is_not():
    colored, plain = (render_scene(_prism("spectral", flag)).pixels[..., :3] for flag in (True, False))

    def saturation(pixels):
        return float(np.ptp(pixels, axis=2).sum() / pixels.sum())

    assert saturation(plain) < 0.1 < 0.25 < saturation(colored)
    assert colored.sum() == pytest.approx(plain.sum(), rel=0.4)


def test_rgb_transport_notes_the_dispersion_that_it_lacks():
    scene = _prism("rgb")
    small = replace(scene, film=replace(scene.film, width=8, height=2, samples=1))
    notes = [note.subject for note in render_scene(small).notes if "dispersion" in note.message]
    assert notes == ["glass"]
    assert not [
        note for note in render_scene(replace(small, settings=RenderSettings())).notes if "disper" in note.message
    ]


def test_dispersion_alone_makes_the_plan_spectral():
    from spectral_core.render import plan_effects

    plan = plan_effects(_prism())
    assert plan.is_spectral and plan["dispersion"].value == "on"
    assert not plan_effects(_prism(dispersive=False)).is_spectral


def test_instances_share_one_mesh_and_equal_separate_meshes():
    """Instances compared with the same meshes in world space, including mirrored and stretched ones."""
    from spectral_core.render.mitsuba_scene import shapes

    light = PointLight(name="lamp", world_from_light=matrix((1, -1, 5)), power_w=300)
    scene = lit_plane(light, film=Film(32, 32, samples=64), camera=Camera(world_from_camera=matrix((0, 0, 9))))
    placements = [np.diag([s * f, s, 0.7 * s, 1.0]) for s, f in ((0.5, 1), (0.4, -1), (0.6, 1), (0.3, -1))]
    for number, placed in enumerate(placements):
        placed[:3, 3] = (number - 1.5, 0.4 * number - 0.6, 0.7)
    balls = tuple(Instance(f"ball {k}", "sphere", placed, ("red",)) for k, placed in enumerate(placements))
    from spectral_core.scene import Diffuse

    scene = replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(12)),
        materials=(*scene.materials, Material("red", Diffuse(Color([0.7, 0.2, 0.1])))),
        instances=(*scene.instances, *balls),
    )
    pictures = []
    for threshold in (1, 10**9):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(shapes, "SHARED_TRIANGLES", threshold)
            pictures.append(render_scene(scene).pixels)
    np.testing.assert_allclose(pictures[0].mean(), pictures[1].mean(), rtol=2e-3)
    blocks = [p[..., :3].reshape(8, 4, 8, 4, 3).mean(axis=(1, 3)) for p in pictures]
    np.testing.assert_allclose(blocks[0], blocks[1], rtol=0.03, atol=0.01 * pictures[1].mean())
