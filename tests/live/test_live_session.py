# SPDX-License-Identifier: GPL-3.0-or-later
"""A live view after each type of edit equals a new render of the changed scene, sample for sample."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import plan_effects
from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.messages import Shown
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import (
    Aperture,
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Film,
    Glass,
    Instance,
    Material,
    Mesh,
    Panorama,
    PointLight,
    Principled,
    RenderSettings,
    Scene,
    World,
    gray,
)

WIDTH, HEIGHT, SAMPLES = 50, 30, 4
PATIENCE_S = 120.0


def at(*place: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return matrix


def ball(name: str, rows: int = 8) -> Mesh:
    polar, turn = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.arange(2 * rows) * np.pi / rows, indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], -1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(rows), np.arange(2 * rows), indexing="ij")
    a, b = row * 2 * rows + column, row * 2 * rows + (column + 1) % (2 * rows)
    c, d = a + 2 * rows, b + 2 * rows
    triangles = np.concatenate([np.stack([a, c, d], -1).reshape(-1, 3), np.stack([a, d, b], -1).reshape(-1, 3)])
    return Mesh(name, points.astype(np.float32), triangles.astype(np.uint32), normals=points.astype(np.float32))


@pytest.fixture(scope="module")
def scene() -> Scene:
    corners = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], np.float32)
    tilt = np.radians(70)
    camera = at(0, -9, 4)
    camera[:3, :3] = [[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]]
    surfaces = {
        "gray": Diffuse(gray(0.5)),
        "red": Diffuse(Color([0.7, 0.2, 0.1])),
        "shiny": Principled(Color([0.2, 0.5, 0.7]), roughness=0.3),
        "glass": Glass(gray(0.9), 0.0),
    }
    return Scene(
        camera=Camera(world_from_camera=camera),
        film=Film(WIDTH, HEIGHT, samples=SAMPLES, seed=3),
        meshes=(Mesh("floor", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)), ball("one"), ball("two")),
        materials=tuple(Material(name, surface) for name, surface in surfaces.items()),
        instances=(
            Instance("floor", "floor", np.eye(4), ("gray",)),
            Instance("left", "one", at(-2, 0, 1), ("red",)),
            Instance("middle", "two", at(0, 0, 1), ("shiny",)),
            Instance("right", "one", at(2, 0, 1), ("glass",)),
        ),
        lights=(
            AreaLight(name="key", world_from_light=at(0, -2, 5), power_w=300.0, size=(2.0, 2.0)),
            PointLight(name="fill", world_from_light=at(-3, -3, 4), power_w=100.0, radius=0.0),
        ),
        world=World(gray(0.2), 1.0),
        settings=RenderSettings(transport="rgb"),
    )


def with_surface(scene: Scene, name: str, **numbers: object) -> Scene:
    materials = [replace(m, surface=replace(m.surface, **numbers)) if m.name == name else m for m in scene.materials]
    return replace(scene, materials=tuple(materials))


def with_light(scene: Scene, name: str, **numbers: object) -> Scene:
    return replace(scene, lights=tuple(replace(x, **numbers) if x.name == name else x for x in scene.lights))


def with_place(scene: Scene, name: str, matrix: np.ndarray) -> Scene:
    moved = (replace(x, world_from_object=matrix) if x.name == name else x for x in scene.instances)
    return replace(scene, instances=tuple(moved))


def with_stretch(scene: Scene, name: str, factors: tuple[float, float, float]) -> Scene:
    made = (
        replace(m, positions=m.positions * np.array(factors, np.float32)) if m.name == name else m for m in scene.meshes
    )
    return replace(scene, meshes=tuple(made))


def flipped(matrix: np.ndarray) -> np.ndarray:
    return matrix @ np.diag([1.0, -0.7, 1.3, 1.0])


EDITS = {
    "the same": lambda s: s,
    "diffuse color": lambda s: with_surface(s, "red", color=Color([0.1, 0.7, 0.2])),
    "roughness": lambda s: with_surface(s, "shiny", roughness=0.55),
    "index of refraction": lambda s: with_surface(s, "glass", ior=1.3),
    "another closure": lambda s: replace(
        s, materials=tuple(Material("red", Principled(gray(0.4))) if m.name == "red" else m for m in s.materials)
    ),
    "power": lambda s: with_light(s, "key", power_w=500.0),
    "lamp color": lambda s: with_light(s, "key", color=Color([1.0, 0.6, 0.3])),
    "lamp moved": lambda s: with_light(s, "key", world_from_light=at(2, -3, 4)),
    "lamp size": lambda s: with_light(s, "key", size=(1.0, 0.5)),
    "point moved": lambda s: with_light(s, "fill", world_from_light=at(3, -4, 3)),
    "world": lambda s: replace(s, world=World(Color([0.1, 0.3, 0.6]), 2.0)),
    "moved": lambda s: with_place(s, "left", at(-1, -2, 1.5)),
    "mesh": lambda s: with_stretch(s, "two", (1.0, 1.0, 1.6)),
    "deleted": lambda s: replace(s, instances=tuple(x for x in s.instances if x.name != "right")),
    "renamed": lambda s: replace(
        s, instances=tuple(replace(x, name="new name") if x.name == "left" else x for x in s.instances)
    ),
    "lamp off": lambda s: with_light(s, "fill", power_w=0.0),
    "lamp gone": lambda s: replace(s, lights=s.lights[:1]),
    "dark world": lambda s: replace(s, world=World()),
    "orthographic": lambda s: replace(s, camera=replace(s.camera, kind="orthographic", orthographic_scale=8.0)),
    "shifted and out of focus": lambda s: replace(
        s, camera=replace(s.camera, shift=(0.1, -0.05), aperture_radius=0.2, focus_distance=8.0)
    ),
    "blades": lambda s: replace(s, camera=replace(s.camera, aperture=Aperture(5, 0.3, 1.5))),
    "panorama": lambda s: replace(
        s, camera=replace(s.camera, kind="panoramic", panorama=Panorama("equirectangular", (-1.2, 1.4, -0.8, 0.6)))
    ),
    "fisheye": lambda s: replace(
        s, camera=replace(s.camera, aperture_radius=0.0, panorama=Panorama("fisheye_equidistant", (2.6,)))
    ),
    "perspective again": lambda s: replace(s, camera=replace(s.camera, kind="perspective", panorama=None)),
    "mirrored": lambda s: with_place(s, "new name", flipped(at(-1, -2, 1.5))),
}
IN_PLACE = {
    "diffuse color", "roughness", "power", "lamp color", "lamp moved", "lamp size", "point moved", "world", "moved",
    "mirrored", "mesh",
}  # fmt: skip
OTHER_DRAWS = {"mirrored"}
"""An instance keeps the order of triangles that a flat mesh reverses: the same light, other random numbers."""


class Looker:
    """One view of one stage."""

    def __init__(self, link: LiveLink) -> None:
        self.link, self.told = link, threading.Event()

    def settled(self, scene: Scene, view: str = "view", stage: str = "stage") -> np.ndarray:
        """The full picture of ``scene`` after all its samples."""
        self.link.show(stage, scene)
        seen = Viewpoint.of_camera(scene.camera, scene.film)
        request = ViewRequest(stage, seen, WIDTH, HEIGHT, SAMPLES, 0)
        return self.picture_of(self.link.look(view, request, self.told.set), view).pixels

    def picture_of(self, generation: int, view: str = "view") -> Shown:
        """The finished picture of a request."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            self.link.wait(view, generation, 1.0)
            shown = self.link.latest(view)
            if shown is not None and shown.frame.is_done and shown.frame.generation == generation:
                self.how = shown.frame.how
                return shown
            self.told.wait(0.05)
            self.told.clear()
        raise AssertionError(f"the view never settled: {self.link.trouble(view)}")


@pytest.fixture(scope="module")
def looker() -> Iterator[Looker]:
    link = LiveLink()
    yield Looker(link)
    link.close()


def fresh(scene: Scene) -> np.ndarray:
    """The picture of a scene of the same type with Mitsuba's emitters as lamps: equal seeds give equal paths."""
    job = RenderJob(scene, plan_effects(scene, pilot=False), Measure(movable=True))
    job.trace(scene.film.samples)
    return job.picture()


@pytest.mark.slow
@pytest.mark.timeout(1200)  # 22 new renders, each of which may compile: minutes on a machine with other work
def test_the_view_after_each_edit_equals_a_new_render(looker: Looker, scene: Scene) -> None:
    # in sequence, so that leftovers of an edit would be visible in the next
    wrong, reloaded = {}, set()
    for name, edit in EDITS.items():
        scene = edit(scene)
        error = looker.settled(scene) - fresh(scene)
        amount = abs(error.mean()) / 30 if name in OTHER_DRAWS else np.abs(error).mean()
        if amount > 1e-4:
            wrong[name] = float(amount)
        if looker.how == "loaded":
            reloaded.add(name)
    assert wrong == {}
    assert sorted(reloaded & IN_PLACE) == [], "these were loaded as a whole again"
    assert looker.link.sent_scenes == 1, "all but the first scene went as changes"


def test_an_edit_in_place_and_a_killed_process(looker: Looker, scene: Scene) -> None:
    looker.settled(scene)
    brighter = with_surface(scene, "red", color=Color([0.1, 0.7, 0.2]))
    before = looker.settled(brighter)
    process = looker.link.process_id
    assert process is not None
    os.kill(process, signal.SIGKILL)
    moved = with_place(brighter, "left", at(-1, -1, 1))
    picture = looker.settled(moved)
    assert looker.link.process_id not in (None, process)
    assert np.abs(picture - before).mean() > 1e-3
    assert np.abs(picture - fresh(moved)).mean() < 1e-4


def test_a_scene_that_cannot_be_rendered_gives_a_reason_and_the_next_one_is_shown(looker: Looker, scene: Scene) -> None:
    looker.settled(scene)
    wrong = replace(scene, settings=replace(scene.settings, overrides=(("bounces", "many"),)))
    looker.link.show("stage", wrong)
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, SAMPLES, 0)
    generation = looker.link.look("view", request, looker.told.set)
    assert not looker.link.wait("view", generation, PATIENCE_S)
    assert "bounces" in looker.link.trouble("view")
    assert np.abs(looker.settled(scene) - fresh(scene)).mean() < 1e-4


def test_a_border_shows_its_part_of_the_picture(looker: Looker, scene: Scene) -> None:
    whole = looker.settled(scene)
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    request = ViewRequest("stage", viewpoint, WIDTH, HEIGHT, SAMPLES, 0, border=(11, 3, 21, 14))
    generation = looker.link.look("view", request, looker.told.set)
    shown = looker.picture_of(generation)
    assert shown.frame.corner == (11, 3)
    np.testing.assert_allclose(shown.pixels, whole[3:17, 11:32], atol=1e-5)


def test_a_paused_view_keeps_its_picture_through_an_edit(looker: Looker, scene: Scene) -> None:
    link = looker.link
    link.show("stage", scene)
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 1 << 16, 0)
    generation = link.look("view", request, looker.told.set)
    assert link.wait("view", generation, PATIENCE_S, level=1)
    link.pause("view", is_paused=True)
    before, kept = None, link.latest("view")
    while kept is not before:  # the launch in progress ends, later on a busy machine
        time.sleep(2.0)
        before, kept = kept, link.latest("view")
    link.show("stage", with_surface(scene, "red", color=Color([0.1, 0.9, 0.1])))
    time.sleep(1.0)
    assert kept is not None and link.latest("view") is kept
    link.pause("view", is_paused=False)
    end = time.monotonic() + PATIENCE_S
    while (shown := link.latest("view")) is None or shown is kept or shown.frame.level > 1:
        assert time.monotonic() < end, "it was not resumed"
        time.sleep(0.01)
    assert np.abs(shown.pixels - kept.pixels).mean() > 1e-3
    assert np.abs(looker.settled(scene) - fresh(scene)).mean() < 1e-4
