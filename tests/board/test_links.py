# SPDX-License-Identifier: GPL-3.0-or-later
"""MIDI through a loopback port and OSC through 127.0.0.1, without any hardware."""

from __future__ import annotations

import time
from typing import Any

import pytest

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.explore.board import Binding, Board, Control
from spectral_core.explore.board.midi import MidiLink, encode
from spectral_core.explore.board.osc import OscLink

mido = pytest.importorskip("mido")


def loopback() -> Any:
    """A port whose messages come back, as a board with motors answers."""
    from mido.ports import EchoPort

    return EchoPort()


@pytest.mark.parametrize("control", [Control("cc", 2, "81"), Control("cc14", 0, "16"), Control("bend", 7)])
def test_positions_survive_the_wire_to_a_step(control: Control) -> None:
    got: list[tuple[Control, float]] = []
    port = loopback()
    link = MidiLink(lambda c, p, t: got.append((c, p)), port=port, output=port, fine=frozenset({(0, 16)}))
    for position in (0.0, 0.123456, 0.5, 1.0):
        link.send(control, position)
        link.pump()
        assert got[-1][0] == control
        assert got[-1][1] == pytest.approx(position, abs=control.step / 2 + 1e-12)


def test_eight_faders_through_midi_reach_their_numbers() -> None:
    faders = [Control("cc14", 0, str(n)) for n in range(8)]
    numbers = {f"n{n}": 0.0 for n in range(8)}
    board = Board(numbers.__getitem__)
    for fader, target in zip(faders, numbers, strict=True):
        board.bind(Binding(fader, target))
    port = loopback()
    link = MidiLink(board.receive, port=port, fine=frozenset((0, n) for n in range(8)))
    for step in range(101):
        for fader in faders:
            for message in encode(fader, step / 100):
                port.send(message)
    assert link.pump() == 101 * 8 * 2
    numbers.update({change.target: change.value for change in board.poll()})

    assert numbers == {f"n{n}": 1.0 for n in range(8)}


def test_osc_arrives_and_answers() -> None:
    numbers = {"n": 0.0}
    board = Board(numbers.__getitem__)
    board.bind(Binding(Control("osc", 0, "/fader/1"), "n"))
    sender_board = Board(lambda target: 0.0)
    sender = OscLink(sender_board.receive, port=0)
    link = OscLink(board.receive, port=0, feedback=("127.0.0.1", sender.port))
    try:
        from pythonosc.udp_client import SimpleUDPClient

        with SimpleUDPClient("127.0.0.1", link.port) as client:
            client.send_message("/fader/1", 0.25)
            client.send_message("/label", "Key")
        _wait(lambda: board.received == 1 and link.ignored == 1)
        numbers.update({change.target: change.value for change in board.poll()})
        assert numbers["n"] == 0.25
        numbers["n"] = 0.75
        for control, position in board.motors(time.monotonic() + 1):
            link.send(control, position)
        _wait(lambda: sender_board.received == 1)
    finally:
        link.close()
        sender.close()


def _wait(condition: Any) -> None:
    deadline = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < deadline, "no answer within ten seconds"
        time.sleep(0.005)


def test_a_taken_port_and_an_absent_device_are_clear_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    link = OscLink(lambda c, p, t: None, port=0)
    try:
        with pytest.raises(SpectralError, match=r"cannot listen for OSC on 127.0.0.1:\d+ .*choose another port"):
            OscLink(lambda c, p, t: None, port=link.port)
    finally:
        link.close()
    monkeypatch.setattr("spectral_core.explore.board.midi.port_names", list)
    with pytest.raises(SpectralError, match="no MIDI device is connected; connect one, or use OSC"):
        MidiLink(lambda c, p, t: None, name="BCF2000")
    monkeypatch.setattr("spectral_core.explore.board.midi.port_names", lambda: ["nano"])
    with pytest.raises(InvalidInputError, match="no MIDI input is named 'BCF2000'; connected: nano"):
        MidiLink(lambda c, p, t: None, name="BCF2000")
