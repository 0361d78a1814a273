# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender with the extension enabled and an empty file for each test, and a small volume to import."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


@pytest.fixture
def blender(_extension, tmp_path):
    """bpy with the extension, an empty file saved in a separate folder, and a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 6)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return bpy


@pytest.fixture
def ramp(tmp_path):
    """(path, values): 6×5×4 int16 of voxels 1×1×2, from -100 to 300."""
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume

    values = np.linspace(-100, 300, 120).round().astype(np.int16).reshape(6, 5, 4)
    volume = ScalarVolume.from_spacing("ramp", values, (1.0, 1.0, 2.0), (7.0, 0.0, -3.0))
    return write_volume(volume, tmp_path / "ramp.nrrd"), values
