# SPDX-License-Identifier: GPL-3.0-or-later
"""MIDI through a loopback port and OSC through 127.0.0.1, without any hardware."""

from __future__ import annotations

import socket
import struct
import time
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.explore.board import Binding, Board, Control
from spectral_core.explore.board.midi import MidiLink, encode
from spectral_core.explore.board.osc import OscLink, numbers_in

mido = pytest.importorskip("mido")


def loopback() -> Any:
    """A loopback port, which returns messages like a board with motors."""
    from mido.ports import EchoPort

    return EchoPort()


@pytest.mark.parametrize("control", [Control("cc", 2, "81"), Control("cc14", 0, "16"), Control("bend", 7)])
def test_positions_are_transmitted_to_a_step(control: Control) -> None:
    got: list[tuple[Control, float]] = []
    port = loopback()
    link = MidiLink(lambda c, p, t: got.append((c, p)), port=port, output=port)
    for position in (0.0, 0.123456, 0.5, 1.0):
        link.send(control, position)
        link.pump()
        assert got[-1][0] == control
        assert got[-1][1] == pytest.approx(position, abs=control.step / 2 + 1e-12)


def test_eight_midi_faders_change_their_numbers() -> None:
    faders = [Control("cc14", 0, str(n)) for n in range(8)]
    numbers = {f"n{n}": 0.0 for n in range(8)}
    board = Board(numbers.__getitem__)
    for fader, target in zip(faders, numbers, strict=True):
        board.bind(Binding(fader, target))
    port = loopback()
    link = MidiLink(board.receive, port=port)
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


def test_an_occupied_port_and_a_missing_device_give_clear_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    link = OscLink(lambda c, p, t: None, port=0)
    try:
        with pytest.raises(SpectralError, match=r"cannot listen for OSC on 127.0.0.1:\d+ .*choose another port"):
            OscLink(lambda c, p, t: None, port=link.port)
        for host in ("256.1.1.1", "192.0.2.1"):  # of no form, and of another machine: no port would help
            with pytest.raises(SpectralError, match=rf"OSC on {host}:\d+ .*choose another address, such as 127.0.0.1"):
                OscLink(lambda c, p, t: None, host=host, port=link.port)
        with pytest.raises(SpectralError, match=r"cannot send OSC to 256.1.1.1:9001 \(.*give another address"):
            OscLink(lambda c, p, t: None, port=0, feedback=("256.1.1.1", 9001))
    finally:
        link.close()
    monkeypatch.setattr("spectral_core.explore.board.midi.port_names", list)
    with pytest.raises(SpectralError, match="no MIDI device is connected; connect one, or use OSC"):
        MidiLink(lambda c, p, t: None, name="BCF2000")
    monkeypatch.setattr("spectral_core.explore.board.midi.port_names", lambda: ["nano"])
    with pytest.raises(InvalidInputError, match="no MIDI input is named 'BCF2000'; connected: nano"):
        MidiLink(lambda c, p, t: None, name="BCF2000")


def osc_message(address: str, kinds: str, body: bytes) -> bytes:
    """An OSC 1.0 message, encoded here."""

    def padded(text: str) -> bytes:
        raw = text.encode() + b"\0"
        return raw + b"\0" * (-len(raw) % 4)

    return padded(address) + padded("," + kinds) + body


def bundle(tag: int, *elements: bytes) -> bytes:
    return b"#bundle\0" + struct.pack(">Q", tag) + b"".join(struct.pack(">i", len(e)) + e for e in elements)


def test_osc_packets_are_read_strictly_and_future_bundles_do_not_block() -> None:
    whole = osc_message("/a", "f", struct.pack(">f", 0.5))
    later = ((int(time.time()) + 2208988800 + 25) & 0xFFFFFFFF) << 32
    assert list(numbers_in(whole)) == [("/a", 0.5)]
    assert list(numbers_in(bundle(later, whole, bundle(later, osc_message("/b", "i", struct.pack(">i", 1)))))) == [
        ("/a", 0.5),
        ("/b", 1.0),
    ]
    assert list(numbers_in(osc_message("/s", "s", b"Key\0"))) == [("/s", None)]
    assert list(numbers_in(osc_message("/f", "fs", struct.pack(">f", 0.25) + b"Key\0"))) == [("/f", 0.25)]
    assert list(numbers_in(osc_message("/d", "d", struct.pack(">d", 0.125)))) == [("/d", 0.125)]
    deep = whole
    for _ in range(3000):
        deep = bundle(1, deep)
    assert list(numbers_in(deep)) == [("/a", 0.5)]
    for broken in (whole[:-2], whole[:-4], b"", b"\0\0\0\0", b"#bundle\0" + b"\0" * 8 + struct.pack(">i", 99) + whole,
                   b"#bundle\0" + b"\0" * 8 + struct.pack(">i", len(whole) + 4) + whole,
                   whole[:4] + whole[8:], b"abcd" * 3):  # fmt: skip
        with pytest.raises((ValueError, struct.error)):
            list(numbers_in(broken))


def test_the_server_ignores_bad_packets_and_closes_at_once() -> None:
    board = Board(lambda target: 0.0)
    link = OscLink(board.receive, port=0)
    later = ((int(time.time()) + 2208988800 + 25) & 0xFFFFFFFF) << 32
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for packet in (b"\xff" * 8, osc_message("/x", "f", b"\0\0"), osc_message("/x", "f", struct.pack(">f", np.inf)),
                       bundle(later, osc_message("/fader", "f", struct.pack(">f", 0.25))),
                       osc_message("/fader", "f", struct.pack(">f", 0.75))):  # fmt: skip
            sender.sendto(packet, ("127.0.0.1", link.port))
        _wait(lambda: board.received == 2 and link.ignored == 3)
    start = time.monotonic()
    link.close()
    assert time.monotonic() - start < 20  # the bundle is due after 25 s


def test_a_large_bundle_is_read() -> None:
    """A tablet sends all its faders at once when a page is opened; socketserver cuts packets off at 8 KiB."""
    board = Board(lambda target: 0.0)
    link = OscLink(board.receive, port=0)
    faders = [osc_message(f"/mixer/of/the/stage/fader/{n}", "f", struct.pack(">f", 0.5)) for n in range(300)]
    packet = bundle(1, *faders)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(packet, ("127.0.0.1", link.port))
        assert len(packet) > 8192
        _wait(lambda: board.received == len(faders))
    link.close()


@pytest.mark.parametrize("port", [70000, -1])
def test_invalid_ports_are_refused(port: int) -> None:
    with pytest.raises(InvalidInputError, match="expected 0 to 65535"):
        OscLink(lambda c, p, t: None, port=port)
    with pytest.raises(InvalidInputError, match="feedback"):
        OscLink(lambda c, p, t: None, port=0, feedback=("127.0.0.1", port))


def test_an_unplugged_device_is_reported_and_found_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Detected once by an error of the port and once by its absence; the device returns under other numbers."""
    from spectral_core.explore.board import midi

    class Port:
        broken, closed = False, False

        def __init__(self) -> None:
            self.waiting: list[Any] = []

        def iter_pending(self) -> list[Any]:
            if self.broken:
                raise OSError("no such device")
            waiting, self.waiting = self.waiting, []
            return waiting

        def close(self) -> None:
            self.closed = True

    names, ports, now = ["nano:nano MIDI 1 20:0"], [], [0.0]
    monkeypatch.setattr(midi, "port_names", lambda: list(names))
    monkeypatch.setattr(mido, "open_input", lambda name: ports.append(Port()) or ports[-1])
    monkeypatch.setattr(mido, "get_output_names", list)
    monkeypatch.setattr(midi.time, "monotonic", lambda: now[0])
    got: list[float] = []
    link = MidiLink(lambda c, p, t: got.append(p), name="nano:nano MIDI 1 20:0")
    assert not link.has_motor(Control("cc", 0, "1"))

    ports[0].broken = True
    assert link.pump() == 0 and link.missing == "nano:nano MIDI 1" and ports[0].closed
    names[:] = []
    now[0] = 5.0
    assert link.pump() == 0 and link.missing
    names[:] = ["nano:nano MIDI 1 28:0"]
    now[0] = 10.0
    link.pump()
    assert link.missing is None and len(ports) == 2
    ports[1].waiting = [mido.Message("control_change", control=3, value=127)]
    assert link.pump() == 1 and got == [1.0]
    names[:] = []
    now[0] = 20.0
    link.pump()
    assert link.missing == "nano:nano MIDI 1" and ports[1].closed
    link.close()
