# SPDX-License-Identifier: GPL-3.0-or-later
"""Embedding, clusters, proposals, Pareto front, features and nodes compared with known values."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.embedding import VARIANTS, cluster, spectral_embedding
from spectral_core.explore.analysis.pareto import pareto_front
from spectral_core.explore.analysis.process import GaussianProcess, propose
from spectral_core.explore.analysis.sensitivity import sobol_indices
from spectral_core.explore.features.images import difference_features, has_flip, image_features, noise_level
from spectral_core.explore.sweep.compute.command import CommandNode
from spectral_core.explore.sweep.compute.palette import PaletteNode
from spectral_core.explore.sweep.compute.scene import SceneNode
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import NormBall, RegionOfInterest, bounding_region

EXAMPLES = Path(__file__).parents[2] / "examples"
rng = np.random.default_rng(1)


@pytest.mark.parametrize("variant", VARIANTS)
def test_two_types_of_rows_are_separated(variant) -> None:
    kinds = np.repeat([0, 1], 30)
    centers = np.array([[1.0, 0.1, 0.4, 0.2], [0.1, 1.0, 0.2, 0.5]])
    features = centers[kinds] + rng.uniform(0, 0.1, (60, 4))
    where = spectral_embedding(features, variant)
    found = cluster(where, 2)
    assert where.shape == (60, 2)
    assert len({*zip(found, kinds, strict=True)}) == 2
    again = spectral_embedding(features, variant)
    np.testing.assert_allclose(where, again, atol=1e-9)  # of eigenvectors with a sign


def test_a_row_of_zeros_stays_at_the_origin() -> None:
    features = rng.random((8, 3))
    features[3] = 0
    assert np.allclose(spectral_embedding(features, "cosine")[3], 0)


def test_the_pareto_front_equals_that_of_a_double_loop() -> None:
    values = rng.integers(0, 6, (60, 3)).astype(float)
    values[5, 1] = np.nan

    def beaten(i: int) -> bool:
        return any((values[j] <= values[i]).all() and (values[j] < values[i]).any() for j in range(60))

    expected = [i for i in range(60) if np.isfinite(values[i]).all() and not beaten(i)]
    assert pareto_front(values).tolist() == expected


def test_a_gaussian_process_learns_a_smooth_function_and_proposes_its_minimum() -> None:
    points = rng.random((60, 2))
    values = (points[:, 0] - 0.3) ** 2 + 0.5 * (points[:, 1] - 0.7) ** 2
    process = GaussianProcess.fit(points, values)
    fresh = rng.random((50, 2))
    truth = (fresh[:, 0] - 0.3) ** 2 + 0.5 * (fresh[:, 1] - 0.7) ** 2
    mean, deviation = process.predict(fresh)
    assert np.abs(mean - truth).max() < 0.01 and (deviation > 0).all()
    assert np.linalg.norm(propose(points[:12], values[:12])[0] - [0.3, 0.7]) < 0.15


def branin(points: np.ndarray) -> np.ndarray:
    """A usual test function of optimizers, over the unit square (Branin 1972)."""
    x, y = 15 * points[:, 0] - 5, 15 * points[:, 1]
    return (y - 5.1 / (4 * np.pi**2) * x**2 + 5 / np.pi * x - 6) ** 2 + 10 * (1 - 1 / (8 * np.pi)) * np.cos(x) + 10


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e6])
def test_deviations_of_a_gaussian_process_are_as_large_as_its_errors(unit: float) -> None:
    """They were those of a process as spread as the values: 20 times too small, so that 7 % of the errors were below
    1.96 of them.
    """
    drawn = np.random.default_rng(5)
    points, fresh = drawn.random((40, 2)), drawn.random((1000, 2))
    mean, deviation = GaussianProcess.fit(points, unit * branin(points)).predict(fresh)
    scores = (unit * branin(fresh) - mean) / deviation
    assert (np.abs(scores) < 1.96).mean() > 0.85
    assert 0.3 < np.sqrt(np.mean(scores**2)) < 2.0


def test_sensitivities_of_a_sum_are_the_shares_of_its_terms() -> None:
    points = rng.random((120, 3))
    found = {one.name: one for one in sobol_indices(points, 3 * points[:, 0] + points[:, 1], "abc", base=512)}
    assert found["a"].first == pytest.approx(0.9, abs=0.05) and found["b"].total == pytest.approx(0.1, abs=0.05)
    assert found["c"].total == pytest.approx(0.0, abs=0.02)
    assert found["a"].first_interval[0] < 0.9 < found["a"].first_interval[1]


def test_intervals_of_sensitivities_hold_the_truth_where_the_prediction_is_poor() -> None:
    """They were those of the prediction alone: of 24 indices from 64 rows, 5 were outside of their 95 % interval."""
    a, b = 7.0, 0.1  # Ishigami and Homma 1990
    variance = a**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    shared = b**2 * np.pi**8 * 8 / 225 / variance
    first = [0.5 * (1 + b * np.pi**4 / 5) ** 2 / variance, a**2 / 8 / variance, 0.0]
    total = [first[0] + shared, first[1], shared]
    held = []
    for seed in range(2):
        points = np.random.default_rng(seed).random((64, 3))
        angle = np.pi * (2 * points - 1)
        values = np.sin(angle[:, 0]) + a * np.sin(angle[:, 1]) ** 2 + b * angle[:, 2] ** 4 * np.sin(angle[:, 0])
        for one in sobol_indices(points, values, "012"):
            held.append(one.first_interval[0] <= first[int(one.name)] <= one.first_interval[1])
            held.append(one.total_interval[0] <= total[int(one.name)] <= one.total_interval[1])
    assert sum(held) >= 11


def test_picture_features_of_known_pictures() -> None:
    gray = np.full((20, 30, 3), 0.18)
    features = image_features(gray)
    assert features["lab_lightness"] == pytest.approx(49.5, abs=0.1)
    assert features["contrast"] == pytest.approx(0, abs=1e-9) and features["noise"] == pytest.approx(0, abs=1e-9)
    noisy = gray + rng.normal(0, 0.02, (200, 200, 1))[:20, :30]
    assert noise_level(rng.normal(0.5, 0.02, (200, 200))) == pytest.approx(0.02, rel=0.03)
    assert noise_level(np.add.outer(np.arange(50.0), np.arange(40.0))) == pytest.approx(0, abs=1e-9)
    differences = difference_features(noisy, gray)
    assert differences["rmse"] == pytest.approx(float(np.sqrt(np.mean((noisy - gray) ** 2))))
    assert differences["snr_db"] == pytest.approx(20 * np.log10(0.18 / differences["rmse"]), abs=1e-6)
    assert ("flip" in differences) == has_flip()
    assert difference_features(gray, gray)["delta_e_mean"] == 0


def test_the_channels_of_a_picture_are_features_of_their_own() -> None:
    orange = np.broadcast_to((0.6, 0.3, 0.05), (20, 20, 3)).copy()
    orange[:2, :10] = (0.0, 0.9, 0.5)  # 5 % of the pixels
    features = image_features(orange)
    means = [features[f"mean_{name}"] for name in ("red", "green", "blue")]
    assert means == pytest.approx([0.57, 0.33, 0.0725])
    assert features["luminance_p99"] == pytest.approx(0.7152 * 0.9 + 0.0722 * 0.5, abs=1e-3)
    assert features["lab_a"] > 5 and features["lab_b"] > 30  # orange: red and yellow
    green, blue = (image_features(np.broadcast_to(color, (4, 4, 3))) for color in ((0.1, 0.6, 0.1), (0.1, 0.1, 0.6)))
    assert green["lab_a"] < -30 and green["lab_b"] > 30 and blue["lab_b"] < -30


def test_a_program_is_swept_without_a_shell(tmp_path: Path) -> None:
    script = tmp_path / "sim.py"
    script.write_text(
        "import json, sys\na, name, out = float(sys.argv[1]), sys.argv[2], sys.argv[3]\n"
        "open(out + '/p.png', 'wb').write(b'\\x89PNG')\nprint('talk')\nprint("
        "json.dumps({'square': a * a, 'name': name}))\n"
    )
    space = Space((Parameter("a", 0, 1), Parameter("word", choices=("$(touch evil); x", "y"), kind="choice")))
    node = CommandNode.of([sys.executable, "sim.py", "{a}", "{word}", "{out}"], space, tmp_path)
    outcome = node({"a": 0.5, "word": "$(touch evil); x"}, 0)
    assert outcome.values == {"square": 0.25, "name": "$(touch evil); x"} and list(outcome.files) == [".png"]
    assert not (tmp_path / "evil").exists()
    with pytest.raises(InvalidInputError, match="never uses 'word'"):
        CommandNode.of([sys.executable, "{a}"], space, tmp_path)
    with pytest.raises(InvalidInputError, match="the place {b}"):
        CommandNode.of([sys.executable, "{a}", "{word}", "{b}"], space, tmp_path)


def test_a_palette_is_swept() -> None:
    space = Space((Parameter("smoothness", 1e-6, 1e-1, scale="log"),))
    node = PaletteNode.of(EXAMPLES / "metamer_pair.toml", space)
    rough, smooth = (node({"smoothness": value}, 0).values["delta_e_max"] for value in (1e-6, 1e-1))
    assert rough < smooth
    with pytest.raises(InvalidInputError, match="smoothnes"):
        PaletteNode.of(EXAMPLES / "metamer_pair.toml", Space((Parameter("x", path="smoothnes"),)))


@pytest.mark.slow
def test_relit_points_equal_renders_within_noise_and_are_recorded_once(monkeypatch) -> None:
    from spectral_core.render.relight import transport

    key, fill = "lights[Key].power_w", "lights[Fill].power_w"
    space = Space((Parameter("key_w", 10, 1000, path=key), Parameter("fill_w", 0, 500, path=fill)))
    address = f"{EXAMPLES / 'sweeps' / 'scenes.py'}:corner"
    small = {"film.width": 24, "film.height": 24, "film.samples": 256}
    node = SceneNode.of(address, space, settings=small)
    assert node.relights
    made = []
    original = transport.record_transport
    monkeypatch.setattr(transport, "record_transport", lambda *a, **k: made.append(1) or original(*a, **k))
    plain = SceneNode.of(address, space, settings=small, relight=False)
    for values in ({"key_w": 50.0, "fill_w": 0.0}, {"key_w": 900.0, "fill_w": 300.0}):
        relit, alone = node(values, 5).pictures[""], plain(values, 5).pictures[""]
        # other paths have other noise: means agree, and pixels differ by much less than a light's share
        assert relit[..., :3].mean() == pytest.approx(alone[..., :3].mean(), rel=0.02)
        assert np.abs(relit[..., :3] - alone[..., :3]).mean() < 0.08 * alone[..., :3].mean()
    assert len(made) == 1


def test_regions_agree_with_their_unit_cube_and_can_be_pickled() -> None:
    space = Space((Parameter("a", 0, 2), Parameter("w", 1, 1000, scale="log"), Parameter("k", 1, 6, kind="integer")))
    region = RegionOfInterest(
        {"a": (0.2, 1.5), "k": (2, 5)},
        constraints=("a + log10(w) <= 3",),
        ball=NormBall({"a": 1, "w": 30}, {"a": 1, "w": 1.2}, 1.0),
    ).checked(space)
    unit = region.in_unit_cube(space)
    points = rng.random((500, 3))
    agree = [region.contains(space, space.values(u)) == bool(unit.contains(u[None])[0]) for u in points]
    assert np.mean(agree) > 0.98  # a whole number corresponds to an interval of the cube
    assert RegionOfInterest.from_dict(region.to_dict()) == region
    box = bounding_region(space, [{"a": 0.1, "w": 5.0, "k": 2}, {"a": 0.4, "w": 50.0, "k": 4}], "good")
    assert box.ranges == {"a": (0.1, 0.4), "w": (5.0, 50.0), "k": (2.0, 4.0)}
