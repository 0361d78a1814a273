# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that change no picture, or not over their whole range, are named before the points are rendered."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

from spectral_core.explore.sweep.parameters import Parameter  # noqa: E402
from tests.blender_sweep.test_sweep_in_blender import KEY, scene  # noqa: E402, F401 - a fixture
from tests.blender_sweep.test_swept_settings import node_of  # noqa: E402

HIDDEN, POWER = 'bpy.data.objects["Fill"].hide_render', 'bpy.data.lights["Fill"].energy'
HEIGHT = 'bpy.data.objects["Plane"].location[2]'


def notes(folder: Any, *parameters: Parameter) -> list[str]:
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    return [line for line in node_of(folder, *parameters).describe() if line.startswith("note: ")]


def test_the_power_of_a_hidden_lamp_is_named_unless_a_swept_switch_shows_it(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    """All pictures were the same, without a word."""
    lamp = bpy.data.objects.new("Fill", bpy.data.lights.new("Fill", "POINT"))
    scene.collection.objects.link(lamp)
    lamp.hide_render = True
    power = Parameter("fill", 1, 100, path=POWER)
    (line,) = notes(tmp_path, power)
    assert line.startswith(f"note: no picture changes with 'fill' ({POWER})")
    assert not notes(tmp_path, Parameter("hidden", kind="choice", choices=("on", "off"), path=HIDDEN), power)
    assert not notes(tmp_path, Parameter("exposure", 0, 1, path='bpy.data.scenes["Scene"].view_settings.exposure'))


def test_what_the_pictures_lack_is_named(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    """F12 names it, and sweeps rendered such pictures without a word."""
    tree = bpy.data.materials["Metal"].node_tree
    texture = tree.nodes.new("SpectralSceneTexture")
    tree.links.new(texture.outputs[0], tree.nodes["Glossy"].inputs["Color"])
    texture.filepath = "//gone.exr"
    (line,) = notes(tmp_path, Parameter("watts", 1, 100, path=KEY))
    assert line.startswith("note: Metal: Spectral Texture") and "there is no file" in line


def test_a_setting_of_another_scene_than_the_rendered_one_is_named(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    bpy.data.scenes.new("Other")
    (line,) = notes(tmp_path, Parameter("dpi", 1, 9, path='bpy.data.scenes["Other"].render.pixel_aspect_x'))
    assert "of another scene" in line


def test_a_constraint_that_limits_a_part_of_the_range_is_named(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    limit = bpy.data.objects["Plane"].constraints.new("LIMIT_LOCATION")
    limit.use_max_z, limit.max_z = True, 0.5
    (line,) = notes(tmp_path, Parameter("height", 0, 1, path=HEIGHT))
    assert line.startswith(f"note: {HEIGHT} has its object in one place at 0.97 and 1: a constraint limits it")
    assert not notes(tmp_path, Parameter("height", 0, 0.5, path=HEIGHT))


def test_a_small_range_far_from_the_origin_is_swept(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    """The range is below the rounding of the largest coordinate: it was refused for a constraint that is not there."""
    bpy.data.objects["Plane"].location[0] = 500000
    assert not notes(tmp_path, Parameter("height", 0, 0.4, path=HEIGHT))


@pytest.mark.parametrize("name", ["samples", "seed"])
def test_samples_of_another_scene_leave_those_of_the_sweep(scene: Any, tmp_path: Any, name: str) -> None:  # noqa: F811
    """The points were rendered with the samples of the file, and with one seed, because those of a scene that nobody
    renders were swept.
    """
    for each in (bpy.data.scenes.new("Other"), scene):
        each.spectral.render.samples, each.render.resolution_percentage = 9, 50
    path = 'bpy.data.scenes["{}"].spectral.render.' + name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    swept = Parameter("other", 3, 7, kind="integer", path=path.format("Other"))
    node = node_of(tmp_path, swept, Parameter("watts", 1, 100, path=KEY), percentage=100)
    made = node.scene({"other": 5, "watts": 10.0}, 42)
    assert (made.film.samples, made.film.seed, made.film.width) == (2, 42, 32)
    assert not any("are not used" in line for line in node.describe())
    own = node_of(tmp_path, Parameter("own", 3, 7, kind="integer", path=path.format("Scene")), percentage=100)
    film = own.scene({"own": 5}, 42).film
    assert (film.samples, film.seed) == ((5, 42) if name == "samples" else (2, 5))


def test_a_swept_size_replaces_that_of_the_sweep(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    path = 'bpy.data.scenes["Scene"].render.resolution_percentage'
    node = node_of(tmp_path, Parameter("size", 50, 100, kind="integer", path=path), percentage=25)
    assert [node.scene({"size": size}, 0).film.width for size in (50, 100)] == [16, 32]
    assert "the size is swept, so the 25 % of the sweep are not used" in node.describe()


def test_a_library_that_is_missing_is_named(scene: Any, tmp_path: Any) -> None:  # noqa: F811
    """`render` names it; a sweep rendered pictures without its contents and said nothing."""
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {bpy.data.objects["Plane"]})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.objects = ["Plane"]
    scene.collection.objects.link(into.objects[0])
    bpy.data.objects["Plane", None].location.z = -1.0
    power = Parameter("watts", 1, 100, path=KEY)
    assert not notes(tmp_path, power)
    (tmp_path / "library.blend").unlink()
    (line,) = notes(tmp_path, power)
    assert line.startswith("note: library.blend: the linked library") and "was not found" in line
