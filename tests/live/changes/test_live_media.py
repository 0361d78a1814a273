# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of scenes with media: the medium at the eye, edits in place, and scenes that are smaller than ray offsets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Film,
    Instance,
    Material,
    MediumGrid,
    Mesh,
    PointLight,
    ScatteringMedium,
    Scene,
    World,
    gray,
)
from tests.render.media.test_medium import box
from tests.render.scenes import matrix

SIDE, SAMPLES = 16, 32


def grid(power: float = 1.0) -> MediumGrid:
    """Layers of fog in the box of the scene."""
    shape = (4, 4, 8)
    level = np.broadcast_to(((np.arange(8) + 0.5) / 8) ** power, shape).astype(np.float32)
    placed = np.eye(4)
    placed[:3, :3] = np.diag(2.0 / np.array(shape))
    placed[:3, 3] = -1 + 1.0 / np.array(shape)
    return MediumGrid(placed, scattering=level, absorption=level)


def fog(density: float = 0.8, **numbers: object) -> ScatteringMedium:
    return ScatteringMedium(density, gray(0.6), **numbers)  # type: ignore[arg-type]


def scene_of(medium: ScatteringMedium, size: float = 1.0) -> Scene:
    """A box of fog around the origin, a wall behind it, and a camera at a distance of 4."""
    scale = np.diag([size, size, size, 1.0])
    wall = Mesh("wall", np.array([[-9, -9, -3], [9, -9, -3], [0, 9, -3]], np.float32), np.array([[0, 1, 2]], np.uint32))
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 4 * size)), field_of_view_rad=0.8, near=0.01 * size),
        film=Film(SIDE, SIDE, samples=SAMPLES),
        meshes=(box(), wall),
        materials=(Material("fog", None, medium), Material("paint", Diffuse(gray(0.5)))),
        instances=(
            Instance("cube", "box", scale @ np.diag([2.0, 2.0, 2.0, 1.0]), ("fog",)),
            Instance("wall", "wall", scale, ("paint",)),
        ),
        lights=(PointLight(name="lamp", world_from_light=matrix((2 * size, 0, 3 * size)), power_w=200.0 * size**2),),
        world=World(gray(0.3), 1.0),
    )


def in_view(scene: Scene) -> Scene:
    """As a 3D view sends it: its camera is part of each request for a picture, not of the scene."""
    return replace(scene, camera=Camera(world_from_camera=np.eye(4)))


def pictured(stage: Stage, scene: Scene, viewpoint: Viewpoint | None = None, samples: int = SAMPLES) -> np.ndarray:
    stage.show(scene)
    stage.activate()
    viewpoint = viewpoint or Viewpoint.of_camera(scene.camera, scene.film)
    stage.look_from(viewpoint)
    picture = ViewPicture(stage.launcher, ViewRequest("stage", viewpoint, SIDE, SIDE, samples, 0), 4)
    while not picture.is_done:
        picture.step()
    return picture.pixels().copy()


def test_a_path_begins_in_the_medium_at_the_eye_of_its_view() -> None:
    """The camera of a view moves after the scene was loaded: out of the fog, and into it."""
    scene, stage = scene_of(fog()), Stage()
    outside = Viewpoint.of_camera(scene.camera, scene.film)
    inside = Viewpoint.of_camera(replace(scene.camera, world_from_camera=matrix((0, 0, 0.2))), scene.film)
    views = (outside, inside, outside)
    found = [pictured(stage, in_view(scene), viewpoint) for viewpoint in views]
    assert (stage.loads, stage.launcher.recordings) == (1, 1)
    for viewpoint, picture in zip(views, found, strict=True):
        true = replace(scene, camera=Camera(world_from_camera=viewpoint.world_from_view))
        np.testing.assert_array_equal(picture, pictured(Stage(), true, viewpoint))
        assert picture[..., :3].mean() > 0.05


def _material(scene: Scene, place: int, **fields: object) -> Scene:
    materials = list(scene.materials)
    materials[place] = replace(materials[place], **fields)  # type: ignore[arg-type]
    return replace(scene, materials=tuple(materials))


EDITS: dict[str, Callable[[Scene], Scene]] = {
    "density": lambda s: _material(s, 0, medium=replace(s.materials[0].medium, density=2.0)),
    "color": lambda s: _material(s, 0, medium=replace(s.materials[0].medium, color=Color(np.array([0.9, 0.4, 0.1])))),
    "direction": lambda s: _material(s, 0, medium=replace(s.materials[0].medium, anisotropy=0.7)),
    "paint": lambda s: _material(s, 1, surface=Diffuse(gray(0.8))),
    "lamp": lambda s: replace(s, lights=(replace(s.lights[0], power_w=400.0),)),
    "world": lambda s: replace(s, world=World(gray(0.6), 1.0)),
    "place": lambda s: replace(
        s,
        instances=tuple(
            replace(x, world_from_object=matrix((0, 1, 1.5))) if x.name == "wall" else x for x in s.instances
        ),
    ),
}


def test_an_edit_beside_or_in_a_medium_is_made_in_place() -> None:
    """The picture after each equals that of a scene that is loaded afresh, and no launch is recorded again."""
    scene = scene_of(fog(grid=grid()))
    second = replace(scene.instances[0], name="even", world_from_object=matrix((0, 0, 1.6)), materials=("even",))
    scene = replace(
        scene, materials=(*scene.materials, Material("even", None, fog())), instances=(*scene.instances, second)
    )
    edits = dict(EDITS)
    for name in ("density", "color", "direction"):
        edits[f"{name} of an even one"] = lambda s, name=name: _of_even(s, EDITS[name])
    edits["grid"] = lambda s: _material(s, 0, medium=replace(s.materials[0].medium, grid=grid(3.0)))
    _edited_in_place(scene, edits, 1e-3)


def test_an_edit_in_a_medium_with_spectra_is_made_in_place() -> None:
    scene = scene_of(fog(grid=grid()))
    edits = {name: EDITS[name] for name in ("color", "density", "paint")}
    scene = replace(scene, settings=replace(scene.settings, transport="spectral"))
    _edited_in_place(scene, edits, 0.03)  # wavelengths are drawn by the spectra of the scene that was loaded


def _of_even(scene: Scene, edit: Callable[[Scene], Scene]) -> Scene:
    """An edit of the first material, made to the third."""
    first, *_ = edit(_material(scene, 0, medium=scene.materials[2].medium)).materials
    return _material(scene, 2, medium=first.medium)


def _edited_in_place(scene: Scene, edits: dict[str, Callable[[Scene], Scene]], limit: float) -> None:
    stage, scenes = Stage(), [scene]
    for edit in edits.values():
        scenes.append(edit(scenes[-1]))
    found = [pictured(stage, each) for each in scenes]
    assert (stage.loads, stage.launcher.recordings) == (1, 1)
    means = [picture[..., :3].mean(axis=(0, 1)) for picture in found]
    for name, each, mean, before in zip(edits, scenes[1:], means[1:], means, strict=False):
        assert np.abs(mean - before).max() > 1e-3 * before.max(), f"{name} changes nothing"
        np.testing.assert_allclose(mean, pictured(Stage(), each)[..., :3].mean(axis=(0, 1)), rtol=limit, err_msg=name)


def test_another_kind_of_medium_loads_the_scene_again() -> None:
    """Emission, a grid, or empty space in place of fog give other kernels."""
    stage, scene = Stage(), scene_of(fog())
    kinds = [fog(emission_strength=2.0), fog(grid=grid()), None, fog(density=0.0), fog()]
    for number, medium in enumerate(kinds, 1):
        changed = _material(scene, 0, medium=medium)
        found = pictured(stage, changed, samples=4)
        np.testing.assert_array_equal(found, pictured(Stage(), changed, samples=4))
        assert stage.loads == number


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_a_scene_of_millimeters_is_seen_at_its_size(kind: str) -> None:
    """Such scenes are loaded in other units, in which the eye and its distances have to be."""
    pictures = []
    for size in (1.0, 0.005):
        scene = _material(scene_of(fog(), size), 0, medium=None, surface=Diffuse(gray(0.7)))
        camera = replace(scene.camera, kind=kind, orthographic_scale=6 * size, far=100.0 * size)
        viewpoint = Viewpoint.of_camera(camera, scene.film)
        pictures.append(pictured(Stage(), in_view(scene), viewpoint))
    assert pictures[0][..., :3].mean() > 0.05
    np.testing.assert_allclose(pictures[1], pictures[0], atol=0.02)
