# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient Occlusion and Bevel in a view: after edits the view equals a new render."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

from spectral_core.scene import Computed, Principled
from spectral_core.scene.shading import Builder
from tests.live.test_live_session import at, fresh, looker, scene, with_place, with_surface  # noqa: F401


def open_share(distance):
    build = Builder()
    normal = build.add("vector_input", (), "normal", 0)
    share = build.add("occlusion", (normal, build.number(distance)), 8, False, False)
    return Computed(build.program(build.as_width(share, 3)))


def rounded(radius):
    build = Builder()
    normal = build.add("vector_input", (), "normal", 0)
    return Computed(build.program(build.add("bevel", (normal, build.number(radius)), 8)))


def blocks(picture):
    height, width = (size // 4 * 4 for size in picture.shape[:2])
    return picture[:height, :width, :3].reshape(height // 4, 4, width // 4, 4, 3).mean((1, 3))


@pytest.mark.slow
def test_rays_of_programs_follow_edits(looker, scene):  # noqa: F811
    first = with_surface(scene, "gray", color=open_share(2.0))
    shiny = [m if m.name != "shiny" else replace(m, surface=Principled(normal=rounded(0.3))) for m in first.materials]
    first = replace(first, materials=tuple(shiny))
    before = looker.settled(first)
    lamp_near = replace(first.lights[0], world_from_light=at(0, -2, 1.2), size=(1.0, 1.0))
    moved = with_place(with_surface(first, "gray", color=open_share(0.5)), "left", at(-1, -2, 1.0))
    edited = replace(moved, lights=(lamp_near, *first.lights[1:]))  # these rays ignore the body of a lamp
    after = looker.settled(edited)
    assert looker.how != "loaded"
    # their random numbers depend on the last bits of the position, which differ: only means of blocks agree
    assert np.abs(blocks(after) - blocks(fresh(edited))).mean() < 0.03 * after[..., :3].mean()
    assert np.abs(blocks(after) - blocks(before)).mean() > 0.2 * after[..., :3].mean()
