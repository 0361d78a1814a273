# SPDX-License-Identifier: GPL-3.0-or-later
"""Processor time and elapsed time: other programs on a machine change only the second."""

from __future__ import annotations

import time
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Spent:
    """``work``: seconds of all cores that this process has used; ``wall``: seconds on the wall meanwhile."""

    work: float = 0.0
    wall: float = 0.0

    def __add__(self, other: Spent) -> Spent:
        return Spent(self.work + other.work, self.wall + other.wall)

    @property
    def slowness(self) -> float:
        """Seconds on the wall per second of work: below 1 where several cores work, above where others use them."""
        return self.wall / self.work if self.work > 0 else 1.0


class Meter:
    """Measures both times from its creation on; ``started``: that moment by ``time.perf_counter``."""

    def __init__(self) -> None:
        self._work, self.started = time.process_time(), time.perf_counter()

    def read(self) -> Spent:
        """Both times so far."""
        return Spent(time.process_time() - self._work, time.perf_counter() - self.started)
