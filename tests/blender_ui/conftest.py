# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for tests of panels and operators, which need bpy; ``blender`` is in the folder above."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


@pytest.fixture
def registered(_extension):
    """bpy with the extension and any open file: for tests that read classes only."""
    return bpy
