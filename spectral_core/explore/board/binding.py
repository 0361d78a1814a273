# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of faders to numbers, with ranges."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, Self

from spectral_core.checks import require_declared, require_whole
from spectral_core.errors import InvalidInputError

CONTROL_KINDS = ("cc", "cc14", "nrpn", "bend", "osc")
STEPS = {"cc": 127, "cc14": 16383, "nrpn": 16383, "bend": 16383, "osc": 1 << 24}
"""Number of steps from one end of a control to the other; an OSC float has 24 bits."""
LARGEST_ADDRESS = {"cc": 127, "cc14": 31, "nrpn": 16383}
"""Largest number of a controller or parameter, of those MIDI controls that have one."""
DATA = 6
"""Controller with the upper 7 bits of the value of a numbered parameter (NRPN); 32 higher are the lower ones."""
PAIRED = 32
"""Controllers 0 to 31 carry the upper 7 bits of a 14-bit fader, 32 higher the lower 7 (MIDI 1.0)."""


@dataclass(frozen=True, slots=True)
class Control:
    """One fader, knob or slider. ``kind``: "cc" (7-bit MIDI), "cc14" (MIDI pair n, n+32), "nrpn" (numbered parameter,
    14 bits), "bend" (pitch bend), "osc".

    ``channel``: MIDI channel 0 to 15; ``address``: number of the controller or parameter, or OSC address such as
    ``/fader/1``.
    """

    kind: Literal["cc", "cc14", "nrpn", "bend", "osc"]
    channel: int = 0
    address: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or self.kind not in CONTROL_KINDS:
            raise InvalidInputError(f"control kind {self.kind!r} is not one of {', '.join(CONTROL_KINDS)}")
        require_declared(self)
        object.__setattr__(self, "channel", require_whole("the MIDI channel", self.channel, 0, 15))
        if self.kind == "osc" and (self.channel or not self.address.startswith("/")):
            raise InvalidInputError(
                f"{str(self)[:80]!r} names no OSC fader; expected channel 0 and an address: they start with '/', as in "
                "osc:0:/fader/1"
            )
        if self.kind == "bend" and self.address:
            raise InvalidInputError(
                f"a pitch bend has no number; expected bend:{self.channel}:, got {str(self)[:80]!r}"
            )
        most = LARGEST_ADDRESS.get(self.kind)
        if most is None:
            return
        if not (re.fullmatch("[0-9]{1,9}", self.address) and int(self.address) <= most):
            raise InvalidInputError(
                f"controller {self.address[:40]!r} of a {self.kind} is not a number from 0 to {most}"
            )
        object.__setattr__(self, "address", str(int(self.address)))  # as messages name it, without leading zeros

    @classmethod
    def parse(cls, text: str) -> Self:
        """Control of a text as str() writes it: ``cc:0:81``, ``bend:3:``, ``osc:0:/fader/1``."""
        parts = text.split(":", 2)
        if len(parts) != 3 or not re.fullmatch("[0-9]{1,9}", parts[1]):
            raise InvalidInputError(f"{text[:80]!r} names no control; expected kind:channel:address, such as cc:0:81")
        return cls(parts[0], int(parts[1]), parts[2])  # type: ignore[arg-type]

    def __str__(self) -> str:
        return f"{self.kind}:{self.channel}:{self.address}"

    @property
    def step(self) -> float:
        """Smallest difference of positions that this control distinguishes, as a share of its travel."""
        return 1.0 / STEPS[self.kind]


@dataclass(frozen=True, slots=True)
class Binding:
    """A control moves ``target`` from ``low`` (fader down) to ``high`` (fader up).

    ``target``: a name that the owner of the numbers knows, such as a Blender data path. ``pick_up``: True to ignore the
    control until it has passed the target's present value, so that the value does not jump.
    """

    control: Control
    target: str
    low: float = 0.0
    high: float = 1.0
    pick_up: bool = False

    def __post_init__(self) -> None:
        if not self.low != self.high or not abs(self.high - self.low) < float("inf"):
            raise InvalidInputError(
                f"the range of {self.target!r} runs from {self.low} to {self.high}; give two different finite ends"
            )

    def value(self, position: float) -> float:
        """Target's value at a position in [0, 1]; the ends are met exactly."""
        return self.high if position >= 1 else self.low + (self.high - self.low) * max(position, 0.0)

    def position(self, value: float) -> float:
        """Position in [0, 1] of ``value``; a value outside the range has the position of the nearest end."""
        return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))
