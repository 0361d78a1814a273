# SPDX-License-Identifier: GPL-3.0-or-later
"""A small saved scene with two lamps, an emissive ball and a world, and its recorded transport."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


@pytest.fixture
def stage(_extension, tmp_path):
    """The saved scene."""
    from tests.blender_relight.stage import build_stage

    bpy.ops.wm.read_factory_settings(use_empty=True)
    return build_stage(tmp_path / "stage.blend")


@pytest.fixture
def dial(stage):
    """The dial of the stage, recorded one bulb per light."""
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    pytest.importorskip("OpenEXR", reason="needs OpenEXR: pip install 'spectral-scene[render]'")
    bpy.ops.spectral.dial_record()
    return stage.spectral.dial


@pytest.fixture
def without_rays(monkeypatch):
    """Recordings of any numbers, at once, for tests that do not depend on the light; the groups that were asked for."""
    from blender_addon import jobs
    from spectral_core.render.light_groups import light_groups
    from spectral_core.render.result import RenderResult

    asked = []

    def render(scene, *, groups, **_):
        asked.append(groups)
        width, height = scene.film.size
        pixels = np.random.default_rng(len(asked)).random((height, width, 4), np.float32)
        pixels[..., 3] = 1.0
        names = light_groups(scene) if groups is True else groups
        shares = {name: pixels * np.float32(number) for number, name in enumerate(names, 1)}
        return RenderResult(pixels, None, (), scene.film.samples, 0.0, "done", "", group_pixels=shares)

    monkeypatch.setattr(jobs, "render", render)
    return asked


@pytest.fixture
def picture():
    """Pixels (height, width, 4) of the image that follows the dial."""

    def read():
        image = bpy.data.images["Light Dial"]
        pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4)

    return read


@pytest.fixture
def f12():
    """The present picture of F12: (height, width, 4), row 0 at the bottom."""

    def render():
        from blender_addon import jobs

        jobs.records.clear()
        bpy.ops.render.render()
        assert jobs.records[-1].status == "done"
        return jobs.records[-1].result.pixels

    return render


@pytest.fixture
def same_paths():
    """The scene rendered with the paths of a recording, which choose lights independently of their brightness."""

    def render():
        from blender_addon.translate.scene import translate_scene
        from spectral_core.render import render_scene
        from spectral_core.render.relight.sampling import SAMPLING_LIGHTS

        scene = translate_scene(bpy.context.evaluated_depsgraph_get())
        return render_scene(scene, sampling_lights=SAMPLING_LIGHTS).pixels

    return render
