# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp that is renamed keeps its recording valid, and its bulb has the present name."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.drawing import dial_labels  # noqa: E402
from blender_addon.editing.dial import kept_mix  # noqa: E402
from blender_addon.editing.dial.names import name_of  # noqa: E402

pytestmark = pytest.mark.usefixtures("without_rays")


def names(dial):
    return [name_of(bulb) for bulb in dial.bulbs]


def changes(dial):
    bpy.ops.spectral.dial_check()
    return dial.changes


def test_a_rename_is_no_change_and_the_bulb_follows(dial, stage):
    """The panel asked for another recording: 'Key' was removed, and 'Main' was added."""
    before = names(dial)
    bpy.data.objects["Key"].name = "Main"
    bpy.data.lights["Key"].name = "Main light"
    assert changes(dial) == ""
    assert names(dial) == [{"Key": "Main"}.get(name, name) for name in before]
    labels = dial_labels.labels_of(dial_labels.DialShape.in_region(900, 700), dial, np.full(len(before), 0.25))
    assert any(text.startswith("Main ") for text, _, _ in labels)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    scene = bpy.context.scene
    kept_mix.forget_mixes()
    assert changes(scene.spectral.dial) == ""
    assert bpy.ops.spectral.dial_show() == {"FINISHED"}  # the file is read with the names that it has
    assert "Main" in names(scene.spectral.dial)


def test_a_long_name_ends_before_the_sidebar(dial):
    """A name that is wider than the view lay below the sidebar at its end, with the share of its lamp."""
    name = bpy.data.objects["Key"].name = "A lamp with a long name above the kitchen table at the window"
    shares = np.array([float(each == name) for each in names(dial)])
    shape = dial_labels.DialShape.in_region(800, 700, left=110, right=420, scale=2.0)
    labels = dial_labels.labels_of(shape, dial, shares)
    text = next(text for text, _, _ in labels if "100 %" in text)
    assert text.startswith("A l")
    assert "…" in text
    assert all(end < shape.end for end in dial_labels.ends_of(labels, shape.scale))


def test_the_changes_of_a_renamed_lamp_have_its_present_name(dial, stage):
    key, fill = bpy.data.objects["Key"], bpy.data.objects["Fill"]
    key.name = "Main"
    key.data.energy *= 2
    assert changes(dial) == "light 'Main' was changed"
    key.data.energy /= 2
    assert changes(dial) == ""
    # two lamps that swap their names, and a new one with the earlier name of another
    key.name, fill.name = "Other", "Key"
    key.name = "Fill"
    assert changes(dial) == ""
    key.name = "Main"
    stage.collection.objects.link(bpy.data.objects.new("Fill", bpy.data.lights.new("New", "POINT")))
    assert changes(dial) == "light 'Fill' was added"


@pytest.fixture
def instanced(stage):
    """The stage with two instances of Key, and a recording."""
    shown, key = bpy.data.collections.new("Shown"), bpy.data.objects["Key"]
    stage.collection.objects.unlink(key)
    shown.objects.link(key)
    for number in range(2):
        place = bpy.data.objects.new(f"Place {number}", None)
        place.instance_type, place.instance_collection, place.location = "COLLECTION", shown, (number, -1, 0)
        stage.collection.objects.link(place)
    bpy.context.view_layer.update()
    bpy.ops.spectral.dial_record()
    return stage.spectral.dial


def test_instances_follow_the_new_name_of_their_lamp(instanced, stage, without_rays):
    """'Key' was removed, and 'Main #2' was added."""
    key, fill = bpy.data.objects["Key"], bpy.data.objects["Fill"]
    assert "Key #2" in names(instanced)
    key.name = "Main"
    assert changes(instanced) == ""
    assert {"Main", "Main #2"} < set(names(instanced)) and "Key #2" not in names(instanced)
    # another lamp takes the earlier name, and a new one that of the instance
    fill.name = "Key"
    assert changes(instanced) == ""
    fill.users_collection[0].objects.link(bpy.data.objects.new("Key #2", fill.data))
    assert changes(instanced) == "light 'Key #2 (2)' was added"
    bpy.data.objects.remove(bpy.data.objects["Key #2"])
    key.data.energy *= 2
    assert changes(instanced) == "light 'Main' was changed, light 'Main #2' was changed"
    key.data.energy /= 2
    place = instanced.bulbs["Key #2"].place = (0.3, 0.4)
    without_rays.clear()
    assert bpy.ops.spectral.dial_record(only_changed=True) == {"FINISHED"}
    assert not without_rays  # no light had changed
    assert tuple(instanced.bulbs["Main #2"].place) == pytest.approx(place)
    assert changes(instanced) == ""


def test_a_renamed_lamp_that_is_hidden_in_the_viewport_is_no_change(dial, stage):
    bpy.data.objects["Key"].name = "Main"
    bpy.data.objects["Main"].hide_set(True)
    assert changes(dial) == ""


def test_a_mixture_is_applied_to_a_renamed_lamp(dial, stage):
    bpy.data.objects["Key"].name = "Main"
    dial.selector = dial.bulbs[[bulb.name for bulb in dial.bulbs].index("Key")].place
    bpy.ops.spectral.dial_apply()
    assert bpy.data.objects["Fill"].data.energy == pytest.approx(0.0, abs=1e-6)
    assert bpy.data.objects["Main"].data.energy > 200
    assert changes(dial) == ""


def test_only_what_changed_is_recorded_after_a_rename(dial, stage, without_rays):
    bpy.data.objects["Key"].name = "Zenith"  # the last of the sorted names
    dial.bulbs[[bulb.name for bulb in dial.bulbs].index("Key")].place = (0.1, 0.7)
    without_rays.clear()
    assert bpy.ops.spectral.dial_record(only_changed=True) == {"FINISHED"}
    assert not without_rays  # no light had changed
    assert [bulb.name for bulb in dial.bulbs] == sorted(bulb.name for bulb in dial.bulbs)
    assert tuple(kept_mix.live_mix(stage).transport.groups) == tuple(bulb.name for bulb in dial.bulbs)
    assert tuple(dial.bulbs["Zenith"].place) == pytest.approx((0.1, 0.7))
    assert dial.bulbs["Zenith"].members[0].owner == bpy.data.objects["Zenith"]
    assert changes(dial) == ""
    bpy.data.objects["Zenith"].name = "Key"
    bpy.data.objects["Fill"].data.energy = 30.0
    kept = kept_mix.live_mix(stage).transport
    zenith = kept.channels[kept.index_of("Zenith")].copy()
    assert bpy.ops.spectral.dial_record(only_changed=True) == {"FINISHED"}
    found = kept_mix.live_mix(stage).transport
    np.testing.assert_array_equal(found.channels[found.index_of("Key")], zenith)
    assert changes(dial) == ""


def test_linked_light_follows_a_rename(stage, without_rays):
    """Objects state by name which lamps do not light them."""
    only = bpy.data.collections.new("only")
    only.objects.link(bpy.data.objects["Plane"])
    bpy.data.objects["Key"].light_linking.receiver_collection = only
    bpy.ops.spectral.dial_record()
    bpy.data.objects["Key"].name = "Main"
    assert changes(stage.spectral.dial) == ""
    without_rays.clear()
    assert bpy.ops.spectral.dial_record(only_changed=True) == {"FINISHED"}
    assert not without_rays


def test_bulbs_of_light_groups_keep_the_names_of_the_groups(stage):
    stage.spectral.dial.one_per_light = False
    layer = bpy.context.view_layer
    for name in ("Key", "Fill"):
        layer.lightgroups.add(name=name)
        bpy.data.objects[name].lightgroup = name
    bpy.ops.spectral.dial_record()
    dial = stage.spectral.dial
    before = names(dial)
    bpy.data.objects["Key"].name = "Main"
    assert changes(dial) == ""
    assert names(dial) == before


def test_a_lamp_that_the_dial_makes_dark_is_no_change(dial, stage):
    """With the selector on a bulb, Apply to Lights reported the lamps of the others as removed."""

    def select(name):
        dial.selector = dial.bulbs[name].place
        bpy.ops.spectral.dial_apply()

    for name in ("Key", "Fill", "Key"):
        select(name)
        assert changes(dial) == ""
    dial.selector = (0.1, 0.2)
    bpy.ops.spectral.dial_apply()
    assert changes(dial) == ""
    select("Key")
    bpy.data.objects["Fill"].location.x += 1.0  # it is dark
    assert changes(dial) == ""
    bpy.ops.spectral.dial_apply(restore=True)
    assert changes(dial) == "light 'Fill' was changed"
    bpy.ops.spectral.dial_record()
    bpy.data.objects["Key"].data.energy = 0.0  # by hand
    assert changes(dial) == "light 'Key' was removed"


def test_a_lamp_of_negative_power_is_mixed_and_applied(stage):
    """It had a bulb, and Apply to Lights refused the dial: no light was known by its name."""
    bpy.data.objects["Fill"].data.energy = -30.0
    bpy.ops.spectral.dial_record()
    dial = stage.spectral.dial
    dial.selector = (0.1, 0.2)
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    assert bpy.data.objects["Fill"].data.energy < 0
    assert changes(dial) == ""
    assert bpy.ops.spectral.dial_apply(restore=True) == {"FINISHED"}
    assert bpy.data.objects["Fill"].data.energy == pytest.approx(-30.0)
    for bulb in dial.bulbs:
        bulb.is_on = bulb.name in ("Key", "Fill")
    made = set(bpy.data.objects)
    bpy.ops.spectral.dial_bake()
    (lamp,) = set(bpy.data.objects) - made
    assert lamp.data.energy > 0
