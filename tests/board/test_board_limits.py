# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules of a board at their limits: times, travels and steps that are exactly representable in floating point."""

from __future__ import annotations

import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.board import Binding, Board, Control
from spectral_core.explore.board.board import ECHO_SECONDS, LEARN_TRAVEL, MOTOR_SECONDS, TOUCH_SECONDS
from tests.board.test_board import Numbers

SLIDER = Control("osc", 0, "/slider")
STEP = 2.0**-24
"""An OSC slider has 2²⁴ steps."""


def slider_board(value: float, **options: bool) -> tuple[Numbers, Board]:
    numbers = Numbers({"a": value})
    board = Board(numbers.__getitem__)
    board.bind(Binding(SLIDER, "a", **options))
    return numbers, board


def test_the_times_of_a_board_are_those_of_its_documentation() -> None:
    """A tenth of a second after a touch, sixty commands a second, 150 ms for an echo, a twentieth of the travel."""
    assert (TOUCH_SECONDS, MOTOR_SECONDS, ECHO_SECONDS, LEARN_TRAVEL) == (0.1, 1 / 60, 0.15, 0.05)
    assert SLIDER.step == STEP
    controls = (Control("cc", 0, "1"), Control("cc14", 0, "1"), Control("bend"), Control("nrpn", 0, "1"))
    assert [control.step for control in controls] == [1 / 127, 1 / 16383, 1 / 16383, 1 / 16383]


@pytest.mark.parametrize(
    ("off", "later", "is_echo"),
    [(0.0, 0.0, True), (STEP, 0.125, True), (-STEP, 0.125, True), (2 * STEP, 0.125, False), (-2 * STEP, 0.125, False),
     (0.0, ECHO_SECONDS, True), (0.0, 0.1875, False), (0.0, -0.125, False)],
)  # fmt: skip
def test_an_echo_is_within_a_step_and_within_its_time(off: float, later: float, is_echo: bool) -> None:
    numbers, board = slider_board(0.5)
    assert board.motors(time=0.0) == ((SLIDER, 0.5),)
    board.receive(SLIDER, 0.5 + off, time=later)
    assert numbers.apply(board) == (0 if is_echo else 1)
    assert numbers["a"] == (0.5 if is_echo else 0.5 + off)


def test_a_message_without_any_command_is_never_an_echo() -> None:
    numbers, board = slider_board(0.5)
    board.receive(SLIDER, 0.5, time=0.0)
    assert numbers.apply(board) == 1


def test_a_motor_moves_again_when_its_times_have_passed() -> None:
    """At exactly the tenth of a second after the hand and the sixtieth after the last command, not before."""
    numbers, board = slider_board(0.0)
    board.receive(SLIDER, 0.25, time=0.0)
    numbers.apply(board)
    numbers["a"] = 0.75
    assert board.motors(time=TOUCH_SECONDS - 2**-10) == ()
    assert board.motors(time=TOUCH_SECONDS) == ((SLIDER, 0.75),)

    numbers, board = slider_board(0.0)
    board.motors(time=0.0)
    numbers["a"] = 0.5
    assert board.motors(time=MOTOR_SECONDS - 2**-14) == ()
    assert board.motors(time=MOTOR_SECONDS) == ((SLIDER, 0.5),)


def test_a_motor_rests_within_one_step_of_its_position() -> None:
    numbers, board = slider_board(0.5)
    board.motors(time=0.0)
    numbers["a"] = 0.5 + STEP
    assert board.motors(time=1.0) == ()
    numbers["a"] = 0.5 + 2 * STEP
    assert board.motors(time=2.0) == ((SLIDER, 0.5 + 2 * STEP),)
    numbers["a"] = 0.5 + STEP
    assert board.motors(time=3.0) == ()


def test_a_fader_stands_where_the_later_of_hand_and_motor_put_it() -> None:
    """At equal times it is the hand's position; after a command, the motor's."""
    numbers, board = slider_board(0.5)
    board.motors(time=1.0)
    board.receive(SLIDER, 0.25, time=1.0)  # at the time of the command, but elsewhere: a hand
    numbers.apply(board)
    assert board.motors(time=2.0) == ()
    numbers["a"] = 0.875
    assert board.motors(time=3.0) == ((SLIDER, 0.875),)
    assert board.motors(time=4.0) == ()


def test_positions_beyond_the_travel_count_as_its_ends() -> None:
    for position, end in ((-3.0, 0.0), (1.5, 1.0)):
        numbers, board = slider_board(0.5)
        board.receive(SLIDER, position, time=0.0)
        numbers.apply(board)
        assert numbers["a"] == end


@pytest.mark.parametrize(("travel", "is_learned"), [(LEARN_TRAVEL, True), (0.049, False), (0.14, True)])
def test_a_control_is_learned_after_a_twentieth_of_its_travel(travel: float, is_learned: bool) -> None:
    numbers = Numbers({"a": 0.5})
    board = Board(numbers.__getitem__)
    board.learn("a")
    board.receive(SLIDER, 0.0, time=0.0)
    board.receive(SLIDER, travel, time=0.1)
    changes = board.poll()
    assert (board.learning is None) == is_learned
    # Without a range the target goes from 0 to 1, and the movement that was learned counts.
    assert board.bindings == ((Binding(SLIDER, "a", 0.0, 1.0),) if is_learned else ())
    assert [change.value for change in changes] == ([travel] if is_learned else [])


def test_the_control_with_the_longest_travel_is_learned() -> None:
    board = Board({"a": 0.0}.__getitem__)
    board.learn("a")
    for number, (start, end) in enumerate(((0.5, 0.75), (0.9, 0.2), (0.0, 0.5))):
        board.receive(Control("cc", 0, str(number)), start, time=0.0)
        board.receive(Control("cc", 0, str(number)), end, time=1.0)
    board.poll()
    assert [binding.control.address for binding in board.bindings] == ["1"]
    assert board.received == 6


def test_two_knobs_whose_numbers_differ_by_32_are_learned_alone() -> None:
    """Either is a fader of 7 bits while the other rests; where both move, only the pair counts."""
    for moved in ("3", "35"):
        board = Board({"a": 0.0}.__getitem__)
        board.learn("a")
        for position in (0.0, 1.0):
            board.receive(Control("cc", 5, moved), position, time=0.0)
            board.receive(Control("cc", 6, "35" if moved == "3" else "3"), 0.0, time=0.0)  # of another channel
        board.poll()
        assert [str(binding.control) for binding in board.bindings] == [f"cc:5:{moved}"]
    board = Board({"a": 0.0}.__getitem__)
    board.learn("a")
    for position in (0.0, 1.0):
        board.receive(Control("cc", 5, "67"), position, time=0.0)  # 67 = 3 + 2 · 32 belongs to no pair
        board.receive(Control("cc", 5, "3"), 0.5, time=0.0)
        board.receive(Control("cc", 5, "35"), 0.5, time=0.0)
    board.poll()
    assert [str(binding.control) for binding in board.bindings] == ["cc:5:67"]


def test_a_binding_replaces_that_of_its_control_and_can_be_removed() -> None:
    numbers = Numbers({"a": 0.0, "b": 0.0})
    board = Board(numbers.__getitem__)
    board.bind(Binding(SLIDER, "a"))
    board.bind(Binding(SLIDER, "b"))
    board.receive(SLIDER, 0.5, time=0.0)
    numbers.apply(board)
    assert numbers == {"a": 0.0, "b": 0.5}
    board.unbind(SLIDER)
    board.unbind(SLIDER)
    board.receive(SLIDER, 0.75, time=1.0)
    assert numbers.apply(board) == 0 and board.bindings == ()


def test_of_two_faders_on_one_target_the_later_message_counts() -> None:
    for times, expected in (((1.0, 2.0), 0.75), ((2.0, 1.0), 0.25)):
        numbers = Numbers({"a": 0.0})
        board = Board(numbers.__getitem__)
        for number, position in enumerate((0.25, 0.75)):
            board.bind(Binding(Control("osc", 0, f"/{number}"), "a"))
            board.receive(Control("osc", 0, f"/{number}"), position, time=times[number])
        (change,) = board.poll()
        assert (change.value, change.time, change.held_back) == (expected, 2.0, False)


@pytest.mark.parametrize(
    ("start", "end", "is_caught"),
    [(0.25, 0.75, True), (0.75, 0.25, True), (0.25, 0.5 - STEP, True), (0.75, 0.5 + STEP, True),
     (0.25, 0.5 - 2 * STEP, False), (0.75, 0.5 + 2 * STEP, False), (0.5, 0.5, True), (0.75, 0.75, False)],
)  # fmt: skip
def test_pick_up_begins_within_a_step_of_the_value(start: float, end: float, is_caught: bool) -> None:
    numbers, board = slider_board(0.5, pick_up=True)
    board.receive(SLIDER, start, time=0.0)
    first = board.poll()
    if first:  # the first position is the value itself
        assert start == 0.5
    board.receive(SLIDER, end, time=1.0)
    assert numbers.apply(board) == int(is_caught)
    assert numbers["a"] == (end if is_caught else 0.5)


def test_a_caught_fader_is_released_by_a_change_of_more_than_a_step() -> None:
    for change, is_held in ((STEP, True), (-STEP, True), (2 * STEP, False), (-2 * STEP, False)):
        numbers, board = slider_board(0.5, pick_up=True)
        for time, position in enumerate((0.25, 0.625)):
            board.receive(SLIDER, position, time=time)
            numbers.apply(board)
        assert numbers["a"] == 0.625
        board.motors(time=1.0)
        numbers["a"] = 0.625 + change
        board.receive(SLIDER, 0.875 if change < 0 else 0.125, time=2.0)
        # The way from 0.625 to the new position does not pass the value on the other side.
        assert numbers.apply(board) == int(is_held)


def test_targets_below_and_above_hold_in_a_tree() -> None:
    """b and c above a, d above both; what does not move is a limit, and of two that move the upper one counts."""
    numbers = Numbers({"a": 0.25, "b": 0.5, "c": 0.375, "d": 0.75})
    board = Board(numbers.__getitem__)
    faders = {name: Control("osc", 0, f"/{name}") for name in numbers}
    for name, control in faders.items():
        board.bind(Binding(control, name))
    board.set_orders([("a", "b"), ("a", "c"), ("b", "d"), ("c", "d"), ("a", "b")])
    assert board.orders == (("a", "c"), ("b", "d"), ("c", "d"), ("a", "b"))
    board.receive(faders["a"], 1.0, time=0.0)
    assert [(change.target, change.value, change.held_back) for change in board.poll()] == [("a", 0.375, True)]
    board.receive(faders["d"], 0.0, time=1.0)
    assert [(change.target, change.value) for change in board.poll()] == [("d", 0.5)]
    board.receive(faders["a"], 1.0, time=2.0)
    board.receive(faders["b"], 0.6875, time=2.0)
    board.receive(faders["c"], 0.625, time=2.0)
    assert {change.target: change.value for change in board.poll()} == {"a": 0.625, "b": 0.6875, "c": 0.625}
    board.receive(faders["d"], 0.125, time=3.0)
    board.receive(faders["b"], 1.0, time=3.0)
    # d moves to 0.375, the greatest of what rests below it, and b stops at d
    assert {change.target: change.value for change in board.poll()} == {"d": 0.375, "b": 0.375}
    with pytest.raises(InvalidInputError, match="'a' cannot bound itself"):
        board.set_orders([("a", "a")])
    with pytest.raises(InvalidInputError, match="'a' is kept below 'd' already"):
        board.set_orders([*board.orders, ("d", "a")])


@pytest.mark.parametrize(
    "control", [("cc", 0, "0"), ("cc", 15, "127"), ("cc14", 0, "31"), ("bend", 15, ""), ("osc", 0, "/")]
)
def test_the_outermost_controls_are_accepted(control: tuple[str, int, str]) -> None:
    kind, channel, address = control
    assert Control.parse(f"{kind}:{channel}:{address}") == Control(kind, channel, address)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["cc:-1:3", "cc:0:128", "cc14:0:32", "cc:0:x", "cc:0", "cc:a:3", "bend:16:"])
def test_controls_just_beyond_are_refused(text: str) -> None:
    with pytest.raises(InvalidInputError):
        Control.parse(text)
    with pytest.raises(InvalidInputError, match="MIDI channel is -1"):
        Control("cc", -1, "3")


def test_positions_below_and_at_the_ends_of_a_binding() -> None:
    binding = Binding(SLIDER, "a", 2.0, 6.0)
    assert [binding.value(position) for position in (-0.5, 0.0, 0.25, 1.0, 1.5)] == [2.0, 2.0, 3.0, 6.0, 6.0]
    assert [binding.position(value) for value in (1.0, 2.0, 3.0, 6.0, 7.0)] == [0.0, 0.0, 0.25, 1.0, 1.0]
    assert (Binding(SLIDER, "a").low, Binding(SLIDER, "a").high, Binding(SLIDER, "a").pick_up) == (0.0, 1.0, False)
