# SPDX-License-Identifier: GPL-3.0-or-later
"""Swept settings of copied scenes, and of data-blocks that are renamed or deleted after they were added."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from blender_addon.editing.sweep import live as sweeps
from blender_addon.editing.sweep.documents import parameters_of, require_own_table
from blender_addon.editing.sweep.points import keyframe_path, set_point
from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.ledger import Row
from spectral_core.explore.sweep.parameters import Space
from tests.blender_sweep.test_sweep_in_blender import HEIGHT, KEY, scene  # noqa: F401 - a fixture

SAMPLES = 'bpy.data.scenes["Scene"].spectral.render.samples'
POINT = {"key_energy": 77.0, "camera_location_z": 9.0, "scene_samples": 12}


def copied(kind: str) -> Any:
    """A scene that Blender makes from the one in the window, as New Scene does."""
    bpy.ops.scene.new(type=kind)
    return bpy.context.scene


@pytest.fixture
def original(scene: Any) -> Any:  # noqa: F811
    for path in (KEY, HEIGHT, SAMPLES):
        sweeps.add(scene, path)
    return scene


def test_a_point_changes_the_full_copy_and_not_its_original(original: Any) -> None:
    """The paths name the original's data: its lamp and its camera were changed, without a word."""
    before = (bpy.data.lights["Key"].energy, original.camera.location[2], original.spectral.render.samples)
    copy = copied("FULL_COPY")
    lamp = next(obj.data for obj in copy.objects if obj.type == "LIGHT")
    assert lamp != bpy.data.lights["Key"] and copy.camera != original.camera
    assert set_point(copy, POINT) == []
    assert (lamp.energy, copy.camera.location[2], copy.spectral.render.samples) == (77.0, 9.0, 12)
    assert (bpy.data.lights["Key"].energy, original.camera.location[2], original.spectral.render.samples) == before
    assert set_point(original, {"key_energy": 55.0}) == []
    assert (lamp.energy, bpy.data.lights["Key"].energy) == (77.0, 55.0)


def test_the_sweep_and_the_keyframes_of_a_full_copy_are_of_its_own_data(original: Any) -> None:
    own = {parameter.name: parameter.target for parameter in parameters_of(original.spectral.sweep)}
    copy = copied("FULL_COPY")
    targets = {parameter.name: parameter.target for parameter in parameters_of(copy.spectral.sweep)}
    assert not set(targets.values()) & set(own.values()), targets
    assert {parameter.name: parameter.target for parameter in parameters_of(original.spectral.sweep)} == own
    with pytest.raises(InvalidInputError, match="the scene sweeps .* by this name; choose another folder"):
        require_own_table(
            copy, sweeps.folder_of(copy.spectral.sweep), Space(tuple(parameters_of(original.spectral.sweep)))
        )
    row = Row("a1", 0, {"key_energy": 40.0}, "done", {}, {}, None, None)
    keyframe_path(copy, [row], 5)
    lamp = next(obj.data for obj in copy.objects if obj.type == "LIGHT")
    assert lamp.energy == 40.0 and lamp.animation_data is not None
    assert bpy.data.lights["Key"].energy == 300.0 and bpy.data.lights["Key"].animation_data is None


def test_a_file_without_data_blocks_gets_them_when_it_is_opened(original: Any) -> None:
    for entry in original.spectral.sweep.parameters:
        entry.block = None  # as earlier versions saved it
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    copy = copied("FULL_COPY")
    assert set_point(copy, POINT) == []
    assert bpy.data.lights["Key"].energy == 300.0


def test_a_linked_copy_has_the_same_lamps_and_its_own_settings(original: Any) -> None:
    samples = original.spectral.render.samples
    copy = copied("LINK_COPY")
    assert set_point(copy, POINT) == []
    assert (copy.spectral.render.samples, original.spectral.render.samples) == (12, samples)
    assert bpy.data.lights["Key"].energy == 77.0


def test_a_setting_of_another_scene_is_refused(original: Any) -> None:
    """Copy Settings leaves it, and a render of the new scene does not read it."""
    samples, other = original.spectral.render.samples, copied("EMPTY")
    with pytest.raises(InvalidInputError, match="'scene_samples' is .*a setting of another scene than 'Scene.001'"):
        set_point(other, POINT)
    assert original.spectral.render.samples == samples and bpy.data.lights["Key"].energy == 300.0


def test_renamed_data_is_followed(original: Any) -> None:
    bpy.data.lights["Key"].name = 'Lamp "A"'
    assert set_point(original, POINT) == []
    assert bpy.data.lights['Lamp "A"'].energy == 77.0
    with pytest.raises(InvalidInputError, match="is swept already"):
        sweeps.add(original, 'bpy.data.lights["Lamp \\"A\\""].energy')


def test_a_path_in_single_quotes_stays_as_it_was_given(scene: Any) -> None:  # noqa: F811
    """A table names the path as it was when the sweep ran."""
    path = KEY.replace('"', "'")
    sweeps.add(scene, path)
    assert parameters_of(scene.spectral.sweep)[0].target == path


def test_a_deleted_object_is_named(original: Any) -> None:
    """The sweep alone keeps it in the file, and points of it would all look the same."""
    lamp = bpy.data.objects["Key"]
    sweeps.add(original, 'bpy.data.objects["Key"].location[0]')
    with bpy.context.temp_override(selected_objects=[lamp]):
        bpy.ops.object.delete()
    with pytest.raises(InvalidInputError, match="'key_location_x' is .*deleted from every collection; remove"):
        parameters_of(original.spectral.sweep)
