# SPDX-License-Identifier: GPL-3.0-or-later
"""The board itself: many messages in, the last value of each fader out, motors moved without a loop.

No device is opened here: ``midi`` and ``osc`` turn wires into calls of ``receive``. It may be called from any thread;
``poll`` is called by whoever owns the numbers, as often as the picture is drawn.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from spectral_core.errors import InvalidInputError
from spectral_core.explore.board.binding import Binding, Control

TOUCH_SECONDS = 0.1
"""A fader that moved this recently is in somebody's hand: its motor rests."""
MOTOR_SECONDS = 1 / 60
"""Least time between two messages to one motor: what is sent is a state, and the last one always goes out."""
LEARN_TRAVEL = 0.05
"""How far a control must travel before learning takes it: a resting hand trembles."""


@dataclass(frozen=True, slots=True)
class Change:
    """A target's new value; ``held_back`` where a partner's bound stopped it short of what the fader says."""

    target: str
    value: float
    time: float
    held_back: bool = False


@dataclass
class _Fader:
    binding: Binding
    position: float | None = None
    """Where the fader is known to stand; None until it first moves or is driven."""
    touched: float = float("-inf")
    driven: float = float("-inf")
    """When its motor was last sent a position."""
    shown: float | None = None
    """Position last sent to its motor."""
    caught: bool = False
    """Pick-up: whether it has met the value yet."""


class Board:
    """Bindings, and what has come in since the last poll."""

    def __init__(self, read: Callable[[str], float]) -> None:
        """``read`` gives a target's present value; it is called inside ``poll`` and ``motors`` only."""
        self._read = read
        self._lock = threading.Lock()
        self._latest: dict[Control, tuple[float, float]] = {}
        self._faders: dict[Control, _Fader] = {}
        self._bounds: dict[str, tuple[str, str]] = {}
        self._learning: str | None = None
        self._learn_start: dict[Control, float] = {}
        self.received = 0
        """Messages so far; with ``Change`` counts it tells how many were merged."""

    @property
    def bindings(self) -> tuple[Binding, ...]:
        """All bindings, in the order they were made."""
        return tuple(fader.binding for fader in self._faders.values())

    def bind(self, binding: Binding) -> None:
        """Add a binding; one that the control had before is replaced."""
        self._faders[binding.control] = _Fader(binding)

    def unbind(self, control: Control) -> None:
        """Take a binding away; none is no error."""
        self._faders.pop(control, None)

    def keep_ordered(self, lower: str, upper: str) -> None:
        """From now on the target ``upper`` never goes below the target ``lower``: each stops at the other."""
        if lower == upper:
            raise InvalidInputError(f"{lower!r} cannot bound itself; name a lower and an upper target")
        self._bounds[lower] = self._bounds[upper] = (lower, upper)

    def learn(self, target: str) -> None:
        """The next control that is moved becomes the one that moves ``target``."""
        with self._lock:
            self._learning, self._learn_start = target, {}

    @property
    def learning(self) -> str | None:
        """Target that waits for a control to be moved; None where none does."""
        return self._learning

    def receive(self, control: Control, position: float, time: float) -> None:
        """A control stands at ``position`` in [0, 1]. Only the last message of each control is kept: none can queue."""
        with self._lock:
            self.received += 1
            self._latest[control] = (min(1.0, max(0.0, position)), time)
            if self._learning is not None:
                self._learn_start.setdefault(control, position)

    def poll(self, range_of: Callable[[str], tuple[float, float]] | None = None) -> tuple[Change, ...]:
        """What has changed since the last poll, one entry per target, all faders that moved at once together.

        ``range_of`` gives the range for a target that was learned; [0, 1] without it.
        """
        with self._lock:
            latest, self._latest = self._latest, {}
        self._finish_learning(latest, range_of)
        wanted: dict[str, Change] = {}
        for control, (position, time) in sorted(latest.items(), key=lambda entry: entry[1][1]):
            fader = self._faders.get(control)
            if fader is not None and self._moved(fader, position, time):
                target = fader.binding.target
                wanted[target] = Change(target, fader.binding.value(position), time)
        return tuple(self._within_bounds(change, wanted) for change in wanted.values())

    def motors(self, time: float) -> tuple[tuple[Control, float], ...]:
        """Controls whose motor must move, with the position to send: where a target changed by other means.

        A fader in somebody's hand is left alone, and one that already stands there gets nothing: no loop can start.
        """
        to_send = []
        for control, fader in self._faders.items():
            position = fader.binding.position(self._read(fader.binding.target))
            known = fader.shown if fader.shown is not None else fader.position
            rests = time - fader.touched < TOUCH_SECONDS or time - fader.driven < MOTOR_SECONDS
            if rests or (known is not None and abs(known - position) <= control.step):
                continue
            fader.shown, fader.position, fader.driven = position, position, time
            to_send.append((control, position))
        return tuple(to_send)

    def _finish_learning(
        self, latest: Mapping[Control, tuple[float, float]], range_of: Callable[[str], tuple[float, float]] | None
    ) -> None:
        if self._learning is None:
            return
        travel = {c: abs(p - self._learn_start.get(c, p)) for c, (p, _) in latest.items()}
        farthest = max(travel, key=lambda control: travel[control], default=None)
        if farthest is None or travel[farthest] < LEARN_TRAVEL:
            return
        low, high = range_of(self._learning) if range_of else (0.0, 1.0)
        self.bind(Binding(farthest, self._learning, low, high))
        self._learning = None

    def _moved(self, fader: _Fader, position: float, time: float) -> bool:
        """Whether a message is a hand's movement that counts; an echo of a motor's own is not."""
        if fader.shown is not None and abs(fader.shown - position) <= fader.binding.control.step:
            fader.position = position
            return False
        before, fader.position, fader.touched = fader.position, position, time
        fader.shown = position
        if fader.binding.pick_up and not fader.caught:
            present = fader.binding.position(self._read(fader.binding.target))
            start = before if before is not None else position
            passed = min(start, position) - fader.binding.control.step <= present
            fader.caught = passed and present <= max(start, position) + fader.binding.control.step
            return fader.caught
        return True

    def _within_bounds(self, change: Change, wanted: Mapping[str, Change]) -> Change:
        pair = self._bounds.get(change.target)
        if pair is None:
            return change
        other = pair[1] if change.target == pair[0] else pair[0]
        limit = wanted[other].value if other in wanted else self._read(other)
        if change.target == pair[0] and change.value > limit:
            # Both moved past each other at once: the upper one wins, the lower one stops at it.
            return Change(change.target, limit, change.time, held_back=True)
        if change.target == pair[1] and change.value < limit and other not in wanted:
            return Change(change.target, limit, change.time, held_back=True)
        return change
