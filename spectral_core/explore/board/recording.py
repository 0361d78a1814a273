# SPDX-License-Identifier: GPL-3.0-or-later
"""Recorded fader motion, and how simultaneous it was (Eq. 6.2)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array
from spectral_core.errors import FileFormatError, InvalidInputError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Motion paths. ``times``: (n,) seconds, ascending; ``positions``: (n, faders), each fader's position at them."""

    targets: tuple[str, ...]
    times: Array
    positions: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", frozen_array("times", self.times, (None,)))
        shape = (self.times.size, len(self.targets))
        object.__setattr__(self, "positions", frozen_array("positions", self.positions, shape))
        if np.any(np.diff(self.times) <= 0):
            raise InvalidInputError("the times of a recording must ascend; sort its samples and drop repeats")

    @classmethod
    def from_events(cls, events: ArrayLike, targets: tuple[str, ...], start: ArrayLike) -> Self:
        """Paths from value updates: ``events`` rows (seconds, fader index, position), ``start`` (faders,) positions."""
        rows = np.asarray(events, dtype=np.float64).reshape(-1, 3)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        times, first = np.unique(rows[:, 0], return_index=True)
        now, path = np.array(start, dtype=np.float64), np.empty((times.size, len(targets)))
        for number, (begin, end) in enumerate(zip(first, [*first[1:], len(rows)], strict=True)):
            for _, fader, position in rows[begin:end]:
                now[int(fader)] = position
            path[number] = now
        return cls(targets, times, path)

    def save(self, path: Path) -> None:
        """Write as JSON."""
        data = {"kind": "spectral-scene fader recording", "version": 1, "targets": list(self.targets),
                "times": self.times.tolist(), "positions": self.positions.tolist()}  # fmt: skip
        path.write_text(json.dumps(data), "utf-8")

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read what save() wrote. Raises FileFormatError for anything else."""
        try:
            data = json.loads(path.read_text("utf-8"))
            if data["kind"] != "spectral-scene fader recording":
                raise KeyError(data["kind"])
            return cls(tuple(data["targets"]), np.array(data["times"]), np.array(data["positions"]))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise FileFormatError(f"{path} is not a fader recording of this program ({error})") from error


def simultaneity(recording: Recording) -> Array:
    """Correlation (faders, faders) of fader velocities over the whole recording, Eq. 6.2, not centered, in [-1, 1].

    c_ab = ∫ s_a′ s_b′ dt, divided by √(c_aa c_bb); paths are linear between samples, so the integral is exact. Rows
    and columns of faders that never moved are 0.
    """
    if recording.times.size < 2:
        return np.zeros((len(recording.targets),) * 2)
    steps, durations = np.diff(recording.positions, axis=0), np.diff(recording.times)
    products = steps.T @ (steps / durations[:, None])
    lengths = np.sqrt(np.diag(products))
    scale = np.where(lengths > 0, lengths, 1.0)
    correlation: Array = np.clip(products / np.outer(scale, scale), -1.0, 1.0)
    return correlation
