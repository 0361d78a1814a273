# SPDX-License-Identifier: GPL-3.0-or-later
"""Drags of the dial and of the divider that end otherwise than by a release of the button over their editor."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy")

from blender_addon.operators import dial_drag
from tests.blender_ui.jobs.test_dial_by_hand import PLACES, Divider, at, context, event, hand, scene  # noqa: F401


def test_a_drag_ends_where_another_program_gets_the_mouse(hand, scene, context) -> None:  # noqa: F811
    """The button is released there: back in Blender, the selector followed a mouse without a pressed button."""
    dial = scene.spectral.dial
    for start in ((0.0, 0.0), PLACES[1]):
        hand.modal(context, event("LEFTMOUSE", place=start))
        hand.modal(context, event("MOUSEMOVE", place=(0.3, 0.4)))
        hand.modal(context, event("WINDOW_DEACTIVATE"))
        hand.modal(context, event("MOUSEMOVE", place=(-0.5, 0.1)))
    assert tuple(dial.selector) == tuple(dial.bulbs[1].place) == pytest.approx((0.3, 0.4))
    hand.modal(context, event("LEFTMOUSE", place=PLACES[2]))
    hand.modal(context, event("WINDOW_DEACTIVATE"))
    assert all(bulb.is_on for bulb in dial.bulbs)  # it is no click


def test_a_drag_ends_with_its_editor_and_its_scene(hand, scene, context) -> None:  # noqa: F811
    """A script closed the editor, or showed another scene, while the mouse button was down: the region was freed, a
    traceback appeared, and the dial of the other scene was turned.
    """
    dial, (area,) = scene.spectral.dial, context.window.screen.areas
    settings, other = scene.spectral.viewport, scene.copy()
    for change in ({"areas": []}, {"scene": other}):
        settings.divider, drag = 0.25, Divider()
        drag.invoke(context, at("LEFTMOUSE", 150))
        hand.modal(context, event("LEFTMOUSE", place=(0.3, 0.4)))
        context.window.screen.areas = change.get("areas", [area])
        context.scene, context.area = change.get("scene", scene), None if "areas" in change else area
        assert drag.modal(context, at("MOUSEMOVE", 300)) == {"FINISHED"}
        assert hand.modal(context, event("MOUSEMOVE", place=(0.5, 0.1))) == {"RUNNING_MODAL"}
        assert hand._drag is None
        assert [each.spectral.viewport.divider for each in (scene, other)] == [0.25, 0.5]
        assert tuple(dial.selector) == pytest.approx((0.3, 0.4))
        assert tuple(other.spectral.dial.selector) == (0.0, 0.0)
        context.window.screen.areas, context.scene, context.area = [area], scene, area


@pytest.mark.parametrize("is_turned", [True, False])
def test_disabling_the_extension_takes_the_hint_out_of_the_status_bar(scene, monkeypatch, is_turned) -> None:  # noqa: F811
    """Blender frees the operator without a call, and the hint stayed until Blender was closed."""
    cleared: list[bool] = []
    monkeypatch.setattr(dial_drag, "clear_every_status", lambda: cleared.append(True))
    monkeypatch.setattr(dial_drag, "_unregister", lambda: None)
    if is_turned:
        dial_drag.running.add(7)
    dial_drag.unregister()
    assert bool(cleared) is is_turned and not dial_drag.running
