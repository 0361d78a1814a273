# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures and pages of tables with missing values, categories, wide ranges, and names that mean something elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.explore.checks.browser import Browser, find_browser
from spectral_core.explore.page.axes import bins, plotted
from spectral_core.explore.page.build import PageTable, shown_at_first, write_page
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


@pytest.mark.parametrize("value", [0.0, 7.0, -3e17, 1e300])
def test_a_variable_of_a_single_value_of_any_size_is_drawn(tmp_path: Path, value: float) -> None:
    """From 1e16 on it ended in a traceback: NumPy's bars around it had no width."""
    pytest.importorskip("matplotlib")
    columns = {"same": [value] * 4, "other": [1.0, 2.0, 3.0, 4.0]}
    path = draw_matrix(tmp_path / "matrix.svg", columns, ["same", "other"], color="same")
    assert drawn(path)[0] == 4
    edges = bins(np.full(4, value), [], is_log=False)
    assert np.histogram([value] * 4, edges)[0].tolist() == [0] * 10 + [4] + [0] * 9


def wide_table(parameters: int, outcomes: int) -> PageTable:
    """Columns with two values each, and a constant outcome before the others."""
    names = [f"x{i}" for i in range(parameters)]
    columns = {name: [0.0, 1.0] for name in names} | {"constant": [7.0, 7.0]}
    columns |= {f"y{i}": [1.0, 2.0] for i in range(outcomes)} | {"seconds": [1.0, 3.0]}
    about = {name: {"role": "parameter"} for name in names} | {"seconds": {"role": "time"}}
    return PageTable("wide", f"wide {parameters} {outcomes}", columns, ["k", "l"], about)


@pytest.mark.parametrize(
    ("parameters", "outcomes", "shown"),
    [
        (20, 20, "x0 x1 x2 x3 y0 y1 y2 y3"),
        (20, 1, "x0 x1 x2 x3 x4 x5 x6 y0"),
        (2, 9, "x0 x1 y0 y1 y2 y3 y4 y5"),
        (2, 0, "x0 x1 constant"),
    ],
)
def test_a_figure_shows_outcomes_beside_many_parameters(parameters: int, outcomes: int, shown: str) -> None:
    """The first eight columns were shown: parameters alone, or constants and the time of computing."""
    table = wide_table(parameters, outcomes)
    assert shown_at_first(table) == shown.split()


def test_a_figure_of_one_variable_has_another_beside_it() -> None:
    assert shown_at_first(PageTable("two", "two", {"a": [1.0, 2.0], "b": [3.0, None]}, ["k", "l"])) == ["a", "b"]
    assert shown_at_first(PageTable("one", "one", {"a": [1.0], "seconds": [2.0]}, ["k"], {
        "a": {"role": "parameter"}, "seconds": {"role": "time"}})) == ["a", "seconds"]  # fmt: skip


@needs_browser
@pytest.mark.parametrize(("parameters", "outcomes"), [(20, 20), (20, 1), (2, 9), (2, 0)])
def test_the_page_shows_the_variables_of_the_figure(tmp_path: Path, parameters: int, outcomes: int) -> None:
    table = wide_table(parameters, outcomes)
    path = write_page(tmp_path / "page.html", table)
    with Browser(1000, 700) as page:
        page.open(path.resolve().as_uri())
        assert page.run("Array.from(explorer.state.columns)") == shown_at_first(table)
        assert page.errors == []


@pytest.mark.parametrize(("names", "upright"), [(["on", "off"], False), (["stone", "square", "stern lights"], True)])
def test_long_names_of_categories_do_not_overlap(tmp_path: Path, names: list[str], upright: bool) -> None:
    """Three names were written over each other."""
    pytest.importorskip("matplotlib")
    columns = {"kind": names, "error": list(range(len(names)))}
    text = draw_matrix(tmp_path / "matrix.svg", columns, ["kind", "error"]).read_text()
    assert ("rotate(-90)" in text.split(f"<!-- {names[0]} -->")[1].split("<!--")[0]) is upright


@needs_browser
def test_rows_are_labeled_where_a_column_is_named_label(tmp_path: Path) -> None:
    """The button did nothing."""
    columns = {"label": [1.0, 2.0], "label_2": ["x", "y"], "samples": [16384, 123457]}
    path = write_page(tmp_path / "page.html", PageTable("odd", "labels", columns, ["k", "l"]))
    with Browser(1000, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("explorer.select(Uint8Array.from([0, 1]))")
        page.run("document.getElementById('label-text').value = 'good'; document.getElementById('label').click()")
        assert page.run("document.getElementById('status').textContent") == "1 row labeled in label_3"
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


def test_points_without_a_text_are_gray_and_have_no_place_on_its_axis(tmp_path: Path) -> None:
    """A missing text had a place without a name, and a color of its own."""
    numbers = [0.0, 1.0, 2.0, 3.0]
    columns = {"a": numbers, "b": numbers, "t": ["one", None, "two", ""]}
    drawing = draw_matrix(tmp_path / "texts.svg", columns, ["a", "b", "t"], color="t").read_text("utf-8")
    assert "fill: #b0b0b0" in drawing
    texts = re.findall(r"<!-- (.*?) -->", drawing)
    assert "color: t; gray: no value" in texts
    assert [text for text in texts if text in ("one", "two", "")] == ["one", "two"] * 3  # the third in the legend


def test_long_names_in_figures_lose_their_middle(tmp_path: Path) -> None:
    """Names of variables began outside of the figure, and categories ended without a sign that they were longer."""
    pytest.importorskip("matplotlib")
    long = "brightness_of_the_lamp_beside_the_window_in_the_morning"
    table = {long: [1.0, 2.0], "place": ["under the old oak tree", "under the old ash tree"]}
    texts = drawn(draw_matrix(tmp_path / "matrix.svg", table, [long, "place"]))[1]
    assert {"brightness_o…the_morning", "under th…ak tree", "under th…sh tree"} <= texts and long not in texts


def test_the_empty_text_of_a_parameter_is_a_value_in_figures(tmp_path: Path) -> None:
    """Points without the flag were in no plot, and "name 10" stood before "name 2"."""
    pytest.importorskip("matplotlib")
    table = {"x": [1.0, 2.0, 3.0], "flag": ["", "fast", ""], "name": ["name 10", "name 2", "name 1"]}
    names = ["x", "flag", "name"]
    points, texts = drawn(draw_matrix(tmp_path / "matrix.svg", table, names, color="flag", parameters=["flag"]))
    assert points == 3 * 3 and {"(empty)", "fast"} <= texts
    assert (
        drawn(draw_matrix(tmp_path / "outcome.svg", table, names))[0] == 3 + 1 + 1
    )  # the text of an outcome is missing
    time = draw_error_against_time(tmp_path / "time.svg", table, "x", ["x"], by=["flag"], parameters=["flag"])
    assert "fill: #b0b0b0" not in time.read_text()
    assert plotted(table, "name")[1] == ["name 1", "name 2", "name 10"]


def test_the_colors_of_a_matrix_have_a_legend_with_the_scale_of_the_variable(tmp_path: Path) -> None:
    """There was none, and the colors of a variable on a log scale were linear: nearly all points looked alike."""
    pytest.importorskip("matplotlib")
    table = {"a": [1.0, 2.0, 3.0], "watts": [0.01, 1.0, 100.0], "five": [5.0] * 3}
    path = tmp_path / "matrix.svg"
    drawing = draw_matrix(path, table, ["a", "five"], color="watts", logarithmic=["watts"]).read_text()
    assert "#21918c" in drawing  # the middle of the colors
    assert any("10^{" in text for text in drawn(path)[1])
    assert "#21918c" not in draw_matrix(path, table, ["a", "five"], color="watts").read_text()
    assert {"20", "100"} <= drawn(path)[1]


def test_plots_of_one_variable_have_one_scale_and_without_a_value_none(tmp_path: Path) -> None:
    """The numbers below a column of plots were those of its last plot, which lacks the points without a value."""
    from matplotlib import figure

    shown: list[figure.Figure] = []
    table = {"a": [0.0, 5.0, 10.0], "b": [1.0, 2.0, 3.0], "none": [None] * 3, "part": [None, None, 4.0]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("spectral_core.explore.page.static.save_figure", lambda made, _: shown.append(made))
        draw_matrix(tmp_path / "a.svg", table, ["a", "b", "none", "part"], color="part")
        draw_error_against_time(tmp_path / "b.svg", table, "none", ["b"], by=["a"])  # ended in a traceback
    plots = shown[0].axes
    assert {plot.get_xlim() for plot in plots[0:16:4]} == {(-0.5, 10.5)}
    assert [list(plots[place].get_xticks()) for place in (10, 14)] == [[], []]
    assert not len(plots[8].get_yticks()) and len(plots[4].get_yticks())
    bar = next(each for each in shown[0].axes[15].figure.axes[3].child_axes)
    assert [text.get_text() for text in bar.get_yticklabels()] == ["4"]
