# SPDX-License-Identifier: GPL-3.0-or-later
"""The time that a run still needs, by the points that it has ended."""

from __future__ import annotations


class Pace:
    """Predicts the rest of a run. Its first points wait for workers that start and load their data; later ones do not.

    ``first``: points that are begun at once.
    """

    def __init__(self, first: int) -> None:
        self._first = first
        self._started = 0.0, 0

    def seconds_left(self, seconds: float, ended: int, remaining: int) -> float | None:
        """Seconds for ``remaining`` points, after ``ended`` points of this run in ``seconds``; None until one ended."""
        if ended <= self._first:
            self._started = seconds, ended
        since, before = self._started if ended >= 2 * self._first else (0.0, 0)
        return (seconds - since) / (ended - before) * remaining if ended > before else None
