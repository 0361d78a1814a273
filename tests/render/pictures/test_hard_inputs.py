# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that fail in other programs: each renders finite pixels, with a note on features that cannot be shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.render import Bands, choose_backend, describe_backend, render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    Glossy,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    MixedPaint,
    PointLight,
    Principled,
    RenderSettings,
    Scene,
    SpotLight,
    SunLight,
    Transparent,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid
from tests.render.scenes import lit_plane, looking_down, matrix, plane, sphere_mesh

pytest.importorskip("mitsuba")
LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)
TINY = Film(6, 4, samples=8)
LIT = 0.5 / np.pi * 100 / (4 * np.pi) / 9


def _finite(scene):
    result = render_scene(scene)
    assert np.isfinite(result.pixels).all() and result.status == "done"
    return result


def _with_plane(placed, **changes):
    scene = lit_plane(LAMP, film=TINY, **changes)
    return replace(scene, instances=(Instance("table", "plane", placed, ("paper",)),))


def test_an_empty_scene_is_black_and_empty():
    empty = Scene(camera=looking_down(), film=TINY)
    assert _finite(empty).pixels[..., :3].max() == 0
    assert _finite(replace(empty, film=replace(TINY, transparent=True))).pixels.max() == 0


@pytest.mark.parametrize(
    "light",
    [
        AreaLight(name="flat", world_from_light=matrix((0, 0, 3)), size=(0.0, 1.0)),
        AreaLight(name="flat", world_from_light=np.diag([0.0, 0, 0, 1])),
        PointLight(name="dark", world_from_light=matrix((0, 0, 3)), power_w=0.0, radius=0.5),
        SunLight(name="nowhere", world_from_light=np.diag([0.0, 0, 0, 1])),
        SpotLight(name="shut", world_from_light=matrix((0, 0, 3)), cone_angle_rad=0.0),
    ],
)
def test_lights_without_extent_or_power_emit_no_light(light):
    assert _finite(lit_plane(light, film=TINY)).pixels[..., :3].max() == 0


def test_a_flat_area_light_gets_a_note():
    light = AreaLight(name="flat", world_from_light=matrix((0, 0, 3)), size=(0.0, 1.0))
    (note,) = render_scene(lit_plane(light, film=TINY)).notes
    assert note.subject == "flat" and "without area" in note.message


def test_a_negative_scale_keeps_fronts_in_front():
    """Mirrored in one axis, the plane still shows its lit side, with and without normals."""
    for flip in (np.diag([-1.0, 1, 1, 1]), np.diag([1.0, -1, 1, 1]), np.diag([-1.0, -1, -1, 1])):
        assert _finite(_with_plane(flip)).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.01)
    light = PointLight(name="lamp", world_from_light=matrix((0, 0, 5)), power_w=200)
    values = []
    for flip in (1.0, -1.0):
        scene = lit_plane(
            light,
            film=Film(8, 8, samples=64),
            camera=Camera(world_from_camera=matrix((0, 0, 6)), field_of_view_rad=0.3),
        )
        ball = Instance("ball", "sphere", np.diag([flip, 1.0, 1.0, 1.0]), ("paper",))
        values.append(_finite(replace(scene, meshes=(sphere_mesh(24),), instances=(ball,))).pixels[..., 0])
    np.testing.assert_allclose(values[0], values[1], rtol=0.02)


def test_a_singular_matrix_gets_a_note_or_is_shown_flat():
    gone = render_scene(_with_plane(np.diag([1.0, 0.0, 0.0, 1.0])))
    assert [note.subject for note in gone.notes] == ["table"]
    flat = _with_plane(np.diag([1.0, 1.0, 0.0, 1.0]))  # a plane scaled to 0 along its normal is the same plane
    assert _finite(flat).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.01)


@pytest.mark.parametrize("axes", [np.diag([1.0, 1, 0]), np.array([[1.0, 1, 0], [0, 0, 1], [0, 0, 0]])])
def test_a_singular_camera_is_an_error(axes):
    """An axis of length 0, and two axes that are one."""
    view = np.eye(4)
    view[:3, :3] = axes
    scene = lit_plane(LAMP, film=TINY, camera=Camera(world_from_camera=view))
    with pytest.raises(InvalidInputError, match="has no view direction"):
        render_scene(scene)


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_tiny_and_huge_scenes(scale):
    light = PointLight(name="lamp", world_from_light=matrix((0, 0, 3 * scale)), power_w=100 * scale**2)
    camera = Camera(
        world_from_camera=matrix((0, 0, 2 * scale)), field_of_view_rad=0.05, near=1e-3 * scale, far=1e3 * scale
    )
    scene = lit_plane(light, film=TINY, camera=camera)
    scene = replace(scene, instances=(Instance("table", "plane", matrix(scale=scale), ("paper",)),))
    assert _finite(scene).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.01)


def test_degenerate_triangles_and_empty_meshes_are_omitted():
    triangles = np.array([[0, 1, 2], [0, 0, 1], [0, 2, 3], [3, 3, 3]], np.uint32)
    broken = replace(plane(), triangles=triangles)
    scene = replace(lit_plane(LAMP, film=TINY), meshes=(broken,))
    assert _finite(scene).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.01)
    line = Mesh("plane", np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32))
    assert _finite(replace(scene, meshes=(line,))).pixels[..., :3].max() == 0


def test_missing_material_slots_show_the_gray_of_blender():
    scene = replace(lit_plane(LAMP, film=TINY), instances=(Instance("table", "plane", np.eye(4)),))
    assert _finite(scene).pixels[..., 0].mean() == pytest.approx(LIT * 0.8 / 0.5, rel=0.01)
    many = replace(plane(), material_indices=np.array([7, 9], np.uint16))
    scene = replace(lit_plane(LAMP, film=TINY), meshes=(many,))
    assert _finite(scene).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.01)


def test_colors_above_1_reflect_more_than_arrives_as_in_cycles():
    result = _finite(lit_plane(LAMP, film=TINY, surface=Diffuse(Color([1.5, 0.5, -0.2]))))
    assert result.pixels[..., 0].mean() == pytest.approx(LIT * 2 * 1.5, rel=0.01)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_the_spectrum_of_a_light_on_a_surface_sets_its_color(transport):
    """A blackbody's power per nm is no reflectance: its color counts."""
    hot = catalogue.blackbody(3000.0)
    settings = RenderSettings(transport=transport)
    found = _finite(lit_plane(LAMP, film=TINY, surface=Diffuse(hot), settings=settings))
    color = np.clip(linear_rgb_from_xyz(xyz_of(normalized(hot))), 0, None)
    alike = _finite(lit_plane(LAMP, film=TINY, surface=Diffuse(Color(color)), settings=settings))
    np.testing.assert_allclose(found.pixels, alike.pixels, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_black_spectra_are_black(transport):
    grid = SpectralGrid.uniform(400, 700, 10)
    black = Reflectance("black", grid, np.zeros(31))
    dark = Illuminant("dark", grid, np.zeros(31))
    settings = RenderSettings(transport=transport)
    assert _finite(lit_plane(LAMP, film=TINY, surface=Diffuse(black), settings=settings)).pixels[..., :3].max() == 0
    unlit = lit_plane(replace(LAMP, color=dark), film=TINY, settings=settings)
    assert _finite(unlit).pixels[..., :3].max() == 0


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_an_image_is_the_factor_of_a_mix(transport):
    """A mask, 0 at the left and 1 at the right, mixes red and green paint; the bottom row of an image is at v = 0."""
    mask = np.zeros((2, 2, 1), np.float32)
    mask[:, 1] = 1
    red, green = Color([0.6, 0.05, 0.05]), Color([0.05, 0.6, 0.05])
    paint = MixedPaint(ImageTexture("mask", mask, "raw", "extend", "nearest"), red, green)
    camera = Camera(world_from_camera=matrix((0, 0, 2)), kind="orthographic", orthographic_scale=2.0)
    sun = SunLight(name="sun", world_from_light=np.eye(4), irradiance=np.pi, angle_rad=0)
    scene = lit_plane(
        sun,
        film=Film(8, 8, samples=64),
        camera=camera,
        surface=Diffuse(paint),
        settings=RenderSettings(transport=transport),
    )
    scene = replace(scene, meshes=(plane(1.0),))
    pixels = _finite(scene).pixels
    assert pixels[:, :3, :3].mean(axis=(0, 1)) == pytest.approx(red.linear_rgb, abs=0.02)
    assert pixels[:, 5:, :3].mean(axis=(0, 1)) == pytest.approx(green.linear_rgb, abs=0.02)
    rows = np.array([[[0.1] * 3] * 2, [[0.7] * 3] * 2], np.float32)
    image = Diffuse(ImageTexture("rows", rows, "linear", "extend", "nearest"))
    pixels = _finite(replace(scene, materials=(Material("paper", image),))).pixels
    assert pixels[:3, :, 0].mean() == pytest.approx(0.1, abs=0.01)
    assert pixels[5:, :, 0].mean() == pytest.approx(0.7, abs=0.01)


def test_an_emissive_texture_emits_its_image():
    glow = np.array([[[2.0, 0.5, 0.0], [0.0, 0.5, 4.0]]], np.float32)
    surface = Emission(ImageTexture("glow", glow, "linear", "extend", "nearest"), 1.5)
    camera = Camera(world_from_camera=matrix((0, 0, 2)), kind="orthographic", orthographic_scale=2.0)
    for transport in ("rgb", "spectral"):
        scene = lit_plane(film=Film(8, 8, samples=64), camera=camera, surface=surface, transport=transport)
        pixels = _finite(replace(scene, meshes=(plane(1.0),))).pixels
        assert pixels[:, :3, :3].mean(axis=(0, 1)) == pytest.approx([3.0, 0.75, 0.0], rel=0.03, abs=0.03)
        assert pixels[:, 5:, :3].mean(axis=(0, 1)) == pytest.approx([0.0, 0.75, 6.0], rel=0.03, abs=0.06)


def test_a_transparent_film_has_the_coverage_of_objects():
    """Coverage: 0 beside objects, 1 on them, 0.5 on half transparent ones; reflections show the world."""
    camera = Camera(world_from_camera=matrix((0, 0, 2)), kind="orthographic", orthographic_scale=4.0)
    film = Film(8, 8, samples=256, transparent=True)
    world = World(gray(0.5))
    scene = lit_plane(film=film, camera=camera, world=world, surface=Glossy(gray(1.0), 0.0))
    scene = replace(scene, meshes=(plane(1.0),))
    pixels = _finite(scene).pixels
    assert np.all(pixels[[0, -1]] == 0)
    assert pixels[3:5, 3:5] == pytest.approx(np.broadcast_to([0.5, 0.5, 0.5, 1.0], (2, 2, 4)), rel=1e-4)
    for half in (Principled(gray(0.0), alpha=0.5, ior=1.0), Transparent(gray(0.5))):
        pixels = _finite(replace(scene, materials=(Material("paper", half),))).pixels
        assert pixels[3:5, 3:5, 3] == pytest.approx(np.full((2, 2), 0.5), abs=1e-5)
        assert pixels[3:5, 3:5, :3].mean() == pytest.approx(0.0, abs=0.02)


def test_lights_are_visible_in_mirrors_and_not_to_the_camera():
    away = np.diag([1.0, -1, -1, 1])
    light = AreaLight(name="area", world_from_light=away, power_w=100, size=(4.0, 4.0))
    scene = replace(lit_plane(light, film=TINY), instances=())
    assert _finite(scene).pixels[..., :3].max() == 0
    seen = replace(scene, lights=(replace(light, camera_visible=True),))
    assert _finite(seen).pixels[..., 0].mean() == pytest.approx(100 / (np.pi * 16), rel=1e-3)
    above = replace(light, world_from_light=matrix((0, 0, 6)))
    mirror = lit_plane(above, film=TINY, surface=Glossy(gray(1.0), 0.0))
    assert _finite(mirror).pixels[..., 0].mean() == pytest.approx(100 / (np.pi * 16), rel=1e-3)


def test_lights_cast_no_shadow():
    """A large lamp between another lamp and the plane blocks no light."""
    between = PointLight(name="ball", world_from_light=matrix((0, 0, 2.5)), power_w=1e-6, radius=0.3)
    assert _finite(lit_plane(LAMP, between, film=TINY)).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.15)
    many = lit_plane(LAMP, between, film=Film(8, 8, samples=512))
    assert _finite(many).pixels[..., 0].mean() == pytest.approx(LIT, rel=0.02)


def test_bands_are_checked():
    with pytest.raises(InvalidInputError, match="expected a rising range in 360 to 830 nm"):
        Bands.uniform(300, 700, 5)
    with pytest.raises(InvalidInputError, match="expected 1 nm or more"):
        Bands.uniform(400, 410, 100)
    with pytest.raises(InvalidInputError, match="share a name"):
        Bands(("a", "a"), np.ones((2, 471)))


def test_variants_are_selected_and_refused(monkeypatch):
    with pytest.raises(InvalidInputError, match="'scalar' cannot render rgb transport; choose cuda or llvm"):
        choose_backend("rgb", "scalar")
    with pytest.raises(InvalidInputError, match="'llvm_ad_rgb' cannot render spectral"):
        choose_backend("spectral", "llvm_ad_rgb")
    with pytest.raises(InvalidInputError, match="'vulkan' cannot"):
        choose_backend("rgb", "vulkan")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/nowhere/libLLVM.so")
    with pytest.raises(MissingDependencyError, match=r"needs the LLVM library, version 17.*DRJIT_LIBLLVM_PATH names "
                       r"/nowhere/libLLVM.so, which is not there: correct or unset it, or install"):  # fmt: skip
        choose_backend("spectral")
    report = describe_backend()
    assert report["llvm_library"] is None and any("LLVM" in problem for problem in report["problems"])
