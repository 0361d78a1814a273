# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of an outcome that collide, columns without variation, strict constraints and lists of points."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spectral_core.cli import explore
from spectral_core.errors import InvalidInputError
from spectral_core.explore.analysis.embedding import cluster
from spectral_core.explore.analysis.process import GaussianProcess, propose
from spectral_core.explore.analysis.sensitivity import sobol_indices
from spectral_core.explore.features.compare import distances_to, picture_features
from spectral_core.explore.features.expression import evaluate
from spectral_core.explore.sweep.compute.command import CommandNode
from spectral_core.explore.sweep.compute.rendering import identifiers
from spectral_core.explore.sweep.designs import design_points
from spectral_core.explore.sweep.document import sweep_of
from spectral_core.explore.sweep.outcome import Outcome, as_outcome
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.runner import text_of
from spectral_core.explore.sweep.task import compute_point
from spectral_core.spectra.color import lab_from_linear_rgb, linear_from_display_rgb

FUNCTION = {"kind": "function", "function": "none.py:f"}
COUNTED = {"name": "n", "low": 1, "high": 6, "kind": "integer"}
CHOSEN = {"name": "c", "choices": [0, 1]}


def points_of(*parameters: dict[str, Any], **tables: Any) -> list[dict[str, Any]]:
    sweep = sweep_of({"compute": FUNCTION, "parameters": list(parameters), **tables}, Path())
    return design_points(sweep.space, sweep.region, sweep.design)[0]


class Node:
    """A node whose outcome has given pictures."""

    fingerprint = "pictures"

    def __init__(self, *names: str) -> None:
        self.fingerprint = repr(names)
        self.names = names

    def __call__(self, parameters: Any, seed: int) -> Outcome:
        return Outcome(pictures={name: np.full((4, 4, 3), 0.1 * i, np.float32) for i, name in enumerate(self.names)})


def test_texts_that_no_file_can_hold_end_no_run() -> None:
    """File names of other encodings have such letters: an error with one ended the run in a traceback."""
    with pytest.raises(InvalidInputError, match=r"'t' is '\\ud800x', a text that UTF-8 cannot store"):
        Outcome({"t": "\ud800x"})
    assert text_of(ValueError("no \udcff.png")) == "ValueError: no \\udcff.png"


def test_a_list_and_a_value_of_one_name_are_refused() -> None:
    """The value of the list was lost."""
    with pytest.raises(InvalidInputError, match="two values named 'x_0'"):
        as_outcome({"x": [1.0, 2.0], "x_0": 5.0}, "f")
    assert dict(as_outcome({"x": [1.0, 2.0], "x_2": 5.0}, "f").values) == {"x_0": 1.0, "x_1": 2.0, "x_2": 5.0}
    text = "import json; print(json.dumps(dict(x_1=7, x=[1, 2])))"
    node = CommandNode.of([sys.executable, "-c", text, "{a}"], Space((Parameter("a"),)))
    with pytest.raises(InvalidInputError, match="named 'x_1'"):
        node({"a": 0.5}, 0)


def test_a_picture_named_linear_does_not_take_the_column_of_another() -> None:
    """It replaced the linear values of the main picture, with which pictures are compared."""
    pytest.importorskip("OpenEXR")
    with pytest.raises(InvalidInputError, match="take the column 'FILE_linear'"):
        compute_point(Node("", "linear"), {}, 0, "k1", None)
    with pytest.raises(InvalidInputError, match="take the column 'FILE_depth_linear'"):
        compute_point(Node("", "depth", "depth_linear"), {}, 0, "k2", None)
    files = compute_point(Node("", "depth"), {}, 0, "k3", None).record["files"]
    assert sorted(files) == ["FILE", "FILE_depth", "FILE_depth_linear", "FILE_linear"]


def test_light_groups_that_differ_in_signs_have_columns_of_their_own() -> None:
    """The features of the second replaced those of the first."""
    found = identifiers(["Key 1", "Key_1", "Key-1", "", "unnamed", "Key_1_2"])
    assert len(set(found.values())) == 6
    assert identifiers(["Fill", "Key"]) == {"Fill": "Fill", "Key": "Key"}


def test_strict_constraints_exclude_their_bound() -> None:
    """``n < 3`` included 3."""

    def counted(*constraints: str) -> list[int]:
        return sorted(point["n"] for point in points_of(COUNTED, region={"constraints": list(constraints)}))

    assert counted("n < 3") == [1, 2]
    assert counted("n <= 3", "1 < n") == [2, 3]
    assert counted("2 < n < 5") == [3, 4]
    assert counted("6 - n > 3") == [1, 2]


def test_listed_whole_numbers_and_choices_are_those_of_the_parameter() -> None:
    """A function got 2.0 for a whole number, and a point listed as 2 and 2.0 was two rows."""
    listed = {"points": [{"n": 2.0, "c": 1.0}, {"n": 2, "c": 1}, {"n": 3, "c": 0}]}
    found = points_of(COUNTED, CHOSEN, design=listed)
    assert found == [{"n": 2, "c": 1}, {"n": 3, "c": 0}]
    assert {type(value) for point in found for value in point.values()} == {int}
    with pytest.raises(InvalidInputError, match="c is True; the choices"):
        points_of(COUNTED, CHOSEN, design={"points": [{"n": 1, "c": True}]})


def test_listed_points_that_would_be_ignored_are_refused() -> None:
    points = [{"n": 2, "c": 1}]
    with pytest.raises(InvalidInputError, match="which kind = 'sobol' does not read"):
        points_of(COUNTED, CHOSEN, design={"kind": "sobol", "points": points})
    with pytest.raises(InvalidInputError, match="lists 1 point and has a budget of 7"):
        points_of(COUNTED, CHOSEN, design={"points": points, "budget": 7})


def test_one_choice_of_a_region_may_be_a_text() -> None:
    """The letters of ``choices = {c = "xy"}`` were taken for choices."""
    parameter = {"name": "c", "choices": ["x", "y", "xy"]}
    assert points_of(parameter, region={"choices": {"c": "xy"}}) == [{"c": "xy"}]


def test_clusters_of_equal_rows() -> None:
    """Fewer different rows than clusters ended the program with an error of SciPy."""
    rows = np.repeat([[0.0, 1.0], [1.0, 0.0]], 4, axis=0)
    assert sorted(np.bincount(cluster(rows, 2))) == [4, 4]
    with pytest.raises(InvalidInputError, match="expected 1 to 2, since the 8 rows have 2 different sets of features"):
        cluster(rows, 3)


def test_columns_of_one_value_have_no_sensitivity() -> None:
    """The fit ended in an error about Inf and NaN."""
    points, values = np.random.default_rng(0).random((40, 2)), np.full(40, 3.5)
    for analysis in (GaussianProcess.fit, propose, lambda x, y: sobol_indices(x, y, ["a", "b"])):
        with pytest.raises(InvalidInputError, match="all 40 rows have 3.5"):
            analysis(points, values)
    values[7] = 4.0  # one part of the rows holds the only difference
    assert all(np.isfinite(one.total) for one in sobol_indices(points, values, ["a", "b"]))


def test_distances_in_a_high_norm() -> None:
    """Differences below 1 vanished in a high power: distant rows had distance 0."""
    rows = np.array([[0.0, 0.0], [0.4, 0.3], [0.1, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(distances_to(rows, 0, 2000.0), [0, 0.4, 0.1, 0], rtol=1e-3)
    np.testing.assert_allclose(distances_to(rows, 0, 3.0), [0, (0.4**3 + 0.3**3) ** (1 / 3), 0.1, 0])
    np.testing.assert_allclose(distances_to(rows, 0, np.inf), [0, 0.4, 0.1, 0])


def test_the_mean_of_an_empty_column_is_empty_without_a_warning() -> None:
    for text in ("mean(a)", "median(a)", "std(a)", "column_min(a)"):
        assert evaluate(text, {"a": [None, None]}) == [None, None]


def test_a_weight_is_given_once() -> None:
    """Only the last one counted."""
    with pytest.raises(InvalidInputError, match="names 'a' twice"):
        explore._weights(["a=1", "b=2", "a=3"])


def test_pictures_are_compared_by_the_means_of_their_blocks(tmp_path: Path) -> None:
    """Blocks of a picture that its size does not divide evenly, and those of one that is smaller than the blocks."""
    image = pytest.importorskip("PIL.Image")
    (tmp_path / "image").mkdir()
    rng = np.random.default_rng(5)
    pictures = [rng.integers(0, 256, shape, dtype=np.uint8) for shape in ((7, 5, 3), (1, 1, 3))]
    for number, pixels in enumerate(pictures):
        image.fromarray(pixels).save(tmp_path / "image" / f"{number}.png")
    rows = [{"FILE": f"image/{number}.png"} for number in range(2)]
    found = picture_features(SimpleNamespace(folder=tmp_path), rows, size=2).reshape(2, 2, 2, 3) * 100
    light = [linear_from_display_rgb(pixels / 255.0) for pixels in pictures]
    for down, across in np.ndindex(2, 2):
        block = light[0][(slice(0, 3), slice(3, 7))[down], (slice(0, 2), slice(2, 5))[across]]
        mean = sum(block.reshape(-1, 3)) / (block.size / 3)
        np.testing.assert_allclose(found[0, down, across], lab_from_linear_rgb(mean), atol=1e-9)
        np.testing.assert_allclose(found[1, down, across], lab_from_linear_rgb(light[1][0, 0]), atol=1e-9)
    with pytest.raises(InvalidInputError, match="no picture"):
        picture_features(SimpleNamespace(folder=tmp_path), [{}])
