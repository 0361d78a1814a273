# SPDX-License-Identifier: GPL-3.0-or-later
"""Dragging a target changes the picture: designed lights are relit, designed reflectances need a new render."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial import live  # noqa: E402
from blender_addon.translate.spectra.stored import store_spectrum  # noqa: E402
from spectral_core.render.relight import mix  # noqa: E402
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid  # noqa: E402


@pytest.fixture
def palette(stage):
    """The palette designs the light "Key" for the color of white paper under it."""
    palette = stage.spectral.palette
    bpy.ops.spectral.palette_add(side="LIGHT")
    bpy.ops.spectral.palette_add(side="MATERIAL")
    light, paper = palette.lights[0], palette.materials[0]
    light.design, light.light = "DESIGNED", bpy.data.lights["Key"]
    paper.material, paper.design = None, "MEASURED"
    store_spectrum(paper.spectral, Reflectance("paper", SpectralGrid(np.linspace(400, 700, 31)), np.full(31, 0.8)))
    paper.cells[0].mode = "FIXED"
    return palette


def middle(dial):
    """Set every light to its recorded state."""
    for bulb in dial.bulbs:
        bulb.is_on = True
    dial.selector, dial.intensity = (0.0, 0.0), len(dial.bulbs)


def test_a_relit_designed_light_equals_its_render_after_apply(stage, palette, picture):
    stage.spectral.dial.storage = "EXACT"
    bpy.ops.spectral.dial_record()
    middle(stage.spectral.dial)
    before = picture().copy()
    palette.materials[0].cells[0].target = (0.3, 0.7, 0.2)
    assert palette.picture == "Re-lit from the recording", palette.message
    shown = picture().copy()
    assert np.abs(shown - before).mean() > 0.01
    bpy.ops.spectral.palette_apply()
    assert palette.picture == ""
    stage.view_settings.exposure = 0.0
    bpy.ops.spectral.dial_record()
    middle(stage.spectral.dial)
    level = 2.0**palette.applied_exposure
    key = list(stage.spectral.dial.bulbs.keys()).index("Key")
    weights = live.weights_of(stage.spectral.dial)
    weights[key] *= level  # Apply changes the exposure of the view instead
    assert np.abs(live.live_mix(stage).picture(weights) - shown).mean() < 0.02 * shown.mean()


def test_a_reflectance_is_not_relit_and_the_panel_states_the_reason(dial, palette):
    paint = bpy.data.materials["Floor"]
    material = palette.materials[0]
    material.material, material.design = paint, "DESIGNED"
    material.cells[0].target = (0.6, 0.2, 0.2)
    assert palette.picture.startswith("Rendered anew: Floor")


def test_relit_lights_are_restored_when_show_in_viewport_is_off(stage, palette, picture):
    stage.spectral.dial.storage = "BANDS31"
    bpy.ops.spectral.dial_record()
    middle(stage.spectral.dial)
    before = picture().copy()
    palette.materials[0].cells[0].target = (0.3, 0.7, 0.2)
    assert np.abs(picture() - before).mean() > 0.01
    palette.in_viewport = False
    np.testing.assert_allclose(picture(), before, atol=1e-5)
    assert palette.picture == ""


def test_mixtures_storage_states_why_it_cannot_relight(dial, palette):
    palette.materials[0].cells[0].target = (0.3, 0.7, 0.2)
    assert palette.picture.startswith("Rendered anew: ")
    assert dial.message == ""


def test_a_slow_drag_shows_half_the_size_and_then_the_full_picture(stage, palette, picture, monkeypatch):
    stage.spectral.dial.storage = "BANDS31"
    bpy.ops.spectral.dial_record()
    middle(stage.spectral.dial)
    monkeypatch.setattr(mix, "QUICK_SECONDS", 0.0)
    monkeypatch.setattr(live, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))  # timers answer at once
    shown, store = [], live._store
    monkeypatch.setattr(
        live, "_store", lambda scene, pixels, **how: (shown.append(pixels.copy()), store(scene, pixels, **how))[1]
    )
    for target in ((0.3, 0.7, 0.2), (0.7, 0.3, 0.2), (0.2, 0.3, 0.8)):
        palette.materials[0].cells[0].target = target
    full, coarse = shown[-1], shown[-2]
    assert full.shape == (12, 16, 4)
    np.testing.assert_allclose(coarse, full.reshape(6, 2, 8, 2, 4).mean(axis=(1, 3)), rtol=1e-4)
    np.testing.assert_allclose(picture(), full, rtol=1e-5)
    monkeypatch.setattr(mix, "QUICK_SECONDS", 10.0)
    live.remember(stage, live.mix_of(live.live_mix(stage).transport))
    shown.clear()
    for target in ((0.3, 0.7, 0.2), (0.2, 0.3, 0.8)):
        palette.materials[0].cells[0].target = target
    np.testing.assert_allclose(shown[-1], full, rtol=1e-5)
    assert all(each.shape == full.shape for each in shown)


def test_a_recording_that_turns_out_to_hold_no_spectra_leaves_the_picture_to_a_render(stage, palette, monkeypatch):
    """It is read on a thread after the table has been told that it is re-lit; then no turn of the dial was shown."""
    stage.spectral.dial.storage = "DIAL"
    bpy.ops.spectral.dial_record()
    middle(stage.spectral.dial)
    with monkeypatch.context() as patch:
        patch.setattr(live, "show_soon", lambda scene, failed: live._waiting.update({scene.session_uid: failed}))
        palette.materials[0].cells[0].target = (0.3, 0.7, 0.2)
    assert palette.picture == "Re-lit from the recording", palette.message
    live._show_quietly(stage)
    assert palette.picture.startswith("Rendered anew: ") and "no spectra" in palette.picture
    live.show(stage)
    assert not stage.spectral.dial.message
