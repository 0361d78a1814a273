# SPDX-License-Identifier: GPL-3.0-or-later
"""Swept seeds, one whole number on a log scale, and balls of whole numbers."""

from __future__ import annotations

import hashlib
import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.compute import rendering
from spectral_core.explore.sweep.designs import Design, design_points
from spectral_core.explore.sweep.document import compute_node, sweep_of
from spectral_core.explore.sweep.ledger import Pace
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.explore.sweep.sweep import Sweep
from spectral_core.scene import scene_hash
from tests.explore.sweep.test_nodes_get_settings import LIGHT, scene_node
from tests.explore.sweep.test_nodes_get_settings import traced as traced  # a fixture

SEED = {"name": "start", "low": 0, "high": 99, "kind": "integer", "path": "film.seed"}


def test_a_swept_seed_of_a_scene_is_that_of_the_render(tmp_path: Path, traced: list[Any]) -> None:
    """The seed of the sweep replaced it, so that all pictures were the same."""
    scene_node(tmp_path, SEED)({"start": 17}, 3)
    scene_node(tmp_path, {"name": "paths", "low": 1, "high": 9, "kind": "integer", "path": "film.samples"},
               settings={"film.seed": 23})({"paths": 2}, 3)  # fmt: skip
    assert [scene.film.seed for scene, _ in traced] == [17, 23]


def test_a_swept_seed_of_a_program_is_what_it_gets(tmp_path: Path) -> None:
    """The program got the seed of the sweep instead."""
    words = [sys.executable, "-c", "import sys; print(sys.argv[1])", "{seed}"]
    table = {"name": "seed", "low": 10, "high": 14, "kind": "integer"}
    sweep = sweep_of({"compute": {"kind": "command", "command": words}, "parameters": [table]}, tmp_path)
    node = compute_node(sweep.compute, sweep.space, tmp_path)
    assert node({"seed": 12}, 0).values["result"] == 12
    compute = {"kind": "command", "command": ["true", "{out}"]}
    sweep = sweep_of({"compute": compute, "parameters": [table | {"name": "out"}]}, tmp_path)
    with pytest.raises(InvalidInputError, match="named 'out'"):
        compute_node(sweep.compute, sweep.space, tmp_path)


def test_a_light_group_may_be_named_as_files_are() -> None:
    """Its features were no columns of a table, so that every point failed."""
    assert rendering._identifier("Filed lamp") == "light_Filed_lamp"
    assert rendering._identifier("Fill") == "Fill"


@pytest.mark.parametrize("alone", [1, 4, 64])
def test_a_region_of_one_whole_number_on_a_log_scale_has_points(alone: int) -> None:
    """The region was 2e-9 wide, and no point was found in it."""
    space = Space((Parameter("n", 1, 64, kind="integer", scale="log"), Parameter("m")))
    region = RegionOfInterest({"n": (alone, alone)})
    for kind in ("lattice", "sobol", "latin_hypercube"):
        points, _ = design_points(space, region, Design(kind, 12).placed(space))
        assert len(points) == 12 and {point["n"] for point in points} == {alone}


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_the_intervals_of_whole_numbers_divide_the_unit_interval(scale: Any) -> None:
    parameter = Parameter("n", 2, 9, kind="integer", scale=scale)
    ends = [(parameter.place(number - 0.5), parameter.place(number + 0.5)) for number in range(2, 10)]
    assert ends[0][0] == pytest.approx(0) and ends[-1][1] == pytest.approx(1)
    for number, ((low, high), (next_low, _)) in enumerate(pairwise(ends), 2):
        assert high == pytest.approx(next_low)
        assert {parameter.value(at) for at in np.linspace(low + 1e-9, high - 1e-9, 7)} == {number}


def test_an_edited_file_is_read_again_by_the_same_process(tmp_path: Path, traced: list[Any]) -> None:
    """A page that was served while a scene's file was edited mixed points of both versions."""
    first = scene_node(tmp_path, SEED)
    (tmp_path / "f.py").write_text("def f(start):\n    return start\n")
    compute = {"kind": "function", "function": "f.py:f"}
    sweep = sweep_of({"compute": compute, "parameters": [SEED | {"path": ""}]}, tmp_path)
    before = compute_node(sweep.compute, sweep.space, tmp_path)
    (tmp_path / "f.py").write_text("def f(start):\n    return -start\n")
    after = compute_node(sweep.compute, sweep.space, tmp_path)
    assert before.fingerprint != after.fingerprint
    assert (before({"start": 3}, 0).values["result"], after({"start": 3}, 0).values["result"]) == (3, -3)
    (tmp_path / "mine.py").write_text((tmp_path / "mine.py").read_text().replace("power_w=5.0", "power_w=50.0"))
    sweep = sweep_of({"compute": {"kind": "scene", "scene": "mine.py:made"}, "parameters": [SEED]}, tmp_path)
    second = compute_node(sweep.compute, sweep.space, tmp_path)
    second({"start": 1}, 0)
    assert second.fingerprint != first.fingerprint and traced[-1][0].lights[0].power_w == 50.0


@pytest.mark.parametrize(
    ("scale", "center", "radius", "inside"),
    [("linear", 2.5, 1.0, (2, 3)), ("linear", 8, 2.0, range(6, 11)), ("log", 8, 0.5, range(3, 26)),
     ("log", 2.5, 0.2, range(2, 4))],
)  # fmt: skip
def test_a_ball_holds_the_whole_numbers_within_its_radius(
    scale: Any, center: float, radius: float, inside: Any
) -> None:
    """A center between two whole numbers was rounded, and on a log scale the radius was too large by a sixth."""
    space = Space((Parameter("n", 1, 64, kind="integer", scale=scale), Parameter("m")))
    ball = {"center": {"n": center}, "radii": {"n": radius}}
    region = RegionOfInterest.from_dict({"ball": ball}).checked(space)
    assert [n for n in range(1, 65) if region.contains(space, {"n": n, "m": 0.5})] == list(inside)
    points, _ = design_points(space, region, Design(budget=40).placed(space))
    assert {point["n"] for point in points} <= set(inside)


def test_a_center_of_a_ball_on_a_log_scale_is_above_0() -> None:
    space = Space((Parameter("n", 1, 64, kind="integer", scale="log"),))
    with pytest.raises(InvalidInputError, match="center"):
        RegionOfInterest.from_dict({"ball": {"center": {"n": 0}, "radii": {"n": 1}}}).checked(space)


def test_points_are_not_added_to_a_list_by_the_page(tmp_path: Path) -> None:
    """The page told that 0 points were added."""
    from spectral_core.explore.page.live import LiveSweep
    from spectral_core.explore.sweep.sweep import Sweep

    plain = {"compute": {"kind": "command", "command": ["true", "{n}"]},
             "parameters": [{"name": "n", "low": 0, "high": 1}], "design": {"points": [{"n": 0.5}]}}  # fmt: skip
    sweep = Sweep(sweep_of(plain, tmp_path), tmp_path / "out")
    sweep.plan()
    for add in (lambda: LiveSweep(sweep.store).refine({}), lambda: LiveSweep(sweep.store).sample({"budget": 3})):
        with pytest.raises(InvalidInputError, match="lists its points"):
            add()
    sweep.store.close()


def test_a_center_names_parameters_of_the_sweep() -> None:
    """An unknown name was not noticed."""
    space = Space((Parameter("n", 1, 64), Parameter("m")))
    with pytest.raises(InvalidInputError, match="'k'"):
        RegionOfInterest.from_dict({"ball": {"center": {"n": 3, "k": 0}, "radii": {"n": 1}}}).checked(space)


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_a_range_of_whole_numbers_can_be_widened(tmp_path: Path, scale: str) -> None:
    """A wider range in the file ended in an error, and none of its points could be computed."""
    (tmp_path / "f.py").write_text("def f(n, word): return {'square': n * n}\n", "utf-8")

    def swept(low: int, high: int, budget: int) -> set[int]:
        sweep = sweep_of({
            "compute": {"kind": "function", "function": "f.py:f"}, "design": {"budget": budget},
            "parameters": [{"name": "n", "low": low, "high": high, "kind": "integer", "scale": scale},
                           {"name": "word", "choices": ["x", "y"]}],
        }, tmp_path)  # fmt: skip
        one = Sweep(sweep, tmp_path / "n")
        keys = one.plan().keys
        rows = {row.key: row for row in one.store.ledger.rows()}
        one.store.close()
        found = [tuple(rows[key].parameters.values()) for key in keys]
        assert len(set(found)) == len(found) == min(budget, 2 * (high - low + 1))
        return {number for number, _ in found}

    assert swept(4, 7, 8) == {4, 5, 6, 7}
    assert swept(2, 12, 50) == set(range(2, 13))  # all of them are taken
    assert swept(1, 40, 30) <= set(range(1, 41))
    assert max(swept(1, 5000, 64)) > 40
    assert swept(5, 6, 4) == {5, 6}


def test_whole_numbers_keep_their_ends() -> None:
    """The end of the unit interval belongs to the last number; beyond it the range goes on."""
    for scale in ("linear", "log"):
        one = Parameter("n", 3, 9, kind="integer", scale=scale)
        assert [one.value(0.0), one.value(1.0)] == [3, 9]
        assert [one.value(one.coordinate(n)) for n in (1, 2, 3, 9, 10, 200)] == [1, 2, 3, 9, 10, 200]


def test_a_setting_is_not_swept_as_well(tmp_path: Path) -> None:
    """The swept value replaced that of ``settings``, also where both are written in other ways."""
    for path in ("lights[bulb].power_w", 'lights["bulb"].power_w', "lights[-2].power_w"):
        with pytest.raises(InvalidInputError, match="set the same value; leave out one of them"):
            scene_node(tmp_path, LIGHT, settings={path: 3.0})
    scene_node(tmp_path, LIGHT, settings={"lights[sun].irradiance": 3.0})


@pytest.mark.parametrize(
    ("limit", "value", "is_rendered"),
    [("clamp_direct", 50.0, True), ("clamp_indirect", 2.0, True), ("clamp_indirect", 10.0, False)],
)
def test_clamped_lights_are_not_re_lit(
    tmp_path: Path, traced: list[Any], monkeypatch: pytest.MonkeyPatch, limit: str, value: float, is_rendered: bool
) -> None:
    """The recording was clamped at a power of 1 W, so that strong lights were not clamped, and weak ones lost light."""
    from spectral_core.render.relight import transport

    class Recorded(Exception):
        pass

    def record(scene: Any, *_: Any, **__: Any) -> None:
        assert (scene.settings.light_paths.clamp_direct, scene.settings.light_paths.clamp_indirect) == (0.0, 0.0)
        raise Recorded

    monkeypatch.setattr(transport, "record_transport", record)
    node = scene_node(tmp_path, LIGHT, settings={f"settings.light_paths.{limit}": value})
    assert node.relights != is_rendered
    assert any("every point is rendered: samples are clamped" in line for line in node.describe()) == is_rendered
    relighter, scene = rendering.Relighter(), node._base()
    if is_rendered:
        node({"watts": 3.0}, 0)
        relighter.picture(scene)
        assert len(traced) == 2 and getattr(traced[0][0].settings.light_paths, limit) == value
    else:
        with pytest.raises(Recorded):
            relighter.picture(scene)


@pytest.mark.parametrize(("clamp", "is_other"), [(10.0, True), (0.0, False)])
def test_points_of_clamped_recordings_are_not_mixed_with_those_of_others(
    tmp_path: Path, clamp: float, is_other: bool
) -> None:
    """Recordings of earlier versions had the scene's clamps; a sweep was continued with recordings without."""
    node = scene_node(tmp_path, LIGHT, settings={"settings.light_paths.clamp_indirect": clamp})
    said = [scene_hash(node._base()), [list(pair) for pair in node.paths], False, True]
    text = json.dumps(said, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert (hashlib.sha256(text.encode()).hexdigest() != node.fingerprint) is is_other


@pytest.mark.parametrize(("kind", "count"), [("sobol", 11), ("sobol", 20), ("latin_hypercube", 20), ("sobol", 64)])
def test_sobol_points_and_latin_hypercubes_have_as_many_parameters_as_a_sweep(kind: Any, count: int) -> None:
    """More than 16 were refused, as those of lattices are."""
    space = Space(tuple(Parameter(f"x{i}", -1.0, 1.0) for i in range(count)))
    points, _ = design_points(space, RegionOfInterest(constraints=("x0 + x10 <= 1",)), Design(kind, 40))
    values = np.array([[float(point[name]) for name in space.names] for point in points])
    assert values.shape == (40, count) and len(np.unique(values, axis=0)) == 40
    assert (np.abs(values) <= 1).all() and (values[:, 0] + values[:, 10] <= 1).all()
    assert np.ptp(values, axis=0).min() > 1.5


def test_a_region_that_chooses_no_value_is_refused() -> None:
    """The plan had no point, and said that all were taken."""
    space = Space((Parameter("m", kind="choice", choices=("a", "b")),))
    with pytest.raises(InvalidInputError, match="the region chooses no value of m; name some"):
        design_points(space, RegionOfInterest(choices={"m": ()}), Design("sobol", 4))


@pytest.mark.parametrize("workers", [1, 2, 16])
def test_the_time_left_is_that_of_the_points(workers: int) -> None:
    """The start of the workers counted as time of the points: one second before the end, 102 s were left."""
    pace, starting, each = Pace(workers), 4.0, 0.05
    for ended in range(1, 101):
        seconds = starting + -(-ended // workers) * each
        left = pace.seconds_left(seconds, ended, 100 - ended)
        assert left is not None
        if ended >= 2 * workers and ended % workers == 0:
            assert left == pytest.approx((100 - ended) * each / workers)
    assert Pace(3).seconds_left(5.0, 0, 8) is None
