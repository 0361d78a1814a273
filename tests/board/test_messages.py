# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages of OSC with other arguments before their number, and senders with any number of addresses."""

from __future__ import annotations

import struct

import pytest

from spectral_core.explore.board import Binding, Board, Control
from spectral_core.explore.board.osc import numbers_in

BEFORE = [
    ("s", "name"), ("b", b"five5"), ("b", b"four"), ("T", True), ("F", False), ("N", None), ("r", 0x01020304),
    ("m", (0, 1, 2, 3)),
]  # fmt: skip


def _encoded(arguments) -> bytes:
    """Encoded by python-osc, which shares no code with the reader."""
    builder = pytest.importorskip("pythonosc.osc_message_builder")
    message = builder.OscMessageBuilder("/fader/1")
    for kind, value in arguments:
        message.add_arg(value, kind)
    return message.build().dgram


@pytest.mark.parametrize("before", BEFORE, ids=[f"{kind} {value}" for kind, value in BEFORE])
@pytest.mark.parametrize(("kind", "value"), [("f", 0.25), ("i", 1), ("d", 0.125), ("h", 1)])
def test_the_first_number_counts_whatever_is_before_it(before, kind, value) -> None:
    packet = _encoded([before, (kind, value), ("f", 0.75)])
    assert list(numbers_in(packet)) == [("/fader/1", value)]
    assert list(numbers_in(_encoded([before]))) == [("/fader/1", None)]


def test_infinitum_and_arrays_have_no_bytes_and_a_time_tag_has_eight() -> None:
    number = struct.pack(">f", 0.5)
    assert list(numbers_in(b"/a\0\0" + b",I[f]\0\0\0" + number)) == [("/a", 0.5)]
    assert list(numbers_in(b"/a\0\0" + b",tf\0" + bytes(8) + number)) == [("/a", 0.5)]
    assert list(numbers_in(b"/a\0\0" + b",cf\0" + b"\0\0\0A" + number)) == [("/a", 0.5)]


@pytest.mark.parametrize(
    "packet",
    [
        b"/a\0\0" + b",bf\0" + struct.pack(">i", -4) + struct.pack(">f", 0.5),
        b"/a\0\0" + b",bf\0" + struct.pack(">i", 400) + struct.pack(">f", 0.5),
        b"/a\0\0" + b",sf\0" + b"abcd",
        b"/a\0\0" + b",Zf\0" + struct.pack(">f", 0.5),
    ],
    ids=["negative blob", "blob beyond the packet", "text without an end", "unknown type"],
)
def test_packets_that_are_no_osc_are_refused(packet) -> None:
    with pytest.raises((ValueError, struct.error)):
        list(numbers_in(packet))


def test_a_sender_of_any_number_of_addresses_takes_no_memory() -> None:
    board = Board(lambda _target: 0.0)
    bound = Control("osc", 0, "/bound")
    board.bind(Binding(bound, "x"))
    for number in range(5000):
        board.receive(Control("osc", 0, f"/{number}"), 7.0, 1.0)
    board.receive(bound, 2.0, 1.0)
    board.poll()
    assert board.beyond == {bound: 2.0}
    assert len(board._beyond) == 1
