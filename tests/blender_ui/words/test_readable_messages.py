# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts over a Rendered view are readable, and calls in a wrong place name the remedy."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.spectra.color import display_rgb_from_linear  # noqa: E402


def luminance(display: np.ndarray) -> float:
    """Relative luminance of sRGB numbers, by WCAG 2."""
    linear = np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def test_a_message_over_a_rendered_view_has_contrast_to_its_plate():
    """Blender encodes what a render engine draws: triangles twice, texts once (screenshots of 4.3 and 5.2)."""
    from blender_addon.drawing.viewport import PLATE, WARNING

    plate = display_rgb_from_linear(display_rgb_from_linear(np.array(PLATE[:3])))
    text = display_rgb_from_linear(np.array(WARNING[:3]))
    assert (luminance(text) + 0.05) / (luminance(plate) + 0.05) > 7.0
    np.testing.assert_allclose(text, (1.0, 0.62, 0.25), atol=0.01)


def test_a_name_beside_the_divider_is_readable_over_a_white_picture():
    """The plate let a seventh of the light through, which is a middle gray on the screen, and the noise of the view."""
    from blender_addon.drawing.split import NAME, PLATE

    below = PLATE[3] * np.array(PLATE[:3]) + (1 - PLATE[3]) * np.ones(3)  # light of a white picture
    text = NAME[3] * np.array(NAME[:3]) + (1 - NAME[3]) * below
    plate, text = display_rgb_from_linear(below), display_rgb_from_linear(text)
    assert (luminance(text) + 0.05) / (luminance(plate) + 0.05) > 7.0


@pytest.mark.parametrize("name", ["transfer_preset", "transfer_export", "volume_material_add", "volume_curve_add"])
def test_a_call_without_a_volume_says_what_to_select(blender, name):
    with pytest.raises(RuntimeError, match="select a Volume object first"):
        getattr(bpy.ops.spectral, name)()


def test_a_button_of_a_pinned_world_changes_that_world(blender):
    bpy.ops.spectral.palette_preset(preset="METAMER_PAIR")
    own, pinned = bpy.data.worlds.new("Own"), bpy.data.worlds.new("Pinned")
    bpy.context.scene.world = own
    with bpy.context.temp_override(world=pinned):  # as the properties editor gives it to its buttons
        bpy.ops.spectral.spectrum_from_palette(carrier="WORLD", entry="Sodium")
    assert pinned.spectral.source == "DESIGNED"
    assert own.spectral.source == "NONE"
    bpy.ops.spectral.spectrum_from_palette(carrier="WORLD", entry="Daylight")
    assert own.spectral.source == "DESIGNED"


def test_lamps_without_a_visible_color_leave_the_swatches_of_volumes_as_they_are(blender, tmp_path):
    """Such a lamp made the panel of volumes fail while it was drawn."""
    from blender_addon.panels.volume import scene_light, swatch_of
    from blender_addon.translate.volume_looks.curves import add_material

    scene, data = bpy.context.scene, bpy.data.volumes.new("Cloud")
    add_material(data, "Mist")
    entry = data.spectral.materials[0]
    entry.color = (0.5, 0.5, 0.5)
    gray = swatch_of(entry, scene_light(scene))
    lamps = [bpy.data.lights.new(name, "POINT") for name in ("Heat", "Shade")]
    for lamp in lamps:
        scene.collection.objects.link(bpy.data.objects.new(lamp.name, lamp))
    (tmp_path / "heat.csv").write_text("wavelength,heat\n900,1\n950,2\n1000,1\n", "utf-8")
    lamps[0].spectral.source, lamps[0].spectral.filepath = "FILE", str(tmp_path / "heat.csv")
    assert len(lamps[0].spectral.samples) == 3
    lamps[1].energy = -500.0  # Blender permits it
    assert swatch_of(entry, scene_light(scene)) == pytest.approx(gray, abs=1e-6)


@pytest.mark.parametrize(("lit", "words"), [(True, "In the scene's light"), (False, "Its own light")])
def test_the_swatch_of_a_volume_says_whose_light_it_shows(blender, monkeypatch, lit, words):
    from types import SimpleNamespace

    from blender_addon.panels import volume
    from blender_addon.translate.volume_looks.curves import add_material
    from tests.blender_ui.words.test_long_names import Texts

    data = bpy.data.volumes.new("Cloud")
    add_material(data, "Mist")
    entry = data.spectral.materials[0]
    entry.lit = lit
    shown = []
    monkeypatch.setattr(volume, "draw_swatches", lambda _layout, swatches: shown.extend(swatches))
    light = volume.scene_light(bpy.context.scene)
    volume._draw_color(Texts(), SimpleNamespace(scene=bpy.context.scene), entry, light)
    assert [name for name, _ in shown] == [words]
