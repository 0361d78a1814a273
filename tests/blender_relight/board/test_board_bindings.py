# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the board follow their data-blocks, and Learn Fader reads the paths that it writes."""

from __future__ import annotations

import bpy
import pytest

from blender_addon.editing.board import followed, live
from blender_addon.editing.board.paths import full_path, number_at


@pytest.fixture
def running(stage):
    """A started board without a device."""
    stage.spectral.board.use_midi = False
    stage.spectral.board.osc_port = 0
    session, _ = live.start(stage)
    yield session
    live.stop()


@pytest.mark.parametrize("name", ["Key", 'Key "left"', "Key's", "back\\slash", "a]b", "Lämpchen", "two\nlines\t"])
def test_written_paths_can_be_read(stage, name):
    lamp = bpy.data.lights["Key"]
    lamp.name = name
    number = number_at(full_path(lamp, "energy"))
    assert number.owner == lamp
    assert number.read() == pytest.approx(200.0)
    assert number_at(full_path(lamp, "color", 1)).read() == pytest.approx(0.6)
    of_blender = f'bpy.data.lights["{bpy.utils.escape_identifier(lamp.name)}"].energy'
    assert number_at(of_blender) == number


def test_a_number_of_a_node_is_found_through_its_material(stage):
    tree = bpy.data.materials["Glow"].node_tree
    node = next(node for node in tree.nodes if node.type == "EMISSION")
    path = full_path(tree, node.path_from_id() + ".inputs[1].default_value")
    assert path.startswith('bpy.data.materials["Glow"].node_tree.nodes')
    assert number_at(path).read() == pytest.approx(3.0)


def test_a_binding_follows_its_renamed_light(stage, running):
    from spectral_core.explore.board import Control

    settings, lamp = stage.spectral.board, bpy.data.lights["Key"]
    entry = settings.bindings.add()
    entry.name, entry.control, entry.high = full_path(lamp, "energy"), "osc:0:/1", 100.0
    order = settings.orders.add()
    order.lower, order.upper = entry.name, full_path(bpy.data.lights["Fill"], "energy")
    live.rebind(stage)
    lamp.name, stage.name = "Main", "Stage"
    live.tick()
    assert entry.name == order.lower == 'bpy.data.lights["Main"].energy'
    running.board.receive(Control.parse("osc:0:/1"), 0.5, 0.0)
    live.tick()
    assert lamp.energy == pytest.approx(50.0)
    assert settings.status == ""


def test_an_order_can_be_removed_while_the_board_runs(stage, running):
    key, fill = (full_path(bpy.data.lights[name], "energy") for name in ("Key", "Fill"))
    bpy.ops.spectral.board_order(lower=key, upper=fill)
    assert running.board.orders == ((key, fill),)
    bpy.ops.spectral.board_disorder(index=0)
    assert running.board.orders == ()
    with pytest.raises(RuntimeError, match="there is no order 0"):
        bpy.ops.spectral.board_disorder(index=0)


@pytest.mark.parametrize("remove", ["the lamp", "its object"])
def test_a_deleted_light_limits_no_fader(stage, running, remove):
    """The fader stopped at 0, or at the last power of a lamp that only its binding kept in the file."""
    from spectral_core.explore.board import Control

    key, fill = (full_path(bpy.data.lights[name], "energy") for name in ("Key", "Fill"))
    for name, control in ((key, "osc:0:/1"), (fill, "osc:0:/2")):
        entry = stage.spectral.board.bindings.add()
        entry.name, entry.control, entry.high = name, control, 200.0
    bpy.ops.spectral.board_order(lower=key, upper=fill)
    live.tick()
    if remove == "the lamp":
        bpy.data.lights.remove(bpy.data.lights["Fill"])
    else:
        bpy.data.objects.remove(bpy.data.objects["Fill"])
        assert "Fill" in bpy.data.lights
    running.board.receive(Control.parse("osc:0:/1"), 0.5, 0.0)
    live.tick()
    assert bpy.data.lights["Key"].energy == pytest.approx(100.0)  # above the 80 of Fill
    assert live.read(fill) is None


def test_an_undo_gives_a_fader_its_binding_back_and_a_redo_takes_it(stage, running):
    from spectral_core.explore.board import Control

    entry = stage.spectral.board.bindings.add()
    entry.name, entry.low, entry.high = full_path(bpy.data.lights["Fill"], "energy"), 0.0, 40.0
    entry.control = "osc:0:/3"
    bpy.ops.ed.undo_push(message="bound")
    bpy.ops.spectral.board_unbind(index=0)
    bpy.ops.ed.undo_push(message="unbound")
    assert running.board.bindings == ()
    bpy.ops.ed.undo()
    running.board.receive(Control.parse("osc:0:/3"), 0.25, 0.0)
    live.tick()
    assert bpy.data.lights["Fill"].energy == pytest.approx(10.0)
    bpy.ops.ed.redo()
    assert not running.board.bindings


def test_a_custom_property_is_bound_over_its_own_range_and_moves_what_it_drives(stage):
    holder = bpy.data.objects["Ball"]
    for name, value, limits in (("Pull", 3.0, (-4.0, 8.0)), ("Count", 3, (1, 12)), ("Free", 3.0, (0.0, 6.0))):
        holder[name] = value
        if name != "Free":
            holder.id_properties_ui(name).update(soft_min=limits[0], soft_max=limits[1])
        assert number_at(f'bpy.data.objects["Ball"]["{name}"]').range() == limits
    holder["Pair"] = [1.0, 2.0]
    holder.update_tag()
    driven = bpy.data.objects.new("Driven", None)
    driver = driven.driver_add("location", 0).driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = holder, '["Pair"][1]'
    stage.collection.objects.link(driven)
    bpy.context.view_layer.update()
    number_at('bpy.data.objects["Ball"]["Pair"][1]').write(7.0)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert driven.evaluated_get(depsgraph).location.x == pytest.approx(7.0)


@pytest.mark.parametrize("name", ["Key", 'Key "left"'])
def test_a_linked_number_is_not_taken_for_the_local_one_of_its_name(stage, tmp_path, name):
    library = tmp_path / "lamps.blend"
    bpy.data.lights["Key"].name = name
    bpy.data.libraries.write(str(library), {bpy.data.lights[name]})
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.lights = [name]
    linked = wanted.lights[0]
    linked.energy = 7.0
    path = full_path(linked, "energy")
    assert number_at(path).owner == linked
    assert number_at(full_path(bpy.data.lights[name], "energy")).read() == pytest.approx(200.0)
    assert path.endswith(f'"{bpy.data.libraries[0].filepath}"].energy')
    with pytest.raises(Exception, match="this file has no lights named 'Key', linked from //other.blend"):
        number_at('bpy.data.lights["Key", "//other.blend"].energy')


def test_a_range_that_blender_refuses_is_reported_and_other_faders_work(stage, running):
    from spectral_core.explore.board import Control

    board = stage.spectral.board
    for control, target, high in (
        ("osc:0:/frame", 'bpy.data.scenes["Scene"].frame_current', 1e12),
        ("osc:0:/key", 'bpy.data.lights["Key"].energy', 100.0),
    ):
        entry = board.bindings.add()
        entry.name, entry.control, entry.low, entry.high = target, control, 0.0, high
    for name in ("/frame", "/key"):
        running.board.receive(Control("osc", 0, name), 0.5, 1.0)
    bpy.ops.spectral.board_poll()
    assert "'frame_current' cannot be set to 5e+11" in board.status
    assert bpy.data.lights["Key"].energy == 50.0


def test_a_binding_keeps_no_deleted_object_and_its_row_reports_it(stage, running, tmp_path):
    """Its reference counted as a user, so that the object stayed in the file, and its fader went on to move it."""
    from blender_addon.panels.board import _fault

    ball = bpy.data.objects.new("Pebble", bpy.data.meshes.new("Pebble"))
    stage.collection.objects.link(ball)
    entry, lamp = stage.spectral.board.bindings.add(), stage.spectral.board.bindings.add()
    entry.name, entry.control = full_path(ball, "location", 0), "osc:0:/1"
    lamp.name, lamp.control = full_path(bpy.data.lights["Key"], "energy"), "osc:0:/2"
    live.rebind(stage)
    assert entry.block == ball
    assert (_fault(entry.name), _fault(lamp.name)) == ("", "")
    stage.collection.objects.unlink(ball)  # as a deletion in the 3D view does
    assert "no scene uses 'Pebble' any more" in _fault(entry.name)
    live.tick()
    assert (entry.block, ball.users) == (None, 0)
    assert "no scene uses 'Pebble' any more" in _fault(entry.name)
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    with bpy.data.libraries.load(str(path)) as (there, _):
        assert "Pebble" not in there.objects
        assert "Key" in there.lights
    assert lamp.block == bpy.data.lights["Key"]
    stage.collection.objects.link(ball)
    assert followed.follow_names(stage.spectral.board) is False
    assert (entry.block, _fault(entry.name)) == (ball, "")


def test_a_file_is_saved_without_a_deleted_object_also_if_the_board_is_stopped(stage, running, tmp_path):
    lamp = bpy.data.lights["Key"]
    entry = stage.spectral.board.bindings.add()
    entry.name, entry.control = full_path(lamp, "energy"), "osc:0:/1"
    live.rebind(stage)
    live.stop()
    for each in [obj for obj in bpy.data.objects if obj.data == lamp]:
        bpy.data.objects.remove(each)
    bpy.data.materials["Glow"].name = "Ember"
    path = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    with bpy.data.libraries.load(str(path)) as (there, _):
        assert "Key" not in there.lights
