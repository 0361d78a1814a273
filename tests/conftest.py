# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every room's tests share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator that starts the same for each test."""
    return np.random.default_rng(20111)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measured data that the project does not ship; the test is skipped where it is absent."""
    folder = Path(os.environ.get("SPECTRAL_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}; set SPECTRAL_SHARED_DATA to a folder that has them")
    return folder


@pytest.fixture(scope="session")
def _extension() -> Iterator[None]:
    """The extension, enabled once: Blender refuses a second registration."""
    import blender_addon

    blender_addon.register()
    yield
    blender_addon.unregister()


@pytest.fixture
def blender(_extension: None) -> Any:
    """bpy with the extension enabled, an empty file (no objects, lights, world or camera) and undo."""
    bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy
