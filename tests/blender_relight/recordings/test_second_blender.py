# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender has a scene's view: its table and its files are those of the first one, to the bit."""

from __future__ import annotations

from concurrent.futures import Future

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial import saving, view_process  # noqa: E402
from blender_addon.editing.dial.picture import new_picture  # noqa: E402
from blender_addon.editing.dial.picture_files import Output, write_picture  # noqa: E402
from blender_addon.translate.display import transform as view_transform  # noqa: E402
from blender_addon.translate.display.settings import ViewSettings  # noqa: E402
from spectral_core.errors import FileWriteError, InvalidInputError  # noqa: E402
from spectral_core.explore.sweep.pool.executor import WorkerDied  # noqa: E402


def plain(view):
    view.view_transform = "AgX"


def looked(view):
    view.view_transform, view.look, view.exposure, view.gamma = "AgX", "AgX - High Contrast", 0.7, 1.1


def balanced(view):
    view.view_transform, view.use_white_balance, view.white_balance_temperature = "Filmic", True, 3100


def curved(view):
    view.view_transform, view.use_curve_mapping = "Standard", True
    mapping = view.curve_mapping
    mapping.black_level, mapping.tone = (0.02, 0.0, 0.01), "FILMLIKE"
    for number, places in enumerate(
        ([(0.2, 0.4), (0.7, 0.6)], [], [(0.5, 0.3)], [(0.1, 0.15), (0.3, 0.5), (0.9, 0.8)])
    ):
        for place in places:
            mapping.curves[number].points.new(*place)
    mapping.curves[3].points[1].handle_type = "VECTOR"
    mapping.curves[3].points[0].location = (0.0, 0.1)
    mapping.update()


VIEWS = [plain, looked, balanced, curved]


@pytest.mark.parametrize("change", VIEWS)
def test_the_settings_of_a_view_can_be_set_in_another_scene(blender, change):
    scene = bpy.context.scene
    change(scene.view_settings)
    settings, table = ViewSettings.of(scene), view_transform.sampled(scene)
    other = bpy.data.scenes.new("other")
    looked(other.view_settings)
    other.view_settings.use_curve_mapping = True
    for place in ((0.2, 0.9), (0.4, 0.1), (0.6, 0.6), (0.8, 0.2)):
        other.view_settings.curve_mapping.curves[0].points.new(*place)
    assert view_transform.view_key(other) != settings.key
    assert settings.set_in(other) and view_transform.view_key(other) == view_transform.view_key(scene)
    np.testing.assert_array_equal(view_transform.sampled(other).table, table.table)


@pytest.fixture
def second(blender):
    """Make a process of the scene as it is; all are ended."""
    made = []

    def started(*arguments):
        made.append(view_process.ViewProcess(bpy.context.scene, *arguments))
        return made[-1]

    yield started
    for each in made:
        each.end()


def test_the_table_of_a_second_blender_is_that_of_the_first(second):
    curved(bpy.context.scene.view_settings)
    found = second().table().result(timeout=100)
    expected = view_transform.sampled(bpy.context.scene)
    assert found.name == expected.name
    np.testing.assert_array_equal(found.table, expected.table)


@pytest.mark.parametrize("depth", ["8", "16"])
def test_pictures_that_a_second_blender_saves_are_those_of_the_first(second, tmp_path, depth):
    scene = bpy.context.scene
    looked(scene.view_settings)
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_depth, scene.render.image_settings.compression = depth, 40
    pixels = np.random.default_rng(3).gamma(0.5, 1.0, (7, 9, 4)).astype(np.float32)
    pixels[..., 3] = 1.0
    image = new_picture("here", 9, 7)
    image.pixels.foreach_set(pixels.reshape(-1))
    process = second(Output.of(scene))
    for ending in ("png", "exr"):
        here, there = tmp_path / f"here.{ending}", tmp_path / f"there.{ending}"
        write_picture(scene, image, here)
        assert process.save(pixels, there).result(timeout=100)
        read = []
        for path in (here, there):
            loaded = bpy.data.images.load(str(path))
            loaded.colorspace_settings.name = "Non-Color"
            read.append(np.array(loaded.pixels[:]))
        assert read[0].any()
        np.testing.assert_array_equal(*read)
        if ending == "png":
            assert here.read_bytes() == there.read_bytes()


def test_a_folder_that_is_not_there_is_named(second, tmp_path):
    with pytest.raises(FileWriteError, match="absent"):
        second().save(np.ones((2, 2, 4), np.float32), tmp_path / "absent" / "a.png").result(timeout=100)


def test_output_with_a_view_of_its_own_stays_here(blender):
    scene = bpy.context.scene
    assert Output.of(scene) is not None
    scene.render.image_settings.color_management = "OVERRIDE"
    assert Output.of(scene) is None


class Stand:
    """In place of a process: it answers as it is told."""

    ended = 0

    def __init__(self, *answers):
        self.answers = list(answers)

    def _next(self, *_arguments):
        answer, future = self.answers.pop(0), Future()
        if isinstance(answer, Exception):
            future.set_exception(answer)
        elif answer is not ...:
            future.set_result(answer)
        return future

    table = save = _next

    def end(self):
        self.ended += 1


@pytest.mark.parametrize(("answer", "is_kept"), [("table", True), (None, False), (WorkerDied("gone"), False)])
def test_the_table_ahead_is_kept_or_left_to_the_first_blender(blender, monkeypatch, answer, is_kept):
    scene = bpy.context.scene
    plain(scene.view_settings)
    view_transform._latest.clear()
    stand = Stand(answer)
    monkeypatch.setattr(view_process, "ViewProcess", lambda _scene: stand)
    monkeypatch.setattr(view_process, "has_program", lambda: True)
    ahead = view_process.TableAhead(scene)
    assert ahead.is_ready() and stand.ended == 1
    assert view_transform.is_known(view_transform.view_key(scene)) is is_kept
    view_transform._latest.clear()


def test_the_table_ahead_is_not_waited_for_without_end(blender, monkeypatch):
    scene = bpy.context.scene
    plain(scene.view_settings)
    view_transform._latest.clear()
    stand = Stand(...)
    monkeypatch.setattr(view_process, "ViewProcess", lambda _scene: stand)
    monkeypatch.setattr(view_process, "has_program", lambda: True)
    ahead = view_process.TableAhead(scene)
    assert not ahead.is_ready()
    monkeypatch.setattr(view_process.time, "monotonic", lambda: 1e12)
    assert ahead.is_ready()
    ahead.end()
    assert stand.ended == 1


def saved_by(monkeypatch, scene, path, stand, frames=()):
    monkeypatch.setattr(saving, "has_program", lambda: True)
    monkeypatch.setattr(saving, "ViewProcess", lambda *_arguments: stand)
    found = saving.Saving(scene, path, frames, at_once=False)
    for _ in range(20):
        if found.step():
            break
    found.wait()
    found.finish()
    found.end()
    return found


@pytest.mark.parametrize("answer", [False, WorkerDied("gone")])
def test_a_picture_that_the_second_blender_cannot_save_is_saved_here(dial, stage, tmp_path, monkeypatch, answer):
    here, path = tmp_path / "here.png", tmp_path / "a.png"
    bpy.ops.spectral.dial_save(filepath=str(here))
    found = saved_by(monkeypatch, stage, path, Stand(answer))
    assert found.saved == 1 and path.read_bytes() == here.read_bytes()


def test_frames_that_the_second_blender_cannot_save_are_saved_here_and_the_frame_stays(
    dial, stage, tmp_path, monkeypatch
):
    stage.frame_set(7)
    stand = Stand(False, WorkerDied("gone"), False)
    found = saved_by(monkeypatch, stage, tmp_path / "walk_.exr", stand, (1, 2, 3))
    assert found.saved == 3 and stand.ended == 1 and stage.frame_current == 7
    assert sorted(each.name for each in tmp_path.glob("walk_*")) == [f"walk_{k:04d}.exr" for k in (1, 2, 3)]


def test_no_more_than_two_pictures_wait(dial, stage, tmp_path, monkeypatch):
    monkeypatch.setattr(saving, "has_program", lambda: True)
    monkeypatch.setattr(saving, "ViewProcess", lambda *_arguments: Stand(..., ...))
    found = saving.Saving(stage, tmp_path / "a.png", (1, 2, 3, 4), at_once=False)
    assert [found.step() for _ in range(5)] == [False] * 5
    found.end()


def test_another_ending_is_refused(blender, tmp_path):
    with pytest.raises(InvalidInputError, match=r"a\.jpg is neither"):
        saving.Saving(bpy.context.scene, tmp_path / "a.jpg", at_once=True)
