# SPDX-License-Identifier: GPL-3.0-or-later
"""Faders change numbers: the last value counts, motors form no loop, bounds hold; learning and pick-up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.explore.board import Binding, Board, Control, Recording, simultaneity

FADERS = [Control("cc14", 0, str(number)) for number in range(8)]


class Numbers(dict[str, float]):
    """The owner of the targets: a dictionary."""

    def apply(self, board: Board) -> int:
        changes = board.poll()
        self.update({change.target: change.value for change in changes})
        return len(changes)


def board_of(numbers: Numbers, **options: bool) -> Board:
    board = Board(numbers.__getitem__)
    for control, target in zip(FADERS, numbers, strict=False):
        board.bind(Binding(control, target, 0.0, 10.0, **options))
    return board


def test_the_last_value_of_each_fader_counts_and_none_is_queued() -> None:
    numbers = Numbers({f"n{i}": 0.0 for i in range(8)})
    board = board_of(numbers)
    for step in range(1001):
        for fader in FADERS:
            board.receive(fader, step / 1000, time=step / 1000)

    assert board.received == 8008
    assert numbers.apply(board) == 8
    assert set(numbers.values()) == {10.0}
    assert numbers.apply(board) == 0


def test_a_motor_follows_the_number_and_its_echo_is_no_movement() -> None:
    numbers = Numbers({"a": 2.5})
    board = board_of(numbers)
    sent = board.motors(time=1.0)

    assert sent == ((FADERS[0], 0.25),)
    board.receive(FADERS[0], 0.25 + 0.9 / 16383, time=1.01)  # the motor reports its final position
    assert numbers.apply(board) == 0
    assert numbers["a"] == 2.5
    assert board.motors(time=2.0) == ()


def test_a_moved_fader_and_its_motor_form_no_loop() -> None:
    """A board that echoes its motors, polled for a simulated minute, keeps the number unchanged."""
    numbers = Numbers({"a": 0.0})
    board = board_of(numbers)
    board.receive(FADERS[0], 0.7, time=0.0)
    numbers.apply(board)
    motor_messages = 0
    for tick in range(3600):
        time = 0.02 + tick / 60
        for control, position in board.motors(time):
            motor_messages += 1
            board.receive(control, round(position * 16383) / 16383, time + 0.005)
        numbers.apply(board)

    assert numbers["a"] == pytest.approx(7.0)
    assert motor_messages == 0


def test_a_motor_rests_while_a_hand_holds_the_fader() -> None:
    numbers = Numbers({"a": 0.0})
    board = board_of(numbers)
    board.receive(FADERS[0], 0.5, time=1.0)
    numbers.apply(board)
    numbers["a"] = 9.0

    assert board.motors(time=1.05) == ()
    assert board.motors(time=1.2) == ((FADERS[0], 0.9),)
    numbers["a"] = 1.0
    assert board.motors(time=1.205) == ()
    assert board.motors(time=1.3) == ((FADERS[0], 0.1),)


def test_pick_up_keeps_a_fader_whose_owner_rounds_its_values() -> None:
    """The stored value lies away from the fader after each movement, but nobody else has changed it."""
    numbers = Numbers({"a": 0.0})
    board = board_of(numbers, pick_up=True)
    for step, position in enumerate((0.0, 0.14, 0.34, 0.48, 0.64, 0.83, 0.97)):
        board.receive(FADERS[0], position, time=float(step))
        numbers.apply(board)
        numbers["a"] = float(5 * round(numbers["a"] / 5))
        board.motors(time=step + 0.5)
        assert numbers["a"] == 5 * round(2 * position)


def test_pick_up_waits_until_the_fader_passes_the_value() -> None:
    numbers = Numbers({"a": 5.0})
    board = board_of(numbers, pick_up=True)
    for position in (0.0, 0.2, 0.45):
        board.receive(FADERS[0], position, time=position)
        assert numbers.apply(board) == 0
    board.receive(FADERS[0], 0.6, time=1.0)

    assert numbers.apply(board) == 1
    assert numbers["a"] == pytest.approx(6.0)


def test_an_upper_bound_never_goes_below_its_lower_one() -> None:
    numbers = Numbers({"low": 2.0, "high": 6.0})
    board = board_of(numbers)
    board.set_orders([("low", "high")])

    board.receive(FADERS[0], 0.9, time=0.0)
    (change,) = board.poll()
    assert (change.value, change.held_back) == (6.0, True)
    board.receive(FADERS[1], 0.1, time=1.0)
    (change,) = board.poll()
    assert (change.value, change.held_back) == (2.0, True)
    board.receive(FADERS[0], 0.8, time=2.0)
    board.receive(FADERS[1], 0.3, time=2.0)
    moved = {change.target: change.value for change in board.poll()}
    assert moved["low"] <= moved["high"] == pytest.approx(3.0)


def test_the_last_binding_is_the_last_one_made() -> None:
    """Also where its control had one before: Learn Fader asks for the newest binding of its number."""
    board = Board({"a": 0.0, "b": 0.0}.__getitem__)
    first, second = Control("cc", 0, "1"), Control("cc", 0, "2")
    for control, target in ((first, "a"), (second, "b"), (first, "b")):
        board.bind(Binding(control, target))
    assert [(each.control, each.target) for each in board.bindings] == [(second, "b"), (first, "b")]


def test_learning_binds_the_control_that_moves() -> None:
    numbers = Numbers({"a": 0.0})
    board = Board(numbers.__getitem__)
    board.learn("a")
    board.receive(Control("cc", 0, "1"), 0.50, time=0.0)
    board.receive(Control("cc", 0, "1"), 0.51, time=0.1)
    assert board.poll() == ()
    assert board.learning == "a"
    board.receive(Control("cc", 0, "7"), 0.10, time=0.2)
    board.receive(Control("cc", 0, "7"), 0.90, time=0.3)
    (change,) = board.poll(range_of=lambda target: (0.0, 100.0))

    assert board.learning is None
    assert (change.target, change.value) == ("a", pytest.approx(90.0))
    assert board.bindings == (Binding(Control("cc", 0, "7"), "a", 0.0, 100.0),)


@pytest.mark.parametrize("text", ["cc:0:81", "cc14:3:16", "bend:15:", "osc:0:/fader/1"])
def test_names_of_controls_can_be_parsed(text: str) -> None:
    assert str(Control.parse(text)) == text


@pytest.mark.parametrize(
    ("text", "message"),
    [("cc:0:200", "0 to 127"), ("cc14:0:64", "0 to 31"), ("cc:16:1", "0 to 15"), ("osc:0:fader", "start with '/'"),
     ("fader", "names no control"), ("knob:0:1", "not one of cc")],
)  # fmt: skip
def test_bad_controls_are_refused(text: str, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        Control.parse(text)
    with pytest.raises(InvalidInputError, match="two different finite ends"):
        Binding(Control("cc", 0, "1"), "a", 1.0, 1.0)


def test_simultaneity_of_known_motions(tmp_path: Path) -> None:
    """1 for equal motion, -1 for opposite, 0 for alternating motion and for rest; after a round trip through a file."""
    times = np.array([0.0, 1.0, 2.5, 3.0])
    together = np.array([0, 0.2, 0.5, 0.5])
    later = np.array([0, 0, 0, 0.4])
    path = np.stack([together, 2 * together, 1 - together, later, np.full(4, 0.3)], axis=1)
    file = tmp_path / "motion.json"
    Recording(tuple("abcde"), times, path).save(file)
    found = simultaneity(Recording.load(file))

    expected = np.array([[1, 1, -1, 0, 0], [1, 1, -1, 0, 0], [-1, -1, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 0]])
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_simultaneity_is_the_integral_of_equation_6_2(rng: np.random.Generator) -> None:
    """Against fine numerical integration of interpolated velocities."""
    times = np.cumsum(rng.uniform(0.1, 1, 30))
    recording = Recording(("a", "b"), times, rng.uniform(0, 1, (30, 2)))
    fine = np.linspace(times[0], times[-1], 400_001)
    velocity = np.stack([np.gradient(np.interp(fine, times, p), fine) for p in recording.positions.T])
    products = velocity @ velocity.T

    assert simultaneity(recording)[0, 1] == pytest.approx(
        products[0, 1] / np.sqrt(products[0, 0] * products[1, 1]), abs=1e-3
    )


def test_events_become_paths_and_invalid_files_are_refused(tmp_path: Path) -> None:
    recording = Recording.from_events([(1.0, 0, 0.5), (1.0, 1, 0.25), (0.5, 1, 0.1)], ("a", "b"), start=(0.0, 0.0))

    np.testing.assert_array_equal(recording.times, [0.4, 0.5, 0.9, 1.0])
    np.testing.assert_array_equal(recording.positions, [[0.0, 0.0], [0.0, 0.1], [0.0, 0.1], [0.5, 0.25]])
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(FileFormatError, match="has no 'format'"):
        Recording.load(tmp_path / "x.json")


def test_a_fader_at_its_top_gives_the_upper_end_to_the_last_bit():
    """-3 + (-0.9 + 3) is not -0.9 in floating point."""
    binding = Binding(Control("cc", 0, "1"), "a", -3.0, -0.9)
    assert binding.value(1.0) == -0.9
    assert binding.value(0.0) == -3.0


def test_the_ends_of_a_range_are_finite_and_so_is_their_distance() -> None:
    for low, high in ((0.0, 0.0), (0.0, float("inf")), (-1.5e308, 1.5e308)):
        with pytest.raises(InvalidInputError, match="give two different finite ends"):
            Binding(FADERS[0], "target", low, high)
