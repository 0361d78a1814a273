# SPDX-License-Identifier: GPL-3.0-or-later
"""The mixing board through Blender's operators: OSC messages on this machine change numbers."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("pythonosc", reason="needs python-osc: pip install 'spectral-scene[board]'")

ENERGY, SIZE = 'bpy.data.lights["Key"].energy', 'bpy.data.lights["Key"].shadow_soft_size'
SELECTOR = 'bpy.data.scenes["Scene"].spectral.dial.selector[0]'


@pytest.fixture
def board(stage):
    """Start the stage's board on a free OSC port without MIDI, and stop it at the end."""
    from blender_addon.editing.board import live as mixing_board_live

    settings = stage.spectral.board
    settings.use_midi, settings.osc_port = False, 0
    bpy.ops.spectral.board_start()
    yield settings
    mixing_board_live.stop()


@pytest.fixture
def fader(board):
    """Send positions to addresses, wait until the board has received them, and poll it."""
    from pythonosc.udp_client import SimpleUDPClient

    from blender_addon.editing.board import live as mixing_board_live

    running = mixing_board_live.session()
    client = SimpleUDPClient("127.0.0.1", running.osc_port)

    def move(poll=True, **positions):
        before = running.board.received
        for name, position in positions.items():
            client.send_message(f"/fader/{name}", float(position))
        deadline = time.monotonic() + 20
        while running.board.received < before + len(positions) and time.monotonic() < deadline:
            time.sleep(0.002)
        if poll:
            bpy.ops.spectral.board_poll()

    yield move
    client._sock.close()


def bind(settings, target, name, low, high):
    entry = settings.bindings.add()
    entry.name, entry.low, entry.high = target, low, high
    entry.control = f"osc:0:/fader/{name}"


def test_faders_change_several_numbers_at_once(board, fader):
    bind(board, ENERGY, "a", 0, 500)
    bind(board, SIZE, "b", 0.1, 1.1)
    fader(a=0.25, b=0.5)
    key = bpy.data.lights["Key"]
    assert (key.energy, key.shadow_soft_size) == pytest.approx((125.0, 0.6), rel=1e-6)


def test_learning_by_moving_is_saved_in_the_file(board, fader, stage):
    bpy.ops.spectral.board_learn(target=SELECTOR)
    fader(x=0.2)
    fader(x=0.7)
    entry = board.bindings[SELECTOR]
    assert entry.control == "osc:0:/fader/x"
    assert stage.spectral.dial.selector[0] == pytest.approx(entry.low + 0.7 * (entry.high - entry.low), rel=1e-5)
    bpy.ops.spectral.board_stop()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert bpy.context.scene.spectral.board.bindings[SELECTOR].control == "osc:0:/fader/x"


def test_a_number_that_is_deleted_while_it_is_learned_does_not_stop_the_others(board, fader):
    bind(board, SIZE, "b", 0.1, 1.1)
    bpy.ops.spectral.board_learn(target='bpy.data.lights["Fill"].energy')
    bpy.data.lights.remove(bpy.data.lights["Fill"])
    fader(poll=False, x=0.1)
    fader(x=0.7, b=0.5)
    assert "no lights named 'Fill'" in board.status and len(board.bindings) == 1
    assert bpy.data.lights["Key"].shadow_soft_size == pytest.approx(0.6, rel=1e-6)


def test_bounds_stay_in_order(board, fader):
    bpy.data.lights["Key"].energy = 10.0
    bind(board, ENERGY, "low", 0, 100)
    bind(board, 'bpy.data.lights["Fill"].energy', "high", 0, 100)
    bpy.ops.spectral.board_order(lower=ENERGY, upper='bpy.data.lights["Fill"].energy')
    fader(high=0.4)
    fader(low=0.9)
    assert bpy.data.lights["Key"].energy == pytest.approx(40.0) == bpy.data.lights["Fill"].energy


def test_motors_follow_a_number_that_is_changed_in_blender(board, fader):
    from blender_addon.editing.board import live as mixing_board_live

    sent = []
    link = mixing_board_live.session().links[0]
    bind(board, ENERGY, "a", 0, 400)
    bpy.ops.spectral.board_poll()
    assert not link.has_motor(None)  # without an address for feedback no position is sent or recorded as sent
    link.has_motor = lambda control: True
    link.send = lambda control, position: sent.append((str(control), position))
    bpy.ops.spectral.board_poll()
    assert sent == [("osc:0:/fader/a", pytest.approx(0.5))]
    bpy.ops.spectral.board_poll()
    assert len(sent) == 1  # the fader has this position: nothing is sent, so there is no loop
    time.sleep(0.03)
    bpy.data.lights["Key"].energy = 100.0
    bpy.ops.spectral.board_poll()
    assert sent[1:] == [("osc:0:/fader/a", pytest.approx(0.25))]


def test_recorded_motion_is_saved_with_its_simultaneity(board, fader, tmp_path):
    from spectral_core.explore.board import Recording

    bind(board, ENERGY, "a", 0, 100)
    bind(board, SIZE, "b", 0, 1)
    for share in np.linspace(0, 1, 6):
        fader(a=share, b=1 - share)
    path = tmp_path / "motion.json"
    bpy.ops.spectral.board_motion(filepath=str(path))
    assert set(Recording.load(path).targets) == {ENERGY, SIZE}
    assert json.loads(path.read_text())["format"] == "spectral-scene fader recording"
    rows = [[float(number) for number in line.split()] for line in board.simultaneity.splitlines()]
    assert rows[0][0] == rows[1][1] == 1.0
    assert rows[0][1] == rows[1][0] < -0.5  # their messages come one after the other


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("energy", "is no data path"),
        ('bpy.data.lights["Nobody"].energy', "no lights named 'Nobody'"),
        ('bpy.data.lights["Key"].name', "not a number"),
        ('bpy.data.lights["Key"].color[7]', "not a number"),
        ('bpy.data.lights["Key"].use_shadow', "not a number"),
    ],
)
def test_a_path_to_no_number_is_refused(board, path, message):
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.spectral.board_learn(target=path)


def test_numbers_of_all_types_are_found(stage):
    from blender_addon.editing.board.paths import number_at

    key = bpy.data.objects["Key"]
    key["my size"] = 2.0
    key.name = 'The "Key"'
    for path, value in (
        (r'bpy.data.objects["The \"Key\""].location[2]', 5.0),
        (r'bpy.data.objects["The \"Key\""]["my size"]', 3.0),
        ('bpy.data.scenes["Scene"].spectral.render.samples', 7.0),
        ('bpy.data.materials["Glow"].node_tree.nodes["Emission"].inputs[1].default_value', 4.0),
    ):
        number = number_at(path)
        number.write(value)
        assert number.read() == value
        low, high = number.range()
        assert low < high


def test_paths_with_single_quotes_are_read_as_those_with_double_ones(stage):
    """Beyond the name of the data-block they led nowhere: no number, and no setting of a sweep."""
    from blender_addon.editing.board.paths import number_at
    from blender_addon.editing.sweep.settings import setting_at

    tree = bpy.data.materials["Glow"].node_tree
    tree.nodes["Emission"].name = 'It\'s "it"'
    bpy.data.objects["Key"]["my 'size'"] = 2.0
    for path, value in (
        (r"""bpy.data.materials['Glow'].node_tree.nodes['It\'s "it"'].inputs[0].default_value[1]""", 0.25),
        (r"""bpy.data.materials['Glow'].node_tree.nodes['It\'s \"it\"'].inputs['Strength'].default_value""", 4.0),
        (r"""bpy.data.objects['Key']['my \'size\'']""", 3.0),
        (r"""bpy.data.objects["Key"]["my 'size'"]""", 5.0),
    ):
        number_at(path).write(value)
        assert number_at(path).read() == value == setting_at(path).place.read()


def test_missing_hardware_is_reported_and_is_no_error(stage, monkeypatch, capfd):
    from blender_addon.editing.board import live as mixing_board_live
    from spectral_core.explore.board import midi

    monkeypatch.setattr(midi, "port_names", list)
    settings = stage.spectral.board
    settings.use_midi, settings.use_osc = True, False
    assert bpy.ops.spectral.board_start() == {"CANCELLED"}
    assert "no MIDI device is connected" in settings.status
    assert mixing_board_live.session() is None
    settings.use_osc, settings.osc_port = True, 0
    assert bpy.ops.spectral.board_start() == {"FINISHED"}
    mixing_board_live.stop()


def test_learning_reports_why_a_device_did_not_open(stage, monkeypatch):
    from blender_addon.editing.board import live as mixing_board_live
    from spectral_core.explore.board import midi

    monkeypatch.setattr(midi, "port_names", list)
    settings = stage.spectral.board
    settings.use_midi, settings.use_osc = True, False
    with pytest.raises(RuntimeError, match="no board was found: no MIDI device is connected"):
        bpy.ops.spectral.board_learn(target=ENERGY)
    assert "no MIDI device is connected" in settings.status
    assert mixing_board_live.session() is None
    settings.use_osc, settings.osc_port, settings.status = True, 0, ""
    assert bpy.ops.spectral.board_learn(target=ENERGY) == {"FINISHED"}
    assert "no MIDI device is connected" in settings.status
    mixing_board_live.stop()
    settings.use_midi = settings.use_osc = False
    with pytest.raises(RuntimeError, match="MIDI and OSC are off; switch one of them on"):
        bpy.ops.spectral.board_learn(target=ENERGY)


def test_starting_keeps_the_report_of_a_binding_that_is_invalid(stage, monkeypatch):
    from blender_addon.editing.board import live as mixing_board_live
    from spectral_core.explore.board import midi

    monkeypatch.setattr(midi, "port_names", list)
    settings = stage.spectral.board
    settings.use_midi, settings.osc_port = True, 0
    bind(settings, ENERGY, "a", 0, 100)
    settings.bindings[0].control = "nonsense"
    assert bpy.ops.spectral.board_start() == {"FINISHED"}
    assert "no MIDI device is connected" in settings.status and "nonsense" in settings.status
    mixing_board_live.stop()


def test_a_fader_that_learns_another_number_names_the_earlier_one(board, fader):
    bind(board, ENERGY, "a", 0, 500)
    bind(board, SIZE, "b", 0.2, 0.4)
    bpy.ops.spectral.board_learn(target=SIZE)
    fader(a=0.0)
    fader(a=0.5)
    assert [entry.name for entry in board.bindings] == [SIZE]
    assert f"osc:0:/fader/a was bound to {ENERGY}, and is bound to {SIZE} now" in board.status
    assert board.bindings[SIZE].control == "osc:0:/fader/a"
