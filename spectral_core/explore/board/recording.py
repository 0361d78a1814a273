# SPDX-License-Identifier: GPL-3.0-or-later
"""Recorded fader motion, and its simultaneity (Eq. 6.2)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_declared
from spectral_core.documents import Schema, read_document, write_document
from spectral_core.errors import InvalidInputError

Array = NDArray[np.float64]
FORMAT, VERSION = "spectral-scene fader recording", 1
MOVING_SECONDS = 0.1
"""A fader moves for so long before each of its updates, at most since the one before: updates of faders that move
together come in turn, and slow ones have pauses of this length between their steps.
"""
RECORDING_SCHEMA = Schema("spectral_core.explore.board", "recording.schema.json")


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Motion paths. ``times``: (n,) seconds, ascending; ``positions``: (n, faders), each fader's position at them."""

    targets: tuple[str, ...]
    times: Array
    positions: Array

    def __post_init__(self) -> None:
        require_declared(self)
        object.__setattr__(self, "times", frozen_array("times", self.times, (None,)))
        shape = (self.times.size, len(self.targets))
        object.__setattr__(self, "positions", frozen_array("positions", self.positions, shape))
        if np.any(np.diff(self.times) <= 0):
            raise InvalidInputError("the times of a recording must ascend; sort its samples and drop repeats")

    @classmethod
    def from_events(cls, events: ArrayLike, targets: tuple[str, ...], start: ArrayLike) -> Self:
        """Paths from value updates: ``events`` rows (seconds, fader index, position), ``start`` (faders,) positions.

        A fader moves evenly from one of its updates to the next, after a longer pause for ``MOVING_SECONDS`` only, so
        that it does not matter in which order and at which moments those of other faders arrive. Raises
        InvalidInputError for an event of a fader that is no target.
        """
        rows = np.asarray(events, dtype=np.float64).reshape(-1, 3)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        begins = frozen_array("start", start, (len(targets),))
        if not np.isin(rows[:, 1], np.arange(len(targets))).all():
            raise InvalidInputError(f"an event names a fader beyond the {len(targets)} targets, which count from 0")
        paths = [_path(rows[rows[:, 1] == fader], begin) for fader, begin in enumerate(begins)]
        times = np.unique(np.concatenate([each for each, _ in paths])) if paths else np.zeros(0)
        positions = np.empty((times.size, len(targets)))
        for fader, (own, path) in enumerate(paths):
            positions[:, fader] = np.interp(times, own, path) if own.size else begins[fader]
        return cls(targets, times, positions)

    def save(self, path: str | Path) -> None:
        """Write as a document in JSON or TOML. Raises FileWriteError."""
        times, positions = self.times.tolist(), self.positions.tolist()
        document = {"format": FORMAT, "version": VERSION, "targets": list(self.targets)}
        write_document(path, {**document, "times": times, "positions": positions}, what="recordings", indent=None)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a file of save(). Raises FileFormatError for anything else."""
        return read_document(path, cls._of_document, "a fader recording")

    @classmethod
    def _of_document(cls, document: Any, _folder: Path) -> Self:
        if isinstance(document, dict) and "kind" in document:  # how recordings of 2026 name their format
            document = {"format": document["kind"], **{key: document[key] for key in document if key != "kind"}}
        RECORDING_SCHEMA.require_valid(document)
        positions = document["positions"] or np.zeros((0, len(document["targets"])))  # without samples, no rows
        return cls(tuple(document["targets"]), document["times"], positions)


def _path(updates: Array, start: float) -> tuple[Array, Array]:
    """Times and positions of the corners of a fader's path, from its updates (n, 3), sorted; of two at one time the
    later counts.
    """
    times = updates[:, 0]
    last = np.append(times[1:] != times[:-1], True)[: times.size]
    times, positions = times[last], updates[last, 2]
    before = np.concatenate([[-np.inf], times])[: times.size]
    moves = np.maximum(before, times - MOVING_SECONDS)
    held = np.concatenate([[start], positions])[: times.size]
    return np.stack([moves, times], axis=1).ravel(), np.stack([held, positions], axis=1).ravel()


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
