# SPDX-License-Identifier: GPL-3.0-or-later
"""Transports that are read behind the interface, while their file changes."""

from __future__ import annotations

import os


def test_a_file_that_changes_during_its_reading_is_read_again(dial, stage, monkeypatch):
    from blender_addon.editing.dial import kept_mix, live
    from spectral_core.render.relight import transport_file

    read, reads = transport_file.read_transport, []

    def read_and_touch(path, **given):
        transport = read(path, **given)
        reads.append(path)
        if len(reads) == 1:
            os.utime(path, (1, 1))  # as after another recording
        return transport

    monkeypatch.setattr(transport_file, "read_transport", read_and_touch)
    kept_mix._sessions.clear()
    live._follow(stage)
    live._follow(stage)
    assert len(reads) == 2
    assert kept_mix._sessions[stage.session_uid].stamp == kept_mix.stamp_of(live.transport_path(dial))
    assert not dial.message
