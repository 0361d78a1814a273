# SPDX-License-Identifier: GPL-3.0-or-later
"""OSC in and out: tablets and programs send floats in [0, 1] to addresses, and get positions back.

UDP loses messages under load, so each message is a state, never a step; ``Board.motors`` limits them to 60 a second.
For the same reason a bundle with a later time tag is applied at once: a fader's state is never queued. Packets are
decoded here, because python-osc waits until a time tag, and pads truncated numbers; python-osc only sends.
"""

from __future__ import annotations

import errno
import math
import socket
import socketserver
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from spectral_core.errors import InvalidInputError, MissingDependencyError, SpectralError
from spectral_core.explore.board.binding import Control

_LAYOUTS = {"i": ">i", "f": ">f", "h": ">q", "d": ">d"}
"""Types of arguments that are numbers."""
_OTHERS = {"c": 4, "r": 4, "m": 4, "t": 8, **dict.fromkeys("TFNI[]", 0)}
"""Bytes of arguments that are no numbers; texts and blobs state their length."""


class OscLink:
    """A UDP server on one address and port, in a thread of its own, and a client for feedback."""

    def __init__(
        self, receive: Callable[[Control, float, float], None], *, host: str = "127.0.0.1", port: int = 9000,
        feedback: tuple[str, int] | None = None,
    ) -> None:  # fmt: skip
        """Listen. ``receive`` is ``Board.receive``; ``port`` 0 takes any free one; ``feedback``: where positions are
        sent. Raises InvalidInputError for an invalid port, SpectralError for an occupied one.
        """
        try:
            from pythonosc import udp_client
        except ImportError as error:
            raise MissingDependencyError.package("python-osc", "an OSC mixing board", "board") from error
        for word, number, least in (("OSC port", port, 0), ("port for feedback", feedback[1] if feedback else 1, 1)):
            if not least <= number <= 65535:
                raise InvalidInputError(f"the {word} is {number}; expected {least} to 65535, such as 9000")
        self._receive = receive
        self._feedback = feedback
        self.unsent = ""
        """Why the last position could not be sent back; "" if it was sent."""
        self.ignored = 0
        """Number of ignored messages: without a finite number, or packets that are no OSC; a board may send names and
        colors too.
        """
        link = self

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                link._take(self.request[0])

        class Server(socketserver.UDPServer):
            max_packet_size = 1 << 16  # the largest of UDP: socketserver cuts off at 8 KiB

        try:
            self._server = Server((host, port), Handler)
        except (OSError, UnicodeError) as error:
            what = "address, such as 127.0.0.1" if _is_no_address(error) else "port"
            raise SpectralError(f"cannot listen for OSC on {host}:{port} ({error}); choose another {what}") from error
        self._client: Any = None
        try:
            if feedback:
                # resolved once: sending to a name would ask for its address each time, and wait where no one answers
                place = socket.getaddrinfo(*feedback, type=socket.SOCK_DGRAM)[0][4]
                self._client = udp_client.SimpleUDPClient(str(place[0]), int(place[1]), allow_broadcast=True)
        except (OSError, UnicodeError) as error:
            self._server.server_close()
            receiver = ":".join(map(str, feedback or ()))
            raise SpectralError(f"cannot send OSC to {receiver} ({error}); give another address") from error
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), name="osc", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """The port of the server."""
        return int(self._server.server_address[1])

    def _take(self, packet: bytes) -> None:
        try:
            for address, value in numbers_in(packet):
                if value is None or not math.isfinite(value):
                    self.ignored += 1
                else:
                    self._receive(Control("osc", 0, address), value, time.monotonic())
        except (ValueError, struct.error, SpectralError):
            self.ignored += 1

    def has_motor(self, control: Control) -> bool:
        """True if positions can be sent back to the control."""
        return self._client is not None and control.kind == "osc"

    def send(self, control: Control, position: float) -> bool:
        """Send the position of a fader to the board; nothing happens without an address for feedback.

        Returns False if it was not sent, because the network is down or the address takes no packets: ``unsent`` is the
        reason.
        """
        if not self.has_motor(control):
            return True
        try:
            self._client.send_message(control.address, float(position))
            self.unsent = ""
        except OSError as error:
            host, port = self._feedback or ("", 0)
            self.unsent = (
                f"positions cannot be sent to {host}:{port} ({error.strerror or error}); check the address for feedback"
            )
        return not self.unsent

    def close(self) -> None:
        """Stop listening and release the port."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(timeout=2.0)
        if self._client is not None:
            self._client.close()


def numbers_in(packet: bytes) -> Iterator[tuple[str, float | None]]:
    """Give address and first number of each message of an OSC 1.0 packet, bundles included; None without a number.

    Raises ValueError or struct.error for a packet that is cut off or is no OSC.
    """
    pending = [packet]
    while pending:
        part = pending.pop()
        if len(part) % 4 or not part:
            raise ValueError("an OSC packet has a multiple of four bytes")
        if part.startswith(b"#bundle\0"):
            pending += reversed(list(_elements(part)))
        else:
            yield _message(part)


def _elements(bundle: bytes) -> Iterator[bytes]:
    place = 16  # past the word and the time tag
    while place < len(bundle):
        (size,) = struct.unpack_from(">i", bundle, place)
        if not 0 < size <= len(bundle) - place - 4:
            raise ValueError("an element of an OSC bundle is truncated")
        yield bundle[place + 4 : place + 4 + size]
        place += 4 + size


def _is_no_address(error: Exception) -> bool:
    """True if the address was refused, no matter which port: it has no such form, is unknown or of another machine."""
    is_foreign = isinstance(error, OSError) and error.errno == errno.EADDRNOTAVAIL
    return is_foreign or isinstance(error, socket.gaierror | UnicodeError)


def _message(packet: bytes) -> tuple[str, float | None]:
    address, place = _text(packet, 0)
    kinds, place = _text(packet, place)
    if not address.startswith("/") or not kinds.startswith(","):
        raise ValueError("an OSC message has an address and the types of its arguments")
    for kind in kinds[1:]:
        if kind in _LAYOUTS:
            return address, float(struct.unpack_from(_LAYOUTS[kind], packet, place)[0])
        place = _after(kind, packet, place)
    return address, None


def _after(kind: str, packet: bytes, place: int) -> int:
    """The place behind an argument that is no number."""
    if kind in "sS":
        return _text(packet, place)[1]
    if kind == "b":
        (size,) = struct.unpack_from(">i", packet, place)
        if size < 0:
            raise ValueError("a blob of an OSC message has a negative size")
        return place + 4 + (size + 3) // 4 * 4
    if kind not in _OTHERS:
        raise ValueError("an OSC message has an argument of unknown type")
    return place + _OTHERS[kind]


def _text(packet: bytes, place: int) -> tuple[str, int]:
    end = packet.index(b"\0", place)
    return packet[place:end].decode("ascii"), (end // 4 + 1) * 4
