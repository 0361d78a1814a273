# SPDX-License-Identifier: GPL-3.0-or-later
"""The page: linter and type check of its script, a real browser, malicious content, the live server."""

from __future__ import annotations

import http.client
import json
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.explore.checks.browser import Browser, find_browser
from spectral_core.explore.page.build import PageTable, page_html, table_of_store, write_page
from spectral_core.explore.page.bundle import modules, script
from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.page.serve import PageServer
from spectral_core.explore.page.static import draw_matrix
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.sweep import Sweep
from tests.explore.sweep.test_sweep import sweep_file

PANEL = """(() => { const m = explorer.matrix; const p = m.panels.find(p => p.row === 1 && p.column === 0);
const b = m.canvas.getBoundingClientRect(); return [b.left + p.left, b.top + p.top, p.width, p.height]; })()"""
needs_browser = pytest.mark.skipif(find_browser() is None, reason="no Chromium")
SCRIPT = Path(__file__).parents[3] / "spectral_core" / "explore" / "page" / "script"


def until(holds: Callable[[], bool]) -> None:
    """Wait until a condition holds, at most 20 s."""
    end = time.monotonic() + 20
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def small_table(rows: int = 60, **more: list[object]) -> PageTable:
    rng = np.random.default_rng(2)
    columns: dict[str, object] = {name: rng.random(rows).tolist() for name in ("a", "b", "c")}
    about = {"a": {"role": "parameter"}, "b": {"role": "parameter"}}
    return PageTable("small", "small-table", {**columns, **more}, [f"k{i}" for i in range(rows)], about)  # type: ignore[dict-item]


def test_the_script_is_one_function_without_imports() -> None:
    text = script()
    assert "import {" not in text and "\nexport " not in text
    assert all(f"class {name}" in text for name in ("Matrix", "Parallel", "List", "Compare", "Explorer"))
    assert all(len(module.splitlines()) < 450 for module in modules().values())


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("npm") is None, reason="no npm")
def test_the_script_modules_are_linted_and_type_checked(tmp_path: Path) -> None:
    for path in [*SCRIPT.glob("*.js"), SCRIPT / "eslint.config.mjs"]:
        shutil.copy(path, tmp_path)
    wanted = ["eslint@9", "typescript@5"]
    quick = ["--silent", "--no-audit", "--no-fund", "--no-package-lock", "--prefer-offline"]
    installed = subprocess.run(["npm", "install", *quick, *wanted], cwd=tmp_path, check=False)
    if installed.returncode:
        pytest.skip("npm cannot install eslint and typescript here")
    files = [path.name for path in tmp_path.glob("*.js")]
    lint = subprocess.run(
        ["node_modules/.bin/eslint", *files], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert lint.returncode == 0, lint.stdout
    options = ["--noEmit", "--allowJs", "--checkJs", "--strict", "--target", "es2022", "--module", "es2022",
               "--moduleResolution", "bundler", "--lib", "es2023,dom,dom.iterable"]  # fmt: skip
    types = subprocess.run(
        ["node_modules/.bin/tsc", *options, *files], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert types.returncode == 0, types.stdout


def test_malicious_texts_stay_texts() -> None:
    evil = ["</script><script>alert(1)</script>", "<img src=x onerror=alert(1)>", "=1+1", "\u2028", "'\"&"]
    page = page_html(small_table(5, note=list(evil)))
    payload = page.split('id="payload">')[1].split("</script>")[0]
    assert json.loads(payload)["columns"][3]["texts"] == evil
    assert "<img src=x" not in page and "</script><script>alert" not in page
    assert page.count("<script") == 2


@needs_browser
def test_the_views_are_linked_in_a_browser(tmp_path: Path) -> None:
    evil = ["<b id=evil>x</b>"] * 60
    table = small_table(60, note=list(evil))
    path = write_page(tmp_path / "page.html", table)
    with Browser(1100, 800) as page:
        page.open(path.resolve().as_uri())
        panel = page.run(PANEL)
        x, y, w, h = panel
        page.drag([(x + 1, y + 1), (x + w / 2, y + 1), (x + w / 2, y + h - 1), (x + 1, y + h - 1)])
        selected = page.run("Array.from(explorer.state.selection)")
        a = np.array(table.columns["a"], float)
        span = a.max() - a.min()
        low = 0.03 + 0.94 * (a - a.min()) / span < 0.5
        assert np.mean(np.array(selected, bool) == low) > 0.96  # a pixel may lie on an edge
        page.key("4")  # difference
        page.drag([(x + 1, y + h / 2), (x + w - 1, y + h / 2), (x + w - 1, y + h - 1), (x + 1, y + h - 1)])
        fewer = page.run("explorer.state.selection.reduce((a, b) => a + b, 0)")
        assert 0 < fewer < sum(selected)
        for view in ("parallel", "table"):
            page.run(f"document.getElementById('view-{view}').click()")
            assert page.run(f"!document.getElementById('{view}').hidden")
        assert page.run("document.getElementById('evil')") is None
        assert page.run("document.querySelectorAll('#table .rows .row').length") == fewer
        region = page.run("explorer.region()")
        chosen = np.array(page.run("Array.from(explorer.state.selection)"), bool)
        assert region["ranges"]["a"] == pytest.approx([a[chosen].min(), a[chosen].max()], rel=1e-6)
        page.key("Escape")
        assert page.run("explorer.state.selected") is False
        assert page.errors == [] and all(address.startswith(("file:", "blob:", "data:")) for address in page.requests)


@needs_browser
def test_the_matrix_fits_whether_the_header_has_one_line_or_two(tmp_path: Path) -> None:
    path = write_page(tmp_path / "page.html", small_table(60, **{name: list(range(60)) for name in "defgh"}))
    with Browser(1000, 800) as page:
        for width in range(800, 1500, 100):
            size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": False}
            page.call("Emulation.setDeviceMetricsOverride", size)
            page.open(path.resolve().as_uri())
            room = "(({scrollHeight, clientHeight}) => [scrollHeight, clientHeight])(document.getElementById('matrix'))"
            needed, given = page.run(room)
            assert needed <= given, width


@needs_browser
@pytest.mark.parametrize("columns", ["", "d", "defgh"])
def test_the_matrix_needs_no_scrolling_and_leaves_no_empty_area(tmp_path: Path, columns: str) -> None:
    path = write_page(tmp_path / "page.html", small_table(60, **{name: list(range(60)) for name in columns}))
    with Browser(1000, 800) as page:
        # widths one after another, as a column of panels has a whole number of pixels: one for each rest and more
        for width in (390, 412, 759, *range(1100, 1104 + len(columns))):
            size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
            page.call("Emulation.setDeviceMetricsOverride", size)
            page.open(path.resolve().as_uri())
            across, given, below = page.run("""(() => { const host = document.getElementById('matrix');
const below = document.getElementById('detail').getBoundingClientRect().top - host.getBoundingClientRect().top;
return [host.scrollWidth, host.clientWidth, below - explorer.matrix.height]; })()""")
            assert across <= given, width
            assert width > 760 or below <= 10, width  # 8 of them are the margin


@needs_browser
def test_outcomes_that_do_not_vary_are_not_shown_at_first(tmp_path: Path) -> None:
    path = write_page(
        tmp_path / "page.html",
        small_table(60, d=[1.0] * 60, status=["solved"] * 60, e=[1.0, 2.0] * 30, f=[1e-15, 0.0] * 30),
    )
    with Browser(1000, 800) as page:
        page.open(path.resolve().as_uri())
        assert page.run("explorer.state.columns") == ["a", "b", "c", "e"]


@needs_browser
def test_a_finger_selects_on_a_narrow_screen(tmp_path: Path) -> None:
    path = write_page(tmp_path / "page.html", small_table())
    with Browser(420, 800, dark=True) as page:
        page.call("Emulation.setTouchEmulationEnabled", {"enabled": True})
        page.open(path.resolve().as_uri())
        x, y, w, h = page.run(PANEL)
        page.touch([(x + 2, y + 2), (x + w - 2, y + 2), (x + w - 2, y + h - 2), (x + 2, y + h - 2)])
        assert page.run("explorer.state.selection.reduce((a, b) => a + b, 0)") > 40
        assert page.run("document.documentElement.scrollWidth") <= 420


def test_a_static_figure_is_drawn(tmp_path: Path) -> None:
    table = small_table()
    for ending in (".png", ".svg"):
        path = draw_matrix(tmp_path / f"matrix{ending}", dict(table.columns), ["a", "b", "c"], color="c")
        assert path.stat().st_size > 5000


@pytest.fixture
def server(tmp_path: Path) -> Iterator[PageServer]:
    document = read_sweep(sweep_file(tmp_path, "picture", budget=8))
    sweep = Sweep(document, tmp_path / "out")
    with ThreadPoolExecutor(1) as threads:
        sweep.run(sweep.plan(), executor=threads)
    applied: list[object] = []
    live = LiveSweep(sweep.store, tmp_path, apply=applied.append)
    live.applied = applied  # type: ignore[attr-defined]
    with PageServer(live) as running:
        threading.Thread(target=running.serve_forever, daemon=True).start()
        yield running
        running.shutdown()
    sweep.store.close()


def ask(server: PageServer, method: str, path: str, body: object = None, **headers: str) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    sent = {"X-Explore-Token": server.token, **{name.replace("_", "-"): value for name, value in headers.items()}}
    connection.request(method, path, None if body is None else json.dumps(body), sent)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content


def test_live_actions_sample_derive_label_and_apply(server: PageServer) -> None:
    region = {"ranges": {"a": [0.2, 0.4]}}
    status, said = ask(server, "POST", "/api/sample", {"region": region, "budget": 5})
    assert status == 200 and json.loads(said)["new"] == 5
    assert ask(server, "POST", "/api/derive", {"name": "twice", "expression": "2 * mean"})[0] == 200
    key = server.live.store.ledger.rows("done")[0].key
    assert ask(server, "POST", "/api/label", {"name": "kind", "values": {key: "=good"}})[0] == 200
    assert ask(server, "POST", "/api/apply", {"key": key})[0] == 200
    assert server.live.applied == [server.live.store.ledger.rows("done")[0].parameters]  # type: ignore[attr-defined]
    table = (server.live.store.folder / "data.csv").read_text()
    assert "twice" in table and "'=good" in table
    status, page = ask(server, "POST", "/page", {})
    assert status == 200 and b'"twice"' in page


def test_a_served_page_keeps_what_other_processes_write_into_the_project(server: PageServer) -> None:
    """The server wrote the project as it was at its start: later columns and points of a run were lost."""
    with Store.open(server.live.store.folder) as other:
        other.derive("other", "3 * mean")
        other.project.design = replace(other.project.design, budget=16)
        other.save_project()
    assert b'"other"' in ask(server, "POST", "/page", {})[1]
    assert ask(server, "POST", "/api/derive", {"name": "mine", "expression": "2 * other"})[0] == 200
    assert json.loads(ask(server, "POST", "/api/refine", {})[1])["new"] == 24
    with Store.open(server.live.store.folder) as other:
        assert set(other.project.expressions) == {"other", "mine"} and other.project.design.budget == 32


@pytest.mark.parametrize(
    ("method", "path", "headers"),
    [
        ("POST", "/page", {"X_Explore_Token": "wrong"}),
        ("POST", "/api/derive", {"X_Explore_Token": ""}),
        ("POST", "/api/label", {"Origin": "https://example.com"}),
        ("POST", "/api/label", {"Origin": "null"}),
        ("POST", "/api/status", {"Sec_Fetch_Site": "cross-site"}),
        ("POST", "/api/status", {"Host": "example.com"}),
        ("GET", "/", {"Host": "rebound.example:80"}),
        ("GET", "/image/../project.json", {}),
        ("GET", "/image/%2e%2e/ledger.sqlite", {}),
        ("GET", "/image/..%2f..%2f..%2fetc%2fpasswd", {}),
        ("GET", "/project.json", {}),
        ("POST", "/api/__init__", {}),
        ("POST", "/api/store", {}),
    ],
)
def test_requests_of_other_pages_are_refused(
    server: PageServer, method: str, path: str, headers: dict[str, str]
) -> None:
    status, said = ask(server, method, path, {} if method == "POST" else None, **headers)
    assert status in (403, 404) and "error" in json.loads(said)


def test_the_first_page_has_no_data_and_pictures_are_sent(server: PageServer) -> None:
    status, gate = ask(server, "GET", "/")
    assert status == 200 and len(gate) < 1000 and server.token.encode() not in gate
    name = server.live.store.ledger.rows("done")[0].files["FILE"]
    status, picture = ask(server, "GET", f"/{name}")
    assert status == 200 and picture.startswith(b"\x89PNG")


def test_pictures_need_the_token_or_the_cookie_that_came_with_the_data(server: PageServer) -> None:
    name = server.live.store.ledger.rows("done")[0].files["FILE"]
    cookie = f"{server.cookie_name}={server.picture_secret}"
    for given, expected in ((cookie, 200), ("", 403), (cookie[:-1], 403), (f"{server.cookie_name}=", 403), ("é", 403)):
        assert ask(server, "GET", f"/{name}", None, X_Explore_Token="", Cookie=given)[0] == expected
    assert ask(server, "POST", "/api/status", {}, X_Explore_Token="", Cookie=cookie)[0] == 403


@needs_browser
def test_the_served_page_opens_with_its_token_alone(server: PageServer) -> None:
    with Browser() as page:
        page.open(server.address)
        until(lambda: page.run("Boolean(window.explorer)"))
        assert page.run("explorer.table.live") is True
        page.run("explorer.state.selection.fill(1); explorer.state.selected = true; explorer.label('all'); 0")
        until(lambda: "labeled" in page.run("document.getElementById('status').textContent"))
        assert set(server.live.store.ledger.manual()["label"].values()) == {"all"}
        page.open(f"http://127.0.0.1:{server.server_port}/?again#token=wrong")
        until(lambda: "token" in page.run("document.body.textContent"))
        assert page.run("Boolean(window.explorer)") is False


def test_the_table_of_a_sweep_has_units_and_groups(server: PageServer) -> None:
    table = table_of_store(server.live.store)
    assert table.about["a"]["role"] == "parameter" and table.about["seconds"]["unit"] == "s"
