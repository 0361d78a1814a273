# SPDX-License-Identifier: GPL-3.0-or-later
"""MIDI in and out: messages become positions of controls, positions become messages that move motors.

mido (and python-rtmidi behind it) are optional; without them, or without a device, everything else works.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from spectral_core.errors import InvalidInputError, MissingDependencyError, SpectralError
from spectral_core.explore.board.binding import Control

PAIRED = 32
"""Controllers 0 to 31 carry the upper 7 bits, 32 higher the lower 7 (MIDI 1.0)."""


class Decoder:
    """MIDI messages to (control, position). Keeps the upper halves of 14-bit pairs until their lower halves come.

    ``fine``: (channel, controller) pairs, controller below 32, that are sent as 14-bit pairs; others are 7-bit.
    """

    def __init__(self, fine: frozenset[tuple[int, int]] = frozenset()) -> None:
        self._fine = fine
        self._upper: dict[tuple[int, int], int] = {}

    def decode(self, message: Any) -> tuple[Control, float] | None:
        """``message``: a mido message. None for what is no fader, or the first half of a pair."""
        if message.type == "pitchwheel":
            return Control("bend", message.channel), (message.pitch + 8192) / 16383
        if message.type != "control_change":
            return None
        number, channel = message.control, message.channel
        if (channel, number) in self._fine:
            self._upper[channel, number] = message.value
            return None
        if (channel, number - PAIRED) in self._fine:
            upper = self._upper.get((channel, number - PAIRED))
            if upper is None:
                return None
            return Control("cc14", channel, str(number - PAIRED)), ((upper << 7) | message.value) / 16383
        return Control("cc", channel, str(number)), message.value / 127


def encode(control: Control, position: float) -> list[Any]:
    """Mido messages that bring the control's motor or ring of lights to ``position`` in [0, 1]."""
    mido = _mido()
    if control.kind == "bend":
        return [mido.Message("pitchwheel", channel=control.channel, pitch=round(position * 16383) - 8192)]
    if control.kind == "cc":
        value = round(position * 127)
        return [mido.Message("control_change", channel=control.channel, control=int(control.address), value=value)]
    if control.kind == "cc14":
        value, number = round(position * 16383), int(control.address)
        halves = ((number, value >> 7), (number + PAIRED, value & 127))
        return [mido.Message("control_change", channel=control.channel, control=n, value=v) for n, v in halves]
    raise InvalidInputError(f"{control} is not a MIDI control")


def port_names() -> list[str]:
    """Names of the MIDI inputs that are there; empty where there is no MIDI on this machine."""
    try:
        return list(_mido().get_input_names())
    except (OSError, ImportError, SystemError):  # rtmidi raises SystemError where the system has no sequencer
        return []


class MidiLink:
    """One open input, and the output of the same name where there is one."""

    def __init__(
        self, receive: Callable[[Control, float, float], None], *, port: Any = None, name: str | None = None,
        output: Any = None, fine: frozenset[tuple[int, int]] = frozenset(),
    ) -> None:  # fmt: skip
        """``receive`` is ``Board.receive``; ``port`` and ``output`` are mido ports, or ``name`` says which to open."""
        self._receive, self._decoder = receive, Decoder(fine)
        self._input = port if port is not None else _open(name)
        self._output = output
        if output is None and port is None and name in _mido().get_output_names():
            self._output = _mido().open_output(name)

    def pump(self) -> int:
        """Hand all messages that wait to the board; how many there were."""
        count = 0
        for message in self._input.iter_pending():
            count += 1
            decoded = self._decoder.decode(message)
            if decoded is not None:
                self._receive(*decoded, time.monotonic())
        return count

    def send(self, control: Control, position: float) -> None:
        """Move a motor; nothing happens where the device has no input of its own."""
        if self._output is not None and control.kind != "osc":
            for message in encode(control, position):
                self._output.send(message)

    def close(self) -> None:
        """Release the ports."""
        for port in (self._input, self._output):
            if port is not None:
                port.close()


def _open(name: str | None) -> Any:
    mido = _mido()  # where it is missing, that is what to say
    names = port_names()
    if not names:
        raise SpectralError("no MIDI device is connected; connect one, or use OSC")
    if name is not None and name not in names:
        raise InvalidInputError(f"no MIDI input is named {name!r}; connected: {', '.join(names)}")
    return mido.open_input(name or names[0])


def _mido() -> Any:
    try:
        import mido
    except ImportError as error:
        raise MissingDependencyError.package("mido", "a MIDI mixing board", "board") from error
    return mido
