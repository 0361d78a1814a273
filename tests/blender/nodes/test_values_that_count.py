# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that count in one configuration only: each is compared with its formula or with Blender's rule."""

from __future__ import annotations

import math

import pytest

from spectral_core.scene import Subsurface

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize("angle", [0.05, 0.3, 1.2])
def test_a_sun_whose_strength_is_its_radiance_is_brighter_the_wider_it_is(build, translate, angle):
    sun = build.light("SUN", 7, angle=angle)
    if not hasattr(sun.data, "normalize"):
        pytest.skip("this Blender's suns have an irradiance always")
    sun.data.normalize = False
    assert translate().lights[0].irradiance == pytest.approx(7 * math.pi * math.sin(angle / 2) ** 2, rel=1e-6)


@pytest.mark.parametrize(("name", "value"), [("resolution_x", 400), ("pixel_aspect_x", 4.0)])
def test_camera_culling_knows_the_sides_of_the_picture(build, translate, name, value):
    """A square picture does not reach an object that a wide one shows."""
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = 100
    render.resolution_percentage, render.use_simplify = 100, True
    build.camera(type="ORTHO", ortho_scale=4.0)
    bpy.context.scene.camera.data.sensor_fit = "VERTICAL"
    plane = build.plane(size=0.5, material=build.material())
    plane.location.x = 6.0
    bpy.context.scene.cycles.use_camera_cull = plane.cycles.use_camera_cull = True
    assert not translate().instances
    setattr(render, name, value)
    assert len(translate().instances) == 1


@pytest.mark.parametrize(("name", "value"), [("resolution_y", 400), ("pixel_aspect_y", 4.0)])
def test_camera_culling_knows_the_height_of_the_picture(build, translate, name, value):
    """A square picture does not reach an object that a high one shows."""
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = 100
    render.resolution_percentage, render.use_simplify = 100, True
    build.camera(type="ORTHO", ortho_scale=4.0)
    bpy.context.scene.camera.data.sensor_fit = "HORIZONTAL"
    plane = build.plane(size=0.5, material=build.material())
    plane.location.y = 6.0
    bpy.context.scene.cycles.use_camera_cull = plane.cycles.use_camera_cull = True
    assert not translate().instances
    setattr(render, name, value)
    assert len(translate().instances) == 1


def test_each_model_of_subsurface_light_is_its_own(build, surface):
    found = set()
    for falloff in ("BURLEY", "RANDOM_WALK", "RANDOM_WALK_SKIN"):
        material = build.material(shader="ShaderNodeSubsurfaceScattering")
        material.node_tree.nodes["shader"].falloff = falloff
        made, _ = surface(material)
        assert isinstance(made, Subsurface)
        found.add(made.model)
    assert len(found) == 3


def test_nodes_write_to_the_aovs_of_their_names(build, translate):
    """Neither to another one, nor to one that the view layer lacks; of two nodes with one name the first counts."""
    for name, kind in (("Color", "COLOR"), ("Value", "VALUE")):
        aov = bpy.context.view_layer.aovs.add()
        aov.name, aov.type = name, kind
    material = build.material()
    for name, value in (("Value", 0.25), ("Value", 0.75), ("Color", 0.5), ("Other", 0.9)):
        node = material.node_tree.nodes.new("ShaderNodeOutputAOV")
        node.aov_name = name
        node.inputs["Value"].default_value = value
        node.inputs["Color"].default_value = (value, value, value, 1.0)
    build.plane(material=material)
    found = dict(translate().materials[0].outputs)
    assert set(found) == {"Color", "Value"}
    assert found["Value"] == pytest.approx(0.25)
    assert found["Color"].linear_rgb == pytest.approx([0.5] * 3)
