# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender with the extension enabled and an empty file, for each test."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


@pytest.fixture(scope="session")
def _extension():
    import blender_addon

    blender_addon.register()
    yield
    blender_addon.unregister()


@pytest.fixture
def registered(_extension):
    """bpy with the extension, whatever file is open: for tests that look at classes only."""
    return bpy


@pytest.fixture
def blender(_extension):
    """bpy with the extension, an empty file and undo."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy
