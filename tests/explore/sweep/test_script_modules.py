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


@pytest.mark.parametrize(("values", "said"), [
    ([None, None], ["no value"]), ([5.0, None], ["5", "no value"]), ([5.0, 5.0], ["5"]), ([1.0, 4.0], ["1", "", "4"]),
])  # fmt: skip
def test_the_legend_of_a_column_names_only_values_that_it_has(
    tmp_path: Path, values: list[float | None], said: list[str]
) -> None:
    """A column without values had the legend 0 to 1, one of 5 alone the legend 4.5 to 5.5."""
    made = "({ style: { setProperty() {} }, textContent: '' })"
    code = f"""(globalThis.document = {{ createElement: () => {made} }},
        (await import("./legend.js")).legendOf(columns[0]).map((part) => part.textContent))"""
    assert answer(tmp_path, code, _packed("only", values, {})) == said


def test_parallel_axes_show_values_whose_neighbors_are_missing(tmp_path: Path) -> None:
    """Values beside a column without any, and those of a single variable, were not drawn."""
    code = """(await (async () => {
        const { Parallel, bundles } = await import("./parallel.js");
        const drawn = (...at) => {
          const calls = [];
          const context = { beginPath() {}, stroke() {} };
          for (const name of ["moveTo", "lineTo"]) context[name] = (x, y) => calls.push([name, x, y]);
          const self = { table: { count: 1, byName: new Map() }, state: { color: "" }, axisX: (k) => 100 * k,
            axisY: (v) => v, mark: Parallel.prototype.mark };
          Parallel.prototype.lines.call(self, context, at.map((v) => Float32Array.of(v)), null, () => "");
          return calls;
        };
        const at = [[0.5, 0.5], [NaN, 0.25], [0.25, NaN]].map((one) => Float32Array.from(one));
        const of = (k, words) => {
          const { counts, sums } = bundles(at, k, null, words);
          const found = [...counts.entries()].filter(([, n]) => n);
          return found.map(([p, n]) => [p % 57, n, ...sums.slice(3 * p, 3 * p + 3)]);
        };
        return [drawn(0.5, NaN, 0.25), drawn(0.5), drawn(0.5, 0.25), [0, 1, 2].map((k) => of(k, null)),
          of(0, Uint32Array.of(0xff030201, 0xff060504))];
      })())"""
    gap, single, line, binned, colors = answer(tmp_path, code)
    assert gap == [["moveTo", -4, 0.5], ["lineTo", 4, 0.5], ["moveTo", 196, 0.25], ["lineTo", 204, 0.25]]
    assert single == [["moveTo", -4, 0.5], ["lineTo", 4, 0.5]]
    assert line == [["moveTo", 0, 0.5], ["lineTo", 100, 0.25]]
    assert binned == [[[14, 1], [56, 1]], [], [[56, 1]]]  # bin 56: a mark at this axis, no line to the next one
    assert colors == [[14, 1, 4, 5, 6], [56, 1, 1, 2, 3]]
