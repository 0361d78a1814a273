# SPDX-License-Identifier: GPL-3.0-or-later
"""The board: receives messages, keeps the last value of each fader, and moves motors without a feedback loop.

No device is opened here: ``midi`` and ``osc`` call ``receive`` for each message, from any thread. The owner of the
numbers calls ``poll`` once per drawn picture.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from spectral_core.errors import InvalidInputError
from spectral_core.explore.board.binding import DATA, PAIRED, Binding, Control
from spectral_core.explore.board.order import Order

TOUCH_SECONDS = 0.1
"""Time after a movement during which a fader counts as touched, so that its motor is not driven."""
MOTOR_SECONDS = 1 / 60
"""Least time between two messages to one motor: messages hold states, and the last one is always sent."""
ECHO_SECONDS = 0.15
"""Time after a motor command in which an equal message counts as the motor's report of its arrival."""
ROUNDING = 1e-6
"""Positions this little outside of [0, 1] are at its ends: a sender computes in single precision."""
LEARN_TRAVEL = 0.05
"""Least travel of a control before it is learned, because a resting hand trembles."""


@dataclass(frozen=True, slots=True)
class Change:
    """A target's new value; ``held_back`` if the limit of another target stopped it before the fader's value."""

    target: str
    value: float
    time: float
    held_back: bool = False


@dataclass
class _Fader:
    """A bound control, its last position by hand, and the last position sent to its motor."""

    binding: Binding
    hand: float | None = None
    touched: float = float("-inf")
    """Time of ``hand``."""
    sent: float | None = None
    driven: float = float("-inf")
    """Time of ``sent``."""
    caught: bool = False
    """Pick-up: True while the fader controls the value; False after the value changed by other means."""
    left_at: float | None = None
    """The value after this fader's last change, as its owner keeps it; None while that is not known."""

    @property
    def stands(self) -> float | None:
        """Position of the fader, the newer of the two; None before the first."""
        return self.sent if self.sent is not None and self.driven > self.touched else self.hand

    def is_echo(self, position: float, time: float) -> bool:
        """True if a message is the motor's own report."""
        near = self.sent is not None and abs(self.sent - position) <= self.binding.control.step
        return near and 0 <= time - self.driven <= ECHO_SECONDS


class Board:
    """Bindings, and the messages since the last poll."""

    def __init__(self, read: Callable[[str], float | None], has_motor: Callable[[Control], bool] | None = None) -> None:
        """Make a board without bindings.

        ``read`` returns a target's present value, None if it is gone: it then limits no other target, and its motor
        rests. It is called inside ``poll`` and ``motors`` only. ``has_motor`` returns True if a control has a motor;
        None means that all have one.
        """
        self._read = read
        self._has_motor = has_motor or (lambda control: True)
        self._lock = threading.Lock()
        self._latest: dict[Control, tuple[float, float]] = {}
        self._beyond: dict[Control, float] = {}
        self._faders: dict[Control, _Fader] = {}
        self._order = Order()
        self._learning: str | None = None
        self._learn_start: dict[Control, float] = {}
        self.not_learned = ""
        """Why the last target was not bound to the control that moved; "" if it was."""
        self.received = 0
        """Number of messages so far; the number of ``Change`` objects shows how many were merged."""

    @property
    def bindings(self) -> tuple[Binding, ...]:
        """All bindings, in the order they were made."""
        return tuple(fader.binding for fader in self._faders.values())

    def bind(self, binding: Binding) -> None:
        """Add a binding after all others; it replaces an earlier one of the control."""
        self._faders.pop(binding.control, None)  # a dict keeps the position of a key that is written again
        self._faders[binding.control] = _Fader(binding)

    def unbind(self, control: Control) -> None:
        """Remove a binding; do nothing if there is none."""
        self._faders.pop(control, None)

    @property
    def orders(self) -> tuple[tuple[str, str], ...]:
        """All pairs (lower, upper) that are kept in order."""
        return self._order.pairs

    def set_orders(self, pairs: Iterable[tuple[str, str]]) -> None:
        """Keep these pairs (lower, upper) in order, and no others. Raises InvalidInputError for a circle."""
        order = Order()
        for lower, upper in pairs:
            order = order.with_pair(lower, upper)
        self._order = order

    def learn(self, target: str) -> None:
        """Bind the next control that moves to ``target``."""
        with self._lock:
            self._learning, self._learn_start, self.not_learned = target, {}, ""

    @property
    def learning(self) -> str | None:
        """Target that waits for the next moved control; None without one."""
        return self._learning

    def receive(self, control: Control, position: float, time: float) -> None:
        """Accept the position of a control in [0, 1]. Only the last message of each control is kept, so none can
        queue.
        """
        inside = min(1.0, max(0.0, position))
        with self._lock:
            self.received += 1
            self._latest[control] = (inside, time)
            self._beyond.pop(control, None)
            # of the others none is kept: a sender may have any number of addresses
            if abs(position - inside) > ROUNDING and (control in self._faders or self._learning is not None):
                self._beyond[control] = position
            if self._learning is not None:
                self._learn_start.setdefault(control, inside)

    @property
    def beyond(self) -> dict[Control, float]:
        """Positions outside [0, 1] by control, of those that are bound, or of all while one is learned: their sender
        has another range, and only the nearest end arrives at the target.
        """
        with self._lock:
            found = dict(self._beyond)
        return {c: position for c, position in found.items() if c in self._faders or self._learning is not None}

    def poll(self, range_of: Callable[[str], tuple[float, float]] | None = None) -> tuple[Change, ...]:
        """Changes since the last poll, one entry per target, with all faders that moved together.

        ``range_of`` returns the range of a learned target; [0, 1] without it. If it raises InvalidInputError, the
        target is not bound, and ``not_learned`` is the reason.
        """
        self._settle()
        with self._lock:
            latest, self._latest = self._latest, {}
        self._finish_learning(latest, range_of)
        wanted: dict[str, Change] = {}
        for control, (position, time) in sorted(latest.items(), key=lambda entry: entry[1][1]):
            fader = self._faders.get(control)
            if fader is not None and not fader.is_echo(position, time) and self._counts(fader, position, time):
                target = fader.binding.target
                wanted[target] = Change(target, fader.binding.value(position), time)
        held = self._order.held({target: change.value for target, change in wanted.items()}, self._read)
        return tuple(
            replace(change, value=held[target], held_back=held[target] != change.value)
            for target, change in wanted.items()
        )

    def motors(self, time: float) -> tuple[tuple[Control, float], ...]:
        """Motors to move, with their positions: those of targets that changed by other means.

        A touched fader, or one that is already in position, gets no message, so no feedback loop can start.
        """
        self._settle()
        to_send = []
        for control, fader in self._faders.items():
            if not self._has_motor(control):
                continue
            if time - fader.touched < TOUCH_SECONDS or time - fader.driven < MOTOR_SECONDS:
                continue
            position, stands = self._position(fader), fader.stands
            if position is not None and (stands is None or abs(stands - position) > control.step):
                fader.sent, fader.driven = position, time
                to_send.append((control, position))
        return tuple(to_send)

    def send_again(self, control: Control) -> None:
        """Let ``motors`` give a position again that could not be sent."""
        if control in self._faders:
            self._faders[control].sent = None

    def _finish_learning(
        self, latest: Mapping[Control, tuple[float, float]], range_of: Callable[[str], tuple[float, float]] | None
    ) -> None:
        if self._learning is None:
            return
        travel = {c: abs(p - self._learn_start.get(c, p)) for c, (p, _) in latest.items()}
        # The low byte of a 14-bit fader jumps over its whole range: if both halves arrive, only the pair counts.
        moved = [c for c, distance in travel.items() if distance >= LEARN_TRAVEL and not self._is_half(c)]
        if not moved:
            return
        chosen = max(moved, key=lambda control: travel[control])
        target, self._learning = self._learning, None
        try:
            low, high = range_of(target) if range_of else (0.0, 1.0)
            self.bind(Binding(chosen, target, low, high))
        except InvalidInputError as error:  # the target was deleted meanwhile, or has no range
            self.not_learned = str(error)

    def _is_half(self, control: Control) -> bool:
        if control.kind != "cc":
            return False
        upper = int(control.address) % PAIRED
        if upper == DATA and any(each.kind == "nrpn" and each.channel == control.channel for each in self._learn_start):
            return int(control.address) in (DATA, DATA + PAIRED)
        halves = (Control("cc", control.channel, str(upper)), Control("cc", control.channel, str(upper + PAIRED)))
        return control in halves and all(half in self._learn_start for half in halves)

    def _position(self, fader: _Fader) -> float | None:
        """Position of a fader at which its target has its present value; None if the target is gone."""
        value = self._read(fader.binding.target)
        return None if value is None else fader.binding.position(value)

    def _settle(self) -> None:
        """Store the values after the last changes, which their owner may have rounded or clipped."""
        for fader in self._faders.values():
            if fader.caught and fader.left_at is None:
                fader.left_at = self._position(fader)

    def _counts(self, fader: _Fader, position: float, time: float) -> bool:
        """Record a movement by hand; True if it changes the target, which under pick-up it must pass first."""
        before = fader.stands
        fader.hand, fader.touched = position, time
        if not fader.binding.pick_up:
            return True
        present, step = self._position(fader), fader.binding.control.step
        if present is None:
            return False
        if fader.caught and fader.left_at is not None and abs(present - fader.left_at) > step:
            fader.caught = False  # the value changed by other means: the fader would make it jump
        if not fader.caught:
            start = position if before is None else before
            fader.caught = min(start, position) - step <= present <= max(start, position) + step
        fader.left_at = None if fader.caught else fader.left_at
        return fader.caught
