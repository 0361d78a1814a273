# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules by type of ray: visibility, light linking, shadows, holdouts, limits, clamping, and two backgrounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.still import render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Falloff,
    Film,
    Instance,
    LightPaths,
    Material,
    Mesh,
    Metal,
    Photometry,
    PointLight,
    Rays,
    RenderSettings,
    Scene,
    SpotLight,
    SunLight,
    Transparent,
    World,
    gray,
)

mitsuba = pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def at(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def square(name, size):
    half = size / 2
    corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]], np.float32)
    return Mesh(name, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))


LAMP = PointLight(name="lamp", world_from_light=at(0, 0, 3), power_w=100.0)
FLOOR = Instance("floor", "floor", np.eye(4), ("gray",))
LID = Instance("lid", "lid", at(0, 0, 2), ("gray",))
VIEW = Camera(world_from_camera=at(0, 0, 1.5), field_of_view_rad=0.3)


def scene(*, lights=(LAMP,), instances=(FLOOR,), **values):
    """A gray floor under a lamp, with the camera below the position of a lid."""
    return Scene(
        camera=VIEW,
        film=values.pop("film", Film(8, 8, samples=32)),
        meshes=(square("floor", 20), square("lid", 4)),
        materials=values.pop(
            "materials", (Material("gray", Diffuse(gray(0.5))), Material("glow", Emission(gray(1.0), 2.0)))
        ),
        instances=instances,
        lights=lights,
        **values,
    )


def brightness(what):
    return float(render_scene(what).pixels[..., :3].mean())


def test_objects_hidden_from_shadow_rays_cast_no_shadow():
    lit = brightness(scene())
    assert brightness(scene(instances=(FLOOR, LID))) < 0.2 * lit
    clear = replace(LID, hidden_from=Rays.SHADOW | Rays.DIFFUSE)
    assert brightness(scene(instances=(FLOOR, clear))) == pytest.approx(lit, rel=1e-4)


def test_shadow_and_light_linking():
    lit = brightness(scene())
    clear = replace(LID, clear_for=("lamp",), hidden_from=Rays.DIFFUSE)
    assert brightness(scene(instances=(FLOOR, clear))) == pytest.approx(lit, rel=1e-4)
    assert brightness(scene(instances=(replace(FLOOR, unlit_by=("lamp",)),))) == 0
    other = replace(LAMP, name="other")
    assert brightness(scene(instances=(replace(FLOOR, unlit_by=("other",)),), lights=(LAMP, other))) == pytest.approx(
        lit, rel=0.02
    )


def test_a_lamp_without_shadows_lights_through_objects():
    bare = scene(lights=(replace(LAMP, casts_shadow=False),), instances=(FLOOR, replace(LID, hidden_from=Rays.DIFFUSE)))
    assert brightness(bare) == pytest.approx(brightness(scene()), rel=1e-4)


def test_mirrors_show_a_lamp_that_casts_no_shadow_and_none_that_rays_do_not_meet():
    lamp = AreaLight(name="lamp", world_from_light=at(0, 0, 3), size=(2.0, 2.0), power_w=100.0)
    mirror = Material("gray", Metal(gray(1.0), gray(1.0)))

    def shown(roughness, **change):
        shiny = replace(mirror, surface=replace(mirror.surface, roughness=roughness))
        return render_scene(scene(lights=(replace(lamp, **change),), materials=(shiny,))).pixels[..., :3]

    for roughness in (0.0, 0.001):  # of a mirror and of a lobe that sampling the lamp does not find
        lit = shown(roughness)
        assert lit.min() > 1
        np.testing.assert_allclose(shown(roughness, casts_shadow=False), lit, rtol=1e-3)
    alone = shown(0.0, is_met=False)
    assert np.median(alone) < 0.1 * np.median(lit)
    assert alone.mean() < 0.3 * lit.mean()  # all pixels show the lamp; the edges of the lobe remain


def test_a_lamp_that_rays_do_not_meet_lights_matt_surfaces_as_any_other():
    lamp = AreaLight(name="lamp", world_from_light=at(0, 0, 3), size=(2.0, 2.0), power_w=100.0)
    lit = brightness(scene(lights=(lamp,)))
    assert brightness(scene(lights=(replace(lamp, is_met=False),))) == pytest.approx(lit, rel=0.02)


def test_lamps_and_world_hidden_from_a_type_of_ray():
    assert brightness(scene(lights=(replace(LAMP, hidden_from=Rays.DIFFUSE),))) == 0
    sky = World(gray(0.5))
    lit = brightness(scene(lights=(), world=sky))
    assert lit == pytest.approx(0.25, rel=0.02)
    assert brightness(scene(lights=(), world=replace(sky, hidden_from=Rays.DIFFUSE))) == 0
    assert brightness(scene(lights=(), world=replace(sky, hidden_from=Rays.CAMERA))) == pytest.approx(lit, rel=1e-5)


def test_the_camera_sees_another_world_than_the_one_that_lights_the_scene():
    sky = World(gray(0.5), camera_view=World(Color(np.array([1.0, 0.0, 0.0]))))
    up = replace(scene(lights=(), world=sky), camera=Camera(world_from_camera=at(0, 0, -1)))
    np.testing.assert_allclose(render_scene(up).pixels[..., :3].mean((0, 1)), (1, 0, 0), atol=1e-4)
    assert brightness(scene(lights=(), world=sky)) == pytest.approx(0.25, rel=0.02)
    clear = replace(up, film=replace(up.film, transparent=True))
    assert np.abs(render_scene(clear).pixels).max() < 1e-5


def test_a_holdout_makes_a_hole_that_reflections_do_not_show():
    film = Film(8, 8, samples=4, transparent=True)
    pixels = render_scene(scene(film=film, instances=(replace(FLOOR, is_holdout=True),))).pixels
    assert np.abs(pixels).max() == 0
    lid = replace(LID, materials=("glow",))
    lit = brightness(scene(lights=(), instances=(FLOOR, lid)))
    hole = brightness(scene(lights=(), instances=(FLOOR, replace(lid, is_holdout=True))))
    assert hole == pytest.approx(lit, rel=1e-4)


def test_limits_by_type_of_bounce_and_clamping():
    """A white furnace of a floor and a lid loses the light of omitted bounces."""
    closed = scene(lights=(replace(LAMP, world_from_light=at(0, 0, 1.9)),), instances=(FLOOR, LID))
    full = brightness(closed)
    direct = brightness(replace(closed, settings=RenderSettings(light_paths=LightPaths(diffuse=0))))
    assert direct == pytest.approx(brightness(replace(closed, settings=RenderSettings(scene_bounces=0))), rel=1e-3)
    assert direct < 0.95 * full
    clamped = replace(closed, settings=RenderSettings(light_paths=LightPaths(clamp_direct=direct / 2)))
    assert brightness(clamped) < brightness(closed) - 0.4 * direct
    assert brightness(replace(closed, lights=(replace(closed.lights[0], max_bounces=0),))) == pytest.approx(
        direct, rel=1e-3
    )


def test_falloff_and_photometry_agree_with_closed_forms():
    """Irradiance straight below a lamp of P watts at height h: P / (4π h²); Linear multiplies by h, Constant by h²."""
    lit, height = brightness(scene()), 3.0
    for power in (1, 2):
        found = brightness(scene(lights=(replace(LAMP, falloff=Falloff(power)),)))
        assert found / lit == pytest.approx(height**power, rel=0.02)
    smooth = brightness(scene(lights=(replace(LAMP, falloff=Falloff(0, 9.0)),)))
    assert smooth / lit == pytest.approx(0.5, rel=0.02)
    even = Photometry(np.array([0, np.pi]), np.array([0.0]), np.full((1, 2), 0.25))
    assert brightness(scene(lights=(replace(LAMP, photometry=even),))) / lit == pytest.approx(0.25, rel=1e-3)
    upwards = Photometry(np.array([np.pi / 2, np.pi]), np.array([0.0]), np.ones((1, 2)))
    assert brightness(scene(lights=(replace(LAMP, photometry=upwards),))) == 0


def test_a_scaled_spot_is_an_ellipse():
    """With a scale of 2 along x, the tangent of the edge is doubled along x and unchanged along y."""
    spot = SpotLight(
        name="spot", world_from_light=at(0, 0, 3), power_w=100.0, cone_angle_rad=0.4, blend=0.0, cone_scale=(2, 1, 1)
    )
    wide = replace(
        scene(lights=(spot,), film=Film(64, 64, samples=4)),
        camera=Camera(world_from_camera=at(0, 0, 2.5), field_of_view_rad=1.2),
    )
    lit = render_scene(wide).pixels[..., 0] > 0
    across, along = lit[32].sum(), lit[:, 32].sum()
    assert across / along == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("spread", [0.02, 0.3])
@pytest.mark.parametrize("shape", ["rectangle", "ellipse"])
def test_a_narrow_spread_has_no_speckles(spread, shape):
    """Below a large panel, light of a narrow spread is as even as that of a wide one, at the same power."""
    panel = AreaLight(
        name="panel", world_from_light=at(0, 0, 3), power_w=50, size=(2, 2), shape=shape, spread_rad=spread
    )
    pixels = render_scene(scene(lights=(panel,))).pixels[..., 0]
    assert pixels.std() / pixels.mean() < 0.05
    wide = render_scene(scene(lights=(replace(panel, spread_rad=np.pi, size=(40, 40), power_w=50 * 400),))).pixels[
        ..., 0
    ]
    assert pixels.mean() == pytest.approx(wide.mean(), rel=0.06)


def bent(shading):
    """Two squares at a right angle, with or without interpolated normals."""
    corners = np.array([[-1, -1, 1], [1, -1, 1], [1, 0, 2], [-1, 0, 2], [1, 1, 1], [-1, 1, 1]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]], np.uint32)
    normals = np.array([[0, -1, 0.2], [0, -1, 0.2], [0, 0, 1], [0, 0, 1], [0, 1, 0.2], [0, 1, 0.2]], np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh("roof", corners, faces, normals=normals if shading else None)


def test_the_light_of_an_emissive_mesh_does_not_depend_on_its_shading_normals():
    pictures = []
    for shading in (False, True):
        bare = scene(lights=(), film=Film(8, 8, samples=256))
        placed = (FLOOR, Instance("roof", "roof", np.eye(4), ("glow",)))
        made = replace(bare, meshes=(*bare.meshes, bent(shading)), instances=placed)
        pictures.append(render_scene(replace(made, camera=replace(VIEW, world_from_camera=at(0, 0, 0.9)))).pixels)
    assert pictures[1].mean() == pytest.approx(pictures[0].mean(), rel=1e-4)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_numbers_that_are_not_finite_are_refused(bad):
    for make in (
        lambda: replace(LAMP, power_w=bad * 1e38),  # negative power removes light, as in Blender
        lambda: replace(LAMP, radius=bad),
        lambda: SunLight(name="sun", world_from_light=np.eye(4), irradiance=bad * 1e38),
        lambda: AreaLight(name="area", world_from_light=np.eye(4), size=(1.0, bad)),
        lambda: World(strength=bad * 1e38),  # as negative power
        lambda: Falloff(0, bad),
        lambda: LightPaths(clamp_direct=bad),
    ):
        with pytest.raises(InvalidInputError, match="expected a value from"):
            make()


def test_clear_planes_before_a_wide_glowing_ceiling_take_no_light():
    """Far from the middle the rounding errors of positions are large beside the slant of the rays."""
    ceiling = Instance("lid", "wide", at(0, 0, 2), ("glow",))
    panes = [Instance(f"pane {z}", "wide", at(0, 0, z), ("clear",)) for z in (0.75, 1.0, 1.25)]
    view = Camera(world_from_camera=at(0, 0, 0.5), field_of_view_rad=0.3)
    bare = scene(lights=(), film=Film(8, 8, samples=256))
    bare = replace(
        bare,
        camera=view,
        meshes=(*bare.meshes, square("wide", 100)),
        materials=(*bare.materials, Material("clear", Transparent(gray(1.0)))),
        instances=(FLOOR, ceiling),
    )
    behind = replace(bare, instances=(*bare.instances, *panes))
    assert brightness(behind) == pytest.approx(brightness(bare), rel=3e-3)
