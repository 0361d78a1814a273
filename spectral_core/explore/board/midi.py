# SPDX-License-Identifier: GPL-3.0-or-later
"""MIDI in and out: messages become positions of controls, positions become messages that move motors.

mido (and python-rtmidi behind it) are optional; without them, or without a device, everything else works.
"""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Callable
from typing import Any

from spectral_core.errors import InvalidInputError, MissingDependencyError, SpectralError
from spectral_core.explore.board.binding import PAIRED, Control

LOOK_SECONDS = 2.0
"""Time between two checks whether the device is connected."""


class Decoder:
    """MIDI messages to positions of controls.

    Controllers n and n + 32 may be two faders of 7 bits or the halves of one of 14; the messages do not show it. So the
    second half is decoded as both, and the board uses the one that is bound.
    """

    def __init__(self) -> None:
        self._upper: dict[tuple[int, int], int] = {}

    def decode(self, message: Any) -> tuple[tuple[Control, float], ...]:
        """Controls that a mido message moves, with their positions; none if the message belongs to no fader."""
        if message.type == "pitchwheel":
            return ((Control("bend", message.channel), (message.pitch + 8192) / 16383),)
        if message.type != "control_change":
            return ()
        number, channel = message.control, message.channel
        coarse = (Control("cc", channel, str(number)), message.value / 127)
        if number < PAIRED:
            self._upper[channel, number] = message.value
        upper = self._upper.get((channel, number - PAIRED))
        if upper is None:
            return (coarse,)
        fine = (Control("cc14", channel, str(number - PAIRED)), ((upper << 7) | message.value) / 16383)
        return coarse, fine


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
    """Names of the available MIDI inputs; empty if there is no MIDI on this machine."""
    try:
        return list(_mido().get_input_names())
    except (OSError, ImportError, SystemError):  # rtmidi raises SystemError where the system has no sequencer
        return []


class MidiLink:
    """One input, and the output of the same name if there is one; reconnected after the device was unplugged."""

    def __init__(
        self, receive: Callable[[Control, float, float], None], *, port: Any = None, name: str | None = None,
        output: Any = None,
    ) -> None:  # fmt: skip
        """Open the ports. ``receive`` is ``Board.receive``; ``port`` and ``output`` are mido ports, or ``name`` says
        which to open, None for the first. Raises SpectralError if there is no such device.
        """
        self._receive, self._decoder = receive, Decoder()
        self._input, self._output = port, output
        self._name = ""
        self.missing: str | None = None
        """Name of the device while it is unplugged; None while it is connected."""
        self._next_look = 0.0
        if port is None:
            self._open(_require_name(name))

    def pump(self) -> int:
        """Pass all waiting messages to the board; returns their number. A disconnected device is no error."""
        self._look_for_device(time.monotonic())
        if self._input is None:
            return 0
        count = 0
        try:
            for message in self._input.iter_pending():
                count += 1
                for control, position in self._decoder.decode(message):
                    self._receive(control, position, time.monotonic())
        except (OSError, ValueError, RuntimeError, SystemError):  # errors of mido's back ends for a disconnected port
            self._lose()
        return count

    def has_motor(self, control: Control) -> bool:
        """True if the device has an input of its own, by which a fader can be moved."""
        return self._output is not None and control.kind != "osc"

    def send(self, control: Control, position: float) -> None:
        """Move a motor; nothing happens where the device has no input of its own."""
        if not self.has_motor(control):
            return
        try:
            for message in encode(control, position):
                self._output.send(message)
        except (OSError, ValueError, RuntimeError, SystemError):
            self._lose()

    def close(self) -> None:
        """Release the ports."""
        for port in (self._input, self._output):
            if port is not None:
                with contextlib.suppress(OSError, ValueError, RuntimeError, SystemError):  # it may be gone
                    port.close()
        self._input = self._output = None

    def _open(self, name: str) -> None:
        mido = _mido()
        self._name, self.missing = name, None
        self._input = mido.open_input(name)
        outputs = [each for each in mido.get_output_names() if _device(each) == _device(name)]
        self._output = mido.open_output(outputs[0]) if outputs else None

    def _lose(self) -> None:
        self.close()
        self.missing = _device(self._name) or "the MIDI device"

    def _look_for_device(self, now: float) -> None:
        """Check every two seconds: systems do not report an unplugged device, only its name disappears."""
        if not self._name or now < self._next_look:
            return
        self._next_look = now + LOOK_SECONDS
        there = [name for name in port_names() if _device(name) == _device(self._name)]
        if self._input is not None and not there:
            self._lose()
        elif self._input is None and self.missing is not None and there:
            with contextlib.suppress(OSError, SystemError):  # not ready yet: the next check tries again
                self._open(there[0])


def _device(name: str) -> str:
    """A port's name without the numbers that change when it is plugged in again (``nano:nano MIDI 1 20:0``)."""
    return re.sub(r" [0-9]+:[0-9]+$", "", name)


def _require_name(name: str | None) -> str:
    _mido()  # its absence is the error to report
    names = port_names()
    if not names:
        raise SpectralError("no MIDI device is connected; connect one, or use OSC")
    found = [each for each in names if name is None or each == name or _device(each) == _device(name)]
    if not found:
        raise InvalidInputError(f"no MIDI input is named {name!r}; connected: {', '.join(names)}")
    return str(name if name in names else found[0])


def _mido() -> Any:
    try:
        import mido
    except ImportError as error:
        raise MissingDependencyError.package("mido", "a MIDI mixing board", "board") from error
    return mido
