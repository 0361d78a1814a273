# SPDX-License-Identifier: GPL-3.0-or-later
"""A volume is imported on a thread, without keeping the interface from Python; Esc leaves nothing in the file."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.volume.importing import Import  # noqa: E402
from spectral_core.errors import RenderCancelled  # noqa: E402
from spectral_core.volume.files import read_volume  # noqa: E402


def work(path, folder, **options):
    given = {"options": {"field": None, "component": None}, "key": "", "preset": "wide", "is_sequence": False}
    return Import([path], folder=folder, centered=True, stopping=threading.Event(), **(given | options))


def test_a_thread_writes_the_volume_without_openvdb_which_keeps_others_from_python(tmp_path, monkeypatch):
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume
    from spectral_core.volume.files.formats import openvdb_format

    values = np.random.default_rng(7).normal(size=(40, 50, 60)).astype(np.float32)
    write_volume(ScalarVolume.from_spacing("noise", values, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), tmp_path / "noise.nrrd")
    with monkeypatch.context() as patch:
        patch.setattr(openvdb_format, "find_openvdb", lambda: SimpleNamespace())  # any use of it is an error
        with ThreadPoolExecutor(1) as threads:
            (made,) = threads.submit(work(tmp_path / "noise.nrrd", tmp_path).read).result()
    back = read_volume(made.target)
    np.testing.assert_array_equal(back.data, values)
    np.testing.assert_allclose(back.corners_world.mean(axis=0), 0, atol=1e-4)


def test_a_stop_is_heard_between_the_frames_of_a_sequence(tmp_path, monkeypatch):
    from spectral_core.volume.files import write

    for number in range(1, 6):
        np.save(tmp_path / f"frame_{number}.npy", np.full((3, 3, 3), float(number)))
    task = work(tmp_path / "frame_1.npy", tmp_path, is_sequence=True)
    written, write_volume = [], write.write_volume

    def counted(volume, path):
        written.append(path)
        if len(written) == 2:
            task.stopping.set()
        return write_volume(volume, path)

    monkeypatch.setattr("spectral_core.volume.files.write_volume", counted)
    with pytest.raises(RenderCancelled, match="nothing was imported"):
        task.read()
    assert len(written) == 2 and task.progress == "frame 2 of 5"


def test_a_volume_for_a_scene_that_the_window_no_longer_shows_is_added_there(blender, ramp, tmp_path):
    (made,) = work(ramp[0], tmp_path).read()
    other = blender.data.scenes.new("Other")
    made.add_to(blender.context, other, 2.0)
    assert [each.name for each in other.objects] == ["ramp"]
    assert "ramp" not in blender.context.scene.objects
