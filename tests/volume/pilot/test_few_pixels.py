# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of a few pixels, which a sample of rays misses: they are found, shown, and count in the stated error."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from benchmarks.volume.checks.exact import exact_amounts
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.places import missed_by_sample, most_apart, pilot_places, places_with, rectangle
from spectral_core.volume.pilot.rays import PILOT_RAYS, Pilot
from spectral_core.volume.pilot.rounding import other_roundings
from spectral_core.volume.pilot.trials import Trial
from spectral_core.volume.plan import _odd_pixels, plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

COLOR = np.array([0.9, 0.5, 0.2])


def measured_db(volume: ScalarVolume, transfer: TransferFunction, view: View, amounts: np.ndarray) -> float:
    """SNR of a picture against the exact marcher of the benchmarks, which shares nothing with the product."""
    return against(exact_amounts(volume, transfer, view, 64) @ transfer.colors, transfer, amounts)


def against(exact: np.ndarray, transfer: TransferFunction, amounts: np.ndarray) -> float:
    """SNR of a picture against its exact colors."""
    error = amounts.astype(np.float64) @ transfer.colors - exact
    return 10.0 * math.log10(np.sum(exact**2) / max(np.sum(error**2), 1e-300))


def each_alone(volume: ScalarVolume, stars: tuple[tuple[int, int, int], ...]) -> list[ScalarVolume]:
    """The voxels around each star as a field of its own: all else is 0, and shows nothing."""
    fields = []
    for place in stars:
        first = np.array(place) - 1
        moved = volume.world_from_index.copy()
        moved[:3, 3] = moved[:3, :3] @ first + moved[:3, 3]
        part = volume.data[tuple(slice(each, each + 3) for each in first)]
        fields.append(ScalarVolume("star", np.ascontiguousarray(part), moved))
    return fields


@pytest.mark.parametrize(("azimuth", "is_flat"), [(12.0, True), (200.0, True), (200.0, False)])
def test_two_stars_in_an_empty_field_are_shown(azimuth, is_flat):
    """No pilot ray met them: the picture was black at uniform steps of 4 voxels, and "no error expected" was stated."""
    data = np.zeros((40, 40, 40), np.float32)
    stars = (4, 5, 6), (34, 33, 35)
    data[stars[0]] = data[stars[1]] = 1.0
    volume = ScalarVolume("stars", data)
    star = Material("star", [0.8, 1.0], [0.0, 20.0], COLOR)
    transfer = TransferFunction((star,))
    # weights of 1 make it two-dimensional, so that it has no pre-integrated steps, and leave its picture as it is
    shown = transfer if is_flat else TransferFunction((replace(star, gradient_values=[0, 1], gradient_weights=[1, 1]),))
    view = View.around(volume, azimuth, 20.0, width=384, height=384)
    renderer = VolumeRenderer(volume)
    made = plan(renderer, view, shown, 50.0)
    # to march the exact picture of all 40 voxels took most of the time of this file
    first, second = (exact_amounts(each, transfer, view, 64) for each in each_alone(volume, stars))
    assert first.any() and second.any() and not np.any((first > 0) & (second > 0))
    amounts = renderer.render(view, shown, made.stepping).amounts
    measured = against((first + second) @ transfer.colors, transfer, amounts)
    assert math.isfinite(made.estimate_db) and abs(made.estimate_db - measured) < 3.0
    assert measured > 47.0 or made.shortfall


def test_grazed_edges_of_opaque_boxes_count_beside_a_small_error_of_all_rays():
    """The error of the sample was small and certain: 55 dB were stated for a picture of 25 dB."""
    rng = np.random.default_rng(100026)
    data = np.zeros((8, 8, 13), np.uint8)
    data[1:4, 2:7, 3:6] = data[4:7, 0:4, 7:12] = 200
    volume = ScalarVolume("boxes", data)
    cut = 200 * 0.9822
    boxes = Material("boxes", [cut, cut, 250], [0, 180, 180], COLOR)
    haze = Material("haze", [-1, 0, 100, cut], [0.05, 0.05, 0, 0], COLOR[::-1])
    transfer, renderer = TransferFunction((boxes, haze)), VolumeRenderer(volume)
    for _ in range(3):
        view = View.around(volume, rng.uniform(0, 360), rng.uniform(-60, 60), width=240, height=240, fov_deg=62.0)
        made = plan(renderer, view, transfer, 40.0)
        measured = measured_db(volume, transfer, view, renderer.render(view, transfer, made.stepping).amounts)
        assert made.estimate_db < measured + 3.0


@pytest.mark.parametrize("seed", [0, 3, 4])
def test_a_thin_film_in_mist_is_no_brighter_in_the_one_pixel_that_hits_it(seed):
    """One midpoint of ten thousand lay in the film, and counted as a whole step: 40 dB were stated for 6 to 35."""
    rng = np.random.default_rng(seed)
    data = gaussian_filter(rng.normal(size=(12, 16, 14)), 1.7)
    volume = ScalarVolume("mist", ((data - data.min()) / np.ptp(data)).astype(np.float32))
    glow = Material("glow", [0.5, 0.75, 1.0], [0, 0, 0], [0.1, 0.1, 0.3], [0, 0.01, 0])
    film = Material("film", [0.52 - 2e-6, 0.52, 0.52 + 2e-6], [0, 0.4, 0], COLOR)
    transfer, renderer = TransferFunction((glow, film)), VolumeRenderer(volume)
    view = View.around(volume, float(rng.uniform(0, 360)), 20.0, width=128, height=128)
    made = plan(renderer, view, transfer, 40.0)
    measured = measured_db(volume, transfer, view, renderer.render(view, transfer, made.stepping).amounts)
    assert abs(made.estimate_db - measured) < 3.0 and made.is_reached


def test_marches_of_the_sample_are_not_repeated_for_the_pixels_that_join_it():
    volume = ScalarVolume("noise", np.random.default_rng(3).random((8, 8, 8)).astype(np.float32))
    transfer = TransferFunction((Material("m", [0.5, 0.5], [0.0, 3.0], COLOR),))
    view = View.around(volume, width=100, height=100)
    renderer, marched = VolumeRenderer(volume), []

    class Counting:
        def __getattr__(self, name):
            return getattr(renderer, name)

        def trace(self, view, transfer, stepping, pixels, limits):
            marched.append(len(pixels[0]))
            return renderer.trace(view, transfer, stepping, pixels, limits)

    pilot = Pilot(Counting(), view, transfer, 40.0, count=400)
    way = Stepping("error", "midpoint", 0.5)
    pilot.try_out(way)
    marched.clear()
    pixels = np.array([[50, 50], [3, 90], [50, 50], [51, 50]])
    joined = pilot.joined(pixels)
    known = joined.try_out(way)
    assert set(marched) <= {3, 400} and marched.count(400) < marched.count(3)
    again = Pilot(renderer, view, transfer, 40.0, 400, pixels)
    assert known == again.try_out(way) and joined.reference_db == again.reference_db
    # more single pixels, of which one is known
    marched.clear()
    further = joined.joined(np.array([[3, 90], [7, 7]]))
    assert further.places.single.tolist() == [[50, 50], [3, 90], [51, 50], [7, 7]] and 1 in marched
    assert further.try_out(way) == Pilot(renderer, view, transfer, 40.0, 400, further.places.single).try_out(way)


@pytest.mark.parametrize(("width", "is_narrow"), [(0.06, False), (0.02, True)])
def test_a_peak_is_narrow_where_the_value_passes_it_within_a_32nd_of_a_voxel(width, is_narrow):
    """The field rises by 1 per voxel; beyond what the function shows it rises faster, which does not count."""
    line = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 60.0, 600.0])
    volume = ScalarVolume("ramp", np.broadcast_to(line[:, None, None], (9, 4, 4)).copy())
    film = Material("film", [1.0, 1.0 + width, 1.0 + 2 * width], [0.0, 0.3, 0.0], COLOR)
    cut = Material("cut", [0.5, 0.5, 3.0, 3.0], [0.0, 0.3, 0.3, 0.0], COLOR)
    view = View.around(volume, width=20, height=20)
    for materials, expected in (((film,), is_narrow), ((cut,), False), ((cut, film), is_narrow)):
        pilot = Pilot(VolumeRenderer(volume), view, TransferFunction(materials), 30.0)
        assert pilot.is_narrow == expected


def looking(width: int, height: int) -> tuple[View, np.ndarray]:
    volume = ScalarVolume("v", np.zeros((8, 8, 8), np.uint8))
    view = View.looking((30, 3.5, 3.5), (3.5, 3.5, 3.5), width=width, height=height, fov_deg=None, ortho_width=8.0)
    return view, volume.corners_world


def test_single_pixels_and_the_sample_of_the_others_add_up_to_the_picture():
    view, corners = looking(200, 200)
    single = np.array([[100, 100], [0, 7], [100, 100], [199, 3]])
    places = places_with(view, corners, 500, single)
    assert not places.is_whole and places.sampled == 500 and len(places.x) == 503
    inside = np.isin(np.floor(places.x) * 1000 + np.floor(places.y), [100100, 7, 199003])
    assert np.all(places.weights[:500][inside[:500]] == 0) and np.all(places.weights[:500][~inside[:500]] == 1)
    # a sampled ray stands for its share of the 39,997 other pixels, a single one for itself
    shares = places.weights / places.weights[-1]
    assert shares.sum() == pytest.approx(200 * 200)
    assert sorted(zip(places.x[500:], places.y[500:], strict=True)) == [(0.5, 7.5), (100.5, 100.5), (199.5, 3.5)]
    x, y, _ = pilot_places(view, corners, 500)
    assert np.array_equal(places_with(view, corners, 500).x, x) and np.array_equal(places.y[:500], y)


@pytest.mark.parametrize("size", [(64, 48), (1500, 1400)])
def test_the_pixels_that_differ_most_are_found_in_all_bands(size):
    view, corners = looking(*size)
    first, last = rectangle(view, corners)[2:]
    rng = np.random.default_rng(5)
    places = rng.integers(first, last, (40, 2))
    wanted = {(int(c), int(r)): 1.0 + n for n, (c, r) in enumerate(places)}
    seen = []

    def compared(x, y):
        seen.append(len(x))
        apart = np.zeros(len(x))
        for (c, r), value in wanted.items():
            apart[(x == c + 0.5) & (y == r + 0.5)] = value
        return apart, np.full(len(x), 1e-3)

    pixels, apart, energy = most_apart(view, corners, compared, 10)
    assert energy == pytest.approx(1e-3 * np.prod(last - first)) and list(apart) == sorted(wanted.values())[:-11:-1]
    found = [tuple(each) for each in pixels]
    assert found == sorted(wanted, key=lambda each: -wanted[each])[:10]
    assert sum(seen) == np.prod(last - first) and (len(seen) > 1) == (size[0] > 1000)


def test_every_pixel_is_looked_at_only_where_a_sample_says_little():
    """A faint field with a measured error needs no second look; an unmeasured or uncertain error, or opacity, does."""
    volume = ScalarVolume.from_spacing("slab", np.ones((6, 6, 6), np.float32), (1.0, 1.0, 2.0))
    view = View.around(volume, width=200, height=200)
    asked = []

    class Watched(Pilot):
        def odd_pixels(self, trial, *, always=False):
            asked.append(trial)
            return np.zeros((0, 2), np.int64)

    def is_asked(extinction: float, trial: Trial, view: View = view) -> bool:
        transfer = TransferFunction((Material("m", [0.0, 2.0], [extinction, extinction], COLOR),))
        asked.clear()
        _odd_pixels(Watched(VolumeRenderer(volume), view, transfer, 40.0, count=1000), trial)
        return bool(asked)

    known = Trial(Stepping(), 45.0, 1.0, 1.0)
    assert not is_asked(0.24, known) and is_asked(0.26, known)  # voxels of 2 along z
    assert is_asked(0.1, replace(known, snr_db=math.inf)) and is_asked(0.1, replace(known, is_bound=True))
    assert is_asked(0.1, replace(known, spread=0.2)) and PILOT_RAYS == 4096
    # so many pixels are looked at only if nothing is known of their error
    large = View.around(volume, width=3000, height=3000)
    assert not is_asked(9.0, known, large) and is_asked(9.0, replace(known, is_bound=True), large)


def test_rounding_counts_by_the_root_of_the_way_at_an_edge():
    """At 8 roundings aside an edge is passed 8 times as often, so that the energy is 9 dB greater, not 18."""
    volume = ScalarVolume("v", np.zeros((4, 4, 4), np.uint8))
    view = View.around(volume, width=8, height=8)
    x = np.full(5, 2.5)

    def smaller_db(*materials: Material) -> float:
        return other_roundings(VolumeRenderer(volume), view, TransferFunction(materials), x, x)[0][1]

    ramp = Material("ramp", [0.0, 1.0], [0.0, 3.0], COLOR)
    level = Material("level", [0.5, 0.5], [2.0, 2.0], COLOR)
    wall = Material("wall", [0.5, 0.5], [0.0, 2.0], COLOR)
    glow = Material("glow", [0.5, 0.5], [0.0, 0.0], COLOR, [0.0, 2.0])
    assert smaller_db(ramp, level) == pytest.approx(18.06, abs=0.01)
    assert smaller_db(ramp, wall) == smaller_db(glow) == pytest.approx(9.03, abs=0.01)


def test_a_sample_with_its_share_of_the_odd_pixels_misses_nothing():
    view, corners = looking(200, 200)
    places = places_with(view, corners, 400, np.array([[3, 3]]))  # each ray stands for 100 pixels
    sample = np.floor(np.stack([places.x, places.y], axis=-1)[:400]).astype(np.int64)
    taken = {tuple(each) for each in sample.tolist()}
    free = np.array([(c, 100) for c in range(200) if (c, 100) not in taken][:99])
    pixels = np.concatenate([free, sample[:1]])
    assert missed_by_sample(places, view, pixels, np.ones(100)) == pytest.approx((100.0, 0.0))
    assert missed_by_sample(places, view, free, np.ones(99)) == pytest.approx((99.0, 99.0))
    # a single pixel is known, however wrong it is
    known = np.concatenate([free, [[3, 3]]])
    assert missed_by_sample(places, view, known, np.append(np.ones(99), 1e9)) == pytest.approx((99.0, 99.0))


def test_a_picture_of_few_bright_pixels_is_uncertain():
    """Half of the rays are as bright as each other: 1/√(n/2). One ray alone: its energy is not known at all."""
    volume = ScalarVolume("slab", np.ones((8, 8, 8), np.float32))
    fog = TransferFunction((Material("fog", [0.0, 2.0], [0.1, 0.1], COLOR),))
    view = View.around(volume, width=100, height=100)
    pilot = Pilot(VolumeRenderer(volume), view, fog, 40.0, count=400)
    pilot.reference = np.repeat([[0.2, 0.2, 0.2], [0.0, 0.0, 0.0]], 200, axis=0)
    assert pilot.signal_spread == pytest.approx(1 / math.sqrt(200))
    pilot.reference = np.zeros((400, 3))
    assert pilot.signal_spread == 0.0
    pilot.reference[7] = 0.3
    assert pilot.signal_spread == pytest.approx(1.0)
