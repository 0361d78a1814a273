# SPDX-License-Identifier: GPL-3.0-or-later
"""A pytest plugin that writes down which functions of the product each test calls.

``mutation`` runs the tests of a room once with it (``-p benchmarks.program.cases.touched``; ``TOUCHED``: path of the
file to write), and then tries each mutant with the tests alone that call the changed function. The line of the file for
each test is an object: its node id, its seconds, True if it passed, and the functions as pairs of a path and a first
line.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FrameType

import pytest

ROOT = Path(os.environ["TOUCHED_TREE"])
_called: set[CodeType] = set()
_failed: set[str] = set()


def _record(frame: FrameType, event: str, _: object) -> None:
    """A trace function that asks for calls alone: a profile function would be called for every call of C as well."""
    _called.add(frame.f_code)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Remember the tests that fail."""
    if report.failed:
        _failed.add(report.nodeid)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Record from the test's fixtures to its end; other processes cannot be observed."""
    _called.clear()
    start = time.perf_counter()
    threading.settrace(_record)
    sys.settrace(_record)
    yield
    sys.settrace(None)
    threading.settrace(None)  # type: ignore[arg-type]
    inside = tuple(str(ROOT / name) + os.sep for name in ("spectral_core", "benchmarks"))
    touched = sorted(
        (str(Path(code.co_filename).relative_to(ROOT)), code.co_firstlineno)
        for code in _called.copy()
        if code.co_filename.startswith(inside)
    )
    seconds, passed = time.perf_counter() - start, item.nodeid not in _failed
    record = {"test": item.nodeid, "seconds": seconds, "passed": passed, "functions": touched}
    with Path(os.environ["TOUCHED"]).open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")
