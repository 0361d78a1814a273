# SPDX-License-Identifier: GPL-3.0-or-later
"""Sweeps of switches, lists, colors and whole numbers of a .blend; pictures use the view transform of the file."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from tests.blender_sweep.test_sweep_in_blender import HEIGHT, KEY, scene  # noqa: E402, F401 - a fixture

SHAPE = 'bpy.data.lights["Key"].type'
HIDDEN = 'bpy.data.objects["Plane"].hide_render'
GREEN = 'bpy.data.lights["Key"].color[1]'
SIDES = 'bpy.data.objects["Plane"].pass_index'


def node_of(folder: Path, *parameters: Any, **options: Any) -> Any:
    from blender_addon.editing.sweep.node import BlendNode
    from spectral_core.explore.sweep.parameters import Space

    return BlendNode.of(folder / "scene.blend", Space(parameters), samples=2, **options)


def test_each_type_of_setting_is_added_with_its_values(scene: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep.documents import parameters_of

    for path in (SHAPE, HIDDEN, GREEN, SIDES):
        assert bpy.ops.spectral.sweep_add(target=path) == {"FINISHED"}
    kinds = {p.name: (p.kind, p.choices) for p in parameters_of(scene.spectral.sweep)}
    assert kinds["key_type"] == ("choice", ("POINT", "SUN", "SPOT", "AREA"))
    assert kinds["plane_hide_render"] == ("choice", ("off", "on"))
    assert kinds["key_color_g"][0] == "real" and kinds["plane_pass_index"][0] == "integer"
    scene.spectral.sweep.parameters[SHAPE].choices = "POINT, LASER"
    with pytest.raises(Exception, match="cannot be 'LASER'; it offers POINT, SUN"):
        parameters_of(scene.spectral.sweep)


def test_names_of_values_may_have_commas_and_spaces_at_their_ends(scene: Any) -> None:  # noqa: F811
    """Such a list was swept over parts of its names, which the run refused."""
    from blender_addon.editing.sweep.documents import parameters_of

    plane = bpy.data.objects["Plane"]
    plane["wood"], names = 0, ("Oak, dark", "Oak", "Pine ", "Oak, dark, old")
    plane.id_properties_ui("wood").update(items=[(name, name, "", number) for number, name in enumerate(names)])
    path = 'bpy.data.objects["Plane"]["wood"]'
    bpy.ops.spectral.sweep_add(target=path)
    sweep = scene.spectral.sweep
    assert parameters_of(sweep)[0].choices == names
    sweep.parameters[path].choices = " Oak, dark , Pine,Oak,"
    assert parameters_of(sweep)[0].choices == ("Oak, dark", "Pine ", "Oak")
    sweep.parameters[path].choices = "Oak, light, Pine"
    with pytest.raises(Exception, match="cannot be 'light'; it offers Oak, dark, Oak, Pine"):
        parameters_of(sweep)


def test_a_point_sets_and_keyframes_switches_and_lists(scene: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep.points import keyframe_path, set_point
    from spectral_core.explore.sweep.ledger import Row

    for path in (SHAPE, HIDDEN, GREEN):
        bpy.ops.spectral.sweep_add(target=path)
    values = {"key_type": "AREA", "plane_hide_render": "on", "key_color_g": 0.25}
    set_point(scene, values)
    light, plane = bpy.data.lights["Key"], bpy.data.objects["Plane"]
    assert (light.type, plane.hide_render, light.color[1]) == ("AREA", True, pytest.approx(0.25))
    with pytest.raises(Exception, match="does not sweep 'other'"):
        set_point(scene, {"other": 1})
    del values["key_type"]  # Blender does not animate the type of a light
    rows = [Row("k", 0, {**values, "plane_hide_render": word}, "done", {}, {}, 0.0, None) for word in ("on", "off")]
    last = keyframe_path(scene, rows, 5)
    scene.frame_set(last)
    assert not bpy.data.objects["Plane"].hide_render
    scene.frame_set(last - 5)
    assert bpy.data.objects["Plane"].hide_render


def test_an_error_names_a_setting_that_has_keyframes(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    from spectral_core.explore.sweep.parameters import Parameter

    camera = bpy.data.objects["Camera"]
    driver = camera.driver_add("location", 2).driver
    driver.expression = "3.25"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    with pytest.raises(Exception, match=r"a driver, a constraint or its limits make it 3\.25"):
        node_of(tmp_path, Parameter("height", 2, 4, path=HEIGHT))


def test_swept_samples_and_size_are_not_overridden(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    from spectral_core.explore.sweep.parameters import Parameter

    node = node_of(
        tmp_path,
        Parameter("samples", 1, 64, kind="integer", path='bpy.data.scenes["Scene"].spectral.render.samples'),
        Parameter("size", 10, 100, kind="integer", path='bpy.data.scenes["Scene"].render.resolution_percentage'),
        percentage=50,
    )
    made = node.scene({"samples": 7, "size": 25}, 0)
    assert (made.film.samples, made.film.width, made.film.height) == (7, 8, 6)
    assert sum("swept, so" in line for line in node.describe()) == 2


@pytest.mark.slow
def test_points_that_the_page_added_are_rendered_by_another_process(scene: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep import live as editing
    from spectral_core.explore.sweep.store import Store

    bpy.ops.spectral.sweep_add(target=SHAPE)
    scene.spectral.sweep.parameters[SHAPE].choices = "POINT, SPOT"
    bpy.ops.spectral.sweep_add(target=GREEN)
    scene.spectral.sweep.budget = 2
    assert bpy.ops.spectral.sweep_run() == {"FINISHED"}, scene.spectral.sweep.status
    with Store.open(editing.folder_of(scene.spectral.sweep)) as store:
        store.enter([{"key_type": "SPOT", "key_color_g": 0.125}])
    file = bpy.data.filepath
    assert bpy.ops.spectral.sweep_run(pending=True) == {"FINISHED"}, scene.spectral.sweep.status
    rows = editing.rows(bpy.context.scene)
    assert len(rows) == 3 and rows[-1].parameters == {"key_type": "SPOT", "key_color_g": 0.125}
    assert bpy.data.filepath == file and bpy.data.lights["Key"].type == "POINT"  # the artist's file is unchanged


@pytest.mark.slow
def test_pictures_are_shown_through_the_view_transform_of_the_file(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    from PIL import Image

    from spectral_core.explore.sweep.parameters import Parameter
    from spectral_core.spectra.pictures import display_png

    parameter = Parameter("type", kind="choice", choices=("POINT", "SPOT"), path=SHAPE)
    shown = {}
    for view in ("Standard", "AgX"):
        bpy.context.scene.view_settings.view_transform = view
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
        node = node_of(tmp_path, parameter)
        outcome = node({"type": "POINT"}, 1)
        shown[view] = (node.fingerprint, outcome)
    assert shown["Standard"][0] != shown["AgX"][0]
    plain, agx = shown["Standard"][1], shown["AgX"][1]
    assert not plain.shown and np.array_equal(plain.pictures[""], agx.pictures[""])
    # the same pixels in an image of Blender, which saves it as 8-bit PNG like a render
    linear = agx.pictures[""][::-1]
    height, width = linear.shape[:2]
    image = bpy.data.images.new("check", width, height, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(np.dstack([linear[..., :3], np.ones((height, width))]).astype(np.float32).ravel())
    bpy.context.scene.render.image_settings.file_format = "PNG"
    image.save_render(str(tmp_path / "check.png"), scene=bpy.context.scene)
    (tmp_path / "sweep.png").write_bytes(agx.shown[""])
    (tmp_path / "srgb.png").write_bytes(display_png(plain.pictures[""]))
    levels = {
        name: np.asarray(Image.open(tmp_path / f"{name}.png").convert("RGB"), int)
        for name in ("sweep", "check", "srgb")
    }
    assert np.abs(levels["sweep"] - levels["check"]).max() <= 1  # Blender's dithering: up to one level
    assert np.abs(levels["sweep"] - levels["srgb"]).max() > 10
    assert KEY


class Started:
    """In place of a sweep's process: what it was started with."""

    calls: list[tuple[Any, ...]] = []

    def __init__(self, command: list[str], folder: Path, total: int, *_: object) -> None:
        self.calls.append((command, total))
        self.process = SimpleNamespace(poll=lambda: 0)


def test_a_run_is_started_with_the_points_and_workers_of_the_panel(scene: Any, monkeypatch: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep import live as sweeps

    bpy.ops.spectral.sweep_add(target=GREEN)
    settings = scene.spectral.sweep
    settings.budget, settings.workers = 7, 3
    monkeypatch.setattr(sweeps, "Run", Started)
    monkeypatch.setattr(sweeps, "_run", None)
    sweeps.start(scene)
    (command, total) = Started.calls[-1]
    assert (total, settings.total, settings.done) == (7, 7, 0)
    assert command[command.index("--workers") + 1] == "3"
    assert "--retry" in command  # no button of the panel tries points again that were set aside


def test_the_estimate_counts_points_size_and_samples(scene: Any, monkeypatch: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep.run import estimate

    bpy.ops.spectral.sweep_add(target=GREEN)
    settings = scene.spectral.sweep
    settings.budget, settings.percentage, settings.samples = 5, 50, 1000
    paths = scene.render.resolution_x * scene.render.resolution_y / 4 * 1000
    assert estimate(scene).startswith(f"5 renders of {paths / 1e6:.2g} million light paths each")


def test_two_settings_of_one_name_get_two_columns(scene: Any) -> None:  # noqa: F811
    bpy.ops.spectral.sweep_add(target=SIDES)
    settings = scene.spectral.sweep
    assert settings.parameters[0].whole and settings.parameters[0].low < settings.parameters[0].high
    other = bpy.data.objects.new("plane", None)
    scene.collection.objects.link(other)
    bpy.ops.spectral.sweep_add(target='bpy.data.objects["plane"].pass_index')
    labels = [each.label for each in settings.parameters]
    assert len(set(labels)) == 2, labels


def driven(light: Any) -> str:
    light.driver_add("energy").driver.expression = "40 + 2"
    return "was set to 9.0, but keyframes, a driver, a constraint or its limits make it 42.0"


def keyframed(light: Any) -> str:
    light.keyframe_insert("energy", frame=bpy.context.scene.frame_current)
    bpy.context.view_layer.update()
    return "has keyframes, which replace 9.0 at the next frame"


@pytest.mark.parametrize("animate", [driven, keyframed])
def test_a_point_names_settings_that_keyframes_or_drivers_hold(scene: Any, animate: Any) -> None:  # noqa: F811
    from blender_addon.editing.sweep.points import set_point

    for path in (KEY, GREEN):
        bpy.ops.spectral.sweep_add(target=path)
    values = {"key_energy": 9.0, "key_color_g": 0.25}
    bpy.data.lights["Key"].keyframe_insert("shadow_soft_size", frame=3)
    assert set_point(scene, values) == []
    held = animate(bpy.data.lights["Key"])
    (text,) = set_point(scene, values)
    assert text.startswith(f"{KEY} {held}")


def test_a_setting_with_keyframes_is_refused_although_blender_shows_the_new_value(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    """Blender evaluates keyframes when the frame is set, so the check passed, and all pictures were the same."""
    from spectral_core.explore.sweep.parameters import Parameter

    bpy.data.objects["Plane"].keyframe_insert("location", index=0, frame=1)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    path = 'bpy.data.objects["Plane"].location[{}]'
    with pytest.raises(Exception, match=r"location\[0\] was set to 1\.0, but keyframes, a driver"):
        node_of(tmp_path, Parameter("x", 1, 2, path=path.format(0)))
    node_of(tmp_path, Parameter("y", 1, 2, path=path.format(1)))  # has none


def test_a_place_that_a_constraint_decides_is_refused(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    """A constraint leaves the property as it was set, so the check passed, and all pictures were the same."""
    from spectral_core.explore.sweep.parameters import Parameter

    def node(path: str, high: float = 2.0) -> Any:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
        return node_of(tmp_path, Parameter("x", 0, high, path=path))

    place, turn = 'bpy.data.objects["Key"].location[0]', 'bpy.data.objects["Camera"].rotation_euler[2]'
    bpy.data.objects["Key"].constraints.new("COPY_LOCATION").target = bpy.data.objects["Plane"]
    with pytest.raises(Exception, match=r"location\[0\] moves nothing: a constraint decides"):
        node(place)
    bpy.data.objects["Key"].constraints[0].use_offset = True
    node(place)
    node(turn, 4 * math.pi)  # whole turns
    bpy.data.objects["Camera"].constraints.new("TRACK_TO").target = bpy.data.objects["Plane"]
    with pytest.raises(Exception, match="moves nothing"):  # up to rounding
        node(turn)
    bpy.data.objects["Camera"].constraints.clear()
    bpy.data.objects["Camera"].rotation_mode = "QUATERNION"
    with pytest.raises(Exception, match="or the rotation mode is another one"):
        node(turn)


@pytest.mark.parametrize(
    ("path", "reason"),
    [(SIDES, "is a whole number; give its parameter kind = 'integer'"),
     (HIDDEN, "is no number; give its parameter choices, of those that it offers: off, on"),
     (SHAPE, "is no number; give its parameter choices, of those that it offers: POINT, SUN")],
)  # fmt: skip
def test_a_real_range_over_a_setting_of_few_values_is_refused(
    scene: Any,  # noqa: F811
    tmp_path: Path,
    path: str,
    reason: str,
) -> None:
    """Values between whole numbers were rounded in the scene, not in the table; those of a switch failed one by one."""
    from spectral_core.explore.sweep.parameters import Parameter

    with pytest.raises(Exception, match=reason):
        node_of(tmp_path, Parameter("value", 0, 1, path=path))
