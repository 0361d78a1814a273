# SPDX-License-Identifier: GPL-3.0-or-later
"""Glossy surfaces behind objects that a large lamp's shadow linking leaves out, as in Cycles."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

from tests.blender import cycles  # noqa: E402


def test_a_glossy_floor_has_the_whole_light_of_a_lamp_behind_an_object_that_is_left_out(build, tmp_path):
    """Half of the light is that of rays which scatter toward the lamp; they hit the object in the way."""
    build.plane(size=4.0, material=build.material(shader="ShaderNodeBsdfGlossy", Roughness=0.4))
    screen = build.plane("Screen", size=4.0, material=build.material())
    screen.location.z, screen.visible_camera = 1.0, False
    lamp = build.light("AREA")
    lamp.data.size, lamp.data.energy, lamp.location.z = 4.0, 100.0, 2.0
    lamp.light_linking.blocker_collection = chosen = bpy.data.collections.new("Blockers")
    chosen.objects.link(screen)
    chosen.collection_objects[0].light_linking.link_state = "EXCLUDE"
    build.camera((0, 0, 0.8))
    cycles.settings(samples=128, size=16)
    for kind in ("max", "diffuse", "glossy"):
        setattr(bpy.context.scene.cycles, f"{kind}_bounces", 0)
    theirs = cycles.cycles(tmp_path)
    ours, notes = cycles.ours(samples=128)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01) and not notes
