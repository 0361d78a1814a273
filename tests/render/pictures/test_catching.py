# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow catchers: light that the scene blocks becomes opacity, or darkens the background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.catching import joined
from spectral_core.scene import Film, Instance, Moment, PointLight, World, gray
from tests.render.scenes import lit_plane, looking_down, matrix, plane

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def pixel(*numbers):
    return np.array(numbers, np.float32).reshape(1, 1, 4)


def test_a_shadow_is_one_minus_the_ratio():
    nothing, alone = pixel(0, 0, 0, 0), pixel(0.4, 0.4, 0.4, 1)
    half = joined(nothing, pixel(0.2, 0.2, 0.2, 1), alone, None)
    np.testing.assert_allclose(half, pixel(0, 0, 0, 0.5))
    brighter = joined(nothing, pixel(0.9, 0.9, 0.9, 1), alone, None)
    np.testing.assert_allclose(brighter, pixel(0, 0, 0, 0), err_msg="light that a catcher gains is not shown")
    blue = joined(nothing, pixel(0, 0, 0.1, 1), pixel(0, 0, 0.4, 1), None)
    np.testing.assert_allclose(
        blue, pixel(0, 0, 0, 0.25), err_msg="channels without light have no shadow, as in Cycles"
    )
    unlit = joined(nothing, pixel(0, 0, 0, 1), pixel(0, 0, 0, 1), None)
    np.testing.assert_allclose(unlit, pixel(0, 0, 0, 0), err_msg="outside of a spot's cone nothing is shadowed")
    sky = joined(nothing, pixel(0.2, 0.2, 0.2, 1), alone, pixel(0.3, 0.6, 0.9, 1))
    np.testing.assert_allclose(sky, pixel(0.15, 0.3, 0.45, 1), rtol=1e-6)
    beside = joined(pixel(0.3, 0, 0, 0.5), pixel(0.1, 0.1, 0.1, 0.5), pixel(0.2, 0.2, 0.2, 0.5), None)
    np.testing.assert_allclose(beside, pixel(0.3, 0, 0, 0.75))


def scene(transparent):
    """A catcher below a panel (x > 0) outside the view that hides a small lamp from half of the picture."""
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 4)), power_w=100.0, radius=0.0)
    film = Film(8, 8, samples=32, transparent=transparent)
    base = lit_plane(lamp, film=film, world=World(gray(0.0)), camera=looking_down(2.0, 0.4))
    panel = Instance("panel", "small", matrix((3.0, 0, 3.0)), ("paper",))
    floor = replace(base.instances[0], is_shadow_catcher=True)
    return replace(base, meshes=(plane(), plane(3.0, "small")), instances=(floor, panel))


def test_an_umbra_is_opaque_and_a_lit_floor_is_transparent():
    from spectral_core.render import render_scene

    result = render_scene(scene(True))
    shown = result.pixels
    assert not any("dark line" in note.message for note in result.notes)
    np.testing.assert_allclose(shown[..., :3], 0)
    np.testing.assert_allclose(shown[:, :3, 3], 0, atol=0.1)
    np.testing.assert_allclose(shown[:, 5:, 3], 1, atol=0.1)


@pytest.mark.parametrize("transparent", [True, False])
def test_progress_counts_all_pictures_of_which_one_is_put_together(transparent):
    from spectral_core.render import render_scene

    seen = []
    result = render_scene(scene(transparent), on_progress=seen.append)
    counts = [progress.samples for progress in seen]
    assert counts == sorted(counts) and result.samples == 32
    assert [progress.samples == 32 for progress in seen] == [False] * (len(seen) - 1) + [True]
    assert seen[-1].left_s == 0.0 and all(progress.left_s > 0.0 for progress in seen[:-1] if progress.samples)


def test_on_a_background_and_in_motion():
    from spectral_core.render import render_scene

    bright = replace(scene(False), world=World(gray(0.5), camera_view=World(gray(0.5))))
    lamp = replace(bright.lights[0], power_w=1e5)  # the sky adds almost no light
    shown = render_scene(replace(bright, lights=(lamp,)))
    np.testing.assert_allclose(shown.pixels[..., 3], 1)
    np.testing.assert_allclose(shown.pixels[:, :3, :3], 0.5, atol=0.06)
    assert shown.pixels[:, 5:, :3].max() < 0.1
    assert any("dark line" in note.message for note in shown.notes)
    still = scene(True)
    moments = (Moment(still.camera), Moment(still.camera))
    moving = render_scene(replace(still, moments=moments))
    np.testing.assert_allclose(moving.pixels[:, 5:, 3], 1, atol=0.1)
