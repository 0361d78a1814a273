# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of a volume's panel that a script sets to NaN or infinity: the volume is left out, and a note names both."""

from __future__ import annotations

import math

import pytest

bpy = pytest.importorskip("bpy")


def stated_note(ramp, change):
    """The note on the volume ``ramp`` after ``change`` of its data, which leaves it out."""
    from blender_addon.translate.scene import translate_scene

    if bpy.context.object is not None:
        bpy.data.objects.remove(bpy.context.object)
    bpy.ops.spectral.volume_import(filepath=str(ramp[0]), preset="opaque", size=2.0)
    thing = bpy.context.object
    change(thing)
    for block in (thing, thing.data, thing.data.spectral.curves):
        block.update_tag()
    scene = translate_scene(bpy.context.evaluated_depsgraph_get())
    assert not scene.volumes
    (note,) = (note for note in scene.notes if note.subject == thing.name)
    assert note.message.endswith("the object was left out")
    return note.message


def every_number(settings):
    """(group, name) of each number that the panel of a volume shows."""
    for group in (settings, settings.materials[0]):
        for name, declared in type(group).__annotations__.items():
            if declared.function in (bpy.props.FloatProperty, bpy.props.FloatVectorProperty):
                yield group, name


def test_every_number_of_the_panel_is_named_if_it_is_none(blender, ramp):
    bpy.ops.spectral.volume_import(filepath=str(ramp[0]), preset="edges", size=2.0)
    names = [(type(group).__name__, name) for group, name in every_number(bpy.context.object.data.spectral)]
    assert len(names) == 5
    for owner, name in names:

        def change(thing, owner=owner, name=name):
            settings = thing.data.spectral
            settings.materials[0].use_gradient = True
            group = settings if owner == "SpectralVolume" else settings.materials[0]
            is_color = declared_as_color(group, name)
            setattr(group, name, (0.5, math.nan, 0.5) if is_color else math.nan)

        message = stated_note(ramp, change)
        label = bpy_label(bpy.context.object.data.spectral, owner, name)
        assert label in message
        assert "nan" in message
        assert f"of volume {bpy.context.object.data.name!r}" in message


def declared_as_color(group, name):
    return group.bl_rna.properties[name].is_array


def bpy_label(settings, owner, name):
    group = settings if owner == "SpectralVolume" else settings.materials[0]
    return group.bl_rna.properties[name].name


@pytest.mark.parametrize("value", [[0.0, math.nan], [-math.inf, 1.0], "wide", 3.0, [1.0]])
def test_a_range_that_is_none(blender, ramp, value):
    def change(thing):
        thing.data["spectral_range"] = value

    message = stated_note(ramp, change)
    assert "spectral_range" in message
    assert bpy.context.object.data.name in message


@pytest.mark.parametrize("axis", [0, 1])
def test_a_point_of_a_curve_that_is_none(blender, ramp, axis):
    def change(thing):
        node = thing.data.spectral.curves.nodes[0]
        node.mapping.curves[0].points[0].location[axis] = math.nan

    message = stated_note(ramp, change)
    assert "density curve of material 'skin'" in message
    assert "nan" in message


@pytest.mark.parametrize("size", [1e34, 1e-34])
def test_voxels_that_no_renderer_can_hold(blender, ramp, size):
    def change(thing):
        thing.scale = (size,) * 3

    assert "the edge of a voxel of volume" in stated_note(ramp, change)


def test_the_least_error_of_the_panel_is_accepted(blender):
    """Single precision holds 0.02 as a little less."""
    from blender_addon.translate.settings import settings_of
    from spectral_core.render.cost.asked import is_asked

    render = bpy.context.scene.spectral.render
    render.goal, render.target_error = "ERROR", 0.0
    settings = settings_of(bpy.context.scene)
    assert settings.target_error == 0.02
    assert is_asked(settings)
