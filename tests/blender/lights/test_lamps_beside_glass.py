# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose limits or shadow linking Cycles treats otherwise beside glass or mirrors get a note; others none."""

from __future__ import annotations

import pytest

from tests.blender.nodes.test_approximations import messages, shaded, smooth_cube

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"visible_glossy": False}, "hidden from glossy rays"),
        ({"visible_transmission": False}, "hidden from transmission rays"),
        ({"visible_transmission": False, "visible_glossy": False}, "hidden from glossy and transmission rays"),
        ({"max_bounces": 2}, "Max Bounces is 2"),
        ({"max_bounces": 12}, ""),  # the scene's own limit
        ({"visible_diffuse": False}, ""),
    ],
)
def test_limits_of_a_lamp_beside_rough_glass_get_a_note(build, translate, setting, words):
    ball, lamp = smooth_cube(), build.light("POINT")
    for name, value in setting.items():
        setattr(lamp.data.cycles if name == "max_bounces" else lamp, name, value)
    for kind, inputs in (
        ("Glossy" if hasattr(bpy.types, "ShaderNodeBsdfGlossy") else "Anisotropic", {"Roughness": 0.4}),
        ("Glass", {"Roughness": 0.0}),
        ("Principled", {"Roughness": 0.4}),
    ):
        shaded(ball, f"ShaderNodeBsdf{kind}", **inputs)
        assert "rough glass" not in messages(translate())
    for kind, inputs in (
        ("Glass", {"Roughness": 0.4}),
        ("Refraction", {"Roughness": 0.1}),
        ("Principled", {"Roughness": 0.4, "Transmission Weight": 1.0}),
    ):
        shaded(ball, f"ShaderNodeBsdf{kind}", **inputs)
        found = [note for note in translate().notes if "rough glass" in note.message]
        assert [note.subject for note in found] == ([lamp.name] if words else [])
        assert all(words in note.message for note in found)


@pytest.mark.parametrize(
    ("roughness", "radius", "state", "tells"),
    [
        (0.0, 0.5, "EXCLUDE", True),
        (0.3, 0.5, "EXCLUDE", False),
        (0.0, 0.0, "EXCLUDE", False),
        (0.0, 0.5, "INCLUDE", False),
    ],
)
def test_shadow_linking_beside_mirrors_gets_a_note(build, translate, roughness, radius, state, tells):
    ball, lamp = smooth_cube(), build.light("POINT")
    lamp.data.shadow_soft_size = radius
    shaded(ball, "ShaderNodeBsdfGlass", Roughness=roughness)
    lamp.light_linking.blocker_collection = chosen = bpy.data.collections.new("Blockers")
    chosen.objects.link(ball)
    chosen.collection_objects[0].light_linking.link_state = state
    found = [note.subject for note in translate().notes if "shadow linking leaves out" in note.message]
    assert found == ([lamp.name] if tells else [])
