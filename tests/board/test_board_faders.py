# SPDX-License-Identifier: GPL-3.0-or-later
"""Faders of a board: every step counts, hand and motor moves are distinguished, orders hold."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.board import Binding, Board, Control
from tests.board.test_board import Numbers, board_of

SLIDER = Control("osc", 0, "/slider")
FADERS = [Control("cc14", 0, str(number)) for number in range(8)]


def step_board(numbers: Numbers, control: Control, **options: object) -> Board:
    board = Board(numbers.__getitem__, options.pop("has_motor", None))  # type: ignore[arg-type]
    board.bind(Binding(control, next(iter(numbers)), 0.0, 127.0, **options))  # type: ignore[arg-type]
    return board


@pytest.mark.parametrize("with_motor", [True, False])
def test_every_step_of_a_seven_bit_fader_arrives(with_motor: bool) -> None:
    """One step per picture, up and down, from any start; motors are polled each time, as in the add-on."""
    knob = Control("cc", 0, "7")
    for start, way in ((64, 1), (0, 1), (127, -1), (1, -1)):
        numbers = Numbers({"a": float(start)})
        board = step_board(numbers, knob, has_motor=lambda control: with_motor)
        time, value = 10.0, start
        while 0 <= value + way <= 127:
            time, value = time + 1 / 60, value + way
            board.receive(knob, value / 127, time)
            numbers.apply(board)
            board.motors(time)
            assert numbers["a"] == pytest.approx(value)


def test_pick_up_works_while_motors_are_polled_for_every_picture() -> None:
    """The value is 20 of 127. The first message, far above, changes nothing; after passing the value it does."""
    knob = Control("cc", 0, "7")
    numbers = Numbers({"a": 20.0})
    board = step_board(numbers, knob, pick_up=True, has_motor=lambda control: False)
    time = 0.0
    for value, expected in ((90, 20), (60, 20), (25, 20), (15, 15), (40, 40), (41, 41)):
        assert board.motors(time) == ()
        time += 0.5
        board.receive(knob, value / 127, time)
        numbers.apply(board)
        assert numbers["a"] == pytest.approx(expected)


def test_a_fader_releases_a_value_that_is_changed_elsewhere() -> None:
    knob = Control("cc", 0, "7")
    numbers = Numbers({"a": 20.0})
    board = step_board(numbers, knob, pick_up=True, has_motor=lambda control: False)
    for value in (10, 30, 31):
        board.receive(knob, value / 127, time=value)
        numbers.apply(board)
        board.motors(time=value)  # as in the add-on after each poll
    assert numbers["a"] == pytest.approx(31)
    numbers["a"] = 100.0
    board.receive(knob, 33 / 127, time=40.0)
    assert numbers.apply(board) == 0
    board.receive(knob, 101 / 127, time=41.0)
    numbers.apply(board)
    assert numbers["a"] == pytest.approx(101)


def test_a_rounded_number_stays_under_control_of_its_fader() -> None:
    """Blender rounds whole numbers, so the stored value differs from that of a 14-bit fader."""
    numbers = Numbers({"a": 3.0})
    board = Board(numbers.__getitem__, lambda control: False)
    board.bind(Binding(FADERS[0], "a", 0.0, 10.0, pick_up=True))
    found = []
    for tick, position in enumerate(np.linspace(0.25, 0.95, 71)):
        board.receive(FADERS[0], float(position), time=tick / 60)
        for change in board.poll():
            numbers["a"] = float(round(change.value))
        found.append(numbers["a"])
    assert found[-1] == 10.0 and found[40] == round(0.65 * 10)


def test_a_motor_moves_for_two_steps_and_rests_for_half_a_step() -> None:
    numbers = Numbers({"a": 5.0})
    board = board_of(numbers)
    assert len(board.motors(time=1.0)) == 1
    numbers["a"] = 5.0 + 5 / 16383  # half of one of ten steps
    assert board.motors(time=2.0) == ()
    numbers["a"] = 5.0 + 20 / 16383
    assert len(board.motors(time=3.0)) == 1


def test_a_late_message_equal_to_the_command_counts_as_a_hand_move() -> None:
    numbers = Numbers({"a": 2.5})
    board = board_of(numbers)
    board.motors(time=1.0)
    board.receive(FADERS[0], 0.25, time=1.149)
    assert numbers.apply(board) == 0
    board.receive(FADERS[0], 0.25, time=1.151)
    assert numbers.apply(board) == 1


def test_chains_of_order_hold_and_can_be_removed() -> None:
    numbers = Numbers({"a": 1.0, "b": 2.0, "c": 3.0})
    board = board_of(numbers)
    board.set_orders([("a", "b"), ("b", "c")])
    rng = np.random.default_rng(3)
    for tick in range(300):
        for fader in rng.choice(3, rng.integers(1, 4), replace=False):
            board.receive(FADERS[fader], float(rng.uniform()), time=tick)
        numbers.apply(board)
        assert numbers["a"] <= numbers["b"] <= numbers["c"]
    with pytest.raises(InvalidInputError, match="'c' is kept below 'a' already|'a' is kept below 'c' already"):
        board.set_orders([*board.orders, ("c", "a")])
    board.set_orders([("a", "b")])
    assert board.orders == (("a", "b"),)
    board.receive(FADERS[1], 1.0, time=400)
    numbers.apply(board)
    assert numbers["b"] == 10.0 > numbers["c"]


def test_learning_a_fourteen_bit_fader_binds_the_pair() -> None:
    """The low byte runs repeatedly over the whole range; a knob of seven bits is still learned as such."""
    from spectral_core.explore.board.midi import MidiLink

    mido = pytest.importorskip("mido")
    from mido.ports import EchoPort

    for wide in (True, False):
        numbers, port = Numbers({"a": 0.0}), EchoPort()
        board = Board(numbers.__getitem__)
        link = MidiLink(board.receive, port=port)
        board.learn("a")
        for value in range(0, 16384, 37):
            port.send(mido.Message("control_change", channel=2, control=7, value=value >> 7))
            if wide:
                port.send(mido.Message("control_change", channel=2, control=39, value=value & 127))
            link.pump()
            numbers.apply(board)
        expected = Control("cc14", 2, "7") if wide else Control("cc", 2, "7")
        assert [binding.control for binding in board.bindings] == [expected]
        assert numbers["a"] == pytest.approx(16354 / 16383 if wide else 127 / 127, abs=0.01)


def test_ranges_that_do_not_start_at_zero_or_are_reversed() -> None:
    knob = Control("cc", 0, "1")
    assert Binding(knob, "a", 5.0, 10.0).position(7.5) == pytest.approx(0.5)
    assert Binding(knob, "a", -2.0, 6.0).value(0.25) == pytest.approx(0.0)
    swapped = Binding(knob, "a", 10.0, 4.0)
    assert (swapped.value(0.0), swapped.value(1.0)) == (10.0, 4.0)
    assert swapped.position(4.0) == 1.0 and swapped.position(11.0) == 0.0
    with pytest.raises(InvalidInputError, match="two different finite ends"):
        Binding(knob, "a", float("-inf"), 1.0)


def test_motors_get_at_most_sixty_commands_a_second() -> None:
    numbers = Numbers({"a": 1.0})
    board = board_of(numbers)
    sent = 0
    for tick in range(400):
        numbers["a"] = tick / 40
        sent += len(board.motors(time=1.0 + tick / 400))
    assert 55 <= sent <= 61


def test_a_target_that_is_gone_limits_no_other_and_its_motor_rests():
    numbers = {"low": 10.0, "middle": 20.0, "high": 30.0}
    board = Board(numbers.get)
    for name in numbers:
        board.bind(Binding(Control("osc", 0, f"/{name}"), name, 0.0, 100.0, pick_up=name == "middle"))
    board.set_orders([("low", "middle"), ("middle", "high")])
    del numbers["middle"]
    board.receive(Control("osc", 0, "/middle"), 0.9, 0.0)
    board.receive(Control("osc", 0, "/low"), 0.25, 0.0)
    assert [(change.target, change.value) for change in board.poll()] == [("low", 25.0)]
    board.receive(Control("osc", 0, "/low"), 0.9, 1.0)
    assert [change.value for change in board.poll()] == [30.0]  # of the chain the other end still holds
    del numbers["high"]
    board.receive(Control("osc", 0, "/low"), 0.9, 2.0)
    assert [change.value for change in board.poll()] == [90.0]
    assert {control.address for control, _ in board.motors(9.0)} == {"/low"}


def test_a_target_that_is_gone_before_a_control_moves_is_not_bound() -> None:
    """Its error ended the poll, and the timer of a session with it: no fader moved anything from then on."""
    numbers = Numbers({"a": 0.5})
    board = Board(numbers.__getitem__)
    board.bind(Binding(SLIDER, "a"))
    board.learn("gone")
    other = Control("cc", 3, "9")
    for place in (0.0, 0.75):
        board.receive(SLIDER, place, time=0.0)
        board.receive(other, place, time=0.0)

    def range_of(target: str) -> tuple[float, float]:
        raise InvalidInputError(f"this file has no {target!r}")

    assert [change.value for change in board.poll(range_of)] == [0.75]
    assert (board.learning, board.not_learned) == (None, "this file has no 'gone'")
    assert board.bindings == (Binding(SLIDER, "a"),)
    board.learn("a")
    assert board.not_learned == ""
