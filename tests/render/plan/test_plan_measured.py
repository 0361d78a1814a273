# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan's pilot: its shares add up to the picture, and its predicted losses are those of a render."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

import itertools

from spectral_core.render import everything_on, plan_effects, plan_from_data, render_scene
from spectral_core.render.job import RenderJob
from spectral_core.render.plan import bounds
from spectral_core.render.plan.decision import error_together
from spectral_core.render.plan.effects import pilot_plan
from spectral_core.render.plan.effects_from_pilot import HIDDEN
from spectral_core.render.plan.levels import Effect, Level, chosen, indirect_error
from spectral_core.render.plan.measured import error_of_loss
from spectral_core.render.plan.pilot import CHANNELS, ROWS, TOTAL, Pilot, run_pilot
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Film,
    Glossy,
    Instance,
    LightPaths,
    Material,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    World,
    gray,
)
from spectral_core.scene.geometry import unit_box
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from tests.render.scenes import lit_plane, matrix, sphere_mesh

LAMP = AreaLight(name="lamp", world_from_light=matrix((0.3, 0.2, 3)), power_w=60, size=(1.0, 1.0))
FREE = RenderSettings()


def corner(surface=None, **changes):
    """A floor and a roof that reflect light to each other."""
    scene = lit_plane(
        LAMP,
        surface=surface or Diffuse(Color([0.7, 0.5, 0.3])),
        film=Film(24, 16, samples=64),
        camera=Camera(world_from_camera=matrix((0, 0, 3.5)), field_of_view_rad=0.9),
        settings=FREE,
        **changes,
    )
    roof = np.diag([1.0, -1, -1, 1])
    roof[2, 3] = 4
    return replace(
        scene, instances=(*scene.instances, replace(scene.instances[0], name="roof", world_from_object=roof))
    )


def test_the_shares_of_the_pilot_add_up_to_the_picture():
    scene = corner(Glossy(gray(0.8), 0.4), world=World(gray(0.1)))
    seen = run_pilot(scene, pilot_plan(scene), samples=64)
    film = replace(scene.film, samples=256)
    job = RenderJob(replace(scene, film=film), everything_on_rgb(scene))
    job.trace(256)
    assert seen.picture.mean() == pytest.approx(job.picture()[..., :3].mean(), rel=0.05)
    # light after the first surface is equal for all bounces and for those of one type
    by_level = seen.bins[..., :34, :3].sum()
    assert by_level == pytest.approx(seen.bins[..., 68:102, :3].sum(), rel=1e-4)
    assert seen.beyond("diffuse", 0)[..., :3].sum() == 0 and seen.beyond("glossy", 0)[..., :3].sum() > 0


def test_the_plan_notes_the_light_that_clamping_removes():
    """The share equals that of a render without the clamp; a clamp that changes nothing has no note."""
    scene = corner(Glossy(gray(0.8), 0.4), world=World(gray(0.1)))
    limits = LightPaths(clamp_indirect=0.02)
    clamped = replace(scene, settings=replace(scene.settings, light_paths=limits))
    plan = plan_effects(clamped)
    means = []
    for each in (scene, clamped):
        job = RenderJob(replace(each, film=replace(scene.film, samples=256)), everything_on_rgb(each))
        job.trace(256)
        means.append(float(job.picture()[..., :3].mean()))
    assert plan.clamped_share == pytest.approx(1 - means[1] / means[0], rel=0.1)
    assert f"clamping removes about {100 * plan.clamped_share:.0f} % of the light" in plan.notes[0].message
    high = replace(scene, settings=replace(scene.settings, light_paths=LightPaths(clamp_indirect=1e6)))
    unclamped = plan_effects(high)
    assert unclamped.clamped_share == 0 and not unclamped.notes


def everything_on_rgb(scene):
    return pilot_plan(scene)


def test_the_measured_error_of_fewer_bounces_equals_that_of_a_render():
    """Compared with renders with and without the bounces: mean ΔE2000 within a third, for one and three bounces."""
    scene = corner()
    plan = plan_effects(scene, 0.0)
    assert plan.pilot_paths > 16_000 and plan["bounces"].how == "measured"
    seen, full = run_pilot(scene, pilot_plan(scene)), _picture(scene, 32)
    for count in (1, 3):
        said = error_of_loss(seen, seen.beyond("bounces", count))
        true = delta_e_2000(lab_from_linear_rgb(full), lab_from_linear_rgb(_picture(scene, count))).mean()
        assert 0.9 * true < said < 1.5 * true + 0.2


def test_the_background_does_not_dilute_the_error_of_a_small_object():
    """An object on 4 % of the pixels loses a fifth of its light: the stated error is that of its pixels."""
    height, width, batches = 24, 24, 8
    bins = np.zeros((height, width, batches, ROWS, CHANNELS))
    bins[..., TOTAL, :3] = 0.2  # light of the sky
    bins[10:15, 10:15, :, TOTAL, :] = [0.3, 0.3, 0.3, 1.0]
    lost = np.zeros((height, width, batches, 3))
    lost[10:15, 10:15] = 0.06
    pair = [lab_from_linear_rgb(np.full(3, level)) for level in (0.3, 0.24)]
    said = error_of_loss(Pilot(bins, 192, np.zeros((0, 3))), lost)
    assert said == pytest.approx(delta_e_2000(*pair), rel=0.01)


def _picture(scene, bounces):
    scene = replace(scene, film=replace(scene.film, samples=512), settings=RenderSettings(max_bounces=bounces))
    return render_scene(scene).pixels[..., :3].astype(np.float64)


def test_a_larger_tolerance_never_omits_less():
    scene = corner(world=World(gray(0.02)))
    kept = [plan_effects(scene, tolerance) for tolerance in (0.0, 0.1, 1.0, 10.0)]
    for before, after in itertools.pairwise(kept):
        assert after.accepted <= after.tolerance_delta_e + 1e-9
        for name in ("bounces", "diffuse_bounces"):
            assert int(after[name].value) <= int(before[name].value)
        assert not (after.is_on("environment") and not before.is_on("environment"))
    assert int(kept[0]["bounces"].value) > int(kept[-1]["bounces"].value)


def test_steps_are_omitted_by_magnitude_then_by_error_per_time():
    slow = Effect("slow", (Level("on"), Level("off", 0.5, 0.5)), "")
    quick = Effect("quick", (Level("on"), Level("off", 0.4, 0.01)), "")
    nothing = Effect("nothing", (Level("on"), Level("off", 0.05, 0.001)), "")
    left = lambda tolerance: [k for k, v in chosen([quick, slow, nothing], tolerance).items() if v]  # noqa: E731
    assert left(0.01) == [] and left(0.1) == ["nothing"]
    assert left(0.6) == ["slow", "nothing"] and left(1.0) == ["quick", "slow", "nothing"]


def test_weak_fog_lens_and_world_are_omitted_and_strong_ones_are_kept():
    scene = lit_plane(PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100), settings=FREE)
    for density, value in ((1e-7, "off"), (0.3, "on")):
        fog = Material("fog", None, ScatteringMedium(density))
        ball = replace(scene.instances[0], name="cloud", mesh="sphere", materials=("fog",))
        foggy = replace(
            scene, meshes=(*scene.meshes, sphere_mesh(12)), materials=(*scene.materials, fog),
            instances=(*scene.instances, ball),
        )  # fmt: skip
        assert plan_from_data(foggy)["media"].value == value
    for radius, value in ((1e-7, "off"), (0.2, "on")):
        lens = replace(scene.camera, aperture_radius=radius, focus_distance=1.0)
        assert plan_from_data(replace(scene, camera=lens))["depth_of_field"].value == value
    for level, value in ((1e-5, "none"), (0.3, "constant")):
        assert plan_effects(replace(scene, world=World(gray(level))))["environment"].value == value


def test_a_loss_of_light_is_bounded_by_the_most_sensitive_gray():
    assert bounds.error_of_share(0.025) == pytest.approx(1.0, abs=0.5)
    assert bounds.error_of_light(0.0) == 0.0 and bounds.error_of_light(0.01) > 5


def test_a_plan_with_all_effects_gives_the_same_picture():
    scene = corner(Diffuse(gray(0.5)))
    plan = everything_on(scene)
    assert plan.is_spectral and plan.is_on("media") and plan.bounces == 64
    job = RenderJob(scene, plan)
    job.trace(64)
    assert job.picture()[..., 1].mean() == pytest.approx(_picture(scene, 32)[..., 1].mean(), rel=0.02)


def test_all_effects_keep_the_colors_of_a_scene_without_spectra():
    """A blue lamp over green paint: spectra that stand for the two colors have another product than the colors."""
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100, color=Color([0.2, 0.3, 1.0]))
    scene = lit_plane(lamp, surface=Diffuse(Color([0.2, 0.5, 0.1])), settings=FREE)
    plan = everything_on(scene)
    assert not plan.is_spectral and plan.is_on("media") and plan.bounces == 64
    pictures = []
    for each in (plan, plan_effects(scene, 1.0), plan.changed("transport", "spectral")):
        job = RenderJob(scene, each)
        job.trace(64)
        pictures.append(lab_from_linear_rgb(job.picture()[..., :3].astype(float)))
    full, planned, spectral = pictures
    assert delta_e_2000(full, planned).mean() < 0.1 < 1.0 < delta_e_2000(spectral, planned).mean()


def test_colors_that_meet_no_others_need_no_spectra():
    """A lamp of measured daylight over one red sheet; a second sheet, above it, reflects its light once more."""
    daylight = replace(LAMP, color=catalogue.illuminant("D65"))
    red = corner(Diffuse(Color([0.7, 0.2, 0.1])))
    red = replace(red, lights=(daylight,))
    alone = replace(red, instances=red.instances[:1])
    assert not plan_effects(alone, 1.0).is_spectral and plan_effects(red, 1.0).is_spectral
    assert plan_from_data(alone, 1.0).is_spectral  # nothing tells that no light is reflected twice


def test_light_after_a_bounce_is_lost_once_whatever_rows_name_it():
    """Three rows of one light: the sum of their errors is no more than that of all indirect light."""
    rows = [
        Effect("bounces", (Level("64"), Level("0", 0.9, 0.1)), "", how="measured"),
        Effect("diffuse_bounces", (Level("64"), Level("0", 0.9, 0.1)), "", how="measured"),
        Effect("reflective_caustics", (Level("on"), Level("off", 0.9, 0.1)), "", how="measured"),
        Effect("media", (Level("on"), Level("off", 0.05, 0.1)), "", how="bounded"),
    ]
    left = lambda tolerance: {k for k, v in chosen(rows, tolerance).items() if v}  # noqa: E731
    assert left(0.94) == {"media"} and left(0.96) == {effect.name for effect in rows}
    assert error_together({"bounces": 0.9, "media": 0.05}, None) == pytest.approx(0.95)
    cut = Effect("bounces", (Level("64"), Level("1", 0.9, 0.1)), "", how="measured")
    assert indirect_error(rows) == 0.9 and indirect_error([cut]) is None


def test_a_medium_that_absorbs_alone_calls_for_no_bounces():
    """The pilot traces it; one that scatters keeps its bounces without a pilot."""
    base = lit_plane(LAMP, film=Film(24, 16, samples=64), settings=FREE)
    ball = replace(
        base.instances[0], name="ball", mesh="sphere", materials=("smoke",), world_from_object=matrix((0, 0, 1))
    )

    def plan(albedo):
        smoke = Material("smoke", None, ScatteringMedium(0.5, gray(albedo)))
        scene = replace(base, meshes=(*base.meshes, sphere_mesh()), materials=(*base.materials, smoke))
        return plan_effects(replace(scene, instances=(*base.instances, ball)), 1.0)

    black, white = plan(0.0), plan(0.9)
    assert black.is_on("media") and black.bounces == 0 and black.pilot_paths > 0
    assert white.is_on("media") and white.bounces == 64 and white.pilot_paths == 0
    assert "absorbed" in black["media"].reason and "scatters" in white["media"].reason


def test_a_volume_among_media_that_are_too_thin_keeps_its_shading():
    from benchmarks.render.cases.plan_scenes import SINGLE, staged

    still = staged(SINGLE["cloud"], (8, 6), 1.0)[0]
    still = replace(still, film=replace(still.film, samples=4))

    def seen(media):
        chosen = replace(still.settings, overrides=(("media", media),))
        return render_scene(replace(still, settings=chosen))

    alone, among = seen("off"), seen("on")
    assert not alone.notes and any("too thin" in note.message for note in among.notes)
    np.testing.assert_array_equal(among.pixels, alone.pixels)


def test_a_volume_in_fog_is_a_medium_too():
    """Even light, so that the volume shines and absorbs alone: its light through fog that absorbs."""
    from benchmarks.render.cases.plan_scenes import SINGLE, staged

    still = staged(SINGLE["cloud"], (24, 18), 1.0)[0]
    cloud = replace(still.volumes[0], lighting="even")
    still = replace(still, film=replace(still.film, samples=256), volumes=(cloud,), lights=())
    still = replace(still, instances=(), materials=(), meshes=(), world=World(gray(0.0)))
    fog = ScatteringMedium(1.0, gray(0.0))
    box = replace(unit_box(), name="box")
    place = np.diag([2.0, 2.0, 1.0, 1.0])
    eye = still.camera.world_from_camera[:3, 3]
    place[:3, 3] = eye - (1.0, 1.0, 0.5)
    foggy = replace(
        still,
        meshes=(box,),
        materials=(Material("fog", None, fog),),
        instances=(Instance("fog", "box", place, ("fog",)),),
    )
    alone, among = render_scene(still), render_scene(foggy)
    # along the view the fog ends where the box does
    way = -still.camera.world_from_camera[:3, 2]
    length = np.min(np.array([1.0, 1.0, 0.5]) / np.maximum(np.abs(way), 1e-9))
    assert any("rendered as media" in note.message for note in among.notes)
    seen = [made.pixels[6:12, 8:16, :3].mean(axis=(0, 1)) for made in (alone, among)]
    np.testing.assert_allclose(seen[1], seen[0] * np.exp(-length), rtol=0.08)  # rays at an angle go further


def test_visible_bounces_stay_unless_they_cost_time():
    """A limit that omits visible light and saves little is stated, and chosen at no tolerance."""
    few = Level("2", 0.005, 0.01), Level("1", 0.5, 0.04, pays=False), Level("0", 2.0, 0.2)
    effect = Effect("bounces", (Level("64"), *few), "")
    assert chosen([effect], 100.0) == {"bounces": 1} and effect.known == 2.0
    paying = Effect("bounces", (Level("64"), few[0], few[2]), "")
    assert [chosen([paying], tolerance)["bounces"] for tolerance in (0.0, 1.0, 2.0)] == [0, 1, 2]


def test_the_plan_keeps_the_light_of_rare_bounces():
    """Two gray sheets: few paths are left after some bounces. Their light stays, although it is below the tolerance."""
    row = plan_effects(corner(Diffuse(gray(0.7))), 0.05)["bounces"]
    assert row.how == "measured" and row.accepted <= HIDDEN and 8 <= int(row.value) < 64
