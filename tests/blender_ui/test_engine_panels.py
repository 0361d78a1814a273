# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's panels that are shown for the engine, and notes on passes that are not rendered."""

from __future__ import annotations

import sys

import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.engine import BL_IDNAME
from blender_addon.translate.passes import pass_notes


def shown() -> list[type]:
    return [each for each in bpy.types.Panel.__subclasses__() if BL_IDNAME in getattr(each, "COMPAT_ENGINES", ())]


@pytest.mark.parametrize("space", ["PROPERTIES", "NODE_EDITOR"])
def test_a_light_has_one_panel_named_light(registered, space):
    named = [each.__name__ for each in shown() if each.bl_label == "Light" and each.bl_space_type == space]
    assert len(named) == 1, named


def test_panels_of_features_that_are_not_rendered_are_hidden(registered):
    assert not [each.__name__ for each in shown() if "freestyle" in each.__name__.lower()]
    assert not [each.__name__ for each in shown() if "pencil" in each.__name__.lower()]


def test_denoising_is_off_by_default_and_independent_of_the_switch_of_cycles(blender, monkeypatch):
    from blender_addon import jobs
    from blender_addon.translate.settings import settings_of
    from spectral_core.render.denoise import PACKAGE

    scene = blender.context.scene
    if hasattr(scene, "cycles"):
        scene.cycles.use_denoising = True
    assert not settings_of(scene).denoise
    scene.spectral.render.denoise = True
    assert settings_of(scene).denoise
    monkeypatch.setitem(sys.modules, PACKAGE, None)
    assert "pip install pyoidn" in jobs.missing_denoiser() and jobs.missing_denoiser().startswith("Denoising needs")


def test_passes_that_are_not_rendered_get_a_note(blender):
    layer = blender.context.view_layer
    assert pass_notes(layer) == ()
    layer.use_pass_z = layer.use_pass_diffuse_color = layer.use_pass_vector = True
    (note,) = pass_notes(layer)
    assert note.subject == f"view layer {layer.name}"
    assert note.message == "Vector: not rendered; the file does not hold it"
