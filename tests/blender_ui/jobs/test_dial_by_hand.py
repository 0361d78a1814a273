# SPDX-License-Identifier: GPL-3.0-or-later
"""The dial under a mouse and keys that a test moves: every press, drag and key changes its own number."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

from blender_addon.drawing import dial as drawn
from blender_addon.drawing.dial_shape import DialShape
from blender_addon.operators import dial_drag
from blender_addon.operators.design.look import GRIP_PIXELS, SPECTRAL_OT_look_divide
from blender_addon.operators.dial_drag import DIGITS, FINE_NUDGE, NUDGE, SPECTRAL_OT_dial_play

SHAPE = DialShape(200.0, 150.0, 100.0)
PLACES = ((0.0, 1.0), (0.9, -0.5), (-0.9, -0.5))


class Hand:
    """The operator's methods without Blender's window."""

    invoke, modal, cancel = SPECTRAL_OT_dial_play.invoke, SPECTRAL_OT_dial_play.modal, SPECTRAL_OT_dial_play.cancel
    _hover, _press = SPECTRAL_OT_dial_play._hover, SPECTRAL_OT_dial_play._press
    _dragging, _end = SPECTRAL_OT_dial_play._dragging, SPECTRAL_OT_dial_play._end

    def report(self, kind: set[str], text: str) -> None:
        self.told = text


@pytest.fixture
def scene(blender: Any, monkeypatch: Any) -> Any:
    for place in PLACES:
        blender.context.scene.spectral.dial.bulbs.add().place = place
    monkeypatch.setattr(drawn, "shape_in", lambda area, region: SHAPE)
    monkeypatch.setattr(dial_drag, "running", set())
    return blender.context.scene


@pytest.fixture
def context(scene: Any) -> Any:
    """A window with one 3D view, which begins at (30, 20)."""
    region = SimpleNamespace(type="WINDOW", x=30, y=20, width=600, height=400, as_pointer=lambda: 6)
    area = SimpleNamespace(
        type="VIEW_3D", x=30, y=20, width=600, height=400, regions=[region], as_pointer=lambda: 5, tag_redraw=lambda: 0
    )
    texts: list[Any] = []
    return SimpleNamespace(
        scene=scene, texts=texts, window=SimpleNamespace(screen=SimpleNamespace(areas=[area]), as_pointer=lambda: 7),
        workspace=SimpleNamespace(status_text_set=texts.append),
        window_manager=SimpleNamespace(modal_handler_add=lambda _: None), region=region, screen=None, area=area,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )  # fmt: skip


def event(kind: str, value: str = "PRESS", place: Any = (0.0, 0.0), **rest: Any) -> Any:
    """An event at coordinates of the dial."""
    x, y = np.add(SHAPE.pixels(place), (30, 20))
    keys = dict.fromkeys(("ctrl", "shift", "alt", "oskey"), False)
    return SimpleNamespace(type=kind, value=value, mouse_x=x, mouse_y=y, **(keys | rest))


@pytest.fixture
def hand(scene: Any, context: Any) -> Hand:
    made = Hand()
    scene.spectral.dial.show = False
    assert made.invoke(context, None) == {"RUNNING_MODAL"}
    assert scene.spectral.dial.show
    return made


def test_the_selector_follows_a_press_on_the_disc_and_a_drag(hand, scene, context) -> None:
    dial = scene.spectral.dial
    assert hand.modal(context, event("LEFTMOUSE", place=(0.3, 0.4))) == {"RUNNING_MODAL"}
    assert tuple(dial.selector) == pytest.approx((0.3, 0.4))
    hand.modal(context, event("MOUSEMOVE", place=(-0.2, 0.31)))
    assert tuple(dial.selector) == pytest.approx((-0.2, 0.31))
    hand.modal(context, event("MOUSEMOVE", place=(0.02, 0.97), ctrl=True))
    assert tuple(dial.selector) == pytest.approx(PLACES[0])  # Ctrl snaps
    hand.modal(context, event("RIGHTMOUSE"))
    assert tuple(dial.selector) == (0.0, 0.0)  # as before the press
    hand.modal(context, event("LEFTMOUSE", place=(0.01, 0.01)))
    hand.modal(context, event("MOUSEMOVE", place=(0.5, -0.25)))
    hand.modal(context, event("LEFTMOUSE", "RELEASE", place=(0.5, -0.25)))
    assert tuple(dial.selector) == pytest.approx((0.5, -0.25))
    assert [tuple(bulb.place) for bulb in dial.bulbs] == [pytest.approx(place) for place in PLACES]
    assert all(bulb.is_on for bulb in dial.bulbs)


def test_a_bulb_is_switched_by_a_click_and_moved_by_a_drag(hand, scene, context) -> None:
    dial = scene.spectral.dial
    before = tuple(dial.selector)
    for is_on in (False, True):
        hand.modal(context, event("LEFTMOUSE", place=PLACES[1]))
        hand.modal(context, event("LEFTMOUSE", "RELEASE", place=PLACES[1]))
        assert [bulb.is_on for bulb in dial.bulbs] == [True, is_on, True]
    hand.modal(context, event("LEFTMOUSE", place=PLACES[1]))
    hand.modal(context, event("MOUSEMOVE", place=(0.4, 0.2)))
    assert tuple(dial.bulbs[1].place) == pytest.approx((0.4, 0.2))
    hand.modal(context, event("ESC"))
    assert tuple(dial.bulbs[1].place) == pytest.approx(PLACES[1])
    hand.modal(context, event("LEFTMOUSE", place=PLACES[2]))
    hand.modal(context, event("MOUSEMOVE", place=(0.88, -0.52), ctrl=True))
    hand.modal(context, event("LEFTMOUSE", "RELEASE"))
    assert tuple(dial.bulbs[2].place) == pytest.approx(PLACES[1])  # snapped to another bulb, not to itself
    assert tuple(dial.selector) == before and all(bulb.is_on for bulb in dial.bulbs)


def test_no_drag_and_no_key_takes_a_handle_off_the_disc(hand, scene, context) -> None:
    """A drag out of the view left the selector, or a bulb, where no mouse reached it."""
    dial, edge = scene.spectral.dial, (1.25 * 0.6, -1.25 * 0.8)
    for handle, start in ((dial, (0.0, 0.0)), (dial.bulbs[1], PLACES[1])):
        hand.modal(context, event("LEFTMOUSE", place=start))
        hand.modal(context, event("MOUSEMOVE", place=(6.0, -8.0)))
        hand.modal(context, event("LEFTMOUSE", "RELEASE", place=(6.0, -8.0)))
        assert tuple(handle.selector if handle is dial else handle.place) == pytest.approx(edge)
    dial.selector = (1.24, 0.0)
    hand.modal(context, event("RIGHT_ARROW"))
    assert tuple(dial.selector) == pytest.approx((1.25, 0.0))


@pytest.mark.parametrize(("key", "moved"), [("LEFT_ARROW", (-1, 0)), ("UP_ARROW", (0, 1))])
def test_arrows_move_the_selector_and_shift_makes_them_fine(hand, scene, context, key, moved) -> None:
    dial = scene.spectral.dial
    for step, shift in ((NUDGE, False), (FINE_NUDGE, True)):
        dial.selector = (0.1, 0.2)
        assert hand.modal(context, event(key, shift=shift)) == {"RUNNING_MODAL"}
        assert tuple(dial.selector) == pytest.approx((0.1 + step * moved[0], 0.2 + step * moved[1]), abs=1e-6)


def test_digits_put_the_selector_on_a_bulb_and_0_in_the_middle(hand, scene, context) -> None:
    dial = scene.spectral.dial
    for number, place in enumerate(PLACES):
        hand.modal(context, event(DIGITS[number]))
        assert tuple(dial.selector) == pytest.approx(place)
    assert hand.modal(context, event("FOUR")) == {"PASS_THROUGH"}
    hand.modal(context, event("ZERO"))
    assert tuple(dial.selector) == (0.0, 0.0)


def test_what_is_not_over_the_dial_is_left_to_blender(hand, scene, context) -> None:
    dial = scene.spectral.dial
    dial.selector = (0.1, 0.2)
    assert hand.modal(context, event("LEFTMOUSE", place=(3.0, 2.0))) == {"PASS_THROUGH"}
    assert hand.modal(context, event("UP_ARROW", place=(3.0, 2.0))) == {"PASS_THROUGH"}
    assert hand.modal(context, event("UP_ARROW", "RELEASE")) == {"PASS_THROUGH"}
    dial.show = False
    assert hand.modal(context, event("UP_ARROW")) == {"PASS_THROUGH"}
    assert hand.modal(context, event("LEFTMOUSE")) == {"PASS_THROUGH"}
    assert tuple(dial.selector) == pytest.approx((0.1, 0.2))
    assert hand.modal(context, event("ESC", "RELEASE")) == {"PASS_THROUGH"}
    # no undo step: each drag has made its own, and another one would end what Redo brings back
    assert hand.modal(context, event("ESC")) == {"CANCELLED"}
    assert hand.modal(context, event("UP_ARROW")) == {"CANCELLED"}  # ended


def test_a_dial_without_bulbs_is_not_turned(scene, context) -> None:
    scene.spectral.dial.bulbs.clear()
    made = Hand()
    assert made.invoke(context, None) == {"CANCELLED"} and "no bulbs" in made.told


class Divider(Hand):
    """The divider's operator, likewise."""

    invoke, modal = SPECTRAL_OT_look_divide.invoke, SPECTRAL_OT_look_divide.modal


def at(kind: str, x: float, value: str = "PRESS") -> Any:
    return SimpleNamespace(type=kind, value=value, mouse_region_x=x)


def test_the_divider_is_gripped_moved_limited_and_put_back(scene, context) -> None:
    settings, drag = scene.spectral.viewport, Divider()
    settings.divider = 0.25
    assert drag.invoke(context, at("LEFTMOUSE", 150 + 2 * GRIP_PIXELS)) == {"PASS_THROUGH"}
    assert drag.invoke(context, at("LEFTMOUSE", 150)) == {"RUNNING_MODAL"}
    for x, expected in ((300, 0.5), (-20, 0.0), (700, 1.0), (450, 0.75)):
        assert drag.modal(context, at("MOUSEMOVE", x)) == {"RUNNING_MODAL"}
        assert settings.divider == pytest.approx(expected)
    assert drag.modal(context, at("LEFTMOUSE", 450)) == {"RUNNING_MODAL"}
    assert drag.modal(context, at("LEFTMOUSE", 450, "RELEASE")) == {"FINISHED"}
    assert settings.divider == pytest.approx(0.75)
    drag.invoke(context, at("LEFTMOUSE", 450))
    drag.modal(context, at("MOUSEMOVE", 60))
    assert drag.modal(context, at("ESC", 60)) == {"CANCELLED"}
    assert settings.divider == pytest.approx(0.75)
    drag.invoke(context, at("LEFTMOUSE", 450))
    drag.modal(context, at("MOUSEMOVE", 300))
    assert drag.modal(context, at("WINDOW_DEACTIVATE", 60)) == {"FINISHED"}  # the button is released elsewhere
    assert settings.divider == pytest.approx(0.5)


def test_the_divider_stays_beside_the_bars_where_the_mouse_reaches_it(scene, context) -> None:
    bars = (("TOOLS", "LEFT", 30, 60), ("UI", "RIGHT", 430, 200))  # the region ends at 630
    context.area.regions += [
        SimpleNamespace(type=kind, alignment=side, x=x, y=20, width=width, height=400) for kind, side, x, width in bars
    ]
    settings, drag = scene.spectral.viewport, Divider()
    settings.divider = 0.5
    assert drag.invoke(context, at("LEFTMOUSE", 300)) == {"RUNNING_MODAL"}
    for x, pixel in ((-20, 60), (700, 400), (250, 250)):
        drag.modal(context, at("MOUSEMOVE", x))
        assert settings.divider * 600 == pytest.approx(pixel, abs=0.01)


def test_each_part_of_a_quad_view_has_its_dial(hand, scene, context) -> None:
    """Blender draws the dial in four regions of the area; the mouse turned only that of the first one."""
    (area,) = context.window.screen.areas
    corners = [(30, 20), (30, 220), (330, 20), (330, 220)]
    area.regions[:] = [
        SimpleNamespace(type="WINDOW", x=x, y=y, width=300, height=200, as_pointer=lambda x=x, y=y: 1000 * x + y)
        for x, y in corners
    ]
    dial = scene.spectral.dial
    for x, y in corners:
        dial.selector = (0.0, 0.0)
        place = np.subtract((x + 230, y + 170), (30, 20))
        at = SHAPE.place((230, 170))
        press = event("LEFTMOUSE", place=SHAPE.place(place))
        assert hand.modal(context, press) == {"RUNNING_MODAL"}
        assert tuple(dial.selector) == pytest.approx(tuple(at))
        assert drawn.hovered["region"] == 1000 * x + y
        hand.modal(context, event("LEFTMOUSE", "RELEASE", place=SHAPE.place(place)))


def test_drags_leave_timers_to_animations_and_recordings(hand, scene, context) -> None:
    """An animation that is played stood still while the selector or the divider was dragged."""
    hand.modal(context, event("LEFTMOUSE", place=(0.3, 0.4)))
    assert hand.modal(context, event("TIMER", "NOTHING", place=(0.9, 0.4))) == {"PASS_THROUGH"}
    assert hand.modal(context, event("TIMER0", "NOTHING", place=(0.9, 0.4))) == {"PASS_THROUGH"}
    assert tuple(scene.spectral.dial.selector) == pytest.approx((0.3, 0.4))
    drag = Divider()
    scene.spectral.viewport.divider = 0.25
    drag.invoke(context, at("LEFTMOUSE", 150))
    assert drag.modal(context, at("TIMER0", 300, "NOTHING")) == {"PASS_THROUGH"}
    assert scene.spectral.viewport.divider == 0.25


def test_a_dragged_bulb_that_a_recording_has_removed_is_released(hand, scene, context) -> None:
    hand.modal(context, event("LEFTMOUSE", place=PLACES[2]))
    scene.spectral.dial.bulbs.remove(2)
    assert hand.modal(context, event("MOUSEMOVE", place=(0.1, 0.1))) == {"RUNNING_MODAL"}
    assert hand.modal(context, event("MOUSEMOVE", place=(0.1, 0.1))) == {"PASS_THROUGH"}
    assert [tuple(each.place) for each in scene.spectral.dial.bulbs] == [pytest.approx(each) for each in PLACES[:2]]


def test_a_drag_of_the_divider_is_an_undo_step() -> None:
    """Undo took Split View away with the drag, and Redo brought the divider back in the middle."""
    assert "UNDO" in SPECTRAL_OT_look_divide.bl_options


def test_a_dial_that_a_panel_has_moved_is_drawn_again(hand, context, monkeypatch) -> None:
    """Blender opens its panel of the last operation over an editor without drawing the editor again."""
    redrawn: list[bool] = []
    context.area.tag_redraw = lambda: redrawn.append(True)
    monkeypatch.setitem(drawn._drawn, context.region.as_pointer(), SHAPE)
    hand.modal(context, event("MOUSEMOVE", "NOTHING", (5.0, 5.0)))
    assert redrawn == []
    monkeypatch.setattr(drawn, "shape_in", lambda area, region: replace(SHAPE, x=SHAPE.x + 250))
    hand.modal(context, event("MOUSEMOVE", "NOTHING", (5.0, 5.0)))
    assert redrawn == [True]


def test_the_hint_comes_back_after_another_tool_has_shown_its_own(hand, context) -> None:
    hand.modal(context, event("MOUSEMOVE", "NOTHING", (5.0, 5.0)))
    context.texts.append(None)  # as at the end of a move of an object
    hand.modal(context, event("MOUSEMOVE", "NOTHING", (0.5, 0.0)))
    assert context.texts[-1] == dial_drag.HINT
