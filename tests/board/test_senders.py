# SPDX-License-Identifier: GPL-3.0-or-later
"""Streams of devices and programs that are not as expected: numbered parameters, other ranges, networks that fail."""

from __future__ import annotations

import errno
import socket
import struct
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from spectral_core.errors import InvalidInputError, MissingDependencyError, SpectralError
from spectral_core.explore.board import Binding, Board, Control
from spectral_core.explore.board import midi as midi_module
from spectral_core.explore.board.midi import LONE_SECONDS, Decoder, MidiLink, encode
from spectral_core.explore.board.osc import OscLink

mido = pytest.importorskip("mido")


def parameter(channel: int, number: int, value: int, *, fine: bool = True) -> list[str]:
    """The bytes by which MIDI 1.0 sets a numbered parameter, in hexadecimal digits."""
    pairs = [(0x63, number >> 7), (0x62, number & 127), (0x06, value >> 7)] + ([(0x26, value & 127)] if fine else [])
    return [f"B{channel:X} {controller:02X} {data:02X}" for controller, data in pairs]


def decoded(decoder: Decoder, packets: list[str], at: float = 0.0) -> dict[str, float]:
    """Last position of each control."""
    found = [pair for packet in packets for pair in decoder.decode(mido.Message.from_hex(packet), at)]
    return {str(control): position for control, position in found}


def test_faders_that_send_numbered_parameters_are_distinguished() -> None:
    decoder = Decoder()
    first = decoded(decoder, parameter(2, 1, 16383))
    second = decoded(decoder, parameter(2, 700, 5000))
    assert first["nrpn:2:1"] == 1.0 and second["nrpn:2:700"] == pytest.approx(5000 / 16383, abs=1e-12)
    assert "nrpn:2:1" not in second and not any(name.startswith("cc14") for name in (*first, *second))
    # a registered parameter, here the range of the pitch bend, is no fader, and neither is "none" (127, 127)
    rpn = decoded(decoder, ["B2 65 00", "B2 64 00", "B2 06 0C", "B2 26 00"])
    none = decoded(decoder, parameter(2, 16383, 99))
    assert not any(name.startswith("nrpn") for name in (*rpn, *none))


def test_a_parameter_of_seven_bits_has_its_whole_travel() -> None:
    decoder = Decoder()
    assert not any(name.startswith("nrpn") for name in decoded(decoder, parameter(0, 9, 127 << 7, fine=False)))
    assert decoder.lone(LONE_SECONDS / 2) == ()
    assert decoder.lone(LONE_SECONDS) == ((Control("nrpn", 0, "9"), 1.0),)
    assert decoder.lone(9.0) == ()


@pytest.mark.parametrize("then", [parameter(0, 10, 5 << 7, fine=False), ["B0 65 7F", "B0 64 7F"], ["B0 63 7F"]])
def test_a_parameter_of_seven_bits_arrives_though_another_one_or_none_is_selected_next(then: list[str]) -> None:
    decoder = Decoder()
    decoded(decoder, parameter(0, 9, 100 << 7, fine=False))
    assert decoded(decoder, then)["nrpn:0:9"] == pytest.approx(100 / 127)
    assert ("nrpn", "9") not in [(control.kind, control.address) for control, _ in decoder.lone(9.0)]


def test_an_upper_half_alone_has_a_lower_half_of_zero() -> None:
    """MIDI 1.0: a receiver sets the lower half to 0 when the upper one arrives."""
    decoder = Decoder()
    decoded(decoder, ["B0 01 40", "B0 21 7F"])
    assert decoder.lone(1.0) == ()
    decoded(decoder, ["B0 01 00"], at=2.0)
    assert decoder.lone(2.0 + LONE_SECONDS) == ((Control("cc14", 0, "1"), 0.0),)
    decoded(decoder, ["B0 07 40"], at=3.0)  # a fader of 7 bits
    assert decoder.lone(4.0) == ()


@pytest.mark.parametrize("number", [0, 1, 129, 16382])
def test_motors_of_numbered_parameters_get_the_bytes_of_midi(number: int) -> None:
    packets = [message.hex() for message in encode(Control("nrpn", 5, str(number)), 5000 / 16383)]
    assert packets == parameter(5, number, 5000)


def test_learning_binds_the_parameter_and_not_the_controllers_that_carry_it() -> None:
    board = Board(lambda target: 0.0)
    port = mido.ports.EchoPort()
    link = MidiLink(board.receive, port=port)
    board.learn("a")
    for value in range(0, 16384, 500):
        for packet in parameter(0, 3, value):
            port.send(mido.Message.from_hex(packet))
    link.pump()
    board.poll()
    assert [str(binding.control) for binding in board.bindings] == ["nrpn:0:3"]
    for packet in parameter(0, 4, 9000):
        port.send(mido.Message.from_hex(packet))
    link.pump()
    assert board.poll() == ()


@pytest.mark.parametrize(
    "text", ["cc:²:7", "cc:0:²", "cc:0:٣", "bend:0:x", "osc:1:/a", "nrpn:0:16384", "cc14:0:" + "9" * 5000]
)
def test_controls_that_no_message_can_have_are_refused(text: str) -> None:
    with pytest.raises(InvalidInputError) as found:
        Control.parse(text)
    assert len(str(found.value)) < 200


def test_zeros_before_a_number_are_no_other_control() -> None:
    assert Control.parse("cc:00:007") == Control("cc", 0, "7")


def test_a_sender_with_another_range_is_reported_and_not_learned_at_rest() -> None:
    board = Board(lambda target: 0.0)
    control = Control("osc", 0, "/volume")
    board.learn("a")
    for _ in range(3):
        board.receive(control, 87.0, 1.0)
    assert board.poll() == () and board.bindings == () and board.beyond == {control: 87.0}
    board.receive(control, 0.0, 2.0)
    board.poll()
    assert board.learning is None and board.beyond == {}
    board.receive(control, 64.0, 2.5)
    assert [change.value for change in board.poll()] == [1.0] and board.beyond == {control: 64.0}
    board.receive(control, 1.0 + 1e-7, 3.0)
    assert board.beyond == {}
    board.unbind(control)
    board.receive(control, 2.0, 4.0)
    board.poll()
    assert board.learning is None and board.beyond == {}


@pytest.fixture
def receiver() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        found.settimeout(5.0)
        yield found


def test_a_network_that_fails_is_reported_and_the_position_is_sent_later(
    receiver: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    control, number = Control("osc", 0, "/a"), [0.25]
    board = Board(lambda target: number[0])
    link = OscLink(board.receive, port=0, feedback=receiver.getsockname())
    board.bind(Binding(control, "n"))

    def drive(at: float) -> None:
        for moved, position in board.motors(at):
            if not link.send(moved, position):
                board.send_again(moved)

    def fails(*_: Any) -> None:
        raise OSError(errno.ENETUNREACH, "Network is unreachable")

    try:
        with monkeypatch.context() as broken:
            broken.setattr(link._client, "send_message", fails)
            drive(1.0)
            assert "Network is unreachable" in link.unsent and str(receiver.getsockname()[1]) in link.unsent
        drive(2.0)
        assert link.unsent == ""
        packet = receiver.recv(100)
        assert packet.startswith(b"/a\0\0,f\0\0") and struct.unpack(">f", packet[8:])[0] == 0.25
    finally:
        link.close()


def test_positions_go_to_every_client_of_a_network() -> None:
    """A broadcast address; without permission the system refuses each packet."""
    link = OscLink(lambda c, p, t: None, port=0, feedback=("255.255.255.255", 9))
    try:
        assert link.send(Control("osc", 0, "/a"), 0.5) or "Permission" not in link.unsent
    finally:
        link.close()


def test_the_port_of_feedback_is_one_that_can_be_sent_to() -> None:
    with pytest.raises(InvalidInputError, match="port for feedback is 0; expected 1 to 65535"):
        OscLink(lambda c, p, t: None, port=0, feedback=("127.0.0.1", 0))


def test_the_name_of_the_client_is_resolved_once(receiver: socket.socket, monkeypatch: pytest.MonkeyPatch) -> None:
    port = receiver.getsockname()[1]
    asked: list[Any] = []
    resolve = socket.getaddrinfo
    monkeypatch.setattr(
        socket, "getaddrinfo", lambda host, *more, **named: asked.append(host) or resolve("127.0.0.1", *more, **named)
    )
    link = OscLink(lambda c, p, t: None, port=0, feedback=("tablet.local", port))
    try:
        for _ in range(3):
            assert link.send(Control("osc", 0, "/a"), 0.5)
            assert receiver.recv(100).startswith(b"/a")
    finally:
        link.close()
    assert asked.count("tablet.local") == 1


class Broken:
    """A machine with a device whose ports open only after a while."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.names, self.now, self.opens, self.inputs, self.closed = ["pad 20:0"], 0.0, True, 0, 0
        monkeypatch.setattr(mido, "get_input_names", lambda: list(self.names))
        monkeypatch.setattr(mido, "get_output_names", lambda: list(self.names))
        monkeypatch.setattr(mido, "open_input", lambda name: self)
        monkeypatch.setattr(mido, "open_output", self.opened)
        monkeypatch.setattr(midi_module.time, "monotonic", lambda: self.now)

    def opened(self, name: str) -> Any:
        if not self.opens:
            raise OSError("device or resource busy")
        self.inputs += 1
        return self

    def iter_pending(self) -> list[Any]:
        return []

    def close(self) -> None:
        self.closed += 1


def test_a_device_that_is_not_ready_when_it_is_plugged_in_again_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    device = Broken(monkeypatch)
    link = MidiLink(lambda c, p, t: None, name="pad 20:0")
    device.names, device.now = [], 5.0
    link.pump()
    assert link.missing == "pad"
    device.names, device.opens, device.now = ["pad 24:0"], False, 10.0
    link.pump()
    assert link.missing == "pad" and link.pump() == 0
    device.opens, device.now = True, 15.0
    link.pump()
    assert link.missing is None and link.has_motor(Control("cc", 0, "1"))


def test_a_device_in_use_is_named_and_its_input_is_released(monkeypatch: pytest.MonkeyPatch) -> None:
    device = Broken(monkeypatch)
    device.opens = False
    with pytest.raises(SpectralError, match=r"'pad 20:0' cannot be opened \(device or resource busy\)"):
        MidiLink(lambda c, p, t: None, name="pad 20:0")
    assert device.closed == 1


def test_without_the_package_that_opens_devices_its_absence_is_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MIDO_BACKEND", raising=False)
    monkeypatch.setattr(midi_module, "port_names", list)
    monkeypatch.setattr(midi_module, "find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match="python-rtmidi"):
        MidiLink(lambda c, p, t: None)


def test_sending_never_waits_for_a_client_that_does_not_answer() -> None:
    link = OscLink(lambda c, p, t: None, port=0, feedback=("192.0.2.1", 9))  # an address that no machine has
    try:
        sending = threading.Thread(target=lambda: [link.send(Control("osc", 0, "/a"), 0.5) for _ in range(200)])
        sending.start()
        sending.join(60.0)  # each answer that is awaited would take seconds
        assert not sending.is_alive()
    finally:
        link.close()
