# SPDX-License-Identifier: GPL-3.0-or-later
"""An edit and the redraw after it are one pause: the redraw does not continue the update that the edit has begun."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
from tests.blender_viewport.edits.test_update_in_parts import followed, redrawn, sent, slow  # noqa: E402, F401


def test_a_redraw_leaves_the_rest_of_an_update_to_the_next_round(slow, monkeypatch):  # noqa: F811
    from blender_addon.editing.viewport import session, stages

    rounds = [1]
    for module in (session, stages):
        monkeypatch.setattr(module, "round_number", lambda: rounds[0])
    calls = []
    translate = session.translate_scene
    monkeypatch.setattr(session, "translate_scene", lambda *a, **k: calls.append(rounds[0]) or translate(*a, **k))
    followed(slow, lambda: None)
    assert slow.session._is_unfinished and calls == [1]
    for _ in range(3):
        slow.redraws.clear()
        redrawn(slow)
        assert slow.redraws, "another redraw continues it"
    assert calls == [1]
    while slow.session._is_unfinished and rounds[0] < 100:
        rounds[0] += 1
        redrawn(slow)
    assert calls == list(range(1, rounds[0] + 1))
    assert sent(slow) is not None
