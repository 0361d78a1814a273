# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: the picture is the mean of its moments, and the samples are divided among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.moving import _plan_of_all, in_order, shares
from spectral_core.render.passes.joined import joined_passes
from spectral_core.render.plan.decision import Decision, EffectPlan, fullest
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import Emission, Film, Glass, Instance, Material, Moment, World, gray
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from tests.render.scenes import lit_plane, looking_down, matrix, plane, sphere_mesh

pytest.importorskip("mitsuba")


def moving(samples=8):
    """An emissive square that jumps from left to right, and a fixed camera."""
    base = lit_plane(camera=looking_down(4.0, 1.0), film=Film(16, 8, samples=samples), world=World(gray(0.0)))
    glow = Instance("glow", "small", matrix((-0.5, 0, 1)), ("lamp",))
    scene = replace(
        base,
        meshes=(*base.meshes, plane(0.3, "small")),
        materials=(*base.materials, Material("lamp", Emission(gray(1.0), 2.0))),
        instances=(glow,),
    )
    right = replace(glow, world_from_object=matrix((0.5, 0, 1)))
    return replace(scene, moments=(Moment(scene.camera), Moment(scene.camera, (right,))))


def test_a_picture_is_the_mean_of_its_moments():
    scene = moving(256)
    result = render_scene(scene)
    stills = [render_scene(scene.at(moment)).pixels for moment in scene.moments]
    assert result.samples == 256 and result.status == "done"
    # an emissive square has noise at its edges only
    assert np.abs(result.pixels - np.mean(stills, axis=0))[..., :3].mean() < 0.03 * result.pixels[..., :3].mean()
    assert np.isclose(result.pixels[4, 5, 0], result.pixels[4, 10, 0], atol=0.1)


def test_progress_counts_all_samples_and_a_stop_keeps_the_picture():
    seen = []
    render_scene(moving(), on_progress=seen.append)
    assert [item.samples for item in seen] == sorted(item.samples for item in seen)
    assert seen[-1].samples == seen[-1].total == 8
    assert [item.seconds for item in seen] == sorted(item.seconds for item in seen), "of all moments, not of the last"
    assert seen[-1].left_s == 0.0 and all(item.left_s > 0.0 for item in seen[:-1])
    assert all(item.memory > 0 for item in seen)
    calls = iter(range(1000))
    stopped = render_scene(moving(), should_stop=lambda: next(calls) > 1)
    assert stopped.status == "cancelled" and 0 < stopped.samples < 8 and stopped.pixels.any()


def test_features_without_motion_get_a_note():
    scene = moving()
    asked = replace(scene, settings=replace(scene.settings, denoise=True))
    assert "Denoising" in {note.subject for note in render_scene(asked).notes}


def test_an_error_is_requested_for_all_moments_together():
    """Moments of unequal noise get unequal samples and still equal parts of the picture."""
    scene = moving()
    dark = replace(scene.instances[0], world_from_object=matrix((0.5, 0, -5.0)))  # below the floor: no light
    scene = replace(scene, moments=(Moment(scene.camera), Moment(scene.camera, (dark,))))
    made = render_scene(replace(scene, settings=replace(scene.settings, target_error=0.5)))
    assert made.outcome.reached and made.outcome.delta_e <= 0.5 and made.sample_counts.shape == (8, 16)
    assert made.prediction.samples > 0 and "spectral.outcome" in made.header
    full = render_scene(replace(scene, film=replace(scene.film, samples=2048)))
    # the few samples that 0.5 asks for miss the mean of 128 pixels by up to 5 % either way
    finer = replace(scene, settings=replace(scene.settings, target_error=0.3))
    means = [render_scene(replace(finer, film=replace(scene.film, seed=k))).pixels[..., :3].mean() for k in (0, 1)]
    assert np.mean(means) == pytest.approx(full.pixels[..., :3].mean(), rel=0.03)


@pytest.mark.parametrize("jumps", [True, False])
def test_the_error_of_moments_of_unequal_light_is_that_of_their_mean(jumps):
    """Where one moment has most of the light, its noise is not averaged out by the others."""
    scene = moving()
    if not jumps:
        dark = replace(scene.instances[0], world_from_object=matrix((0.5, 0, -5.0)))
        scene = replace(scene, moments=(Moment(scene.camera), Moment(scene.camera, (dark,))))
    lab = lambda pixels: lab_from_linear_rgb(np.maximum(pixels[..., :3].astype(float), 0.0))  # noqa: E731
    limit = lab(render_scene(replace(scene, film=replace(scene.film, samples=2048, seed=901))).pixels)
    asked = replace(scene, settings=replace(scene.settings, target_error=0.5))
    made = [render_scene(replace(asked, film=replace(scene.film, seed=seed))) for seed in range(3)]
    true = np.array([delta_e_2000(lab(each.pixels), limit).mean() for each in made])
    assert 0.3 < true.mean() < 0.55 and true.max() < 0.65
    assert 0.65 < np.mean([each.outcome.delta_e for each in made]) / true.mean() < 1.4


def test_passes_of_two_rounds_keep_their_brightness():
    """Weights of rounds add up to 1, whole numbers of samples to more."""
    one, other = ({"Combined": np.full((2, 2, 3), value, np.float32)} for value in (1.0, 3.0))
    assert joined_passes(one, 0.25, other, 0.25)["Combined"] == pytest.approx(2.0)


def test_a_time_is_divided_among_moments():
    scene = moving()
    made = render_scene(replace(scene, settings=replace(scene.settings, time_budget_s=2.0)))
    assert made.outcome.samples >= 4 and made.outcome.seconds == pytest.approx(made.seconds, rel=0.2)
    assert not any("not followed" in note.message for note in made.notes)


@pytest.mark.parametrize(("samples", "moments"), [(64, 16), (65, 16), (7, 8), (1, 3)])
def test_samples_are_divided_among_moments(samples, moments):
    counts = shares(samples, moments)
    assert len(counts) == moments and min(counts) >= 1 and max(counts) - min(counts) <= 1
    assert sum(counts) == max(samples, moments)


@pytest.mark.parametrize("count", [1, 2, 8, 13])
def test_the_first_moments_are_distributed_over_the_whole_time(count):
    moments = tuple(Moment(looking_down(1.0 + k)) for k in range(count))
    order = in_order(moments)
    assert set(order) == set(moments)
    if count >= 8:
        heights = [moment.camera.world_from_camera[2, 3] for moment in order[:2]]
        assert abs(heights[0] - heights[1]) >= count / 2


def test_the_plan_is_that_of_all_moments():
    """A ball of glass that entered the picture later was black, and took 31 % of the light of that moment."""
    still = moving()
    ball = Instance("ball", "ball", matrix((60, 0, 1)), ("glass",))
    entered = replace(ball, world_from_object=matrix((0, 0, 1)))
    scene = replace(
        still,
        meshes=(*still.meshes, sphere_mesh(8, "ball")),
        materials=(*still.materials, Material("glass", Glass())),
        instances=(*still.instances, ball),
        moments=(Moment(still.camera), *[Moment(still.camera, (entered,))] * 2),
    )
    planned = []

    def plan(at_once):
        planned.append(at_once)
        full = plan_from_data(at_once)
        return full if at_once.instances[-1] is entered else full.changed("bounces", "0").changed("transport", "rgb")

    together = _plan_of_all(scene, plan)
    assert [each.instances[-1] is entered for each in planned] == [False, True, True]
    assert together.bounces == 64 and not together.is_spectral and together.accepted == 0.0
    assert render_scene(scene).plan.bounces == 64


def test_the_fullest_plan_has_the_largest_error_of_its_values():
    one, other = (
        EffectPlan((Decision("media", first, "", accepted=error), Decision("bounces", second, "", accepted=error)), 1.0)
        for first, second, error in (("off", "12", 0.2), ("on", "12", 0.1))
    )
    both = fullest([one, other])
    assert [(each.value, each.accepted) for each in both.decisions] == [("on", 0.1), ("12", 0.2)]
    assert both.indirect_error is None and both.clamped_share is None
    assert fullest([one]) == one
