# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that Blender evaluates for the frames of a rendered animation alone: it leaves the originals as they were."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

FIRST, LAST = 1, 5


@pytest.fixture
def animation(build, tmp_path):
    """Render the first and the last frame as an animation: the middle pixel (4,) of each."""
    from blender_addon import compat, jobs

    def run():
        scene = bpy.context.scene
        build.camera(type="ORTHO", ortho_scale=2.0)
        scene.render.engine, scene.spectral.render.samples = "SPECTRAL", 4
        scene.render.resolution_x = scene.render.resolution_y = 5
        scene.frame_start, scene.frame_end, scene.frame_step = FIRST, LAST, LAST - FIRST
        scene.frame_set(FIRST)
        scene.render.filepath = str(tmp_path / "frame_")
        compat.set_image_format(scene.render.image_settings, "OPEN_EXR", color_depth="32", color_mode="RGBA")
        jobs.records.clear()
        bpy.ops.render.render(animation=True)
        assert [entry.status for entry in jobs.records] == ["done", "done"]
        return [_middle(str(tmp_path / f"frame_{frame:04d}.exr")) for frame in (FIRST, LAST)]

    return run


def _middle(path):
    image = bpy.data.images.load(path, check_existing=False)
    pixels = np.array(image.pixels[:]).reshape(5, 5, 4)
    bpy.data.images.remove(image)
    return pixels[2, 2]


def keyed(owner, name, first, last):
    """Animate a property: ``first`` at the first frame, ``last`` at the last."""
    for frame, value in ((FIRST, first), (LAST, last)):
        if name.startswith("["):
            owner[name[2:-2]] = value
        else:
            setattr(owner, name, value)
        owner.keyframe_insert(name, frame=frame)


def plane_of(build, kind, name):
    """A plane that shows the number of an attribute."""
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = kind, name
    tree.links.new(node.outputs["Fac"], tree.nodes["shader"].inputs["Strength"])
    tree.nodes["shader"].inputs["Color"].default_value = (1, 1, 1, 1)
    return build.plane(size=3.0, material=material)


def _property(build):
    keyed(plane_of(build, "OBJECT", "glow"), '["glow"]', 0.25, 0.75)


def _property_of_the_mesh(build):
    keyed(plane_of(build, "OBJECT", "glow").data, '["glow"]', 0.25, 0.75)


def _driven(build):
    plane = plane_of(build, "OBJECT", "glow")
    plane["glow"] = 0.0
    plane.driver_add('["glow"]').driver.expression = "frame / 8 + 0.125"


def _path(build):
    keyed(plane_of(build, "OBJECT", "delta_location"), "delta_location", (0.75, 0.0, 0.0), (0.75, 0.75, 0.75))


def _instancer(build):
    plane = plane_of(build, "INSTANCER", "glow")
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.objects.unlink(plane)
    group.objects.link(plane)
    empty = build.object("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    keyed(empty, '["glow"]', 0.25, 0.75)


def _world(build):
    plane_of(build, "VIEW_LAYER", "glow")
    bpy.context.scene.world = bpy.data.worlds.new("World")
    keyed(bpy.context.scene.world, '["glow"]', 0.25, 0.75)


@pytest.mark.parametrize("make", [_property, _property_of_the_mesh, _driven, _path, _instancer, _world])
def test_attributes_have_the_values_of_the_rendered_frame(build, animation, make):
    make(build)
    first, last = animation()
    np.testing.assert_allclose(first[:3], 0.25, rtol=1e-3)
    np.testing.assert_allclose(last[:3], 0.75, rtol=1e-3)


def test_a_holdout_that_ends_is_seen_again(build, animation):
    plane = build.plane(size=3.0, material=build.material(shader="ShaderNodeEmission", Color=(0.5, 0.5, 0.5, 1.0)))
    keyed(plane, "is_holdout", True, False)
    first, last = animation()
    np.testing.assert_allclose(first, 0.0, atol=1e-6)
    np.testing.assert_allclose(last, (0.5, 0.5, 0.5, 1.0), rtol=1e-3)


def test_hair_that_is_hidden_at_first_is_shown_with_its_object(build, animation):
    material = build.material(shader="ShaderNodeEmission", Color=(0.5, 0.5, 0.5, 1.0))
    plane = build.plane(size=0.5, material=material)
    plane.show_instancer_for_render = False
    plane.modifiers.new("P", "PARTICLE_SYSTEM")
    settings = plane.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 50, 1.0
    settings.root_radius = settings.tip_radius = 20.0
    keyed(plane, "hide_render", True, False)
    first, last = animation()
    np.testing.assert_allclose(first[:3], 0.0, atol=1e-6)
    assert np.all(last[:3] > 0.1)  # strands of half a pixel's width and more


def test_a_frame_without_objects_has_no_note_about_its_size(build, animation):
    from blender_addon import jobs

    plane = build.plane(size=3.0, material=build.material(shader="ShaderNodeEmission", Color=(0.5, 0.5, 0.5, 1.0)))
    keyed(plane, "hide_render", True, False)
    first, last = animation()
    np.testing.assert_allclose((first[0], last[0]), (0.0, 0.5), rtol=1e-3)
    assert [entry.notes for entry in jobs.records] == [(), ()]


def test_a_film_becomes_transparent(build, animation):
    """As in Cycles: it stayed as it was in the file's own frame."""
    keyed(bpy.context.scene.render, "film_transparent", False, True)
    first, last = animation()
    np.testing.assert_allclose((first, last), [(0, 0, 0, 1), (0, 0, 0, 0)], atol=1e-6)


def test_simplify_culls_from_the_frame_on_in_which_it_is_on(build, animation):
    """As in Cycles: it stayed as it was in the file's own frame."""
    scene = bpy.context.scene
    plane = build.plane(size=3.0, material=build.material(shader="ShaderNodeEmission", Color=(0.5, 0.5, 0.5, 1.0)))
    scene.cycles.use_distance_cull = plane.cycles.use_distance_cull = True
    scene.cycles.distance_cull_margin = 2.0  # the camera is 5 above the plane
    keyed(scene.render, "use_simplify", False, True)
    first, last = animation()
    np.testing.assert_allclose((first[0], last[0]), (0.5, 0.0), rtol=1e-3)
