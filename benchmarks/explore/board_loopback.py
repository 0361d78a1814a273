# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixing board: 8 faders over loopback MIDI and OSC, 1,000 messages a second for a minute: backlog, losses, loops."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from benchmarks import Options
from spectral_core.explore.board import Binding, Board, Control
from spectral_core.explore.board.midi import MidiLink, encode
from spectral_core.explore.board.osc import OscLink

FADERS, RATE = 8, 1000


def run(options: Options) -> dict[str, Any]:
    """Sends in real time, polls at 60 Hz as a picture would; the backlog is the age of a message when it is applied."""
    seconds = 2.0 if options.quick else 60.0
    figures: dict[str, Any] = {"seconds": seconds, "messages_per_second": RATE}
    figures["midi"] = _midi(seconds)
    figures["osc"] = _osc(seconds)
    for wire in ("midi", "osc"):
        f = figures[wire]
        print(f"{wire:5} {f['sent']} sent, {f['received']} received, worst backlog {f['worst_backlog_ms']:.1f} ms, "
              f"p99 {f['p99_backlog_ms']:.1f} ms, last values right: {f['last_values_right']}, "
              f"motor messages while moving: {f['motor_messages_while_moving']}")  # fmt: skip
    wires = [figures["midi"], figures["osc"]]
    figures["holds"] = {
        "every last value arrives": all(f["last_values_right"] for f in wires),
        "backlog under 50 ms in 99 %": all(f["p99_backlog_ms"] < 50 for f in wires),
        "no motor is moved while its fader is moved by hand": all(
            f["motor_messages_while_moving"] <= FADERS
            for f in wires  # each once, to the initial position of its number
        ),
    }
    return figures


def _midi(seconds: float) -> dict[str, Any]:
    from mido.ports import EchoPort

    controls = [Control("cc14", 0, str(n)) for n in range(FADERS)]
    port = EchoPort()
    board, numbers = _board(controls)
    received = board.receive

    def pairs_only(control: Control, position: float, at: float) -> None:
        """A pair is also decoded as two controls of 7 bits; these are not separate messages."""
        if control.kind == "cc14":
            received(control, position, at)

    link = MidiLink(pairs_only, port=port)

    def send(control: Control, position: float) -> None:
        for message in encode(control, position):
            port.send(message)

    return _drive(seconds, controls, send, board, numbers, link.pump)


def _osc(seconds: float) -> dict[str, Any]:
    from pythonosc.udp_client import SimpleUDPClient

    controls = [Control("osc", 0, f"/fader/{n}") for n in range(FADERS)]
    board, numbers = _board(controls)
    link = OscLink(board.receive, port=0)
    try:
        client: Any  # of python-osc, whose ``__enter__`` promises less than it returns
        with SimpleUDPClient("127.0.0.1", link.port) as client:
            return _drive(
                seconds, controls, lambda c, p: client.send_message(c.address, p), board, numbers, lambda: None
            )
    finally:
        link.close()


def _board(controls: list[Control]) -> tuple[Board, dict[str, float]]:
    numbers = {f"n{n}": 0.0 for n in range(FADERS)}
    board = Board(numbers.__getitem__)
    for control, target in zip(controls, numbers, strict=True):
        board.bind(Binding(control, target))
    return board, numbers


def _drive(
    seconds: float, controls: list[Control], send: Callable[[Control, float], None], board: Board,
    numbers: dict[str, float], pump: Callable[[], Any],
) -> dict[str, Any]:  # fmt: skip
    start, sent, backlog, motors = time.monotonic(), 0, [], 0
    next_poll, total = start, int(seconds * RATE)
    sent_at: dict[str, float] = {}
    while sent < total:
        now = time.monotonic()
        while sent < min(total, int((now - start) * RATE) + 1):
            fader = sent % FADERS
            sent_at[f"n{fader}"] = time.monotonic()
            send(controls[fader], (sent // FADERS % 101) / 100)
            sent += 1
        if now >= next_poll:
            pump()
            backlog += _apply(board, numbers, sent_at)
            motors += len(board.motors(time.monotonic()))
            next_poll += 1 / 60
        time.sleep(0.0005)
    for control in controls:
        send(control, 0.5)
    time.sleep(0.1)
    pump()
    _apply(board, numbers, sent_at)
    ordered = sorted(backlog)
    right = all(abs(value - 0.5) < 1e-4 for value in numbers.values())
    return {"sent": sent + FADERS, "received": board.received, "worst_backlog_ms": 1000 * ordered[-1],
            "p99_backlog_ms": 1000 * ordered[int(0.99 * (len(ordered) - 1))], "last_values_right": right,
            "motor_messages_while_moving": motors}  # fmt: skip


def _apply(board: Board, numbers: dict[str, float], sent_at: dict[str, float]) -> list[float]:
    """Seconds from the sending of the message that each changed number came from to now."""
    changes = board.poll()
    numbers.update({change.target: change.value for change in changes})
    return [time.monotonic() - sent_at[change.target] for change in changes]
