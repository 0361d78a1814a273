# SPDX-License-Identifier: GPL-3.0-or-later
"""MIDI bytes and OSC packets against values that were encoded by hand, and links at the limits of their rules."""

from __future__ import annotations

import struct
from typing import Any

import pytest

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.explore.board import Control
from spectral_core.explore.board import midi as midi_module
from spectral_core.explore.board.midi import LOOK_SECONDS, Decoder, MidiLink, encode, port_names
from spectral_core.explore.board.osc import OscLink, numbers_in

mido = pytest.importorskip("mido")


@pytest.mark.parametrize(
    ("control", "position", "packets"),
    [("cc:0:7", 0.0, ["B0 07 00"]), ("cc:15:127", 1.0, ["BF 7F 7F"]), ("cc:2:1", 0.5, ["B2 01 40"]),
     ("cc14:1:7", 1.0, ["B1 07 7F", "B1 27 7F"]), ("cc14:0:31", 8191 / 16383, ["B0 1F 3F", "B0 3F 7F"]),
     ("cc14:0:0", 129 / 16383, ["B0 00 01", "B0 20 01"]),
     ("bend:3:", 0.0, ["E3 00 00"]), ("bend:0:", 1.0, ["E0 7F 7F"]), ("bend:0:", 8192 / 16383, ["E0 00 40"])],
)  # fmt: skip
def test_positions_are_encoded_as_the_bytes_of_midi(control: str, position: float, packets: list[str]) -> None:
    assert [message.hex() for message in encode(Control.parse(control), position)] == packets


@pytest.mark.parametrize(
    ("packets", "expected"),
    [(["B0 07 7F"], [("cc:0:7", 1.0)]),
     (["B4 07 01"], [("cc:4:7", 1 / 127)]),
     (["E2 00 00"], [("bend:2:", 0.0)]), (["E2 7F 7F"], [("bend:2:", 1.0)]),
     (["E2 01 40"], [("bend:2:", 8193 / 16383)]),
     (["B0 1F 40", "B0 3F 01"], [("cc:0:31", 64 / 127), ("cc:0:63", 1 / 127), ("cc14:0:31", 8193 / 16383)]),
     (["B0 00 40", "B1 20 01"], [("cc:0:0", 64 / 127), ("cc:1:32", 1 / 127)]),  # another channel
     (["B0 20 05"], [("cc:0:32", 5 / 127)]), (["B0 20 7F", "B0 40 7F"], [("cc:0:32", 1.0), ("cc:0:64", 1.0)]),
     (["90 07 7F"], []), (["C0 07"], [])],
)  # fmt: skip
def test_bytes_of_midi_are_decoded_to_positions(packets: list[str], expected: list[tuple[str, float]]) -> None:
    decoder = Decoder()
    found = [pair for packet in packets for pair in decoder.decode(mido.Message.from_hex(packet))]
    assert found == [(Control.parse(name), pytest.approx(position, abs=1e-15)) for name, position in expected]


def test_an_osc_control_has_no_bytes_of_midi() -> None:
    with pytest.raises(InvalidInputError, match="osc:0:/a is not a MIDI control"):
        encode(Control("osc", 0, "/a"), 0.5)


class Device:
    """A port that keeps what it is sent."""

    def __init__(self, name: str) -> None:
        self.name, self.sent, self.closed, self.fails = name, [], 0, False

    def iter_pending(self) -> list[Any]:
        return []

    def send(self, message: Any) -> None:
        if self.fails:
            raise OSError("gone")
        self.sent.append(message.hex())

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def plugged(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A machine with two devices, whose names, opened ports and clock the test sets."""
    state: dict[str, Any] = {
        "inputs": ["pad:pad 20:0", "nano:nano 24:0"], "outputs": ["other 1:0", "nano:nano 28:0", "nano:nano 29:0"],
        "opened": [], "now": 0.0, "looks": 0,
    }  # fmt: skip

    def opened(name: str) -> Device:
        state["opened"].append(Device(name))
        return state["opened"][-1]

    def inputs() -> list[str]:
        state["looks"] += 1
        return list(state["inputs"])

    monkeypatch.setattr(mido, "get_input_names", inputs)
    monkeypatch.setattr(mido, "get_output_names", lambda: list(state["outputs"]))
    monkeypatch.setattr(mido, "open_input", opened)
    monkeypatch.setattr(mido, "open_output", opened)
    monkeypatch.setattr(midi_module.time, "monotonic", lambda: state["now"])
    return state


@pytest.mark.parametrize(
    ("name", "opened"),
    [(None, ["pad:pad 20:0"]), ("nano:nano 24:0", ["nano:nano 24:0", "nano:nano 28:0"]),
     ("nano:nano 99:7", ["nano:nano 24:0", "nano:nano 28:0"])],
)  # fmt: skip
def test_a_device_is_opened_by_its_name_without_numbers(
    plugged: dict[str, Any], name: str | None, opened: list[str]
) -> None:
    link = MidiLink(lambda c, p, t: None, name=name)
    assert [device.name for device in plugged["opened"]] == opened
    assert link.missing is None
    assert link.has_motor(Control("cc", 0, "1")) == (len(opened) == 2)
    assert not link.has_motor(Control("osc", 0, "/a"))


def test_a_motor_is_sent_to_the_output_alone_and_a_lost_output_is_reported(plugged: dict[str, Any]) -> None:
    link = MidiLink(lambda c, p, t: None, name="nano:nano 24:0")
    source, motor = plugged["opened"]
    link.send(Control("osc", 0, "/a"), 1.0)
    link.send(Control("cc14", 0, "1"), 1.0)
    assert (source.sent, motor.sent) == ([], ["B0 01 7F", "B0 21 7F"])
    motor.fails = True
    link.send(Control("cc", 0, "1"), 0.0)
    assert link.missing == "nano:nano" and source.closed == motor.closed == 1
    link.send(Control("cc", 0, "1"), 0.0)
    assert not link.has_motor(Control("cc", 0, "1")) and link.pump() == 0


def test_the_device_is_looked_for_every_two_seconds(plugged: dict[str, Any]) -> None:
    assert LOOK_SECONDS == 2.0
    link = MidiLink(lambda c, p, t: None, name="nano:nano 24:0")
    plugged["looks"] = 0
    for now in (0.0, 1.0, 1.999, 2.0, 2.001, 3.999, 4.0, 4.5):
        plugged["now"] = now
        link.pump()
    assert plugged["looks"] == 3 and link.missing is None
    plugged["inputs"] = ["pad:pad 20:0"]
    plugged["now"] = 6.0
    assert link.pump() == 0 and link.missing == "nano:nano"
    plugged["inputs"] = ["nano:nano 40:1"]
    plugged["now"] = 8.0
    link.pump()
    assert link.missing is None and plugged["opened"][2].name == "nano:nano 40:1"
    count = len(plugged["opened"])
    plugged["now"] = 10.0
    link.pump()
    assert len(plugged["opened"]) == count


def test_a_port_that_was_given_is_not_looked_for(plugged: dict[str, Any]) -> None:
    port = Device("given")
    link = MidiLink(lambda c, p, t: None, port=port)
    plugged["inputs"], plugged["now"] = [], 100.0
    plugged["looks"] = 0
    assert link.pump() == 0 and plugged["looks"] == 0 and link.missing is None
    link.close()
    link.close()
    assert port.closed == 1


def test_a_machine_without_a_sequencer_has_no_ports(plugged: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    assert port_names() == ["pad:pad 20:0", "nano:nano 24:0"]

    def fails() -> list[str]:
        raise SystemError("no sequencer")

    monkeypatch.setattr(mido, "get_input_names", fails)
    assert port_names() == []


def text(word: str) -> bytes:
    raw = word.encode() + b"\0"
    return raw + b"\0" * (-len(raw) % 4)


@pytest.mark.parametrize("address", ["/", "/a", "/ab", "/abc", "/abcd", "/abcde"])
@pytest.mark.parametrize(
    ("kinds", "body", "expected"),
    [("f", struct.pack(">f", 0.75), 0.75), ("i", struct.pack(">i", -3), -3.0),
     ("h", struct.pack(">q", 1 << 40), 2.0**40),
     ("d", struct.pack(">d", 0.1), 0.1), ("fff", struct.pack(">fff", 0.25, 1, 2), 0.25), ("s", b"Key\0", None),
     ("sf", b"Key\0" + struct.pack(">f", 0.5), 0.5), ("T", b"", None), ("", b"", None)],
)  # fmt: skip
def test_messages_of_every_type_and_length_are_read(
    address: str, kinds: str, body: bytes, expected: float | None
) -> None:
    packet = text(address) + text("," + kinds) + body
    assert list(numbers_in(packet)) == [(address, expected)]
    inside = b"#bundle\0" + b"\0" * 8 + struct.pack(">i", len(packet)) + packet
    assert list(numbers_in(inside)) == [(address, expected)]
    two = inside + struct.pack(">i", len(packet)) + packet
    assert list(numbers_in(two)) == [(address, expected)] * 2


def test_an_empty_bundle_holds_no_message_and_its_elements_have_a_size() -> None:
    assert list(numbers_in(b"#bundle\0" + b"\0" * 8)) == []
    message = text("/a") + text(",f") + struct.pack(">f", 0.5)
    for size in (0, -4, len(message) + 4, len(message) + 1):
        with pytest.raises(ValueError, match="an element of an OSC bundle is truncated"):
            list(numbers_in(b"#bundle\0" + b"\0" * 8 + struct.pack(">i", size) + message))
    with pytest.raises(ValueError, match="a multiple of four bytes"):
        list(numbers_in(b"#bundle\0" + b"\0" * 8 + struct.pack(">i", 6) + message[:6]))
    for broken in (b"abc\0" + text(",f") + message[-4:], text("/a") + text("xf") + message[-4:]):
        with pytest.raises(ValueError, match="an address and the types"):
            list(numbers_in(broken))


def test_osc_listens_on_port_9000_of_this_machine_by_default() -> None:
    import inspect

    defaults = {name: each.default for name, each in inspect.signature(OscLink).parameters.items()}
    assert (defaults["host"], defaults["port"], defaults["feedback"]) == ("127.0.0.1", 9000, None)


def test_the_outermost_ports_are_in_range(monkeypatch: pytest.MonkeyPatch) -> None:
    """Port 65535 may be occupied, but it is a port; feedback goes to any."""
    for port in (65536, -1):
        with pytest.raises(InvalidInputError, match=f"OSC port is {port}"):
            OscLink(lambda c, p, t: None, port=port)
    try:
        OscLink(lambda c, p, t: None, port=65535).close()
    except SpectralError as error:
        assert "cannot listen" in str(error)
    link = OscLink(lambda c, p, t: None, port=0, feedback=("127.0.0.1", 65535))
    try:
        assert link.has_motor(Control("osc", 0, "/a")) and not link.has_motor(Control("cc", 0, "1"))
        link.send(Control("osc", 0, "/a"), 0.5)
        link.send(Control("cc", 0, "1"), 0.5)
    finally:
        link.close()
    alone = OscLink(lambda c, p, t: None, port=0)
    try:
        assert not alone.has_motor(Control("osc", 0, "/a"))
        alone.send(Control("osc", 0, "/a"), 0.5)
        assert alone.ignored == 0
    finally:
        alone.close()
    assert not alone._thread.is_alive()
