# SPDX-License-Identifier: GPL-3.0-or-later
"""Mistakes of users' functions, programs and files: each is reported, none is silently dropped."""

from __future__ import annotations

import copy
import json
import sys
import threading
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, MissingDependencyError, RenderError, SpectralError
from spectral_core.explore.analysis.steps import print_sensitivity, region_of_label
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.page.serve import PageServer
from spectral_core.explore.sweep.compute.command import CommandNode
from spectral_core.explore.sweep.compute.function import FunctionNode
from spectral_core.explore.sweep.designs import Design, design_points
from spectral_core.explore.sweep.document import sweep_of
from spectral_core.explore.sweep.outcome import as_outcome
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.project import Project
from spectral_core.explore.sweep.region import RegionOfInterest
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.task import Receipt

ONE = Space((Parameter("x", 0.0, 1.0),))
DOCUMENT: dict[str, Any] = {
    "seed": 1,
    "compute": {"kind": "function", "function": "f.py:f"},
    "design": {"kind": "list", "budget": 4, "seed": 0, "rate": 2, "points": [{"x": 0.5, "n": 2, "c": "red"}]},
    "parameters": [
        {"name": "x", "low": 0.1, "high": 1.0, "scale": "log", "unit": "m", "group": "g", "path": "a.b"},
        {"name": "n", "low": 1, "high": 4, "kind": "integer"},
        {"name": "c", "choices": ["red", "blue"]},
    ],
    "region": {
        "ranges": {"x": [0.2, 0.9]}, "choices": {"c": ["red"]}, "constraints": ["log10(x) + n <= 4"],
        "ball": {"center": {"x": 0.5}, "radii": {"x": 1.0}, "p": 2},
    },
    "columns": {"z": "2 * x"},
}  # fmt: skip
WRONG: list[Any] = [0, -1, 1.5, True, "", "x", [], [1], [[1]], {}, {"a": 1}, {"x": [1]}, float("nan"), 10**400]


def _places(part: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    inner = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ()
    return ([at] if at else []) + [place for key, value in inner for place in _places(value, (*at, key))]


@pytest.mark.parametrize("kind", ["sobol", "list"])
def test_an_error_names_each_wrong_entry_of_a_sweep_file(kind: str, tmp_path: Path) -> None:
    refused = 0
    for place in _places(DOCUMENT):
        for wrong in WRONG:
            plain = copy.deepcopy(DOCUMENT)
            plain["design"]["kind"] = kind
            inner: Any = plain
            for key in place[:-1]:
                inner = inner[key]
            inner[place[-1]] = wrong
            try:
                document = sweep_of(plain, tmp_path)
                design_points(document.space, document.region, document.design)
            except SpectralError as error:
                assert str(error)
                refused += 1
    assert refused > 300


def function(tmp_path: Path, body: str) -> FunctionNode:
    path = tmp_path / f"f{abs(hash(body))}.py"
    path.write_text(body)
    return FunctionNode.of(f"{path}:f")


def test_a_value_with_the_name_of_a_parameter_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="'x', which is a parameter's column"):
        function(tmp_path, "def f(x): return {'x': 2 * x, 'y': 1}")({"x": 0.5}, 0)
    same = function(tmp_path, "def f(x): return {'x': x, 'y': 1}")({"x": 0.5}, 0)
    assert same.values["y"] == 1


def test_a_parameter_cannot_have_the_name_of_a_picture_feature(tmp_path: Path) -> None:
    plain = {"compute": {"kind": "scene", "scene": "s.py:s"}, "parameters": [{"name": "contrast", "low": 0, "high": 1}]}
    with pytest.raises(InvalidInputError, match="'contrast'.*every picture"):
        sweep_of(plain, tmp_path).node()


@pytest.mark.parametrize("body", ["def f(x: 3", "raise RuntimeError('boom')", "import nothing_such"])
def test_an_error_names_a_file_that_cannot_be_loaded(tmp_path: Path, body: str) -> None:
    with pytest.raises(InvalidInputError, match="cannot be imported: .*Error"):
        function(tmp_path, body)


def test_numbers_of_many_types_are_accepted() -> None:
    assert as_outcome({"v": np.array(3.5)}, "f").values == {"v": 3.5}
    with pytest.raises(InvalidInputError, match="beyond 1e308"):
        as_outcome({"v": 10**400}, "f")


def program(tmp_path: Path, lines: str) -> CommandNode:
    path = tmp_path / "program.py"
    path.write_text(lines)
    return CommandNode.of([sys.executable, str(path), "{x}", "{out}"], ONE, tmp_path)


def test_a_program_without_output_fails_and_lists_become_columns(tmp_path: Path) -> None:
    with pytest.raises(RenderError, match="left no result"):
        program(tmp_path, "print('no JSON')")({"x": 0.5}, 0)
    found = program(tmp_path, 'print(\'{"a": [1, null], "b": "text"}\')')({"x": 0.5}, 0).values
    assert found["a_0"] == 1 and np.isnan(found["a_1"]) and found["b"] == "text"
    with pytest.raises(InvalidInputError, match="'a' is a dict"):
        program(tmp_path, 'print(\'{"a": {"b": 1}}\')')({"x": 0.5}, 0)


def test_a_failed_program_is_listed_with_the_last_line_that_it_wrote(tmp_path: Path) -> None:
    """The list of failures showed "Traceback (most recent call last):" alone."""
    with pytest.raises(RenderError) as told:
        program(tmp_path, "def compute(): return [][3]\ncompute()")({"x": 0.5}, 0)
    first, *others = str(told.value).splitlines()
    assert first.endswith("ended with status 1: IndexError: list index out of range")
    assert others[0].startswith("Traceback") and "in compute" in str(told.value)
    with pytest.raises(RenderError, match="ended with status 3:$"):
        program(tmp_path, "raise SystemExit(3)")({"x": 0.5}, 0)


def test_a_program_that_is_not_installed_ends_the_run(tmp_path: Path) -> None:
    """Each point failed twice by itself."""
    with pytest.raises(MissingDependencyError, match="no-such-program cannot be started.*install the program"):
        CommandNode.of(["no-such-program", "{x}"], ONE, tmp_path)({"x": 0.5}, 0)
    swept = CommandNode.of(["no-such-{x}"], ONE, tmp_path)
    with pytest.raises(RenderError, match="no-such-0.5 cannot be started"):
        swept({"x": 0.5}, 0)
    gone = CommandNode.of(["true", "{x}"], ONE, tmp_path / "gone")
    with pytest.raises(RenderError, match="true cannot be started: .*gone"):
        gone({"x": 0.5}, 0)


def test_a_point_fails_if_its_pictures_cannot_be_stored(tmp_path: Path) -> None:
    nine = "import sys\nfor k in range(9): open(sys.argv[2] + f'/{k}.png', 'wb').write(b'x')\nprint(1.0)"
    with pytest.raises(RenderError, match="left 9 pictures in {out}; a point keeps at most 8"):
        program(tmp_path, nine)({"x": 0.5}, 0)
    link = "import os, sys\nos.symlink('/etc/hostname', sys.argv[2] + '/l.png')\nprint(1.0)"
    with pytest.raises(RenderError, match="l.png is not"):
        program(tmp_path, link)({"x": 0.5}, 0)


def stored(folder: Path, outcomes: list[dict[str, Any]]) -> Store:
    store = Store.create(folder / "s.cdb", Project(ONE, RegionOfInterest(), Design("sobol", len(outcomes))))
    points = [{"x": (k + 0.5) / len(outcomes)} for k in range(len(outcomes))]
    store.enter(points)
    for point, values in zip(points, outcomes, strict=True):
        store.take_in(Receipt(store.key(point), {"values": values, "files": {}, "seconds": 0.1}))
    return store


def test_a_label_with_the_name_of_a_value_of_some_rows_is_refused(tmp_path: Path) -> None:
    with stored(tmp_path, [{"v": 1.0}, {"v": 2.0, "late": 3.0}]) as store:
        key = store.columns()["key"][0]
        with pytest.raises(InvalidInputError, match="not a manual column"):
            store.label("late", {key: "mine"})
        with pytest.raises(InvalidInputError, match="beyond 1e308"):
            store.label("mine", {key: 10**400})


def test_analysis_of_too_few_rows_is_refused_with_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with stored(tmp_path, [{"v": 1.0}, {"v": 2.0}, {"v": 4.0}]) as store:
        print_sensitivity(store, "v")
        said = capsys.readouterr().out
        assert "nan" not in said and "unreliable" in said
        with pytest.raises(InvalidInputError, match="no row has v = '3'; it holds 1.0, 2.0, 4.0"):
            region_of_label(store, "v", "3")
        assert json.dumps(region_of_label(store, "v", "2.0"))


def test_the_live_page_of_an_empty_sweep_reports_it(tmp_path: Path) -> None:
    empty = Project(ONE, RegionOfInterest(), Design("sobol", 4))
    with Store.create(tmp_path / "e.cdb", empty) as store, PageServer(LiveSweep(store)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        connection = HTTPConnection("127.0.0.1", server.server_port, timeout=20)
        connection.request("POST", "/page", "{}", {"X-Explore-Token": server.token})
        answer = connection.getresponse()
        said = json.loads(answer.read())["error"]
        connection.close()
        assert answer.status == 400 and "0 rows" in said
        server.shutdown()
