# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes far from the origin and very small ones: equal pictures, and programs that see the scene as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.mitsuba_scene.units import at_origin, in_working_units, moved
from spectral_core.scene import (
    AreaLight,
    Camera,
    Computed,
    Diffuse,
    Film,
    Instance,
    Material,
    Moment,
    Passes,
    RenderSettings,
    Scene,
    Subsurface,
    VolumeObject,
    World,
    gray,
)
from spectral_core.scene.motion import MovedVolume
from spectral_core.scene.shading.moved import Units, in_units
from spectral_core.scene.shading.program import Builder
from tests.render.scenes import matrix, plane, sphere_mesh

FACTOR, SHIFT = 250.0, (1200.0, -700.0, 33.0)


def _operations(builder: Builder) -> dict[str, int]:
    """Every kind of result that depends on where the scene is and how large it is."""
    position, radius = builder.add("vector_input", (), "position", 0), builder.number(0.03)
    normal = builder.add("vector_input", (), "normal", 0)
    made = {
        "position": position,
        "location": builder.add("vector_input", (), "object_location", 0),
        "length": builder.add("number_input", (), "ray:Ray Length", 0),
        "step": builder.add("vector_input", (), "step_x", 0),
        "occlusion": builder.add("occlusion", (normal, radius), 4, False, False),
        "bevel": builder.add("bevel", (normal, radius), 4),
        "wireframe": builder.add("wireframe", (radius,), False),
        "pixels": builder.add("wireframe", (radius,), True),
    }
    spaces = ("WORLD", "OBJECT", "CAMERA")
    for kind in ("POINT", "VECTOR"):
        for source in spaces:
            for target in spaces:
                made[f"{kind} {source} {target}"] = builder.add("transformed", (position,), kind, source, target)
    doubled = builder.add("vector_math", (position, position, position, radius), "ADD")
    made["computed point"] = builder.add("transformed", (doubled,), "POINT", "WORLD", "OBJECT")
    return made


class _World:
    """A hit point as the renderer sees it: each point without ``shift``, times ``factor``."""

    def __init__(self, factor: float, shift: np.ndarray) -> None:
        self.factor, self.shift = factor, shift
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        self.spaces = {"OBJECT": self._placed(2.0 * turn, (5.0, 1, 2)), "CAMERA": self._placed(turn.T, (0.5, 7, 3))}
        self.spaces["CAMERA"][:3, :3] /= factor  # a camera's axes have no length

    def _placed(self, axes: np.ndarray, place: tuple[float, float, float]) -> np.ndarray:
        """World from another space."""
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = self.factor * axes, self.factor * (np.array(place) - self.shift)
        return result

    def read(self, name: str, _: int):
        if name in ("position", "object_location"):
            return tuple(self.factor * (np.array((4.0, 2.5, -1)) + (name != "position") - self.shift))
        if name in ("step_x", "ray:Ray Length"):
            lengths = self.factor * np.array((0.01, 0.02, -0.01))
            return tuple(lengths) if name == "step_x" else np.array(self.factor * 8.5)
        return 0.0, 0.0, 1.0

    def transform(self, vector, kind: str, space: str, inverse: bool):
        rows = self.spaces[space] if inverse else np.linalg.inv(self.spaces[space])
        made = [sum(rows[i, j] * vector[j] for j in range(3)) for i in range(3)]
        return tuple(part + rows[i, 3] * (kind == "POINT") for i, part in enumerate(made))

    def value(self, program, monkeypatch):
        from spectral_core.scene.shading.numpy_backend import NumPy

        factor = self.factor
        monkeypatch.setattr(NumPy, "open_share", lambda _, n, d, *__: d / factor, raising=False)
        monkeypatch.setattr(
            NumPy, "rounded", lambda _, n, r, *__: tuple(part * r / factor for part in n), raising=False
        )
        monkeypatch.setattr(NumPy, "edge_distance", lambda _, px: 0.014 * (1 if px else factor), raising=False)
        return program.evaluate(self.read, transform=self.transform)


@pytest.mark.parametrize("units", [Units(FACTOR), Units(shift=SHIFT), Units(FACTOR, SHIFT)])
def test_programs_see_points_and_lengths_of_the_scene(units, monkeypatch):
    builder = Builder()
    scene, own = _World(1.0, np.zeros(3)), _World(units.factor, np.array(units.shift))
    for name, register in _operations(builder).items():
        program = builder.program(register)
        expected = scene.value(program, monkeypatch)
        found = own.value(in_units(program, units), monkeypatch)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-7, err_msg=name)
    point = in_units(builder.program(0), units, "point")
    np.testing.assert_allclose(own.value(point, monkeypatch)[0], own.read("position", 0), rtol=1e-9, atol=1e-9)


def _still(place=(0.0, 0.0, 0.0), scale=1.0, surface=None) -> Scene:
    """A ball on a floor below a panel, seen from above at an angle."""
    camera = np.eye(4)
    camera[:3, :3] = [[1, 0, 0], [0, 0.6, -0.8], [0, 0.8, 0.6]]
    camera[:3, 3] = np.array((0.0, -4.0, 3.3)) * scale + place
    at = [matrix(tuple(np.array(p) * scale + place), scale) for p in ((0, 0, 0), (0, 0, 0.5), (1.0, -1.0, 3))]
    at[1][:3, :3] *= 0.5
    lamp = np.eye(4)
    lamp[:3, 3] = at[2][:3, 3]
    light = AreaLight(name="panel", world_from_light=lamp, power_w=100 * scale**2, size=(0.5 * scale,) * 2)
    return Scene(
        camera=Camera(world_from_camera=camera, field_of_view_rad=0.6, near=0.1 * scale, far=100 * scale),
        film=Film(24, 24, samples=64),
        meshes=(plane(2.0), sphere_mesh()),
        materials=(Material("paper", Diffuse(gray(0.7))), Material("ball", surface or Diffuse(gray(0.5)))),
        instances=(Instance("floor", "plane", at[0], ("paper",)), Instance("ball", "sphere", at[1], ("ball",))),
        lights=(light,),
        world=World(gray(0.3)),
    )


def _checks(place, scale) -> Diffuse:
    """A color that alternates along a point of the world, in cells of 0.4 of the scene's own units."""
    builder = Builder()
    position = builder.add("vector_input", (), "position", 0)
    minus, cell = builder.number(np.array(place)), builder.number(np.full(3, 1 / (0.4 * scale)))
    own = builder.add("vector_math", (position, minus, minus, builder.number(0.0)), "SUBTRACT")
    own = builder.add("vector_math", (own, cell, cell, builder.number(0.0)), "MULTIPLY")
    return Diffuse(
        Computed(builder.program(builder.add("vector_math", (own, own, own, builder.number(0.0)), "FRACTION")))
    )


@pytest.mark.parametrize(
    ("place", "scale"),
    [((1000.0, -1000, 500), 1.0), ((3e4, 1e4, -2e4), 1.0), ((0.0, 0, 0), 2e-3), ((300.0, 0, 0), 0.01)],
)
def test_a_picture_depends_neither_on_place_nor_on_size(place, scale):
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    from spectral_core.render import render_scene

    expected = render_scene(_still(surface=_checks((0, 0, 0), 1.0))).pixels
    found = render_scene(_still(place, scale, _checks(place, scale))).pixels
    blocks = [picture.reshape(6, 4, 6, 4, 4).mean((1, 3)) for picture in (expected, found)]
    np.testing.assert_allclose(blocks[1], blocks[0], rtol=0.02, atol=0.005)


def test_volumes_that_move_are_brought_to_the_origin_with_the_scene():
    place = matrix((1000.0, 0, 0), 1.0)
    volume = VolumeObject("smoke", np.zeros((2, 2, 2)), place, None)
    moment = Moment(Camera(world_from_camera=place), volumes=(MovedVolume("smoke", place),))
    scene = moved(replace(_still((1000.0, 0, 0)), volumes=(volume,), moments=(moment,)), np.array((1000.0, 0, 0)))
    for each in (scene, scene.at(scene.moments[0])):
        np.testing.assert_array_equal(each.volumes[0].world_from_index, np.eye(4))


def test_subsurface_light_reaches_equally_far_in_a_small_scene():
    scene = _still(scale=1e-3, surface=Subsurface(radius=(0.3e-3, 0.2e-3, 0.1e-3), scale=0.5))
    made = in_working_units(scene, 1e-3).materials[1].surface
    np.testing.assert_allclose(made.radius, (0.3, 0.2, 0.1), rtol=1e-9)


def test_a_scene_stays_where_its_objects_are_spread_about_the_origin():
    for place in ((0.0, 0, 0), (3.0, 2, 0)):
        assert not at_origin(_still(place))[1].any()
    wide = _still()
    far = Instance("hill", "sphere", matrix((900.0, 0, 0), 30.0), ("ball",))
    assert not at_origin(replace(wide, instances=(*wide.instances, far)))[1].any()


def test_a_scene_beyond_32_bits_has_a_note_and_positions_are_those_of_the_scene():
    pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
    from spectral_core.render import render_scene

    assert any("32-bit" in note.message for note in at_origin(_still((4e6, 0, 0)))[0].notes)
    place = (2000.0, 100, 0)
    settings = RenderSettings(passes=Passes(("Position",)))
    made = render_scene(replace(_still(place), settings=settings, film=Film(8, 8, samples=4)))
    assert not any("32-bit" in note.message for note in made.notes)
    seen = made.passes["Position"].reshape(-1, 3)
    hit = seen[(seen != 0).any(axis=1)]
    assert len(hit) > 20 and np.abs(hit - place).max() < 4.0
