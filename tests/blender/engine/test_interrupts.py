# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C while Blender starts, which would crash it, counts when it has started."""

from __future__ import annotations

import os
import signal
import sys

import pytest

pytest.importorskip("bpy")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals as Unix has them")


def test_ctrl_c_waits_for_the_end_of_a_start() -> None:
    from blender_addon.commands import _blend

    before, done = signal.getsignal(signal.SIGINT), []
    with pytest.raises(KeyboardInterrupt, match=r"^$"), _blend._without_interrupts():
        os.kill(os.getpid(), signal.SIGINT)
        done.append(True)
    assert done and signal.getsignal(signal.SIGINT) is before
    with _blend._without_interrupts():
        pass


def test_a_render_that_ctrl_c_has_stopped_exits_as_other_commands_do(monkeypatch, tmp_path, capsys) -> None:
    """It exited with 1, as after a fault; all others exit with 130."""
    from blender_addon.commands import main, render
    from spectral_core.errors import RenderCancelled

    def stopped(_arguments: object) -> int:
        raise RenderCancelled("frame 3 was stopped after 4 samples")

    monkeypatch.setattr(render, "run", stopped)
    assert main(["render", str(tmp_path / "scene.blend")]) == 130
    assert capsys.readouterr().err == "spectral-scene render: frame 3 was stopped after 4 samples\n"
