# SPDX-License-Identifier: GPL-3.0-or-later
"""Empty-space skipping: certain distances, and the error of speculative steps."""

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.brick_word import BrickWord
from spectral_core.volume.march.bricks import brick_statistics, voxel_statistics
from spectral_core.volume.march.march_input import REFERENCE, Limits
from spectral_core.volume.march.ranges import RangeTables
from spectral_core.volume.march.rules import step_grid
from spectral_core.volume.march.tables import tabulate
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.presets import preset
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

FUNCTIONS = {
    "two peaks": [([0.2, 0.21, 0.22], [0, 1, 0]), ([0.7, 0.75, 0.8], [0, 2, 0])],
    "reaches the low end": [([0.0, 0.1], [1, 0])],
    "reaches the high end": [([0.9, 1.0], [0, 1])],
    "everywhere": [([0.0, 1.0], [1, 1])],
    "nowhere": [([0.0, 1.0], [0, 0])],
    "jumps": [([0.5, 0.5, 0.6, 0.6], [0, 1, 1, 0])],
}


def function(pieces):
    return TransferFunction(
        tuple(Material(f"m{i}", values, heights, [1, 1, 1]) for i, (values, heights) in enumerate(pieces))
    )


@pytest.mark.parametrize("name", list(FUNCTIONS))
def test_clearance_is_at_most_the_distance_to_a_visible_value(name, rng):
    volume = ScalarVolume("v", rng.random((9, 9, 9)))
    table = tabulate(function(FUNCTIONS[name]), volume)
    at = np.concatenate([rng.uniform(-0.3, 1.3, 400), table.knots])
    segment = np.searchsorted(table.knots, at, side="right")
    stated = np.where(table.is_empty[segment], np.abs(at - table.anchors[segment]), 0.0)
    # By exhaustive search: the nearest of very many visible values within the range 0 to 1 of the field.
    low, high = volume.value_range
    many = np.unique(np.concatenate([np.linspace(low, high, 200_001), table.knots, np.nextafter(table.knots, -9)]))
    shown = many[function(FUNCTIONS[name]).curves(many)[1].any(axis=-1)]
    if not len(shown):
        assert np.isinf(stated).all()
        return
    inside = (at >= low) & (at <= high)
    true = np.abs(at[inside, None] - shown[None, :]).min(axis=1)
    assert np.allclose(stated[inside], true, atol=1e-5)


def test_words_store_the_distance_of_a_ray_per_stored_unit_rounded_down(rng):
    volume = ScalarVolume("v", rng.normal(0, 20, (17, 17, 17)))
    statistics = brick_statistics(volume, 4)
    ranges = RangeTables(tabulate(function([([-5, 0, 5], [0, 1, 0])]), volume), 1.0)
    words = step_grid("error", statistics, ranges, unit=8.0).words
    shows = BrickWord.shown(words)
    exact = 8.0 / statistics.slope
    stated = BrickWord.paces_of(words)
    assert shows.any() and (stated[shows] <= exact[shows]).all() and (stated[shows] >= 0.99 * exact[shows]).all()


@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_slopes_are_right_for_data_whose_squares_overflow(scale, rng):
    data = rng.random((9, 9, 9))
    for statistics in (
        lambda d: brick_statistics(ScalarVolume("v", d), 2),
        lambda d: voxel_statistics(ScalarVolume("v", d), 2),
    ):
        assert np.allclose(statistics(data * scale).slope / scale, statistics(data).slope, rtol=1e-5)


@pytest.mark.parametrize("name", ["marschner-lobb", "noise", "shells", "gaussians"])
def test_the_careful_march_has_no_error_and_the_speculative_one_a_small_one(name):
    pytest.importorskip("drjit")
    from spectral_core.volume.image import Stepping
    from spectral_core.volume.renderer import VolumeRenderer

    volume = sample_volume(name, 40)
    transfer = preset("narrow", volume)
    view = View.around(volume, 33.0, 21.0, width=96, height=96)
    renderer = VolumeRenderer(volume)

    def picture(stepping, limits):
        image = renderer.render(view, transfer, stepping, counts=True, limits=limits)
        return image.picture().astype(float), image.steps

    truth, _ = picture(Stepping("uniform", "preintegrated", 0.004), REFERENCE)
    way = Stepping("error", "preintegrated", 0.02)
    careful, slow = picture(way, REFERENCE)
    speculative, quick = picture(way, Limits())
    assert snr_db(truth, careful - truth) > 55.0 and snr_db(truth, speculative - truth) > 55.0
    assert quick < 0.95 * slow


def test_a_field_outside_the_function_is_skipped_in_a_few_iterations():
    pytest.importorskip("drjit")
    from spectral_core.volume.image import Stepping
    from spectral_core.volume.renderer import VolumeRenderer

    line = np.linspace(0.0, 1.0, 65)
    volume = ScalarVolume("ramp", np.broadcast_to(line[:, None, None], (65, 65, 65)).copy())
    transfer = function([([0.495, 0.5, 0.505], [0, 5, 0])])
    view = View.looking([-200, 32, 32], [0, 32, 32], width=8, height=8, fov_deg=None, ortho_width=40)
    renderer = VolumeRenderer(volume)
    image = renderer.render(view, transfer, Stepping("error", "preintegrated", 0.01), counts=True)
    assert image.steps / 64 < 90  # two voxels of the brick would need two hundred steps of 0.01
    assert image.transmittance[0, 0] == pytest.approx(np.exp(-5 * 0.005 * 64), rel=1e-3)


def through(volume, transfer, origin, direction, scale):
    """Transmittance of one ray, marched with midpoints by the `error` rule and by fine uniform steps."""
    from spectral_core.volume.image import Stepping
    from spectral_core.volume.renderer import VolumeRenderer

    ahead = np.asarray(origin) + np.asarray(direction)
    view = View.looking(origin, ahead, [0.0, 0.3, 1.0], width=1, height=1, fov_deg=None, ortho_width=1e-6)
    renderer = VolumeRenderer(volume)
    return [
        float(renderer.render(view, transfer, stepping).transmittance[0, 0])
        for stepping in (Stepping("error", "midpoint", scale), Stepping("uniform", "midpoint", 0.002))
    ]


@pytest.mark.parametrize("scale", [0.2089, 0.25, 0.409, 0.5, 0.7671, 0.8, 1.0])
def test_a_plateau_just_above_the_threshold_is_not_skipped(scale):
    pytest.importorskip("drjit")
    data = np.zeros((7, 3, 3), np.uint8)
    data[2:5] = 200
    transfer = TransferFunction((Material("sheet", [0, 195, 195, 255], [0, 0, 1, 1], [1, 1, 1]),))
    got, wanted = through(ScalarVolume("sheet", data), transfer, [-5.0, 1.0, 1.0], [1.0, 0.0, 0.0], scale)
    assert wanted < 0.2 and got < 3 * wanted


def test_clearance_ends_at_the_border_of_a_brick(rng):
    pytest.importorskip("drjit")
    data = np.zeros((21, 21, 21), np.uint8)
    for start in (2, 14):
        data[start : start + 5] = np.array([190, 198, 206, 198, 190], np.uint8)[:, None, None]
    transfer = TransferFunction((Material("ridge", [0, 192, 192, 255], [0, 0, 0.5, 0.5], [1, 1, 1]),))
    volume = ScalarVolume("ridges", data)
    rays = [([-8.101472, -13.097548, 4.887183], [0.684059, 0.726665, 0.063409])]
    for _ in range(12):
        direction = np.array([1.0, *rng.uniform(-1.0, 1.0, 2)])
        direction /= np.linalg.norm(direction)
        rays.append((np.array([10.0, *rng.uniform(6, 14, 2)]) - 20 * direction, direction))
    for origin, direction in rays:
        got, wanted = through(volume, transfer, origin, direction, 0.2)
        assert got < 1.5 * wanted + 1e-4


@pytest.mark.parametrize(("clear_after", "integral_after", "way", "missed"), [
    (0.0, 1.0, 6.0, True),  # ends on a visible value within the reach of the slope
    (2.0, 1.5, 6.0, True),  # a visible value lies between the values on both sides
    (1.0, 1.0, 9.0, True),  # long enough to reach a visible value and to return
    (1.0, 1.0, 6.0, False),
])  # fmt: skip
def test_each_sign_of_a_missed_value_is_detected(clear_after, integral_after, way, missed):
    pytest.importorskip("drjit")
    import drjit.llvm as types

    from spectral_core.llvm_library import use_newest_llvm
    from spectral_core.volume.march.quadrature import PreintegratedState, _missed

    use_newest_llvm()

    def state(clear, integral):
        return PreintegratedState(types.Float(0), types.UInt32(0), [types.Float(integral)], types.Float(clear), None)

    got = _missed(state(5.0, 1.0), state(clear_after, integral_after), types.Float(way), types.Float(1.0))
    assert got.numpy()[0] == missed
