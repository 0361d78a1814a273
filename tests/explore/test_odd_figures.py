# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures and pages of tables with missing values, categories, wide ranges, and names that mean something elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.explore.checks.browser import Browser, find_browser
from spectral_core.explore.page.build import PageTable, write_page
from spectral_core.explore.page.static import draw_error_against_factors, draw_error_against_time, draw_matrix

needs_browser = pytest.mark.skipif(find_browser() is None, reason="no Chromium")
COLUMNS = {
    "watts": [0.01, 1.0, 100.0, 10.0], "kind": ["a$b$c", "", "plain", "a$b$c"], "error": [1.0, 2.0, 3.0, 4.0],
    "share": [0.5, None, None, 0.25], "seconds": [1.0, 2.0, 3.0, 4.0],
}  # fmt: skip


def drawn(svg: Path) -> tuple[int, set[str]]:
    """Points of the scatter plots of a figure, and its texts, which Matplotlib writes beside their outlines."""
    text = svg.read_text()
    groups = re.findall(r'<g id="PathCollection_\d+">(.*?)\n   </g>', text, re.DOTALL)
    return sum(group.count("<use ") for group in groups), set(re.findall(r"<!-- (.*?) -->", text))


def test_points_without_a_value_of_the_color_are_drawn(tmp_path: Path) -> None:
    """Half of the points were not in the figure."""
    pytest.importorskip("matplotlib")
    matrix = draw_matrix(tmp_path / "matrix.svg", COLUMNS, ["watts", "error"], color="share")
    time = draw_error_against_time(tmp_path / "time.svg", COLUMNS, "seconds", ["error"], by=["share"])
    factors = draw_error_against_factors(tmp_path / "factors.svg", COLUMNS, ["watts"], ["error"], color="share")
    assert [drawn(path)[0] for path in (matrix, time, factors)] == [4, 4, 4]


def test_a_matrix_names_categories_and_has_the_scales_of_the_parameters(tmp_path: Path) -> None:
    """Categories were numbers, parameters on a log scale were crowded at one end."""
    pytest.importorskip("matplotlib")
    path = tmp_path / "matrix.svg"
    texts = drawn(draw_matrix(path, COLUMNS, ["watts", "kind"], logarithmic=["watts"]))[1]
    assert {"a$b$c", "plain"} <= texts and any("10^{" in text for text in texts)
    plain = drawn(draw_matrix(path, {**COLUMNS, "watts": [0.0, 1, 2, 3]}, ["watts", "error"], logarithmic=["watts"]))[1]
    assert not any("10^{" in text for text in plain)


@needs_browser
def test_rows_are_labeled_where_a_column_is_named_label(tmp_path: Path) -> None:
    """The button did nothing."""
    columns = {"label": [1.0, 2.0], "label_2": ["x", "y"], "samples": [16384, 123457]}
    path = write_page(tmp_path / "page.html", PageTable("odd", "labels", columns, ["k", "l"]))
    with Browser(1000, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("explorer.select(Uint8Array.from([0, 1]))")
        page.run("document.getElementById('label-text').value = 'good'; document.getElementById('label').click()")
        assert page.run("document.getElementById('status').textContent") == "1 rows labeled in label_3"
        assert page.run("explorer.csv()").splitlines()[2].split(",")[1:5] == ["2", "y", "123457", "good"]
        page.run("explorer.setLabels('samples', {k: 'z'})")
        assert page.run("Array.from(explorer.table.byName.get('samples').values)") == [16384, 123457]
        page.run("document.getElementById('clear').click(); document.getElementById('view-table').click()")
        assert {"16384", "123457"} <= set(page.run("document.getElementById('table').innerText").split())
        assert page.errors == []


@needs_browser
def test_a_drag_along_an_axis_may_end_outside(tmp_path: Path) -> None:
    """It went on without the button, because the view never got its end."""
    columns = {"a": [0.0, 1.0, 2.0, 3.0], "b": [1.0, 2.0, 3.0, 4.0]}
    path = write_page(tmp_path / "page.html", PageTable("drag", "drag", columns, list("klmn")))
    with Browser(1000, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("document.getElementById('view-parallel').click()")
        x, middle, top = page.run(
            "(() => { const p = explorer.parallel, box = p.canvas.getBoundingClientRect();"
            "return [box.left + p.axisX(0), box.top + p.axisY(0.5), box.top + p.axisY(1)]; })()"
        )
        page.drag([(x, middle), (x, top), (x, 10)])
        assert page.run("explorer.parallel.drag") is None
        assert page.run("Array.from(explorer.state.selection)") == [0, 0, 1, 1]
        assert page.errors == []
