# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages of odd tables: chosen and whole numbers, numbers of any size, odd names, pictures that are too large."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from benchmarks.explore.checks.browser import Browser, find_browser
from spectral_core.explore.page.build import PageTable, page_html, write_page
from spectral_core.explore.sweep.parameters import Parameter, Space
from spectral_core.explore.sweep.region import RegionOfInterest


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_a_region_around_points_fits_numbers_that_are_chosen_or_whole(tmp_path: Path) -> None:
    """Chosen numbers gave a range, and a single whole number one beyond its ends, which the sweep refused."""
    rows = 8
    columns = {"size": [2, 4, 8, 4] * 2, "count": [1, 1, 200, 400] * 2, "far": [-np.inf, 1.0, 2.0, 3.0] * 2,
               "large": [1e20] * rows}  # fmt: skip
    about = {"size": {"role": "parameter", "of": "choice"}, "count": {"role": "parameter", "of": "integer"}}
    keys = ['a "b", c', "=1+1", *(f"k{i}" for i in range(rows - 2))]
    path = write_page(tmp_path / "page.html", PageTable("odd", "odd", columns, keys, about))
    with Browser(900, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("explorer.select(Uint8Array.from([1, 1, 0, 0, 0, 0, 0, 0]))")
        region = page.run("explorer.region()")
        assert region["choices"] == {"size": [2, 4]} and region["ranges"] == {"count": [1, 1]}
        lines = page.run("explorer.csv()").splitlines()
        assert lines[1].startswith('"a ""b"", c",2') and lines[2].startswith("'=1+1,4")
        for name in ("far", "large"):
            places = page.run(f"Array.from(explorer.matrix.positions('{name}'), (x) => Number.isFinite(x) ? x : null)")
            assert [place is None for place in places] == [value == -np.inf for value in columns[name]]
        assert page.errors == []
    space = Space((Parameter("size", kind="choice", choices=(2, 4, 8)), Parameter("count", 1, 1000, kind="integer")))
    assert RegionOfInterest.from_dict(region).checked(space).contains(space, {"size": 4, "count": 1})


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_numbers_of_any_size_are_drawn(tmp_path: Path) -> None:
    """The page hung: a tick beyond 2^53 steps was its own successor."""
    near, wide = [1e16 + 2 * i for i in range(5)], [1e308, -1e308, 0.0, 1e-308, 5e-324]
    columns = {"near": near, "wide": wide, "same": [1e15] * 5, "nothing": [None] * 5}
    path = write_page(tmp_path / "page.html", PageTable("odd", "odd", columns, list("abcde")))
    with Browser(1100, 700) as page:
        page.open(path.resolve().as_uri())
        for name in columns:
            for view in ("matrix", "parallel", "table"):
                page.run(f"explorer.state.columns = ['{name}']; explorer.state.view = '{view}'; explorer.changed()")
        assert page.run("explorer.state.columns") == ["nothing"] and page.errors == []


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_a_saved_region_is_a_part_of_a_sweep_file(tmp_path: Path) -> None:
    """It was JSON, which no sweep file takes, and around one small number on a log scale it began below 0."""
    columns = {"w": [1e-9, 1e-9], "n": [1, 3], "kind": ['a "b"', "\\c\té\x7f"], "v": [1.0, 2.0]}
    about = {
        name: {"role": "parameter", "of": of} for name, of in (("w", "real"), ("n", "integer"), ("kind", "choice"))
    }
    about["w"]["log"] = True  # type: ignore[assignment]
    path = write_page(tmp_path / "page.html", PageTable("one", "one", columns, ["k", "l"], about))
    with Browser(900, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("explorer.select(Uint8Array.from([1, 1]))")
        page.run("globalThis.saved = []; URL.createObjectURL = (blob) => { saved.push(blob); return 'blob:x'; }; 0")
        page.run("HTMLAnchorElement.prototype.click = () => {}; 0")
        page.run("document.getElementById('export-region').click(); 0")
        plain = tomllib.loads(page.run("saved[0].text()"))
        assert page.errors == []
    space = Space((
        Parameter("w", 1e-9, 1.0, scale="log"), Parameter("n", 1, 9, kind="integer"),
        Parameter("kind", kind="choice", choices=(*columns["kind"], "other")),
    ))  # fmt: skip
    region = RegionOfInterest.from_dict(plain["region"]).checked(space)
    assert all(region.contains(space, {name: columns[name][row] for name in space.names}) for row in (0, 1))
    assert not region.contains(space, {"w": 1e-9, "n": 4, "kind": "other"})


def test_a_page_leaves_out_the_thumbnail_of_a_picture_of_too_many_pixels(tmp_path: Path, monkeypatch: object) -> None:
    """Pillow's own limit ended in a traceback."""
    image = pytest.importorskip("PIL.Image")
    from spectral_core.errors import FileFormatError
    from spectral_core.explore.features.picture_files import read_display

    (tmp_path / "image").mkdir()
    image.new("RGB", (40, 30)).save(tmp_path / "image" / "big.png")
    monkeypatch.setattr(image, "MAX_IMAGE_PIXELS", 500)  # type: ignore[attr-defined]
    with pytest.raises(FileFormatError, match=r"big\.png is too large"):
        read_display(tmp_path / "image" / "big.png")
    table = PageTable("big", "big", {"a": [1.0], "FILE": ["image/big.png"]}, ["k"], {}, tmp_path)
    assert "big.png" in page_html(table)


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_large_whole_numbers_keep_their_digits(tmp_path: Path) -> None:
    """Counts above 2^24 had the digits of the nearest 32-bit float, in the card, the legend and the CSV."""
    counts = [16777217, 847730372, 1073741824, 2**53 - 1, 3, None]
    halves = [0.5, 16777217.0, 2.5, 1.5, 4.5, 1.0]
    table = PageTable("t", "whole", {"samples": counts, "mixed": halves, "x": [0.1] * 6}, list("abcdef"))
    with Browser(900, 700) as page:
        page.open(write_page(tmp_path / "page.html", table).resolve().as_uri())
        rows = [line.split(",") for line in page.run("explorer.csv()").splitlines()[1:]]
    assert [row[1] for row in rows] == [*map(str, counts[:-1]), "NaN"]
    assert [float(row[2]) for row in rows] == halves and {row[3] for row in rows} == {"0.1"}


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_numbers_on_an_axis_keep_their_digits(tmp_path: Path) -> None:
    """Three ticks of one axis read 1.0…+9."""
    columns = {"a": [1.0, 2.0, 3.0], "big": [1073741824 + 8000 * i for i in range(3)], "near": [100020, 100070, 100110]}
    with Browser(1000, 800) as page:
        page.open(write_page(tmp_path / "page.html", PageTable("t", "axis", columns, list("abc"))).resolve().as_uri())
        page.run("""globalThis.written = []; const draw = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
          const width = this.measureText(text).width;
          written.push([text, this.textAlign === "right" ? x - width : x]); draw.call(this, text, x, y); };
        explorer.changed(); 0""")
        written = page.run("written")
        assert page.errors == []
    assert {"1.0006e+5", "+10000"} <= {text for text, _ in written}
    assert not any("…" in text for text, _ in written) and all(left >= 0 for _, left in written)


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_keys_work_after_a_variable_was_ticked_and_arrows_go_on_from_the_point_picked_last(tmp_path: Path) -> None:
    """A ticked variable took all keys, the first arrow to the left skipped the last point, one after a click on a row
    of the table went to its start, and a label without a selection became an empty column.
    """
    columns = {"a": [float(i) for i in range(9)], "b": [1.0, 2.0] * 4 + [3.0]}
    with Browser(1000, 700) as page:
        page.open(
            write_page(tmp_path / "page.html", PageTable("t", "keys", columns, list("abcdefghi"))).resolve().as_uri()
        )
        page.key("ArrowLeft")
        assert page.run("explorer.state.compare") == [8]
        page.run("document.querySelector('#variables input').focus(); 0")
        page.key("v")
        assert page.run("explorer.state.view") == "parallel"
        page.run("document.getElementById('label-text').focus(); 0")
        page.key("v")
        assert page.run("explorer.state.view") == "parallel"
        page.run("document.activeElement.blur(); document.getElementById('view-table').click(); 0")
        page.run("document.querySelectorAll('#table .rows .row')[5].click(); 0")
        page.key("ArrowRight")
        assert page.run("explorer.state.compare") == [5, 6]
        page.run("document.getElementById('label').click(); 0")
        assert page.run("[explorer.state.color, document.getElementById('status').textContent]") == [
            "a", "Select points first; the label is written on them."]  # fmt: skip
        assert page.errors == []


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_an_axis_of_a_phone_has_two_ticks_and_its_file_has_texts_that_stay_texts(tmp_path: Path) -> None:
    """The axis of a column from 2000 to 12000 had the tick 5000 alone, and texts such as 3 were numbers in the file."""
    texts = ["3", "1e5", "nan", "'a'", "=1+1", "a,b", "3 m"]
    columns = {"t": np.linspace(2000, 12000, 7).tolist(), "u": np.linspace(99000, 99999, 7).tolist(),
               "w": [float(k) for k in range(7)], "text": texts}  # fmt: skip
    table = PageTable("narrow", "narrow", columns, list("abcdefg"))
    with Browser(390, 800) as page:
        page.open(write_page(tmp_path / "page.html", table).resolve().as_uri())
        page.run("""globalThis.written = []; const draw = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
          written.push([text, ...rest]); draw.call(this, text, ...rest); };""")
        for order in (["w", "u", "t", "text"], ["t", "u", "w", "text"], ["u", "w", "text", "t"]):
            page.run(f"written.length = 0; explorer.state.columns = {order}; explorer.changed(); 0")
            lowest = page.run("Math.max(...written.map(([, , y]) => y))")
            panels = page.run("explorer.matrix.panels.filter((p) => p.row === 3).map((p) => [p.left, p.width])")
            for (left, width), name in zip(panels, order, strict=True):
                below = page.run(f"""written.filter(([, x, y]) => y === {lowest} && x > {left - 5} &&
                    x < {left + width + 5}).map(([text]) => text)""")
                assert name == "text" or len(below) >= 2, (name, below)
        lines = page.run("explorer.csv()").splitlines()
        assert page.errors == []
    assert [line.split(",", 4)[4].removesuffix(",0") for line in lines[1:]] == [
        "'3", "'1e5", "'nan", "''a'", "'=1+1", '"a,b"', "3 m"]  # fmt: skip


def test_a_column_with_an_infinite_value_varies_and_is_quiet() -> None:
    """Beside an infinite first value all others counted as its rounding, and NumPy warned on the terminal."""
    from spectral_core.explore.page.build import shown_at_first

    columns = {"first": [np.inf, 1.0, 2.0], "same": [np.inf] * 3, "a": [0.0, 1.0, 2.0], "wide": [-1e308, 1e308, 0.0]}
    with np.errstate(all="raise"):
        assert shown_at_first(PageTable("odd", "odd", columns, list("abc"))) == ["first", "a", "wide"]


@pytest.mark.skipif(find_browser() is None, reason="no Chromium")
def test_an_infinite_value_has_the_color_of_the_largest(tmp_path: Path) -> None:
    """In the matrix it had that of the least."""
    columns = {"far": [np.inf, 1.0, 2.0, 1.5, 1.5], "a": [0.4, 0.5, 0.6, 0.0, 1.0], "b": [0.4, 0.5, 0.6, 0.0, 1.0]}
    path = write_page(tmp_path / "page.html", PageTable("odd", "odd", columns, list("abcde")))
    with Browser(900, 700) as page:
        page.open(path.resolve().as_uri())
        assert page.run("explorer.state.columns") == ["far", "a", "b"]
        page.run("explorer.state.columns = ['a', 'b']; explorer.state.color = 'far'; explorer.changed()")
        colors = page.run("""(() => {
const m = explorer.matrix, p = m.panels.find((p) => p.row === 1 && p.column === 0), ink = m.canvas.getContext("2d");
const pixel = (at) => {
  const [x, y] = [p.left + at * p.width, p.top + (1 - at) * p.height];
  return ink.getImageData(x * m.ratio, y * m.ratio, 1, 1);
};
return [0, 1, 2].map((row) => Array.from(pixel(m.positions("a")[row]).data).slice(0, 3)); })()""")
        infinite, least, most = np.array(colors, float)
        assert np.abs(infinite - most).max() < 40 and np.abs(infinite - least).max() > 100
