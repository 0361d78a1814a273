# SPDX-License-Identifier: GPL-3.0-or-later
"""Details of the page: colors of texts and their legend, saved states, names of pictures, values without pictures."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.explore.checks.browser import Browser, find_browser
from spectral_core.explore.page.build import PageTable, table_of_folder, write_page

pytestmark = pytest.mark.skipif(find_browser() is None, reason="no Chromium")
DICHROMATS = {
    "protanope": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    "deuteranope": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
}
"""Linear sRGB as people see it who lack a type of cone (Viénot, Brettel and Mollon 1999)."""


def page_of(folder: Path, **columns: list[object]) -> str:
    count = len(next(iter(columns.values())))
    table = PageTable("table", folder.name, columns, [f"k{i}" for i in range(count)])
    return write_page(folder / "page.html", table).resolve().as_uri()


def test_colors_of_texts_differ_for_people_who_lack_a_type_of_cone(tmp_path: Path) -> None:
    """The third and the fifth color were ΔE2000 1 apart to them."""
    import colour

    names = [f"lamp {i}" for i in range(13)]
    with Browser(1400, 900) as page:
        page.open(page_of(tmp_path, lamp=[*names, ""], v=list(range(14))))
        page.run("explorer.state.color = 'lamp'; explorer.changed()")
        said = page.run("document.getElementById('legend').innerText").split("\n")
        assert [each.strip() for each in said[10:]] == ["and 3 more in the same colors", "no value"]
        dots = "[...document.querySelectorAll('#legend .item')].map((e) => e.style.getPropertyValue('--color'))"
        drawn = page.run(dots)
    colors = np.array([[int(part) for part in each[4:-1].split()] for each in drawn]) / 255
    assert len(colors) == 11 and (colors[10] == 128 / 255).all()
    linear = colour.models.eotf_sRGB(colors)
    for name, matrix in {"all cones": np.eye(3), **DICHROMATS}.items():
        seen = colour.XYZ_to_Lab(colour.RGB_to_XYZ(linear @ np.transpose(matrix), "sRGB"))
        apart = {pair: colour.delta_E(*seen[list(pair)], method="CIE 2000") for pair in combinations(range(11), 2)}
        assert min(apart.values()) > 7, (name, min(apart, key=apart.__getitem__))


def test_a_saved_state_comes_back_whole(tmp_path: Path) -> None:
    """What was selected before stayed selected, the order of the table was lost, and a state of another table made
    every point gray.
    """
    with Browser(1200, 800) as page:
        page.open(page_of(tmp_path, a=[1.0, 2.0, 3.0, 4.0], b=[4.0, 3.0, 2.0, 1.0]))
        page.run("""globalThis.opened = async (plain) => {
          const holder = new DataTransfer();
          holder.items.add(new File([JSON.stringify(plain)], "state.json"));
          const input = document.getElementById("open-state");
          input.files = holder.files;
          input.dispatchEvent(new Event("change"));
          await new Promise((resolve) => setTimeout(resolve, 200));
          return [[...explorer.state.selection], explorer.state.selected, explorer.state.sort,
            document.getElementById("status").textContent];
        }; 0""")
        page.run("explorer.select(Uint8Array.from([0, 0, 1, 1]))")
        state = {"selection": ["k0"], "sort": {"column": "b", "down": True}}
        assert page.run(f"opened({json.dumps(state)})") == [[1, 0, 0, 0], True, {"column": "b", "down": True}, ""]
        other = {"selection": ["x", "y"], "columns": ["a", "other"]}
        found = page.run(f"opened({json.dumps(other)})")
        assert found[:2] == [[0, 0, 0, 0], False]
        assert found[3] == "not in this table: the column other, 2 of 2 selected rows"
        assert page.errors == []


def test_pictures_have_any_name_and_points_without_one_show_their_values(tmp_path: Path) -> None:
    """A click on a picture whose name has a space showed nothing, as one on a point of a table without pictures."""
    folder = tmp_path / "odd.cdb"
    (folder / "image" / "my set").mkdir(parents=True)
    names = ["image/my set/one two.png", "image/my set/50% é#1?.png", "../image/out.png", ""]
    for name in names[:2]:
        Image.new("RGB", (20, 10), (200, 90, 40)).save(folder / name)
    (tmp_path / "image").mkdir()
    Image.new("RGB", (20, 10)).save(tmp_path / "image" / "out.png")
    (folder / "data.csv").write_text("a,FILE\n" + "".join(f"{i},{name}\n" for i, name in enumerate(names[:2])), "utf-8")
    path = write_page(folder / "page.html", table_of_folder(folder))
    shown = "[...document.querySelectorAll('#compare img')].map((image) => image.naturalWidth)"
    with Browser(1000, 700) as page:
        page.open(path.resolve().as_uri())
        for row in range(2):
            page.run(f"explorer.state.compare = []; explorer.pick({row}); new Promise((r) => setTimeout(r, 300))")
            assert page.run(shown) == [20]
        page.run(f"explorer.table.files.set('FILE', {json.dumps([names[2], names[3]])})")
        for row in range(2):
            page.run(f"explorer.state.compare = []; explorer.pick({row})")
            text = page.run("document.getElementById('compare').innerText")
            assert page.run(shown) == [] and "no picture" in text and f"a\t{row}" in text
        assert page.errors == []


def test_long_names_do_not_widen_the_page_of_a_phone(tmp_path: Path) -> None:
    long = "brightness of the lamp beside the window in the morning"
    with Browser(390, 800) as page:
        page.open(page_of(tmp_path, **{long: ["long text " * 15, "b"], "v": [1.0, 2.0]}))
        page.run(f"explorer.state.color = '{long}'; explorer.changed()")
        assert page.run("[document.documentElement.scrollWidth, innerWidth]") == [390, 390]
        assert page.errors == []


@pytest.mark.parametrize("dark", [False, True])
def test_the_page_on_paper_is_light_and_complete(tmp_path: Path, dark: bool) -> None:
    """A printed page was as dark as the screen, its buttons were on it, and its table ended after 30 rows."""
    names = [f"a_rather_long_name_{k}" for k in range(12)]
    values = {name: [float(k * row) for row in range(200)] for k, name in enumerate(names)}
    sizes = "[...document.querySelectorAll('canvas, .row')].map((e) => e.getBoundingClientRect().right)"
    shown = "[...document.querySelectorAll('button')].filter((e) => e.offsetWidth && !e.closest('.row')).length"
    with Browser(1400, 900, dark=dark) as page:
        page.open(page_of(tmp_path, **values))
        for view in ("matrix", "parallel", "table"):
            page.run(f"document.getElementById('view-{view}').click(); dispatchEvent(new Event('beforeprint'))")
            page.call("Emulation.setEmulatedMedia", {"media": "print"})
            page.call("Emulation.setDeviceMetricsOverride",
                      {"width": 720, "height": 1000, "deviceScaleFactor": 1, "mobile": False})  # fmt: skip
            assert page.run("getComputedStyle(document.documentElement).getPropertyValue('--ink')") == "#1c1e21"
            assert page.run(shown) == 0 and max(page.run(sizes)) <= 720
            if view == "table":
                assert page.run("document.querySelectorAll('.rows .row').length") == 200
            else:  # drawn at twice the resolution of the screen
                assert page.run(f"document.querySelector('#{view} canvas').width") > 1300
            page.call("Emulation.setEmulatedMedia", {"media": ""})
            page.call("Emulation.setDeviceMetricsOverride",
                      {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False})  # fmt: skip
            page.run("dispatchEvent(new Event('afterprint'))")
        assert page.run("document.querySelectorAll('.rows .row').length") < 60
        assert page.errors == []


def test_numbers_of_a_wide_table_stay_whole_on_paper(tmp_path: Path) -> None:
    """Of thirty columns each number was broken into four lines, and its digits stood beside those of the next."""
    values = {f"column_{k}": [1.2345 * 10.0 ** (k - 15), -2.5 * 10.0 ** (k - 15)] for k in range(30)}
    lines = """[...document.querySelectorAll('.rows .row span')].map((cell) => {
        const range = document.createRange();
        range.selectNodeContents(cell);
        return range.getClientRects().length; })"""
    lefts = "[...document.querySelectorAll('{} > *')].map((cell) => Math.round(cell.getBoundingClientRect().left))"
    with Browser(720, 1000) as page:
        page.open(page_of(tmp_path, **values))
        page.run("document.getElementById('view-table').click(); dispatchEvent(new Event('beforeprint'))")
        page.call("Emulation.setEmulatedMedia", {"media": "print"})
        assert set(page.run(lines)) == {1}
        names = page.run(lefts.format(".row.head"))
        assert len(names) == 30 and page.run(lefts.format(".rows .row:first-child")) == names
        assert page.errors == []


def test_keys_reach_thumbnails_files_and_rows(tmp_path: Path) -> None:
    """A thumbnail took the focus and heard no key, *Open state* took none, and arrows marked no row of the table."""
    folder = tmp_path / "keys.cdb"
    (folder / "image").mkdir(parents=True)
    for row in range(80):
        Image.new("RGB", (20, 10), (row, 90, 40)).save(folder / "image" / f"{row}.png")
    (folder / "data.csv").write_text("a,FILE\n" + "".join(f"{-i},image/{i}.png\n" for i in range(80)), "utf-8")
    path = write_page(folder / "page.html", table_of_folder(folder))
    with Browser(1200, 700) as page:
        page.open(path.resolve().as_uri())
        page.run("explorer.select(new Uint8Array(80).fill(1)); document.querySelectorAll('.thumbnail')[2].focus()")
        page.key("Enter")
        assert page.run("explorer.state.compare") == [2]
        page.run("document.getElementById('open-state').focus()")
        assert page.run("document.activeElement.id") == "open-state"
        page.run("document.activeElement.blur(); document.getElementById('view-table').click()")
        page.run("explorer.state.sort = {column: 'a', down: false}; explorer.changed()")
        for _ in range(60):  # from -2, the point picked last, over the end to -79
            page.key("ArrowRight")
        assert page.run("[...document.querySelectorAll('.row.picked span')].map((e) => e.textContent)") == [
            "-23",
            "-22",
        ]
        assert page.errors == []


def test_axes_of_whole_numbers_have_no_halves(tmp_path: Path) -> None:
    columns: dict[str, list[object]] = {"n": [1, 2, 3, 2], "v": [1.0, 2.0, 3.0, 2.5]}
    for kind, expected in (("integer", False), ("real", True)):
        about = {"n": {"role": "parameter", "of": kind}, "v": {"role": "parameter", "of": kind}}
        table = PageTable("table", f"whole-{kind}", columns, list("abcd"), about)
        with Browser(1200, 800) as page:
            page.open(write_page(tmp_path / f"{kind}.html", table).resolve().as_uri())
            page.run("""globalThis.written = []; const draw = CanvasRenderingContext2D.prototype.fillText;
            CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
              written.push(text); draw.call(this, text, ...rest); };
            explorer.changed(); explorer.state.view = "parallel"; explorer.changed(); 0""")
            texts = page.run("written")
            assert {"1", "2", "3"} <= set(texts) and ("1.5" in texts) == expected
            assert page.errors == []


def test_ticks_tell_the_values_at_their_places(tmp_path: Path) -> None:
    """0.00015 was written as 2e-4, and 999999.998 as 1e+6 with the next ticks counted from there."""
    ranges = [(0.0, 3e-4), (1e-5, 1.3e-3), (0.0, 1.2e6), (1e5, 9e5), (4.965e-10, 5.035e-10),
              (1e6 - 0.003, 1e6 + 0.003), (123456.781, 123456.789), (1e16, 1e16 + 20), (0.3, 0.3 + 1e-12),
              (0.0, 1.0)]  # fmt: skip
    columns: dict[str, list[object]] = {
        f"v{n}": [low, high, 0.5 * (low + high)] for n, (low, high) in enumerate(ranges)
    }
    with Browser(900, 800) as page:
        page.open(page_of(tmp_path, **columns))
        page.run("""globalThis.written = []; const draw = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
          written.push([text, y]); draw.call(this, text, x, y); }; explorer.state.view = "parallel"; 0""")
        for name, (low, high) in zip(columns, ranges, strict=True):
            page.run(f"written.length = 0; explorer.state.columns = ['{name}']; explorer.changed(); 0")
            bottom, top = page.run("[explorer.parallel.axisY(0), explorer.parallel.axisY(1)]")
            written = [(text, (y - 4 - bottom) / (top - bottom)) for text, y in page.run("written") if text != name]
            at = [low + (place - 0.03) / 0.94 * (high - low) for _, place in written]  # the axis has margins of 3 %
            base = next((float(text) for text, _ in written if text[0] not in "+-"), 0.0)
            is_relative = any(text[0] in "+-" for text, _ in written)
            told = [base + float(text) if is_relative and text[0] in "+-" else float(text) for text, _ in written]
            assert len(written) >= 2, name
            assert np.allclose(told, at, rtol=0, atol=1e-3 * (high - low) + 4e-16 * abs(high)), name


def test_values_of_a_narrow_column_are_told_apart(tmp_path: Path) -> None:
    columns = {"v": [1e6 + 0.0013, 1e6 - 0.0021, 1e6], "w": [1.5e-7, 2.5e5, 0.5]}
    with Browser(900, 800) as page:
        page.open(write_page(tmp_path / "page.html", PageTable("t", "t", columns, list("abc"))).resolve().as_uri())
        page.run("explorer.state.view = 'table'; explorer.changed(); 0")
        cells = page.run("Array.from(document.querySelectorAll('#table .row span'), (cell) => cell.textContent)")
    assert np.allclose([float(cell) - 1e6 for cell in cells[0::2]], [0.0013, -0.0021, 0.0], atol=1e-5)
    assert [float(cell) for cell in cells[1::2]] == columns["w"]


def test_menus_and_second_fingers_select_nothing(tmp_path: Path) -> None:
    """A drag with the right button selected points, and of a box the second finger took the corner."""
    with Browser(1000, 700) as page:
        page.open(page_of(tmp_path, a=[0.0, 1.0, 2.0, 3.0], b=[0.0, 1.0, 2.0, 3.0]))
        page.run("explorer.state.tool = 'box'; 0")
        left, top, width, height = page.run("""(() => { const m = explorer.matrix;
          const p = m.panels.find((p) => p.row === 1 && p.column === 0), b = m.canvas.getBoundingClientRect();
          return [b.left + p.left, b.top + p.top, p.width, p.height]; })()""")

        def at(across: float, down: float) -> dict[str, float]:
            return {"x": left + across * width, "y": top + down * height}

        def mouse(kind: str, place: dict[str, float], button: str) -> None:
            page.call("Input.dispatchMouseEvent", {"type": kind, **place, "button": button, "clickCount": 1})

        for view in ("matrix", "parallel"):
            page.run(f"explorer.state.view = '{view}'; explorer.changed()")
            mouse("mousePressed", at(0.02, 0.05), "right")
            mouse("mouseMoved", at(0.02, 0.95), "right")
            mouse("mouseReleased", at(0.02, 0.95), "right")
            assert page.run("explorer.state.selected") is False
        page.run("explorer.state.view = 'matrix'; explorer.changed()")
        first = [at(0.01, 0.99), at(0.2, 0.8), at(0.5, 0.5)]

        def touch(kind: str, *places: dict[str, float]) -> None:
            points = [{**place, "id": number} for number, place in enumerate(places)]
            page.call("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", first[0])
        touch("touchMove", first[1])
        touch("touchStart", first[1], at(0.9, 0.1))
        touch("touchMove", first[2])
        touch("touchEnd")
        assert page.run("[...explorer.state.selection]") == [1, 1, 0, 0]
        assert page.errors == []
