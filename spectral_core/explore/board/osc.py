# SPDX-License-Identifier: GPL-3.0-or-later
"""OSC in and out: tablets and programs send floats in [0, 1] to addresses, and get positions back.

UDP loses messages under load, so what is sent is always a state, never a step; ``Board.motors`` keeps it to 60 a
second.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from spectral_core.errors import MissingDependencyError, SpectralError
from spectral_core.explore.board.binding import Control


class OscLink:
    """A UDP server on one address and port, in a thread of its own, and a client for feedback."""

    def __init__(
        self, receive: Callable[[Control, float, float], None], *, host: str = "127.0.0.1", port: int = 9000,
        feedback: tuple[str, int] | None = None,
    ) -> None:  # fmt: skip
        """``receive`` is ``Board.receive``; ``port`` 0 takes any free one; ``feedback``: where positions are sent."""
        try:
            from pythonosc import dispatcher, osc_server, udp_client
        except ImportError as error:
            raise MissingDependencyError.package("python-osc", "an OSC mixing board", "board") from error
        self._receive = receive
        routes = dispatcher.Dispatcher()
        routes.set_default_handler(self._handle)
        try:
            self._server = osc_server.BlockingOSCUDPServer((host, port), routes)
        except OSError as error:
            raise SpectralError(f"cannot listen for OSC on {host}:{port} ({error}); choose another port") from error
        self._client: Any = udp_client.SimpleUDPClient(*feedback) if feedback else None
        self.ignored = 0
        """Messages without a number: a board may send names and colors too."""
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), name="osc", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """The port that is listened on."""
        return int(self._server.server_address[1])

    def _handle(self, address: str, *values: Any) -> None:
        if values and isinstance(values[0], (int, float)) and values[0] == values[0]:
            self._receive(Control("osc", 0, address), float(values[0]), time.monotonic())
        else:
            self.ignored += 1

    def send(self, control: Control, position: float) -> None:
        """Tell the board where a fader should stand; nothing happens without an address for feedback."""
        if self._client is not None and control.kind == "osc":
            self._client.send_message(control.address, float(position))

    def close(self) -> None:
        """Stop listening and release the port."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(timeout=2.0)
        if self._client is not None:
            self._client.close()
