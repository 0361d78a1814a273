# SPDX-License-Identifier: GPL-3.0-or-later
"""The ledger is complete: every setting of this Blender is read, has no effect on a picture, or has a note."""

from __future__ import annotations

import pytest

from tests.blender.ledger_walk import missing_of, missing_of_nodes, missing_of_types

bpy = pytest.importorskip("bpy")


def test_the_ledger_has_every_setting(blender):
    """Blender's own types and Cycles' settings."""
    missing = missing_of_types()
    assert not missing, f"enter these settings in blender_addon/translate/ledger: {missing}"


def test_the_ledger_has_every_node_setting_and_input(blender):
    missing = missing_of_nodes()
    assert not missing, f"enter these in blender_addon/translate/ledger/nodes.toml: {missing}"


def test_a_node_that_is_read_has_no_entry_as_a_whole(blender):
    """An entry for a whole node would hide its new settings."""
    from blender_addon.translate.ledger import entries
    from blender_addon.translate.shading import surfaces
    from blender_addon.translate.shading.nodes import textures as texture_nodes
    from blender_addon.translate.shading.reader import EVALUATORS

    tree = bpy.data.node_groups.new("every node", "ShaderNodeTree")
    read = (set(EVALUATORS) | set(surfaces.SURFACES)) - set(texture_nodes.PATTERNS)
    whole = [kind for kind, entry in entries().items() if entry.stand_in and hasattr(bpy.types, kind)]
    assert len(whole) > 3
    assert [kind for kind in whole if tree.nodes.new(kind).type in read] == []


def test_a_missing_setting_is_detected(blender):
    assert missing_of("World", ["color", "a setting of tomorrow"]) == ["a setting of tomorrow"]
    assert missing_of("A type of tomorrow", ["anything"]) == ["anything"]


def test_no_name_has_two_entries(blender):
    from blender_addon.translate.ledger import entries

    for kind, entry in entries().items():
        assert not entry.read & entry.no_effect, kind
        assert not (entry.read | entry.no_effect) & set(entry.noted), kind


def test_a_changed_setting_without_support_gets_its_note(build, translate):
    material = build.material()
    build.plane(material=material)
    assert not translate().notes
    cycles = bpy.context.scene.cycles
    cycles.use_fast_gi = True
    bpy.context.view_layer.samples = 7
    notes = {(note.subject, note.message.split(";")[0]) for note in translate().notes}
    assert ("Scene", "Fast GI is not simulated") in notes
    assert any(message == "samples of the view layer are not used" for _, message in notes)
