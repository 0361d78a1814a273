# SPDX-License-Identifier: GPL-3.0-or-later
"""The dial's comparison in a window translates only what was edited: it finds what a whole translation finds."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import EDITS  # noqa: E402


def test_each_edit_is_found_as_by_a_whole_translation(stage, monkeypatch):
    from blender_addon.editing.dial import changes

    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    stage.scene.collection.objects.link(eye)
    stage.scene.camera = eye
    in_a_window = lambda scene: changes._stages.setdefault(scene.session_uid, changes.Stage())  # noqa: E731
    wrong, same = [], []
    monkeypatch.setattr(changes, "_stage_of", in_a_window)
    before = changes.parts_of(stage.scene)
    try:
        for name, edit in EDITS.items():
            edit(stage)
            bpy.context.view_layer.update()
            kept = changes.parts_of(stage.scene)
            monkeypatch.setattr(changes, "_stage_of", lambda _scene: None)
            if kept != changes.parts_of(stage.scene):
                wrong.append(name)
            monkeypatch.setattr(changes, "_stage_of", in_a_window)
            if kept == before:
                same.append(name)
            before = kept
    finally:
        changes._stages.clear()
        changes._hashes.clear()
    assert wrong == []
    assert set(same) <= {"film", "hidden"}, "edits that a recording does not depend on"


def test_a_scene_that_is_read_in_shares_is_that_of_the_last_edit(stage, monkeypatch):
    """Each share makes one part at least, and an edit between two shares is in the outcome."""
    from blender_addon.editing.dial import changes
    from blender_addon.translate.viewport import kept

    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    stage.scene.collection.objects.link(eye)
    stage.scene.camera = eye
    bpy.context.view_layer.update()
    monkeypatch.setattr(
        changes, "_stage_of", lambda scene: changes._stages.setdefault(scene.session_uid, changes.Stage())
    )
    monkeypatch.setattr(changes, "SHARE_SECONDS", 0.0)
    monkeypatch.setattr(kept, "NEW_SHARE", 0.0)
    try:
        for name, edit in EDITS.items():
            shares, number = changes.Shares(), 0
            while not shares.read(stage.scene):
                number += 1
                if number == 1:
                    edit(stage)
                    bpy.context.view_layer.update()
                assert number < 200, name
            with monkeypatch.context() as whole:
                whole.setattr(changes, "_stage_of", lambda _scene: None)
                assert shares.parts.hashes() == changes.parts_of(stage.scene), name
            changes._stages.clear()
            assert number > 1, name
    finally:
        changes._stages.clear()
        changes._hashes.clear()
