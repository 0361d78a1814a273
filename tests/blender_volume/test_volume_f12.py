# SPDX-License-Identifier: GPL-3.0-or-later
"""A volume object through Blender's own render operator."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def test_f12_shows_the_volume(blender, ramp):
    """The engine renders an X-ray of the ramp: bright at the data, and black beside them."""
    pytest.importorskip("mitsuba")
    from blender_addon import jobs

    bpy.ops.spectral.volume_import(filepath=str(ramp[0]), preset="xray", size=2.0)
    data = bpy.context.object.data
    render = bpy.context.scene.render
    render.engine = "SPECTRAL"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 32, 24, 100
    bpy.context.scene.spectral.render.samples = 4
    bpy.ops.render.render()
    record = jobs.records[-1]
    assert (record.status, record.message) == ("done", "")
    pixels = record.result.pixels[..., :3]
    assert np.isfinite(pixels).all()
    assert pixels[12, 16].min() > 0.05
    assert pixels[0, 0].max() == 0
    data.spectral.materials[0].emission *= 2
    bpy.ops.render.render()
    twice = jobs.records[-1].result.pixels[..., :3]
    assert twice.sum() / pixels.sum() == pytest.approx(2.0, rel=0.01)


def test_a_volume_of_which_nothing_is_shown_is_named(blender, ramp, tmp_path):
    """Its picture was black without a word; a cube of one density was, under every preset."""
    from blender_addon.translate.scene import translate_scene
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume

    def notes(preset, path=ramp[0]):
        for thing in list(bpy.context.scene.objects):
            if thing.type == "VOLUME":
                bpy.data.objects.remove(thing)
        bpy.ops.spectral.volume_import(filepath=str(path), preset=preset, size=2.0)
        scene = translate_scene(bpy.context.evaluated_depsgraph_get())
        assert len(scene.volumes) == 1
        return [note.message for note in scene.notes if "shows nothing" in note.message]

    assert notes("xray") == []
    cube = write_volume(ScalarVolume("cube", np.full((4, 4, 4), 0.75, np.float32)), tmp_path / "cube.nrrd")
    assert notes("xray", cube) == [] and notes("opaque", cube) == []
    assert notes("narrow", cube) == ["its transfer function shows nothing of its values from 0.75 to 0.75"]
