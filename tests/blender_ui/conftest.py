# SPDX-License-Identifier: GPL-3.0-or-later
"""These tests need bpy; ``blender`` is in the folder above."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


@pytest.fixture
def registered(_extension):
    """bpy with the extension, whatever file is open: for tests that look at classes only."""
    return bpy
