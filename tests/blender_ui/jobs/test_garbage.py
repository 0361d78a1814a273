# SPDX-License-Identifier: GPL-3.0-or-later
"""The garbage collector passes over loaded modules in a Blender with a window, and over nothing else."""

from __future__ import annotations

import gc
import sys
from types import ModuleType, SimpleNamespace

import pytest

pytest.importorskip("bpy")


@pytest.fixture(scope="module", autouse=True)
def _nothing_is_passed_over():
    """The collector looks at all objects before a test here, and at none of the test session after the last."""
    gc.unfreeze()
    yield
    gc.collect()
    gc.freeze()


@pytest.fixture
def garbage(monkeypatch):
    from blender_addon.editing import garbage

    monkeypatch.setattr(garbage, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    garbage.register()
    yield garbage
    garbage.unregister()
    assert gc.get_freeze_count() == 0 and garbage._after_collection not in gc.callbacks


def test_objects_of_loaded_modules_are_passed_over_and_later_ones_are_not(garbage, monkeypatch):
    assert gc.get_freeze_count() > 10_000
    kept = [[number] for number in range(1000)]
    gc.collect()
    passed_over = gc.get_freeze_count()
    assert any(item is kept for item in gc.get_objects())
    for number in range(garbage.FEWEST):
        monkeypatch.setitem(sys.modules, f"loaded_{number}", ModuleType(f"loaded_{number}"))
    gc.collect(0)
    assert gc.get_freeze_count() >= passed_over + len(kept)


def test_without_a_window_python_keeps_its_ways(monkeypatch):
    from blender_addon.editing import garbage

    monkeypatch.setattr(garbage, "bpy", SimpleNamespace(app=SimpleNamespace(background=True)))
    before = list(gc.callbacks)
    garbage.register()
    assert gc.callbacks == before and gc.get_freeze_count() == 0
    garbage.unregister()
