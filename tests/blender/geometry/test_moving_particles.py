# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of particles that are born and die while the shutter is open: each keeps its own way."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

FRAME = 8


@pytest.fixture
def fountain(build):
    """A square that emits cubes straight up, without gravity: x and y of each never change. Those live 4 frames."""
    ground = build.plane(size=4.0)
    bpy.ops.mesh.primitive_cube_add(size=0.1, location=(50, 0, 0))
    shown = bpy.context.object
    settings = ground.modifiers.new("Fountain", "PARTICLE_SYSTEM").particle_system.settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 120, 1, 20, 4
    settings.normal_factor, settings.effector_weights.gravity = 3.0, 0.0
    settings.render_type, settings.instance_object, settings.particle_size = "OBJECT", shown, 1.0
    build.camera()
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    for frame in range(1, FRAME + 3):
        scene.frame_set(frame)
    scene.frame_set(FRAME)
    return ground


def blurred(position):
    from blender_addon.translate.camera.motion import with_motion
    from blender_addon.translate.scene import translate_scene

    scene = bpy.context.scene
    scene.render.motion_blur_position = position
    depsgraph = bpy.context.evaluated_depsgraph_get()
    plain = translate_scene(depsgraph, is_moving=True)
    return with_motion(plain, depsgraph, None, lambda frame, part: scene.frame_set(frame, subframe=part))


@pytest.mark.parametrize(("position", "opens"), [("CENTER", -0.5), ("START", 0.0), ("END", -1.0)])
def test_particles_keep_their_way_and_those_that_do_not_last_are_left_out(fountain, position, opens):
    scene = blurred(position)
    ways = {}
    for moment in scene.moments:
        for item in scene.at(moment).instances:
            if item.name.startswith("Cube"):
                ways.setdefault(item.name, []).append(item.world_from_object[:3, 3])
    flying = {name: np.array(way) for name, way in ways.items() if np.abs(way[0][:2]).max() < 10}
    assert all(np.ptp(way[:, :2], axis=0).max() < 1e-4 for way in flying.values())
    evaluated = fountain.evaluated_get(bpy.context.evaluated_depsgraph_get())
    lives = [(p.birth_time, p.die_time) for p in evaluated.particle_systems[0].particles]
    first, last = FRAME + opens, FRAME + opens + 1.0
    expected = sum(birth <= first and last < death for birth, death in lives)
    born = sum(first < birth < last for birth, _ in lives)
    assert born > 2 and len(flying) == pytest.approx(expected, abs=1)
    assert all(np.ptp(way[:, 2]) > 0.05 for way in flying.values())


def test_names_of_the_instances_of_a_frame_stay_theirs_at_other_instants():
    from blender_addon.translate.camera.identities import Identity, Named
    from spectral_core.scene import Instance

    one, two, three = (Identity(1, 2, (place,), 0, is_particle=True) for place in range(3))
    items = [Instance(name, "mesh", np.eye(4), ("paint",)) for name in ("Cube", "Cube #2", "Cube #3")]
    named = Named({one: "Cube", two: "Cube #2"})
    found = named.placed([two, three], items[:2])
    assert found["Cube #2"] is not items[1] and found["Cube #2"].name == "Cube #2"
    assert set(found) - {"Cube #2"} == {"Cube #2 #2"}  # a new one takes no name of another
    assert named.of_particles() == {"Cube", "Cube #2", "Cube #2 #2"}
