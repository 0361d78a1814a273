# SPDX-License-Identifier: GPL-3.0-or-later
"""Modules of the page's script that need no browser, run by Node: columns, scales, regions."""

from __future__ import annotations

import json
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest

from spectral_core.explore.page.build import _packed
from spectral_core.explore.page.bundle import modules
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import RegionOfInterest

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no Node")
LEVEL = {"role": "parameter", "of": "choice"}
IMPORTS = """import { columnOf, shown } from "./data.js"; import { position, ticks } from "./scales.js";
import { regionAround, tomlOf } from "./selection.js";
const columns = COLUMNS.map(columnOf); const table = { columns, limits: {} };
"""


def answer(folder: Path, code: str, *columns: dict[str, Any]) -> Any:
    """The value of an expression over ``columns``, which are packed as in a page."""
    for name, text in modules().items():
        (folder / name).write_text(text, "utf-8")
    (folder / "package.json").write_text('{"type": "module"}')
    imports = IMPORTS.replace("COLUMNS", json.dumps(columns))
    (folder / "asked.js").write_text(f"{imports}console.log(JSON.stringify({code}));", "utf-8")
    done = subprocess.run(["node", "asked.js"], cwd=folder, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_an_empty_text_of_a_parameter_is_a_value_and_of_an_outcome_none(tmp_path: Path) -> None:
    """A region around points without the flag chose nothing: points with the flag were sampled there, too."""
    texts = ["", "--fast", ""]
    flag, label = _packed("flag", texts, LEVEL), _packed("label", texts, {})
    assert answer(tmp_path, "columns.map((c) => c.order)", flag, label) == [["", "--fast"], ["--fast"]]
    text = answer(tmp_path, "tomlOf(regionAround(table, [0, 2], 'r'))", flag, label)
    region = tomllib.loads(text)["region"]
    assert region["choices"] == {"flag": [""]}
    space = Space((Parameter("flag", kind="choice", choices=("", "--fast")),))
    assert not RegionOfInterest.from_dict(region).checked(space).contains(space, {"flag": "--fast"})


def test_a_region_of_numbers_and_texts_has_the_values_of_the_parameter(tmp_path: Path) -> None:
    """The table has texts alone in such a column; the region was refused, as it chose '1' and not 1."""
    level = _packed("level", [1, "auto", 2.5], LEVEL)
    region = tomllib.loads(answer(tmp_path, "tomlOf(regionAround(table, [0, 1, 2], 'r'))", level))["region"]
    space = Space((Parameter("level", kind="choice", choices=(1, 2.5, "auto", 4)),))
    checked = RegionOfInterest.from_dict(region).checked(space)
    assert sorted(checked.choices["level"], key=str) == [1, 2.5, "auto"]
    assert [checked.contains(space, {"level": one}) for one in (1, 4)] == [True, False]


def test_a_column_whose_range_no_number_holds_has_a_scale(tmp_path: Path) -> None:
    """All negative values were at one place, beside the tick NaN."""
    wide = _packed("wide", [-1.7e308, 0.0, 1.7e308], {})
    places, texts = answer(
        tmp_path,
        "[Array.from(columns[0].values, (v) => position(columns[0], v)), ticks(columns[0], 5).map((t) => t.text)]",
        wide,
    )
    assert places == pytest.approx([0.03, 0.5, 0.97]) and texts == ["-1.7e+308", "0", "1.7e+308"]


@pytest.mark.parametrize(("log", "value", "expected"), [
    (False, 0.001, [0.0, 0.006]), (False, 1.0, [0.995, 1.0]), (False, 3.0, [2.995, 3.005]), (True, 0.01, [0.01, None]),
])  # fmt: skip
def test_the_region_around_one_point_stays_in_the_range_of_the_sweep(
    tmp_path: Path, log: bool, value: float, expected: list[float | None]
) -> None:
    """A point with roughness 0.001 gave a region from -0.004, where *Sample here* added points."""
    about = {"role": "parameter", "of": "real", "log": log, "range": [0.01 if log else 0.0, 1.0]}
    column = _packed("roughness", [value, value + 1.0 if value != 1.0 else 0.0], about)
    region = tomllib.loads(answer(tmp_path, "tomlOf(regionAround(table, [0], 'r'))", column))["region"]
    found = region["ranges"]["roughness"]
    assert found[0] < found[1]
    for end, wanted in zip(found, expected, strict=True):
        assert wanted is None or end == pytest.approx(wanted)
