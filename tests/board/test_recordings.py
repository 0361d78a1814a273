# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of fader motion, their files, and the correlation of faders in them (Eq. 6.2)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.board import Recording, simultaneity


def test_recordings_need_ascending_times_and_their_own_shape(tmp_path: Path) -> None:
    for times in ([0.0, 0.0], [1.0, 0.5]):
        with pytest.raises(InvalidInputError, match="must ascend"):
            Recording(("a",), np.array(times), np.zeros((2, 1)))
    with pytest.raises(InvalidInputError):
        Recording(("a", "b"), np.array([0.0, 1.0]), np.zeros((2, 1)))
    empty = Recording.from_events([], ("a", "b"), start=(0.25, 0.5))
    empty.save(tmp_path / "empty.toml")
    back = Recording.load(tmp_path / "empty.toml")
    assert back.positions.shape == (0, 2)
    np.testing.assert_array_equal(simultaneity(back), np.zeros((2, 2)))
    still = Recording(("a",), np.array([1.0]), np.array([[0.5]]))
    np.testing.assert_array_equal(simultaneity(still), [[0.0]])
    (tmp_path / "list.json").write_text("[1]")
    with pytest.raises(FileFormatError):
        Recording.load(tmp_path / "list.json")


def test_recordings_of_an_earlier_version_are_read(tmp_path: Path) -> None:
    """They named their format ``kind``."""
    import json

    Recording(("a",), np.array([0.0, 2.0]), np.array([[0.25], [0.5]])).save(tmp_path / "new.json")
    document = json.loads((tmp_path / "new.json").read_text())
    (tmp_path / "old.json").write_text(json.dumps({"kind": document.pop("format"), **document}))
    np.testing.assert_array_equal(Recording.load(tmp_path / "old.json").positions, [[0.25], [0.5]])


def test_events_keep_the_earlier_positions_of_other_faders() -> None:
    """Of two events of one fader at one time the later in the list counts."""
    events = [(2.0, 1, 0.5), (1.0, 0, 0.25), (2.0, 1, 0.75), (4.0, 0, 1.0)]
    path = Recording.from_events(events, ("a", "b"), start=(0.125, 0.0))
    np.testing.assert_array_equal(path.times, [0.9, 1.0, 1.9, 2.0, 3.9, 4.0])
    np.testing.assert_array_equal(path.positions[:, 0], [0.125, 0.25, 0.25, 0.25, 0.25, 1.0])
    np.testing.assert_array_equal(path.positions[:, 1], [0.0, 0.0, 0.0, 0.75, 0.75, 0.75])
    # after a pause a fader moves for a tenth of a second: they never move together
    np.testing.assert_array_equal(simultaneity(path), np.eye(2))


@pytest.mark.parametrize("lag", [0.0, 2e-5, 0.004, 0.008])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_faders_that_move_together_are_correlated_whenever_their_updates_come(lag: float, way: float) -> None:
    """Updates of two faders never come at one moment: each stood still where the other moved, so that nothing did."""
    times = 0.016 * np.arange(100)
    there = 0.5 - 0.4 * np.cos(4.0 * times)
    first = [(time, 0, at) for time, at in zip(times, there, strict=True)]
    other = [(time + lag, 1, 0.5 + way * (at - 0.5)) for time, at in zip(times, there, strict=True)]
    for events in (first + other, other + first):
        path = Recording.from_events(events, ("a", "b"), start=(0.1, 0.5 - 0.4 * way))
        assert simultaneity(path)[0, 1] == pytest.approx(way, abs=0.02)
    later = [(time + 2.0, fader, at) for time, fader, at in other]
    assert simultaneity(Recording.from_events(first + later, ("a", "b"), start=(0.1, 0.1)))[0, 1] == 0.0


def test_slow_steps_of_two_faders_are_one_motion(rng: np.random.Generator) -> None:
    """Faders of 7 bits that are moved slowly send a step now and then, at moments of their own."""
    events = [(time, fader, time / 10) for fader in (0, 1) for time in np.cumsum(rng.uniform(0.02, 0.09, 100))]
    assert simultaneity(Recording.from_events(events, ("a", "b"), start=(0.0, 0.0)))[0, 1] > 0.8


def test_events_of_no_target_are_refused() -> None:
    for events in ([(0.0, 2, 0.5)], [(0.0, -1, 0.5)], [(0.0, 0.5, 0.5)]):
        with pytest.raises(InvalidInputError, match="beyond the 2 targets"):
            Recording.from_events(events, ("a", "b"), start=(0.0, 0.0))
    with pytest.raises(InvalidInputError, match="start"):
        Recording.from_events([], ("a", "b"), start=(0.0,))
