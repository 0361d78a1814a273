# SPDX-License-Identifier: GPL-3.0-or-later
"""Several scenes with palettes: views show the design of their scene's table after an undo, a copy and a load."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial import live as dial_live  # noqa: E402
from blender_addon.editing.palette import picture  # noqa: E402

RED, GREEN = (0.6, 0.3, 0.25), (0.25, 0.5, 0.3)


@pytest.fixture
def other(blender):
    """A second scene, which no window shows; its palette designs a material of its own."""
    scene = bpy.data.scenes.new("Other")
    with bpy.context.temp_override(scene=scene):
        bpy.ops.spectral.palette_preset(preset="HIDDEN_MARK")
    palette = scene.spectral.palette
    palette.materials[0].material = bpy.data.materials.new("Mark")
    palette.materials[0].cells[0].target = RED
    yield scene
    if "Other" in bpy.data.scenes:
        bpy.data.scenes.remove(bpy.data.scenes["Other"])


def shown_color(scene):
    """Share of the red in the reflectance, beside the green, of what views show of the material."""
    spectrum, _ = picture.shown_in(scene)[bpy.data.materials["Mark"].session_uid]
    nm = spectrum.grid.wavelengths_nm
    red, green = spectrum.values[nm > 590].sum(), spectrum.values[(nm > 500) & (nm < 570)].sum()
    return red / (red + green)


def test_an_undo_in_another_scene_shows_the_colors_of_before(other):
    bpy.ops.ed.undo_push(message="before")
    red = shown_color(other)
    other.spectral.palette.materials[0].cells[0].target = GREEN
    assert shown_color(other) != pytest.approx(red, rel=0.1)
    bpy.ops.ed.undo_push(message="green")
    assert bpy.context.scene.name != "Other"
    bpy.ops.ed.undo()
    again = bpy.data.scenes["Other"]
    assert tuple(again.spectral.palette.materials[0].cells[0].target) == pytest.approx(RED)
    assert shown_color(again) == pytest.approx(red, rel=0.02)


@pytest.fixture
def windowed(monkeypatch):
    """Blender as the module sees it in a window."""
    app = SimpleNamespace(background=False, is_job_running=lambda _kind: False)
    monkeypatch.setattr(picture, "bpy", SimpleNamespace(app=app, types=bpy.types, context=bpy.context, data=bpy.data))


def shown_in_a_view(stage, scene):
    """A window's view begins to show a scene; Blender calls no handler for a copy."""
    with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        stage.session.update(stage.context, bpy.context.evaluated_depsgraph_get())


def test_a_copied_scene_shows_the_design_that_its_panel_states(stage, other, windowed):
    copied = other.copy()
    assert picture.shown_in(copied) == {}
    assert copied.spectral.palette.picture.startswith(picture.RENDERED)
    shown_in_a_view(stage, copied)
    assert shown_color(copied) == pytest.approx(shown_color(other), rel=1e-6)
    bpy.data.scenes.remove(copied)


def test_an_opened_file_shows_the_design_that_its_panel_states(other, windowed, tmp_path):
    red, path = shown_color(other), str(tmp_path / "two.blend")
    other.spectral.palette.materials[0].material.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    opened = bpy.data.scenes["Other"]
    assert shown_color(opened) == pytest.approx(red, rel=1e-6)


def test_a_copied_scene_whose_option_is_off_shows_the_file(stage, other, windowed):
    other.spectral.palette.in_viewport = False
    copied = other.copy()
    shown_in_a_view(stage, copied)
    assert picture.shown_in(copied) == {}
    bpy.data.scenes.remove(copied)


def test_an_undo_asks_for_the_picture_of_every_dial_in_memory(other, monkeypatch):
    asked = []
    monkeypatch.setattr(dial_live, "changed", lambda scene: asked.append(scene.name))
    monkeypatch.setattr(dial_live, "known_mix", lambda scene: "mix" if scene.name == "Other" else None)
    unseen = bpy.data.scenes.new("Unseen")
    dial_live._after_undo(bpy.context.scene)
    assert sorted(asked) == sorted(["Other", bpy.context.scene.name])
    bpy.data.scenes.remove(unseen)
