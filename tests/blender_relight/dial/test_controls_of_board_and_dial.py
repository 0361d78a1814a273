# SPDX-License-Identifier: GPL-3.0-or-later
"""Controls of the mixing board and the dial that other tests do not use."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("pythonosc", reason="needs python-osc: pip install 'spectral-scene[board]'")

ENERGY = 'bpy.data.lights["Key"].energy'


@pytest.fixture
def running(stage):
    """Start the stage's board with ``settings``, and stop it at the end."""
    from blender_addon.editing.board import live as mixing_board_live

    def start():
        bpy.ops.spectral.board_start()
        return mixing_board_live.session()

    yield start
    mixing_board_live.stop()


def test_positions_are_sent_to_the_address_of_the_board(stage, running):
    """A number that changes in Blender is sent to ``feedback_host`` and ``feedback_port``."""
    from spectral_core.explore.board.osc import OscLink

    heard = []
    tablet = OscLink(lambda control, position, at: heard.append((control.address, position)), port=0)
    settings = stage.spectral.board
    settings.use_midi, settings.osc_host, settings.osc_port = False, "127.0.0.1", 0
    settings.feedback_host, settings.feedback_port = "127.0.0.1", tablet.port
    entry = settings.bindings.add()
    entry.name, entry.low, entry.high, entry.control = ENERGY, 0.0, 400.0, "osc:0:/fader/1"
    try:
        running()
        bpy.data.lights["Key"].energy = 100.0
        deadline = time.monotonic() + 20
        while not heard and time.monotonic() < deadline:
            bpy.ops.spectral.board_poll()
            time.sleep(0.01)
    finally:
        tablet.close()

    assert heard[-1] == ("/fader/1", pytest.approx(0.25, abs=1e-6))


def test_pick_up_applies_to_the_board_and_unbind_removes_a_row(stage, running):
    settings = stage.spectral.board
    settings.use_midi, settings.osc_port = False, 0
    entry = settings.bindings.add()
    entry.name, entry.control, entry.pick_up = ENERGY, "osc:0:/fader/1", True
    board = running().board
    assert [binding.pick_up for binding in board.bindings] == [True]

    bpy.ops.spectral.board_unbind(index=0)
    assert not settings.bindings
    assert board.bindings == ()
    with pytest.raises(RuntimeError, match="there is no binding 3"):
        bpy.ops.spectral.board_unbind(index=3)


def test_a_missing_midi_device_is_reported_and_osc_works(stage, running):
    settings = stage.spectral.board
    settings.use_midi, settings.midi_port, settings.osc_port = True, "BCF2000", 0

    assert running().osc_port


def test_the_selector_is_set_without_a_mouse_and_the_dial_hidden(dial):
    assert bpy.ops.spectral.dial_play("EXEC_DEFAULT", selector=(0.25, -0.5)) == {"FINISHED"}
    assert tuple(dial.selector) == pytest.approx((0.25, -0.5))
    dial.show = False
    assert not dial.show
    assert bpy.ops.spectral.dial_stop() == {"FINISHED"}


@pytest.mark.parametrize(
    ("where", "number"), [("intensity", float("nan")), ("intensity", float("inf")), ("base", float("nan"))]
)
def test_apply_and_bake_refuse_powers_that_are_no_numbers(stage, dial, where, number):
    """A script may store NaN, which Blender does not limit; the lamps then had powers of NaN or Inf."""
    holder = dial if where == "intensity" else dial.bulbs["Key"].members[0]
    setattr(holder, where, number)
    before = [bpy.data.lights[name].energy for name in ("Key", "Fill")]
    with pytest.raises(RuntimeError, match="would get the power"):
        bpy.ops.spectral.dial_apply()
    assert [bpy.data.lights[name].energy for name in ("Key", "Fill")] == before
    dial.selector = dial.bulbs["Key"].place
    with pytest.raises(RuntimeError, match="'Dial Light' would get the power|not finite"):
        bpy.ops.spectral.dial_bake()
    assert "Dial Light" not in bpy.data.objects


@pytest.mark.parametrize("held", ["ctrl", "alt", "oskey"])
def test_keys_with_ctrl_alt_or_cmd_are_those_of_blender(stage, held):
    """Over the dial, Ctrl 1 moved the selector; in Blender it subdivides."""
    from blender_addon.operators.dial_drag import _key

    dial = stage.spectral.dial
    dial.bulbs.add().place = (0.0, 1.0)
    plain = {"ctrl": False, "alt": False, "oskey": False, "shift": False}
    for key in ("ONE", "UP_ARROW"):
        assert not _key(bpy.context, SimpleNamespace(type=key, **{**plain, held: True}))
        assert tuple(dial.selector) == (0.0, 0.0)
    assert _key(bpy.context, SimpleNamespace(type="ONE", **plain))
    assert tuple(dial.selector) == (0.0, 1.0)
