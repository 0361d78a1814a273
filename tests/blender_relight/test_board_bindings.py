# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the board follow their data-blocks, and Learn Fader reads the paths that it writes."""

from __future__ import annotations

import bpy
import pytest

from blender_addon.editing.board import live
from blender_addon.editing.board.paths import full_path, number_at


@pytest.fixture
def running(stage):
    """A started board without a device."""
    stage.spectral.board.use_midi = False
    stage.spectral.board.osc_port = 0
    session, _ = live.start(stage)
    yield session
    live.stop()


@pytest.mark.parametrize("name", ["Key", 'Key "left"', "Key's", "back\\slash", "a]b", "Lämpchen"])
def test_written_paths_can_be_read(stage, name):
    lamp = bpy.data.lights["Key"]
    lamp.name = name
    number = number_at(full_path(lamp, "energy"))
    assert number.owner == lamp
    assert number.read() == pytest.approx(200.0)
    assert number_at(full_path(lamp, "color", 1)).read() == pytest.approx(0.6)


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
