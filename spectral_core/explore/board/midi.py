# SPDX-License-Identifier: GPL-3.0-or-later
"""MIDI in and out: messages become positions of controls, positions become messages that move motors.

mido (and python-rtmidi behind it) are optional; without them, or without a device, everything else works.
"""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from spectral_core.errors import InvalidInputError, MissingDependencyError, SpectralError
from spectral_core.explore.board.binding import DATA, LARGEST_ADDRESS, PAIRED, Control

LOOK_SECONDS = 2.0
"""Time between two checks whether the device is connected."""
LONE_SECONDS = 0.02
"""Time after which the lower half of a pair does not come any more: devices send both in one go."""
NUMBERED, REGISTERED = (99, 98), (101, 100)
"""Controllers that select a parameter by the upper and lower 7 bits of its number (MIDI 1.0)."""
FAULTS = (OSError, ValueError, RuntimeError, SystemError, MemoryError)
"""Errors of mido's back ends for a port that is gone or used by another program."""


class Decoder:
    """MIDI messages to positions of controls.

    Controllers n and n + 32 may be two faders of 7 bits or the halves of one of 14; the messages do not show it. So the
    second half is decoded as both, and the board uses the one that is bound. All numbered parameters (NRPN) of a
    channel send their values by controllers 6 and 38, after two others have selected the parameter.
    """

    def __init__(self) -> None:
        self._upper: dict[tuple[int, int], int] = {}
        self._paired: set[Control] = set()
        """Controls whose lower half has been seen."""
        self._alone: dict[tuple[int, int], float] = {}
        """Upper halves whose lower one has not arrived yet, with the time of each."""
        self._selected: dict[int, dict[int, int]] = {}
        """Halves of the number of the selected parameter by channel, by controller."""

    def decode(self, message: Any, time: float = 0.0) -> tuple[tuple[Control, float], ...]:
        """Controls that a mido message moves, with their positions; none if the message belongs to no fader."""
        if message.type == "pitchwheel":
            return ((Control("bend", message.channel), (message.pitch + 8192) / 16383),)
        if message.type != "control_change":
            return ()
        number, channel, value = message.control, message.channel, message.value
        ended = self._select(channel, number, value)
        coarse = (Control("cc", channel, str(number)), value / 127)
        pair = (channel, number % PAIRED)
        if number < PAIRED:
            self._upper[pair] = value
            fine = self._fine(pair)
            if fine.kind == "nrpn" or fine in self._paired:
                self._alone[pair] = time
        elif number < 2 * PAIRED and pair in self._upper:
            fine = self._fine(pair)
            self._paired.add(fine)
            self._alone.pop(pair, None)
            return coarse, (fine, (self._upper[pair] << 7 | value) / 16383)
        return (*ended, coarse)

    def lone(self, time: float) -> tuple[tuple[Control, float], ...]:
        """Faders whose upper half has arrived without the lower one, which is then 0 (MIDI 1.0)."""
        late = [pair for pair, came in self._alone.items() if time - came >= LONE_SECONDS]
        return tuple(self._without_lower(pair) for pair in late)

    def _without_lower(self, pair: tuple[int, int]) -> tuple[Control, float]:
        """The fader of an upper half whose lower one does not come, and its position."""
        del self._alone[pair]
        fine, upper = self._fine(pair), self._upper[pair]
        # a parameter that never has a lower half has 7 bits
        return fine, (upper << 7) / 16383 if fine in self._paired else upper / 127

    def _fine(self, pair: tuple[int, int]) -> Control:
        channel, number = pair
        parameter = self._parameter(channel) if number == DATA else None
        return Control("cc14", channel, str(number)) if parameter is None else Control("nrpn", channel, str(parameter))

    def _select(self, channel: int, number: int, value: int) -> tuple[tuple[Control, float], ...]:
        """Follow the selection of parameters; a registered one, such as the range of the pitch bend, is no fader.

        Returns the fader of the earlier selection if its lower half has not come: it does not come any more. Devices
        of 7 bits select the next parameter, or none, right after a value.
        """
        if number not in (*REGISTERED, *NUMBERED):
            return ()
        data = (channel, DATA)
        ended = (self._without_lower(data),) if data in self._alone else ()
        if number in REGISTERED:
            self._selected.pop(channel, None)
        else:
            self._selected.setdefault(channel, {})[number] = value
        self._upper.pop(data, None)
        return ended

    def _parameter(self, channel: int) -> int | None:
        """Number of the selected parameter; None without one, or if it is deselected (16383)."""
        halves = self._selected.get(channel, {})
        if len(halves) < 2:
            return None
        upper, lower = (halves[each] for each in NUMBERED)
        number = upper << 7 | lower
        return None if number == 16383 else number


def encode(control: Control, position: float) -> list[Any]:
    """Mido messages that bring the control's motor or ring of lights to ``position`` in [0, 1]."""
    mido = _mido()
    if control.kind == "bend":
        return [mido.Message("pitchwheel", channel=control.channel, pitch=round(position * 16383) - 8192)]
    if control.kind not in LARGEST_ADDRESS:
        raise InvalidInputError(f"{control} is not a MIDI control")
    number = int(control.address)
    if control.kind == "cc":
        numbers = [(number, round(position * 127))]
    else:
        value = round(position * 16383)
        first = number if control.kind == "cc14" else DATA
        numbers = [(first, value >> 7), (first + PAIRED, value & 127)]
    if control.kind == "nrpn":
        numbers = [*zip(NUMBERED, (number >> 7, number & 127), strict=True), *numbers]
    return [mido.Message("control_change", channel=control.channel, control=n, value=v) for n, v in numbers]


def port_names() -> list[str]:
    """Names of the available MIDI inputs; empty if there is no MIDI on this machine."""
    try:
        return list(_mido().get_input_names())
    except (*FAULTS, ImportError):  # rtmidi raises SystemError where the system has no sequencer
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
                now = time.monotonic()
                for control, position in self._decoder.decode(message, now):
                    self._receive(control, position, now)
        except FAULTS:
            self._lose()
        now = time.monotonic()
        for control, position in self._decoder.lone(now):
            self._receive(control, position, now)
        return count

    def has_motor(self, control: Control) -> bool:
        """True if the device has an input of its own, by which a fader can be moved."""
        return self._output is not None and control.kind != "osc"

    def send(self, control: Control, position: float) -> bool:
        """Move a motor; nothing happens where the device has no input of its own. False if it was not sent."""
        if not self.has_motor(control):
            return True
        try:
            for message in encode(control, position):
                self._output.send(message)
        except FAULTS:
            self._lose()
            return False
        return True

    def close(self) -> None:
        """Release the ports."""
        for port in (self._input, self._output):
            if port is not None:
                with contextlib.suppress(*FAULTS):  # it may be gone
                    port.close()
        self._input = self._output = None

    def _open(self, name: str) -> None:
        mido = _mido()
        try:
            self._input = mido.open_input(name)
            outputs = [each for each in mido.get_output_names() if _device(each) == _device(name)]
            self._output = mido.open_output(outputs[0]) if outputs else None
        except FAULTS as error:
            self.close()
            raise SpectralError(
                f"the MIDI device {name!r} cannot be opened ({error}); close other programs that use it"
            ) from error
        self._name, self.missing = name, None

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
            with contextlib.suppress(SpectralError):  # not ready yet: the next check tries again
                self._open(there[0])


def _device(name: str) -> str:
    """A port's name without the numbers that change when it is plugged in again (``nano:nano MIDI 1 20:0``)."""
    return re.sub(r" [0-9]+:[0-9]+$", "", name)


def _require_name(name: str | None) -> str:
    _mido()  # its absence is the error to report
    names = port_names()
    if not names:
        _require_back_end()
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


def _require_back_end() -> None:
    """Raise MissingDependencyError without the package by which mido opens devices."""
    back_end = os.environ.get("MIDO_BACKEND", "mido.backends.rtmidi").partition("/")[0]
    if back_end == "mido.backends.rtmidi" and find_spec("rtmidi") is None:
        raise MissingDependencyError.package("python-rtmidi", "a MIDI mixing board", "board")
