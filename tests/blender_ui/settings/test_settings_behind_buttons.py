# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that only a comparison, a message or a refusal reads."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy

from blender_addon.operators import dial_record
from blender_addon.translate.display.transform import view_name
from blender_addon.translate.palette.paint import solver_of
from blender_addon.translate.viewport.look import look_of
from blender_addon.translate.viewport.walk import facts_of
from spectral_core.errors import InvalidInputError
from tests.settings_walk import ignored_settings, other_rna, read_rna


def walked(owner: Any, names: list[str], seen: Any, others: dict[str, Any] | None = None) -> dict[str, str]:
    """``ignored_settings`` for properties of a struct."""
    return ignored_settings(
        names, lambda name: read_rna(owner, name), lambda name, value: setattr(owner, name, value),
        lambda name: (others or {}).get(name, other_rna(owner, name)), seen,
    )  # fmt: skip


def test_every_setting_of_the_view_makes_another_view(blender: Any) -> None:
    """Pictures are drawn anew for another view only."""
    view = blender.context.scene.view_settings
    names = ["view_transform", "look", "exposure", "gamma", "use_curve_mapping"]
    others = {"view_transform": "Raw", "look": "AgX - Greyscale"}
    view.view_transform = "AgX"
    assert walked(view, names, lambda: view_name(blender.context.scene), others) == {}


def test_every_fact_of_an_object_that_blender_reports_as_an_edit_of_a_material_is_compared(blender: Any) -> None:
    thing = bpy.data.objects.new("thing", bpy.data.meshes.new("thing"))
    names = ["pass_index", "color", "is_holdout", "is_shadow_catcher", "lightgroup"]
    names += [each.identifier for each in thing.bl_rna.properties
              if each.identifier.startswith("visible_") and each.identifier != "visible_raycast"]  # fmt: skip
    assert walked(thing, names, lambda: facts_of(thing, thing)) == {}


def test_tints_and_dyes_are_refused_together(blender: Any) -> None:
    palette = blender.context.scene.spectral.palette
    palette.live = False
    for side in ("LIGHT", "MATERIAL"):
        blender.ops.spectral.palette_add(side=side)
    palette.materials[0].dyes.add()
    solver_of(palette)
    palette.use_tints = True
    with pytest.raises(InvalidInputError, match="tints and fluorescent dyes"):
        solver_of(palette)


def test_a_palette_light_of_the_world_alone_has_no_lamps(blender: Any) -> None:
    scene = blender.context.scene
    scene.world = bpy.data.worlds.new("World")
    column = scene.spectral.palette.lights.add()
    column.name = "Sky"
    look = scene.spectral.viewport.look
    look.kind, look.column = "COLUMN", "Sky"
    assert (look_of(look, scene).lamps, look_of(look, scene).with_world) == (None, False)
    column.world = scene.world
    assert (look_of(look, scene).lamps, look_of(look, scene).with_world) == (frozenset(), True)
    column.world = bpy.data.worlds.new("Other")
    assert not look_of(look, scene).with_world


@pytest.mark.parametrize("keeps", [True, False])
def test_bulbs_lose_their_lamps_in_a_recording_that_keeps_no_spectra(blender: Any, keeps: bool) -> None:
    """And the panel offers none; the settings of the recording are its facts."""
    dial = blender.context.scene.spectral.dial
    for name in ("Key", "Fill"):
        dial.bulbs.add().name = name
        dial.bulbs[name].lamp = "HP1"
    storage = SimpleNamespace(keeps_spectra=keeps, kind="bands", channel_count=3, channel_names=lambda: ("a", "b", "c"))
    transport = SimpleNamespace(
        groups=("Key", "Fill"), storage=storage, size=(4, 3), samples=7, scene_hash="1" * 64,
        lights=(None, None), group_rgb=lambda *_: np.ones((2, 3)),
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dial_record, "color_bulbs", lambda *_: None)
        dial_record._take(blender.context.scene, transport, [])
    assert dial.keeps_spectra == keeps and dial.scene_hash == "1" * 64
    assert {bulb.lamp for bulb in dial.bulbs} == ({"HP1"} if keeps else {""})
    assert dial.facts.startswith("4×3, 7 samples, bands")
