# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile expressions, cells, property paths, file names and requests to sweeps: how many are refused or escaped.

Python's audit events show if an expression opened, imported or executed anything. The page is read by Python's
HTML parser and, where there is a Chromium, by that; data.csv by a parser that shares no code with the writer.
"""

from __future__ import annotations

import html.parser
import json
import sys
import tempfile
import tracemalloc
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks import Options
from benchmarks.explore.cases import hostile_inputs as hostile
from benchmarks.explore.cases.hostile_requests import measure_requests
from benchmarks.explore.checks.browser import Browser, find_browser
from benchmarks.explore.checks.cinema import kind_of, parse, problems
from spectral_core.errors import SpectralError
from spectral_core.explore.features.expression import evaluate
from spectral_core.explore.page.build import PageTable, page_html, write_page
from spectral_core.explore.sweep.cinema import csv_text, read_csv
from spectral_core.explore.sweep.compute.paths import set_path
from spectral_core.explore.sweep.constraints import parse_constraint
from spectral_core.explore.sweep.files import inside, require_file_name
from spectral_core.explore.sweep.parameters import Parameter, Space

WATCHED = ("open", "import", "exec", "os.", "subprocess.", "socket.", "ctypes.", "shutil.", "tempfile.")
MOST_BYTES = 20_000_000
ROWS = 1000
_seen: list[str] = []
_watching = [False]


def _audit(event: str, _arguments: tuple[Any, ...]) -> None:
    if _watching[0] and event.startswith(WATCHED):
        _seen.append(event)


def run(options: Options) -> dict[str, Any]:
    """Try all types of input, count the outcomes, and list inputs that were neither refused nor harmless."""
    count = 300 if options.quick else 20_000
    figures: dict[str, Any] = {
        "expressions": _expressions(count),
        "constraints": _constraints(count // 4),
        "cells": _cells(count // 20, options.out),
        "property_paths": _property_paths(count // 10),
        "data_paths": _data_paths(count // 20),
        "file_names": _file_names(),
        "requests": measure_requests(count // 20),
    }
    lines = {
        "expressions": "expressions are refused or give a column, without side effects",
        "constraints": "constraints are refused or linear, without side effects",
        "cells": "cells are never formulas or HTML",
        "property_paths": "errors name property paths that do not exist",
        "data_paths": "errors name data paths of a .blend that do not exist",
        "file_names": "file names do not lead out of the folder",
        "requests": "requests without the token, from another origin or without meaning are refused",
    }
    figures["holds"] = {line: not figures[name]["wrong"] for name, line in lines.items() if figures[name]}
    for name in lines:
        print(f"{name:16} {figures[name]}")
    return figures


def _tried(work: Any, text: str, tally: Counter[str], wrong: list[str]) -> Any:
    """Result of a call, None if it was refused with a message; anything else is recorded as wrong."""
    _seen.clear()
    tracemalloc.reset_peak()
    before = tracemalloc.get_traced_memory()[0]
    _watching[0] = True
    try:
        result = work(text)
    except SpectralError as error:
        result = None
        tally["refused"] += 1
        if len(str(error)) < 10:
            wrong.append(f"{text[:60]!r}: says only {str(error)!r}")
    except BaseException as error:
        _watching[0] = False
        wrong.append(f"{text[:60]!r}: {type(error).__name__}: {str(error)[:100]}")
        return None
    finally:
        _watching[0] = False
    used = tracemalloc.get_traced_memory()[1] - before
    if _seen or used > MOST_BYTES:
        wrong.append(f"{text[:60]!r}: {_seen[:3]}, {used / 1e6:.0f} MB")
    tally["most_mb"] = max(tally["most_mb"], -(-used // 1_000_000))
    return result


def _expressions(count: int) -> dict[str, Any]:
    columns: dict[str, list[Any]] = {
        "a": [k / ROWS for k in range(ROWS)], "b": [None, *range(1, ROWS)], "name": ["x", "=y"] * (ROWS // 2),
    }  # fmt: skip
    tally, wrong = Counter[str](), list[str]()
    sys.addaudithook(_audit)
    for text in (
        "where(a > 0, sqrt(a), mean(b))",
        "ａ",
    ):  # modules that NumPy and Python load at their first use are harmless
        evaluate(text, columns)
    tracemalloc.start()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        canary = Path(folder) / "canary"
        for text in hostile.expressions(count):
            text = text.replace("CANARY", str(canary))
            tally["tried"] += 1
            result = _tried(lambda given: evaluate(given, columns), text, tally, wrong)
            if result is not None:
                tally["harmless"] += 1
                if len(result) != ROWS or not all(v is None or isinstance(v, float | str) for v in result):
                    wrong.append(f"{text[:60]!r}: gives {str(result)[:60]}")
        if canary.exists():
            wrong.append("a file was written")
    tracemalloc.stop()
    return {**tally, "wrong": wrong[:10]}


def _constraints(count: int) -> dict[str, Any]:
    space = Space(
        (Parameter("a"), Parameter("b", 1, 9, scale="log"), Parameter("name", choices=("x", "y"), kind="choice"))
    )
    tally, wrong = Counter[str](), list[str]()
    tracemalloc.start()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for text in hostile.expressions(count, seed=9):
            for whole in (text, f"{text} <= 1", f"a <= {text}"):
                tally["tried"] += 1
                made = _tried(
                    lambda given: [one.row(space) for one in parse_constraint(given, space)], whole, tally, wrong
                )
                tally["linear"] += made is not None
    tracemalloc.stop()
    return {**tally, "wrong": wrong[:10]}


class _Elements(html.parser.HTMLParser):
    """Elements and their attributes."""

    def __init__(self) -> None:
        super().__init__()
        self.found: Counter[str] = Counter()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found[tag] += 1
        self.found.update(f"@{name}" for name, _ in attributes if name.startswith("on"))


def _cells(count: int, out: Path) -> dict[str, Any]:
    given = hostile.texts(count)
    wrong: list[str] = []
    folder = out / "cells.cdb"
    folder.mkdir(exist_ok=True)
    rows = [{"x": float(k), "note": text} for k, text in enumerate(given)]
    (folder / "data.csv").write_text(csv_text(["x", "note"], rows), encoding="utf-8", newline="")
    wrong += problems(folder)
    cells = [row[1] or "" for row in parse((folder / "data.csv").read_bytes().decode())[1:]]
    wrong += [
        f"a formula: {cell[:60]!r}" for cell in cells if cell[:1] in tuple("=+-@\t\r\n") and kind_of(cell) == "string"
    ]
    back = [str(row["note"] or "") for row in read_csv(folder / "data.csv")[1]]
    wrong += [
        f"read back as {b[:40]!r}: {a[:40]!r}" for a, b in zip(given, back, strict=True) if a.replace("\0", "") != b
    ]
    keys = [f"k{number}" for number in range(len(given))]
    values = {"x": [row["x"] for row in rows], "note": given}
    clean = _elements(page_html(PageTable("t", "t", {**values, "note": ["plain"] * len(given)}, keys)))
    table = PageTable(given[11], "hostile", values, keys)
    page = page_html(table)
    if _elements(page) != clean:
        wrong.append(f"the page gained elements: {_elements(page) - clean}")
    payload = json.loads(page.split('id="payload">')[1].split("</script>")[0])
    if payload["columns"][1]["texts"] != [text[:200] for text in given]:
        wrong.append("the page's texts differ")
    checked = ["csv", "html parser"]
    if find_browser() is not None:
        checked.append("Chromium")
        wrong += _in_browser(write_page(out / "cells.html", table))
    return {
        "tried": len(given),
        "escaped_in_csv": sum(cell.startswith("'") for cell in cells),
        "checked_by": checked,
        "wrong": wrong[:10],
    }


def _elements(page: str) -> Counter[str]:
    reader = _Elements()
    reader.feed(page)
    return reader.found


def _in_browser(path: Path) -> list[str]:
    """True if any text became an element or was executed in any view; and the text of the page's CSV export."""
    wrong = []
    with Browser() as page:
        page.open(path.resolve().as_uri())
        before = page.run("document.querySelectorAll('*').length")
        page.run("for (const v of ['table', 'parallel', 'matrix']) document.getElementById(`view-${v}`).click(); 0")
        page.run("for (let i = 0; i < explorer.table.count; i++) { explorer.hover(i, 99, 99); explorer.pick(i); } 0")
        page.run("explorer.label('<b id=evil>=1'); 0")
        if page.run("Boolean(window.evil || document.getElementById('evil'))"):
            wrong.append("a text ran, or became an element")
        if page.run("document.querySelectorAll('iframe, svg, b, body img').length") or not before:
            wrong.append("a text became an element")
        cells = [cell or "" for row in parse(page.run("explorer.csv()"))[1:] for cell in row]
        wrong += [
            f"exported formula {c[:40]!r}" for c in cells if c[:1] in tuple("=+-@\t\r\n") and kind_of(c) == "string"
        ]
        wrong += page.errors
    return wrong


def _property_paths(count: int) -> dict[str, Any]:
    from examples.sweeps.scenes import corner

    scene, tally, wrong = corner(), Counter[str](), list[str]()
    tracemalloc.start()
    for text in hostile.paths(hostile.PATHS, hostile.GOOD_PATHS, count):
        tally["tried"] += 1
        if _tried(lambda given: set_path(scene, given, 1.0), text, tally, wrong) is not None:
            tally["a property after all"] += 1
            if any(word in text for word in ("__", "()", "..")):
                wrong.append(f"{text[:60]!r} was set")
    tracemalloc.stop()
    return {**tally, "wrong": wrong[:10]}


def _data_paths(count: int) -> dict[str, Any]:
    try:
        import bpy
    except ImportError:
        print("bpy is not installed; data paths of a .blend are not measured")
        return {}
    import blender_addon
    from blender_addon.editing.sweep.node import setting_at

    blender_addon.register_once()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.data.lights.new("Key", "POINT")
    bpy.data.objects.new("Camera", None)
    tally, wrong = Counter[str](), list[str]()
    tracemalloc.start()
    for text in hostile.paths(hostile.DATA_PATHS, hostile.GOOD_DATA_PATHS, count):
        tally["tried"] += 1
        if _tried(setting_at, text, tally, wrong) is not None:
            tally["a setting after all"] += 1
            if any(word in text for word in ("__", "()", "..", ";")):
                wrong.append(f"{text[:60]!r} was taken")
    tracemalloc.stop()
    return {**tally, "wrong": wrong[:10]}


def _file_names() -> dict[str, Any]:
    wrong: list[str] = []
    tally = Counter[str]()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "s.cdb"
        (folder / "image").mkdir(parents=True)
        (Path(name) / "secret.png").write_bytes(b"secret")
        (folder / "image" / "link.png").symlink_to(Path(name) / "secret.png")
        for text in hostile.FILE_NAMES:
            (folder / "data.csv").write_text(csv_text(["a", "FILE"], [{"a": 1.0, "FILE": text}]), encoding="utf-8")
            for check in (
                lambda given: inside(folder, given),
                lambda _: read_csv(folder / "data.csv"),
                require_file_name,
            ):
                tally["tried"] += 1
                try:
                    found = check(text)
                except SpectralError:
                    tally["refused"] += 1
                    continue
                if isinstance(found, Path) and not found.resolve().is_relative_to(folder.resolve()):
                    wrong.append(f"{text!r} leads to {found}")
                tally["stays inside"] += 1
    return {**tally, "wrong": wrong}
