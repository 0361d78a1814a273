# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every room's tests share."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# Deadlines would fail on a busy machine; examples may share a test's folder, which each of them overwrites.
settings.register_profile(
    "house", deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
)
settings.load_profile("house")

ROOT = Path(__file__).resolve().parents[1]


WITH_A_RENDERER = (
    "blender", "blender_relight", "blender_sweep", "blender_ui", "blender_viewport", "blender_volume", "real_blender",
    "render", "relight", "live", "volume_scene", "examples", "benchmarks", "package",
)  # fmt: skip
"""Folders whose tests render, run Blender or build packages: seconds each."""
STILL_FIRST = ("test_ledger.py", "test_declared_settings.py", "test_sobol.py")
"""Quick files of these folders."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--first``: one test of each file that needs no renderer, so that a change is tried within a minute."""
    parser.addoption("--first", action="store_true", help="run the first test of each file that needs no renderer")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Omit files that render, with ``--first``."""
    if not config.getoption("--first") or collection_path.suffix != ".py":
        return None
    renders = any(parent.name in WITH_A_RENDERER for parent in collection_path.parents if parent != ROOT)
    return (
        True
        if renders and collection_path.name.startswith("test_") and collection_path.name not in STILL_FIRST
        else None
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the first test of each file that is not slow, with ``--first``."""
    if not config.getoption("--first"):
        return
    chosen: dict[Path, pytest.Item] = {}
    for item in items:
        if item.get_closest_marker("slow") is None and item.get_closest_marker("real_blender") is None:
            chosen.setdefault(item.path, item)
    kept = set(map(id, chosen.values()))
    config.hook.pytest_deselected(items=[item for item in items if id(item) not in kept])
    items[:] = list(chosen.values())


def pytest_collection_finish() -> None:
    """Let the garbage collector pass over the tests and the modules that they import.

    These are half a million objects, which stay to the end. A full collection took 0.3 s of each live session, and all
    collections together a fifth of the processor time of tests/live.
    """
    gc.collect()
    gc.freeze()


_skipped: dict[str, list[str]] = {}
"""Reasons for skipped tests, by folder; ``_ran`` has the number of tests that ran in each."""
_ran: dict[str, int] = {}


def _folder(node_id: str) -> str:
    return node_id.partition("::")[0].rpartition("/")[0]


def _note_skip(report: pytest.TestReport | pytest.CollectReport) -> None:
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
    _skipped.setdefault(_folder(report.nodeid), []).append(reason.removeprefix("Skipped: "))


def pytest_collectreport(report: pytest.CollectReport) -> None:
    """Count a skipped module."""
    if report.skipped:
        _note_skip(report)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Count tests that ran and tests that were skipped."""
    if report.skipped:
        _note_skip(report)
    elif report.when == "call":
        _ran[_folder(report.nodeid)] = _ran.get(_folder(report.nodeid), 0) + 1


def _silent_folders() -> list[str]:
    """Folders without a test that ran. Tests in a real Blender have a separate make target."""
    return sorted(folder for folder in _skipped if not _ran.get(folder) and folder != "tests/real_blender")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the skipped tests with their reasons."""
    if not _skipped:
        return
    terminalreporter.section("skipped")
    for folder, reasons in sorted(_skipped.items()):
        for reason in sorted(set(reasons)):
            terminalreporter.line(f"{reasons.count(reason):4} in {folder}: {reason}")
    for folder in _silent_folders():
        terminalreporter.line(f"NOTHING of {folder} ran")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """If CI is set, a folder without a test that ran is a failure; otherwise a missing bpy would go unnoticed."""
    is_worker = hasattr(session.config, "workerinput")  # neither of two processes runs every folder
    if os.environ.get("CI") and not is_worker and _silent_folders() and session.exitstatus == 0:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.fixture
def rng() -> np.random.Generator:
    """A random generator with the same seed for each test."""
    return np.random.default_rng(20111)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measured data that the project does not ship; the test is skipped if it is absent."""
    folder = Path(os.environ.get("SPECTRAL_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}; set SPECTRAL_SHARED_DATA to a folder that has them")
    return folder


@pytest.fixture(scope="session")
def _extension() -> Iterator[None]:
    """The extension, enabled once: Blender refuses a second registration."""
    import blender_addon

    blender_addon.register_once()  # a command or a sweep in an earlier test may have enabled it
    yield
    blender_addon.unregister()


@pytest.fixture
def blender(_extension: None) -> Any:
    """bpy with the extension enabled, an empty file (no objects, lights, world or camera) and undo."""
    bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy
