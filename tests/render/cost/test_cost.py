# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost of accuracy: estimated and true errors, target errors and times, distribution of samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import InvalidInputError
from spectral_core.render import Bands, cost_curve, render_scene
from spectral_core.render.cost.allocate import Laws, for_error, for_samples
from spectral_core.render.cost.curve import table
from spectral_core.render.cost.errors import (
    Told,
    Wide,
    estimated,
    expected_errors,
    pixel_errors,
    rarity,
    scatter,
    seen_later,
    splits,
    told_by_later,
)
from spectral_core.render.cost.figure import write_figure
from spectral_core.render.cost.model import CostModel
from spectral_core.render.cost.probe import probe_pixels
from spectral_core.render.cost.resample import PooledNoise, pools
from spectral_core.scene import AreaLight, Color, Diffuse, Film, ImageTexture, RenderSettings, World
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from tests.render.scenes import lit_plane, looking_down, matrix

LAMP = AreaLight(name="lamp", world_from_light=matrix((0.4, 0, 1.0)), power_w=15, size=(1.0, 1.0))
SKY = np.full((8, 16, 3), 0.05, np.float32)
SKY[5:7, 3:6] = 3.0


def noisy(**settings):
    """A floor under a near soft lamp and a sky with a bright spot."""
    scene = lit_plane(
        LAMP,
        surface=Diffuse(Color([0.6, 0.5, 0.4])),
        film=Film(48, 32, samples=16, filter_kind="box", filter_width=1.0),
        camera=looking_down(2.0, 0.9),
        world=World(ImageTexture("sky", SKY, "linear")),
    )
    return replace(scene, settings=RenderSettings(transport="rgb", max_bounces=2, **settings))


@cache
def _reference():
    return render_scene(replace(noisy(), film=replace(noisy().film, samples=2048, seed=5))).pixels


def _true_error(pixels):
    lab = [lab_from_linear_rgb(each[..., :3].astype(np.float64)) for each in (pixels, _reference())]
    return float(delta_e_2000(*lab).mean())


def test_a_target_error_is_reached_without_excess_samples():
    result = render_scene(noisy(target_error=0.5))
    assert result.status == "done" and result.outcome.reached
    assert 0.7 * 0.5 < _true_error(result.pixels) < 1.1 * 0.5
    assert result.outcome.delta_e == pytest.approx(_true_error(result.pixels), rel=0.2)
    assert result.prediction.samples == pytest.approx(result.outcome.samples, rel=0.35)
    assert "dE2000" in result.header["spectral.predicted"] and "samples" in result.header["spectral.outcome"]


def test_a_time_budget_reports_its_error_and_supports_bands():
    result = render_scene(noisy(time_budget_s=1.5), bands=Bands.uniform(400, 700, 4))
    assert result.outcome.delta_e > 0 and result.outcome.samples >= 2
    assert result.band_pixels.shape == (32, 48, 4) and result.band_pixels.min() > 0


def test_impossible_requests_are_refused():
    with pytest.raises(InvalidInputError, match="request one of them"):
        render_scene(noisy(target_error=1.0, time_budget_s=5.0))
    with pytest.raises(InvalidInputError, match=r"expected ΔE2000 from 0\.02 to 100"):
        render_scene(noisy(target_error=0.001))
    with pytest.raises(InvalidInputError, match="equal samples everywhere"):
        render_scene(noisy(target_error=1.0), groups=True)


def test_the_curve_predicts_the_error_of_a_plain_render(tmp_path):
    scene = noisy()
    curve = cost_curve(scene)
    assert curve.now.samples == 16
    assert curve.now.delta_e == pytest.approx(_true_error(render_scene(scene).pixels), rel=0.25)
    assert (errors := [point.delta_e for point in curve.axis("samples")]) == sorted(errors, reverse=True)
    assert curve.axis("bounces")[0].setting == "0"
    assert "predicted" in table(curve) and 0 < curve.now.work < 1e4 and curve.model.slowness > 0
    pytest.importorskip("matplotlib")
    for name, begins in (("cost.png", b"\x89PNG"), ("cost.svg", b"<?xml")):
        write_figure(tmp_path / name, curve, title="room")
        assert (tmp_path / name).read_bytes().startswith(begins)
    with pytest.raises(InvalidInputError, match="no axis is named 'colors'"):
        write_figure(tmp_path / "cost.png", curve, "colors")
    with pytest.raises(InvalidInputError, match="ends in '.txt'"):
        write_figure(tmp_path / "cost.txt", curve)


def test_the_cost_of_a_border_is_that_of_its_render():
    """A border that a smaller picture would not hold, under the plan of the render: without a pilot here."""
    scene = replace(noisy(), film=Film(120, 90, samples=8, crop=(90, 70, 24, 16)))
    curve = cost_curve(scene)
    made = render_scene(scene)
    assert curve.probe_pixels == 24 * 16
    assert [(each.name, each.value) for each in curve.plan.decisions] == [
        (each.name, each.value) for each in made.plan.decisions
    ]


POOLS = np.arange(4096) // 8


def test_the_difference_of_two_halves_estimates_the_error_of_their_mean(rng):
    light = np.full((4096, 3), 0.3)
    halves = light + rng.normal(0, 0.02, (2, 4096, 3))
    true = delta_e_2000(lab_from_linear_rgb(halves.mean(axis=0)), lab_from_linear_rgb(light)).mean()
    found = estimated(expected_errors(halves, POOLS), halves, POOLS)
    assert found.delta_e == pytest.approx(true, rel=0.08) and abs(found.delta_e - true) < 8 * found.spread


def _rare(rng, samples, chance=0.03):
    """(2, samples, 4096, 3): light of which few paths carry many times as much as the others; 0.26 in the mean."""
    return 0.2 + 0.06 / chance * (rng.random((2, samples, 4096, 1)) < chance) * np.ones(3)


@pytest.mark.parametrize("samples", [2, 8, 32, 128])
@pytest.mark.parametrize("albedo", [1.0, 0.2])
def test_light_on_rare_paths_counts_where_a_pixel_has_met_none_of_it(rng, samples, albedo):
    """A bright path in a hundred, over a texture: two halves agree in most pixels, which are too dark by a fifth."""
    paint = np.where(np.arange(4096) % 2, 1.0, albedo)[:, None]
    halves = paint * _rare(rng, samples, 0.01).mean(axis=1)
    limit = lab_from_linear_rgb(paint * np.full((4096, 3), 0.26))
    true = delta_e_2000(lab_from_linear_rgb(halves.mean(axis=0)), limit).mean()
    first, second = halves
    if samples <= 32:
        assert pixel_errors(first, second).mean() < 0.75 * true  # the halves alone
    assert 0.75 * true < expected_errors(halves, POOLS).mean() < 1.25 * true


def test_drawn_pictures_have_the_error_of_more_samples(rng):
    drawn = _rare(rng, 128, 0.05)
    limit = lab_from_linear_rgb(np.full((4096, 3), 0.26))
    noise = PooledNoise(drawn[:, :16].mean(axis=1), np.arange(4096) // 64)
    for parts in (2, 8):
        picture = drawn.reshape(-1, 16, 4096, 3)[:parts].mean(axis=(0, 1))
        true = delta_e_2000(lab_from_linear_rgb(picture), limit).mean()
        assert noise.errors(parts).mean() == pytest.approx(true, rel=0.2)


def test_pools_are_small_rectangles_of_the_picture():
    numbers = pools(np.arange(60), 10).reshape(6, 10)
    assert np.array_equal(numbers[:2, :4], np.zeros((2, 4))) and numbers[2, 0] == 3 and numbers[5, 9] == 8


def test_light_that_whole_pools_have_not_met_is_told_by_later_samples(rng):
    drawn, counts = _rare(rng, 64, 0.002), (np.full(4096, 4), np.full(4096, 64))
    early, late = drawn[:, :4].mean(axis=1), drawn.mean(axis=1)
    rare = rarity(early, late, *counts, expected_errors(early, POOLS))
    common = 0.2 + rng.normal(0, 0.05, (2, 64, 4096, 1)) * np.ones(3)
    early, late = common[:, :4].mean(axis=1), common.mean(axis=1)
    assert 1.0 <= rarity(early, late, *counts, expected_errors(early, POOLS)) < 1.08 < rare


def _told(drawn, limit, part=4):
    """Pooled errors and all that is told of a picture, over its true error; ``drawn``: (2, samples, 4096, 3).

    ``part``: its samples over those of the early picture.
    """
    late, early, wide = drawn.mean(axis=1), drawn[:, : len(drawn[0]) // part].mean(axis=1), Wide(np.arange(4096) // 32)
    told = [Told(pixel_errors(*each).mean(), expected_errors(each, POOLS, wide).mean()) for each in (late, early)]
    counts = np.ones(4096) * len(drawn[0])
    _, seen = seen_later(early, late, counts / part, counts)
    lab = [lab_from_linear_rgb(np.maximum(each, 0)) for each in (late.mean(axis=0), np.full((4096, 3), limit))]
    true = delta_e_2000(*lab).mean()
    return told[0].pooled / true, told_by_later(*told, seen, 1 / part) / true


def test_neighbors_of_different_noise_do_not_exaggerate_the_error(rng):
    """Alternating columns of little and of much noise, dark and gray: neighbors lend theirs to the quiet ones."""
    for light in (0.05, 0.3):
        deviations = np.where(np.arange(4096) % 2, 4 * light, 0.08 * light)
        noise = deviations[:, None] * rng.normal(size=(2, 64, 4096, 1)) * np.ones(3)
        pooled, told = _told(light + noise, light)
        assert pooled > 1.25 and 0.93 < told < 1.2


def test_common_noise_is_told_as_it_is(rng):
    assert _told(0.3 + 0.2 * rng.normal(size=(2, 64, 4096, 1)) * np.ones(3), 0.3)[1] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("chance", [0.02, 0.005, 0.001])
def test_rare_light_is_not_underestimated_by_halves_that_agree(rng, chance):
    drawn = _rare(rng, 64, chance)
    halves = drawn.mean(axis=1)
    true = delta_e_2000(*(lab_from_linear_rgb(each) for each in (halves.mean(axis=0), np.full((4096, 3), 0.26))))
    assert 0.85 < _told(drawn, 0.26)[1] < 1.15
    assert chance > 0.005 or pixel_errors(*halves).mean() < 0.75 * true.mean()


@pytest.mark.parametrize("chance", [0.005, 0.002])
@pytest.mark.parametrize("even", [0.2, 0.8])
def test_rare_light_is_told_beside_noise_that_falls_faster(rng, chance, even):
    """As that of evenly spread numbers, which falls by 1/n: at first it is most of the error, in the end little."""
    common = even * np.diff(rng.normal(size=(2, 65, 4096, 1)), axis=1) * np.ones(3)
    assert 0.78 < _told(_rare(rng, 64, chance) + common, 0.26, 16)[1] < 1.1


def test_splits_of_a_picture_in_parts_are_halves_of_all_its_samples(rng):
    sums, counts = rng.normal(size=(4, 2, 50, 3)), np.full(50, 16)
    every = splits(sums, counts)
    assert len(every) == 7
    for halves in every:
        assert halves.mean(axis=0) == pytest.approx(sums.sum(axis=(0, 1)) / 32)
    assert every[0] == pytest.approx(sums.sum(axis=0) / 16)
    away = np.array([(first - second).ravel() for first, second in every])
    assert away @ away.T / len(away[0]) == pytest.approx(np.eye(7) * 8 / 16**2, abs=0.02)


def test_the_error_of_a_small_picture_scatters(rng):
    pictures = np.abs(rng.normal(size=(500, 100)))
    assert scatter(np.ones(100)) == pytest.approx(pictures.mean(axis=1).std() / pictures.mean(), rel=0.1)
    assert scatter(np.ones(100), 4.0) == pytest.approx(scatter(np.ones(400)))


@pytest.mark.parametrize("of_half", [False, True])
def test_rarity_is_the_ratio_of_the_true_error_to_the_estimate(rng, of_half):
    """The error of a picture of few samples against the exact limit, and the estimate from its own pixels alone."""
    drawn = _rare(rng, 64)
    early, late = drawn[:, :4].mean(axis=1), drawn.mean(axis=1)
    limit = lab_from_linear_rgb(np.full((4096, 3), 0.26))
    seen = early[0] if of_half else early.mean(axis=0)
    true = delta_e_2000(lab_from_linear_rgb(seen), limit).mean()
    first, second = early
    errors = pixel_errors(first, second, of_half=of_half)
    assert true > 1.15 * errors.mean()
    found = rarity(early, late, np.full(4096, 4), np.full(4096, 64), errors, of_half=of_half)
    assert found * errors.mean() == pytest.approx(true, rel=0.1)


def test_noise_at_edges_that_looks_like_rare_light_is_told_from_it(rng):
    """One pixel in eight is an edge: later samples see far less error than its noise would make in its neighbors."""
    edge = np.arange(4096)[None, None, :, None] % 8 == 0
    drawn = 0.3 + edge * rng.normal(0, 0.25, (2, 64, 4096, 1)) * np.ones(3)
    early, late = drawn[:, :4].mean(axis=1), drawn.mean(axis=1)
    limit = lab_from_linear_rgb(np.full((4096, 3), 0.3))
    true = delta_e_2000(lab_from_linear_rgb(np.maximum(early.mean(axis=0), 0)), limit).mean()
    pooled = expected_errors(early, POOLS)
    factor = rarity(early, late, np.full(4096, 4), np.full(4096, 64), pooled)
    assert pooled.mean() > 1.5 * true and 0.8 * true < factor * pooled.mean() < 1.5 * true


def test_pixels_with_the_largest_gain_get_more_samples():
    errors, counts, weights = np.array([4.0, 1.0, 0.0]), np.full(3, 16.0), np.ones(3)
    after = for_error(errors, counts, 0.5, weights)
    assert np.sum(errors * np.sqrt(counts / after)) / 3 == pytest.approx(0.5, rel=1e-3)
    assert after[0] / after[1] == pytest.approx(4 ** (2 / 3), rel=1e-3) and after[2] == 16
    same = for_samples(errors, counts, after.sum(), weights)
    assert same == pytest.approx(after, rel=1e-3)


def test_parts_whose_error_falls_late_get_their_samples(rng):
    """Two parts of one error now; one has light on rare paths, and its error stays before it falls."""
    counts = np.array([32.0, 128.0, 512.0, 2048.0])
    laws = Laws(counts, np.array([[2.0, 2.0], [1.0, 2.0], [0.5, 1.6], [0.25, 0.8]]), np.ones(2))
    assert laws.error(np.array([64.0, 64.0])) == pytest.approx([np.sqrt(2), 2.0])
    assert laws.error(np.array([8.0, 8192.0])) == pytest.approx([4.0, 0.4])
    after = laws.for_error(0.8, 8.0)
    assert laws.mean(after) == pytest.approx(0.8, rel=1e-3) and after[1] > 2 * after[0]
    assert laws.for_samples(float(after.mean()), 8.0) == pytest.approx(after, rel=1e-2)


def test_the_error_law_extrapolates_beyond_the_measurements():
    model = CostModel((4, 16, 64), (4.0, 2.0, 1.0), 0.1, 2.0)
    assert model.error(256) == pytest.approx(0.5) and model.error(8) == pytest.approx(np.sqrt(8))
    assert model.for_error(0.5).samples == pytest.approx(256, rel=1e-3)
    assert model.for_time(12.0).samples == pytest.approx(100) and model.for_samples(20).seconds == pytest.approx(4.0)
    rare = CostModel((4, 16, 64), (2.0, 2.0, 2.0), 0.1, 2.0, later=(1.9, 1.2, 0.6))
    assert rare.error(256) == pytest.approx(1.9) and rare.for_error(0.6).samples == pytest.approx(4096, rel=1e-3)


def test_probe_pixels_are_blocks_distributed_over_the_picture():
    film = Film(1920, 1080)
    pixels = probe_pixels(film)
    assert 7800 < len(pixels) <= 8192 and len(np.unique(pixels)) == len(pixels)
    blocks = pixels.reshape(-1, 4, 8)
    assert pixels.max() < 1920 * 1080
    assert np.all(np.diff(blocks, axis=2) == 1) and np.all(np.diff(blocks, axis=1) == 1920)
    column, row = np.histogram(pixels % 1920, 8, (0, 1920))[0], np.histogram(pixels // 1920, 8, (0, 1080))[0]
    assert column.min() > 0.7 * column.mean() and row.min() > 0.7 * row.mean()
    assert np.array_equal(probe_pixels(Film(30, 20)), np.arange(600))
    assert all(len(np.unique(probe_pixels(Film(*size)))) > 4000 for size in ((4000, 3), (5, 9000)))  # narrow pictures
