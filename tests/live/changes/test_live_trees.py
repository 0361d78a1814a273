# SPDX-License-Identifier: GPL-3.0-or-later
"""Search trees that are updated one by one give the picture of a scene that was loaded anew."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.in_place import edits
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.trees import Trees
from spectral_core.scene import Instance, Scene, SunLight, World
from tests.live import test_live_session as session
from tests.live.changes.test_live_programs import _pictured
from tests.live.test_live_session import at, with_light, with_place, with_stretch

scene = session.scene
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Embree's functions have other names there")


@pytest.fixture
def crowded(scene: Scene) -> Scene:
    """The scene with a mesh of two materials, and copies of one mesh with several."""
    meshes = [
        replace(m, material_indices=np.arange(len(m.triangles)).astype(np.uint16) % 2) if m.name == "two" else m
        for m in scene.meshes
    ]
    # the corners at a pole are one point, so that no stretch gives their triangles an area
    meshes = [replace(m, positions=m.positions.round(6)) for m in meshes]
    items = [replace(x, materials=("shiny", "red")) if x.name == "middle" else x for x in scene.instances]
    more = (Instance("small", "one", at(-1, -2, 0.6) @ np.diag([0.4, 0.4, 0.4, 1]), ("red",)),
            Instance("twin", "two", at(1, -2, 0.6) @ np.diag([0.3, 0.3, 0.6, 1]), ("gray", "shiny")))  # fmt: skip
    return replace(scene, meshes=tuple(meshes), instances=(*items, *more))


Edit = Callable[[Scene, np.random.Generator], Scene]
EDITS: dict[str, Edit] = {
    "move": lambda s, rng: with_place(s, str(rng.choice(["left", "middle", "right", "small", "twin"])),
                                      at(*rng.uniform(-2, 2, 2), rng.uniform(0.5, 1.5))),
    "turn": lambda s, rng: with_place(s, "twin", at(1, -2, 1) @ turned(rng)),
    "mesh": lambda s, rng: with_stretch(s, str(rng.choice(["one", "two"])), tuple(rng.uniform(0.8, 1.2, 3))),
    "diagonals": lambda s, rng: with_diagonals(s, str(rng.choice(["one", "two"])), rng),
    "mesh and place": lambda s, rng: EDITS["move"](EDITS["mesh"](s, rng), rng),
    "lamp": lambda s, rng: with_light(s, "key", world_from_light=at(*rng.uniform(-2, 2, 2), 5)),
    "lamp turned": lambda s, rng: with_light(s, "key", world_from_light=at(*rng.uniform(-2, 2, 2), 4) @ turned(rng)),
    "lamp far": lambda s, rng: with_light(s, "key", world_from_light=at(*rng.uniform(15, 25, 2), 9)),
    "lamp size": lambda s, rng: with_light(s, "key", size=tuple(rng.uniform(0.5, 3, 2))),
    "far": lambda s, rng: with_place(s, "small", at(*rng.uniform(20, 40, 2), 2)),
    "shade": lambda s, rng: with_place(s, "twin", at(0, 0, 60) @ np.diag([30.0, 30, 1, 1])),
}  # fmt: skip


def with_diagonals(scene: Scene, name: str, rng: np.random.Generator) -> Scene:
    """Some quadrilaterals of a mesh divided along the other diagonal, as Blender does when a vertex moves."""
    (mesh,) = (each for each in scene.meshes if each.name == name)
    triangles = mesh.triangles.copy()
    half = len(triangles) // 2  # the other triangles of the same quadrilaterals; those at the poles have no area
    for first, second in zip(range(half), range(half, 2 * half), strict=True):
        one, other = triangles[first], triangles[second]
        (own,), (far,) = np.setdiff1d(one, other), np.setdiff1d(other, one)
        corners = mesh.positions[[own, far, *np.intersect1d(one, other)]]
        if rng.random() < 0.5 and len(np.unique(corners.round(4), axis=0)) == 4:
            place = int(np.flatnonzero(one == own)[0])
            left, right = one[(place + 1) % 3], one[(place + 2) % 3]
            triangles[first], triangles[second] = (own, left, far), (own, far, right)
    assert not np.array_equal(triangles, mesh.triangles)
    meshes = tuple(replace(each, triangles=triangles) if each is mesh else each for each in scene.meshes)
    return replace(scene, meshes=meshes)


def turned(rng: np.random.Generator) -> np.ndarray:
    found, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = found * rng.uniform(0.3, 1, 3)  # also mirrored
    return matrix


def test_pictures_after_random_edits_are_those_of_scenes_loaded_anew(
    crowded: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng, stage, all_trees = np.random.default_rng(11), Stage(), []
    monkeypatch.setattr(Trees, "finish", counted(Trees.finish, all_trees))
    now = crowded
    _pictured(stage, now, 1)
    shown = []
    for kind in [*EDITS, *rng.permutation([*EDITS])]:
        now = EDITS[str(kind)](now, rng)
        shown.append((str(kind), now, _pictured(stage, now, 1)))
    assert stage.launcher.recordings == 1
    for kind, scene, picture in shown:
        np.testing.assert_allclose(picture, _pictured(Stage(), scene, 1), atol=1e-4, err_msg=kind)
    assert stage.loads == 1
    assert len(all_trees) >= 10
    assert all(all_trees)


@pytest.mark.parametrize("kind", ["lamp", "lamp turned", "lamp far", "lamp size", "move", "mesh", "diagonals"])
def test_an_edit_builds_no_other_tree_anew(kind: str, crowded: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    finish, complete = edits.Edit.finish, []

    def finished(edit: edits.Edit) -> None:
        complete.append(edit._moved)
        finish(edit)

    stage = Stage()
    _pictured(stage, crowded, 1)
    monkeypatch.setattr(edits.Edit, "finish", finished)
    stage.show(EDITS[kind](crowded, np.random.default_rng(9)))
    assert stage.loads == 1
    assert complete == [False]


def counted(finish: Callable[[Trees], bool], told: list[bool]) -> Callable[[Trees], bool]:
    def finished(trees: Trees) -> bool:
        told.append(finish(trees))
        return told[-1]

    return finished


def test_without_its_trees_mitsuba_builds_all(crowded: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    monkeypatch.setattr(Trees, "of", lambda *_: None)
    stage = Stage()
    _pictured(stage, crowded, 1)
    now = EDITS["diagonals"](EDITS["mesh and place"](crowded, rng), rng)
    np.testing.assert_allclose(_pictured(stage, now, 1), _pictured(Stage(), now, 1), atol=1e-4)
    assert stage.loads == 1


@pytest.mark.parametrize("has_world", [True, False])
def test_a_sun_of_one_direction_is_shaded_by_what_has_left_the_scene(
    crowded: Scene, has_world: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its shadow rays ended where the loaded scene did: an object beyond that had no shadow."""
    sun = SunLight(name="sun", world_from_light=np.eye(4), irradiance=3.0, angle_rad=0.0)
    lit = replace(crowded, lights=(sun,), world=crowded.world if has_world else World())
    shaded = EDITS["shade"](lit, np.random.default_rng(1))
    tilted = with_light(shaded, "sun", world_from_light=tilt(0.1))
    scenes = (lit, shaded, tilted, lit)
    anew = [_pictured(Stage(), each, 1) for each in scenes[:3]]
    for has_trees in (True, False):
        if not has_trees:
            monkeypatch.setattr(Trees, "of", lambda *_: None)
        stage = Stage()
        pictures = [_pictured(stage, each, 1) for each in scenes]
        assert stage.loads == 1
        assert stage.launcher.recordings == 1 or not has_trees
        for true, picture in zip((*anew, anew[0]), pictures, strict=True):
            np.testing.assert_allclose(picture, true, atol=1e-4)
        assert pictures[1].mean() < 0.7 * pictures[0].mean()


def tilt(angle: float) -> np.ndarray:
    """A rotation around the axis of y."""
    matrix = np.eye(4)
    matrix[:3:2, :3:2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    return matrix


def test_handles_that_are_not_certain_are_refused(crowded: Scene) -> None:
    """As after another version of Mitsuba has ordered its numbers otherwise."""
    stage = Stage()
    stage.show(crowded)
    loaded = stage._job.loaded.scene.scene  # type: ignore[union-attr]
    assert Trees.of(loaded, stage._spare[0]) is not None

    class Other:
        def shapes(self) -> list[object]:
            return []

        def _traverse_1_cb_ro(self, hear: Callable[..., None]) -> None:
            found: list[int] = []
            loaded._traverse_1_cb_ro(lambda index, *_: found.append(index))
            for index in (found[1], found[0], found[2]):
                hear(index, "", "")

    assert Trees.of(Other(), stage._spare[0]) is None
