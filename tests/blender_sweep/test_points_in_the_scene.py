# SPDX-License-Identifier: GPL-3.0-or-later
"""A point that is set in the scene shows the picture of its row, also for a palette; paths leave the first point."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from spectral_core.explore.sweep.ledger import Row  # noqa: E402
from tests.blender_sweep.test_sweep_in_blender import KEY, scene  # noqa: E402, F401 - a fixture

PALETTE = 'bpy.data.scenes["Scene"].spectral.palette'
RED = f"{PALETTE}.materials[0].cells[0].target[0]"


@pytest.fixture
def swept(scene: Any) -> Any:  # noqa: F811
    """The scene with a palette of its lamp and two materials, whose first target is swept."""
    from blender_addon import compat

    paint = bpy.data.materials.new("Paint")
    compat.use_nodes(paint)
    bpy.data.objects["Plane"].data.materials.append(paint)
    assert bpy.ops.spectral.palette_from_scene() == {"FINISHED"}
    scene.spectral.palette.live = False
    assert bpy.ops.spectral.palette_solve() == {"FINISHED"}
    assert bpy.ops.spectral.sweep_add(target=RED) == {"FINISHED"}
    return scene


def spectra() -> dict[str, list[float]]:
    return {each.name: [point.value for point in each.spectral.samples] for each in bpy.data.materials}


def rows_of(label: str, *values: float) -> list[Row]:
    return [Row("k", 0, {label: value}, "done", {}, {}, 0.0, None) for value in values]


def test_a_point_of_a_palette_gives_the_scene_its_spectra(swept: Any) -> None:
    """The spectra are those of a solve and an application by hand."""
    from blender_addon.editing.sweep.points import set_point

    label = swept.spectral.sweep.parameters[0].label
    by_points = []
    for value in (0.2, 0.7):
        assert set_point(swept, {label: value}) == []
        by_points.append(spectra())
    assert by_points[0] != by_points[1]
    swept.spectral.palette.materials[0].cells[0].target[0] = 0.2
    bpy.ops.spectral.palette_solve()
    bpy.ops.spectral.palette_apply()
    assert list(by_points[0]) == list(spectra())
    for name, values in spectra().items():
        assert values == pytest.approx(by_points[0][name], abs=1e-6)


def test_an_unsolvable_palette_is_reported(swept: Any) -> None:
    from blender_addon.editing.sweep.points import set_point

    label = swept.spectral.sweep.parameters[0].label
    for row in swept.spectral.palette.materials:
        row.material = None
    for column in swept.spectral.palette.lights:
        column.light = None
    with pytest.raises(Exception, match="the palette: .*no row or column names"):
        set_point(swept, {label: 0.4})


def test_a_palette_cannot_be_keyframed(swept: Any) -> None:
    """Nothing solves it for each frame, so that every frame would show the same spectra."""
    from blender_addon.editing.sweep.points import keyframe_path

    bpy.ops.spectral.sweep_add(target=KEY)
    labels = [entry.label for entry in swept.spectral.sweep.parameters]
    both = [Row("k", 0, {labels[1]: 50.0, labels[0]: 0.2}, "done", {}, {}, 0.0, None)]
    with pytest.raises(Exception, match="not solved anew for each frame"):
        keyframe_path(swept, both, 10)
    assert bpy.data.lights["Key"].animation_data is None  # nothing is keyframed in part


def test_a_path_leaves_the_scene_at_its_first_point(scene: Any) -> None:  # noqa: F811
    """The present frame is that of the first point, so the controls show it."""
    from blender_addon.editing.sweep.points import keyframe_path

    bpy.ops.spectral.sweep_add(target=KEY)
    scene.frame_set(7)
    label = scene.spectral.sweep.parameters[0].label
    assert keyframe_path(scene, rows_of(label, 40.0, 80.0, 20.0), 5) == 17
    light = bpy.data.lights["Key"]
    assert light.energy == pytest.approx(40.0)
    shown = []
    for frame in (7, 12, 17):
        scene.frame_set(frame)
        shown.append(light.energy)
    assert shown == pytest.approx([40.0, 80.0, 20.0])
