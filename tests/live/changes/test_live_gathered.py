# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattered copies of a mesh are one mesh in a view, and look the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live import gathered
from spectral_core.render.live.gathered import Gathered
from spectral_core.render.live.messages import LOADED
from spectral_core.render.live.stage import Stage
from spectral_core.scene import (
    Computed,
    Diffuse,
    Emission,
    Instance,
    Material,
    Mesh,
    Principled,
    Rays,
    ScatteringMedium,
    Scene,
    gray,
)
from spectral_core.scene.geometry import Attribute
from spectral_core.scene.shading import Builder
from tests.live import test_live_session as session
from tests.live.changes.test_live_programs import _pictured

scene = session.scene
COUNT = 81


def program(*steps: tuple) -> Computed:
    build = Builder()
    for step in steps:
        last = build.add(*step)
    return Computed(build.program(last))


@pytest.fixture
def scattered(scene: Scene) -> Scene:
    """81 leaning tetrahedra of two materials, one of which shows generated coordinates, above the scene's objects."""
    corners = 0.12 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], np.float32)
    mesh = Mesh(
        "seed", corners, np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)], np.uint32),
        corners / np.linalg.norm(corners, axis=1, keepdims=True), corners[:, :2] + 0.5,
        material_indices=np.array([0, 0, 1, 1], np.uint16),
        attributes=(Attribute("generated", (corners / 0.24 + 0.5).astype(np.float32)),),
    )  # fmt: skip
    colored = Diffuse(program(("vector_input", (), "generated", 0)))
    materials = (Material("leaf", Principled(gray(0.6), roughness=0.4)), Material("petal", colored))
    rng, items = np.random.default_rng(5), []
    for number in range(COUNT):
        turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        matrix = np.eye(4)
        matrix[:3, :3] = turned * np.sign(np.linalg.det(turned)) * rng.uniform(0.5, 1.5, 3)
        matrix[:3, 3] = number % 9 / 3 - 1.3, number // 9 / 3 - 1.3, rng.uniform(0.2, 1.4)
        items.append(Instance(f"leaf {number}", "seed", matrix, ("leaf", "petal"), random=rng.uniform()))
    return replace(
        scene,
        meshes=(*scene.meshes, mesh), materials=(*scene.materials, *materials), instances=(*scene.instances, *items),
    )  # fmt: skip


def changed(scene: Scene, **fields: object) -> Scene:
    """The scene with other fields of all copies."""
    items = [replace(item, **fields) if item.mesh == "seed" else item for item in scene.instances]
    return replace(scene, instances=tuple(items))


def surfaced(scene: Scene, **fields: object) -> Scene:
    """The scene with another material of the copies."""
    found = tuple(replace(m, **fields) if m.name == "leaf" else m for m in scene.materials)
    return replace(scene, materials=found)


def test_the_picture_is_that_of_single_copies(scattered: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    one = _pictured(Stage(), scattered, 8)
    assert len(Gathered().of(scattered).instances) == len(scattered.instances) - COUNT + 1
    monkeypatch.setattr(gathered, "FEWEST", COUNT + 1)
    assert Gathered().of(scattered) is scattered
    many = _pictured(Stage(), scattered, 8)
    # the same random numbers: only rays that graze an edge end elsewhere
    assert np.abs(one - many).mean() < 3e-3 * many.mean()


def test_edits_are_made_in_place(scattered: Scene) -> None:
    """A number, and all copies moved; fewer copies load the scene again."""
    stage = Stage()
    _pictured(stage, scattered, 1)
    edited = surfaced(scattered, surface=Principled(gray(0.2), roughness=0.7))
    np.testing.assert_allclose(_pictured(stage, edited, 2), _pictured(Stage(), edited, 2), atol=1e-4)
    assert stage.loads == 1
    lifted = [
        replace(item, world_from_object=item.world_from_object + _up()) if item.mesh == "seed" else item
        for item in edited.instances
    ]
    moved = replace(edited, instances=tuple(lifted))
    np.testing.assert_allclose(_pictured(stage, moved, 2), _pictured(Stage(), moved, 2), atol=1e-4)
    assert stage.loads == 1
    fewer = replace(moved, instances=moved.instances[:-1])
    np.testing.assert_allclose(_pictured(stage, fewer, 2), _pictured(Stage(), fewer, 2), atol=1e-4)
    assert stage.how == LOADED


def _up() -> np.ndarray:
    matrix = np.zeros((4, 4))
    matrix[2, 3] = 0.2
    return matrix


def test_equal_copies_stay_the_same_mesh(scattered: Scene) -> None:
    made = Gathered()
    first, second = made.of(scattered), made.of(replace(scattered, instances=tuple(scattered.instances)))
    assert first.meshes[-1] is second.meshes[-1]
    assert first.instances[-1] is second.instances[-1]


OBJECT = program(("number_input", (), "object_random", 0))
APART = {
    "reads its object": lambda scene: surfaced(scene, surface=Diffuse(OBJECT)),
    "glows": lambda scene: surfaced(scene, surface=Emission(gray(1.0), 2.0)),
    "is filled": lambda scene: surfaced(scene, medium=ScatteringMedium(1.0, gray(0.5))),
    "scatters below": lambda scene: surfaced(scene, surface=Principled(gray(0.5), subsurface_weight=0.5)),
    "is mirrored": lambda scene: changed(scene, world_from_object=np.diag([-1.0, 1, 1, 1])),
    "is flat": lambda scene: changed(scene, world_from_object=np.diag([1.0, 1, 0, 1])),
    "has no material": lambda scene: changed(scene, materials=()),
}  # fmt: skip


@pytest.mark.parametrize("kind", APART)
def test_copies_that_depend_on_their_object_stay_apart(scattered: Scene, kind: str) -> None:
    seen = APART[kind](scattered)
    assert Gathered().of(seen) is seen


def test_copies_that_rays_treat_differently_become_two_meshes(
    scattered: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gathered, "FEWEST", 20)
    items = [
        replace(item, hidden_from=Rays.CAMERA) if item.name.endswith(("1", "3", "5")) else item
        for item in scattered.instances
    ]
    found = Gathered().of(replace(scattered, instances=tuple(items))).instances
    assert sorted(item.hidden_from for item in found[-2:]) == [Rays.NONE, Rays.CAMERA]


def test_a_mirrored_copy_stays_apart_from_the_others(scattered: Scene) -> None:
    """One of them kept thousands from being gathered."""
    items = list(scattered.instances)
    items[-1] = replace(items[-1], world_from_object=items[-1].world_from_object @ np.diag([-1.0, 1, 1, 1]))
    found = Gathered().of(replace(scattered, instances=tuple(items))).instances
    assert len(found) == len(items) - COUNT + 2
    assert items[-1] in found


def test_too_many_triangles_stay_apart(scattered: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gathered, "MOST_TRIANGLES", 4 * COUNT - 1)
    assert Gathered().of(scattered) is scattered
