# SPDX-License-Identifier: GPL-3.0-or-later
"""Image sequences show the file that Cycles shows."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender import cycles  # noqa: E402
from tests.blender.images.test_image_files import saved, textured  # noqa: E402


@pytest.mark.parametrize("refreshes", [False, True])
def test_a_sequence_shows_the_file_that_cycles_renders(build, tmp_path, refreshes):
    """Auto Refresh, which is off in a new node, and the frame that an editor has shown last do not count."""
    for number in (1, 2, 3):
        saved(tmp_path / f"walk_{number:04d}.png", (number / 5, 0, 0))
    image = bpy.data.images.load(str(tmp_path / "walk_0001.png"))
    image.source = "SEQUENCE"
    user = textured(build, image).image_user
    user.frame_duration, user.use_auto_refresh, user.frame_current = 3, refreshes, 2
    build.camera()
    bpy.context.scene.frame_set(3)
    cycles.settings(samples=1, size=4)
    theirs, (ours, notes) = cycles.cycles(tmp_path), cycles.ours(1)
    np.testing.assert_allclose(theirs[1:3, 1:3, 0], 3 / 5, atol=1 / 255)
    np.testing.assert_allclose(ours[1:3, 1:3], theirs[1:3, 1:3], atol=1e-4)
    assert notes == []
