# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting of the board's panel reaches its devices, its bindings or its orders; edits of the scene are named."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from blender_addon.editing.board import live
from blender_addon.editing.board.paths import full_path
from blender_addon.editing.dial.changes import parts_of, told
from spectral_core.errors import InvalidInputError
from tests.settings_walk import ignored_settings, other_rna, read_rna, settings_of

OUTSIDE = {"active": "the row that the list shows", "status": "of the run", "simultaneity": "of the last recording"}


class Link:
    """A device that keeps what it was opened with."""

    opened: list[Any]

    def __init__(self, receive: Any, **options: Any) -> None:
        type(self).opened.append((type(self).__name__, options))
        self.port = options.get("port")

    def has_motor(self, control: Any) -> bool:
        return False

    def close(self) -> None:
        pass


class Midi(Link):
    """A MIDI device."""


class Osc(Link):
    """An OSC server."""


@pytest.fixture
def opened(monkeypatch: Any) -> list[Any]:
    from spectral_core.explore.board import midi, osc

    Link.opened = []
    monkeypatch.setattr(midi, "MidiLink", Midi)
    monkeypatch.setattr(osc, "OscLink", Osc)
    yield Link.opened
    live.stop()


def test_every_connection_of_the_panel_reaches_its_device(stage: Any, opened: list[Any]) -> None:
    board = stage.spectral.board
    board.feedback_host = "10.0.0.2"

    def connected() -> Any:
        opened.clear()
        live.start(stage)
        return [(kind, sorted(options.items())) for kind, options in opened]

    names = set(settings_of(board, bpy.types.PropertyGroup)) - set(OUTSIDE) - {"bindings", "orders"}
    found = ignored_settings(
        names, lambda name: read_rna(board, name), lambda name, value: setattr(board, name, value),
        lambda name: other_rna(board, name), connected,
    )  # fmt: skip
    assert found == {}
    assert connected() == [
        ("Midi", [("name", None)]), ("Osc", [("feedback", ("10.0.0.2", 9001)), ("host", "127.0.0.1"), ("port", 9000)]),
    ]  # fmt: skip
    assert live.session().osc_port is None or live.session().osc_port == 9000
    board.feedback_host = ""
    assert dict(connected()[1][1])["feedback"] is None


def test_every_setting_of_a_binding_and_of_an_order_reaches_the_running_board(stage: Any, opened: list[Any]) -> None:
    key, fill = (full_path(bpy.data.lights[name], "energy") for name in ("Key", "Fill"))
    session, _ = live.start(stage)
    board = stage.spectral.board
    entry = board.bindings.add()
    entry.name, entry.control, entry.low, entry.high = key, "cc:0:81", 10.0, 300.0

    def running() -> Any:
        live.rebind(stage)
        assert board.status == ""
        return list(session.board.bindings), session.board.orders

    def walked(owner: Any, others: dict[str, Any]) -> dict[str, str]:
        return ignored_settings(
            others, lambda name: read_rna(owner, name), lambda name, value: setattr(owner, name, value), others.get,
            running,
        )  # fmt: skip

    of_binding = {"control": "cc:0:82", "low": 20.0, "high": 200.0, "pick_up": True, "name": fill}
    assert set(of_binding) | {"block"} == set(settings_of(entry, bpy.types.PropertyGroup)) | {"name"}
    entry.block = bpy.data.lights["Key"]
    assert walked(entry, {name: value for name, value in of_binding.items() if name != "name"}) == {}
    entry.block, entry.name = None, fill
    assert [each.target for each in running()[0]] == [fill] and entry.block == bpy.data.lights["Fill"]
    order = board.orders.add()
    order.lower, order.upper = key, fill
    size = full_path(bpy.data.lights["Key"], "shadow_soft_size")
    assert walked(order, {"lower": size, "upper": size}) == {}
    order.upper = ""
    assert running()[1] == ()
    order.upper = fill
    entry.low = entry.high
    live.rebind(stage)
    assert "two different finite ends" in board.status
    entry.low = 10.0
    live.rebind(stage)
    assert board.status == ""


def test_a_renamed_block_is_followed_by_the_orders_that_name_it(stage: Any) -> None:
    board = stage.spectral.board
    paths = [full_path(bpy.data.lights[name], "energy") for name in ("Key", "Fill")]
    for path in paths:
        entry = board.bindings.add()
        entry.name, entry.control = path, f"cc:0:{len(board.bindings)}"
    for lower, upper in (paths, paths[::-1]):
        order = board.orders.add()
        order.lower, order.upper = lower, upper
    assert not live.follow_names(board)
    bpy.data.lights["Fill"].name = "Rim"
    assert live.follow_names(board)
    now = full_path(bpy.data.lights["Rim"], "energy")
    assert [each.name for each in board.bindings] == [paths[0], now]
    assert [(each.lower, each.upper) for each in board.orders] == [(paths[0], now), (now, paths[0])]
    assert not live.follow_names(board)


def test_a_learned_fader_takes_the_range_of_its_number(stage: Any, opened: list[Any]) -> None:
    from spectral_core.explore.board import Control

    session, _ = live.start(stage)
    board, camera = stage.spectral.board, stage.camera.data
    path = full_path(camera, "lens")
    old = board.bindings.add()
    old.name, old.control = full_path(bpy.data.lights["Key"], "energy"), "cc:0:7"
    taken = board.bindings.add()
    taken.name, taken.block, taken.control = path, camera, "cc:0:1"
    live.rebind(stage)
    session.board.learn(path)
    for position in (0.2, 0.8):
        session.board.receive(Control.parse("cc:0:7"), position, 0.0)
        live.tick()
    assert [each.name for each in board.bindings] == [path]  # the fader is taken from its earlier number
    entry = board.bindings[path]
    assert (entry.control, entry.low, entry.high) == ("cc:0:7", *(pytest.approx(each) for each in live.range_of(path)))
    assert entry.block == camera or entry.block is None
    assert camera.lens == pytest.approx(entry.low + 0.8 * (entry.high - entry.low), rel=1e-5)
    bpy.data.cameras.remove(camera)
    session.board.receive(Control.parse("cc:0:7"), 0.5, 0.0)
    live.tick()
    assert board.status != ""


def test_an_unplugged_device_is_reported_until_it_is_back(stage: Any, opened: list[Any]) -> None:
    session, _ = live.start(stage)
    device = SimpleNamespace(
        missing="nanoKONTROL", pump=lambda: None, has_motor=lambda _: False, send=lambda *_: None, close=lambda: None
    )
    session.links.append(device)
    board = stage.spectral.board
    live.tick()
    assert board.status.startswith("nanoKONTROL is unplugged")
    device.missing = None
    live.tick()
    assert board.status == ""


def test_a_network_that_fails_and_a_sender_of_another_range_are_reported_until_they_are_right(
    stage: Any, opened: list[Any]
) -> None:
    from spectral_core.explore.board import Binding, Control

    session, _ = live.start(stage)
    works: list[bool] = [False]
    device = SimpleNamespace(
        unsent="positions cannot be sent", has_motor=lambda _: True, send=lambda *_: works[0], close=lambda: None
    )
    session.links[:] = [device]
    fader, path = Control("osc", 0, "/key"), full_path(bpy.data.lights["Key"], "energy")
    session.board.bind(Binding(fader, path, 0.0, 50.0))
    session.board.receive(fader, 100.0, 0.0)
    live.tick()
    report = stage.spectral.board.status
    assert "positions cannot be sent" in report and "osc:0:/key sends 100; a fader sends 0 to 1" in report
    assert bpy.data.lights["Key"].energy == 50.0
    bpy.data.lights["Key"].energy = 20.0
    live.tick()
    assert session.board.motors(float("inf")) == ((fader, 0.4),)  # was not sent
    device.unsent, works[0] = "", True
    session.board.receive(fader, 0.5, 0.0)
    live.tick()
    assert stage.spectral.board.status == "" and bpy.data.lights["Key"].energy == 25.0


def test_a_device_that_cannot_be_opened_is_named(stage: Any, opened: list[Any], monkeypatch: Any) -> None:
    from spectral_core.explore.board import midi

    def absent(*_: Any, **__: Any) -> Any:
        raise InvalidInputError("no MIDI device is connected")

    monkeypatch.setattr(midi, "MidiLink", absent)
    assert live.start(stage)[1] == ["no MIDI device is connected"]
    assert [kind for kind, _ in opened] == ["Osc"]


EDITS = {
    "the camera": lambda stage: setattr(stage.camera.data, "lens", 31.0),
    "the size of the picture": lambda stage: setattr(stage.render, "resolution_x", 20),
    "the world": lambda stage: setattr(
        next(node for node in stage.world.node_tree.nodes if node.type == "BACKGROUND").inputs["Strength"],
        "default_value", 0.7,
    ),
    "light 'Key'": lambda stage: setattr(bpy.data.lights["Key"], "energy", 3.0),
    "object 'Ball'": lambda stage: setattr(bpy.data.objects["Ball"], "location", (0.0, 0.0, 2.0)),
    "mesh 'Sphere'": lambda stage: bpy.data.meshes["Sphere"].vertices[0].co.__setitem__(0, 3.0),
    "material 'Glow'": lambda stage: setattr(
        next(node for node in bpy.data.materials["Glow"].node_tree.nodes if node.type == "EMISSION").inputs["Strength"],
        "default_value", 9.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", EDITS)
def test_the_part_that_an_edit_changes_is_named(stage: Any, name: str) -> None:
    """Without a recording: parts before and after."""
    before = parts_of(stage)
    EDITS[name](stage)
    for data in (*bpy.data.meshes, *bpy.data.materials, *bpy.data.worlds):
        data.update_tag()
    assert name in before
    assert told(before, parts_of(stage)).split(", ") == [f"{name} was changed"]
