# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes at edges, at and behind holdouts, and behind media, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from benchmarks.render.cases.meshes import at, box, square
from spectral_core.render.passes.cryptomatte import id_of
from spectral_core.render.still import render_scene
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Film,
    Glass,
    Holdout,
    Instance,
    Material,
    MixSurface,
    Passes,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    Transparent,
    gray,
)

SUN = SunLight(name="sun", world_from_light=np.eye(4), irradiance=np.pi, angle_rad=0.0)
"""It shines along the camera's view."""


def _render(materials, instances, names, *, size=24, samples=32, aovs=()):
    wanted = Passes(names, aovs=aovs)
    scene = Scene(
        camera=Camera(world_from_camera=np.eye(4), field_of_view_rad=0.8),
        film=Film(size, size, samples),
        meshes=(square(), box()),
        materials=materials,
        instances=instances,
        lights=(SUN,),
        settings=RenderSettings(transport="rgb", passes=wanted),
    )
    return render_scene(scene).passes


@pytest.mark.parametrize(
    "surface", [Diffuse(Color([0.5, 0.1, 0.02])), MixSurface(0.9, Diffuse(Color([0.5, 0.1, 0.02])), Glass())]
)
def test_light_without_its_color_is_even_up_to_the_edge_of_a_surface(surface):
    """A surface of any color under the sun has the same light, also in pixels that one ray in a hundred meets."""
    wall = Instance("wall", "square", at(0.07, 0.03, -5, 0.9, ("z", 31)), ("paint",))
    made = _render((Material("paint", surface),), (wall,), ("Diffuse Direct",))
    light = made["Diffuse Direct"]
    covered = light[light > 0]
    assert 0.2 < (light > 0).mean() < 0.8
    np.testing.assert_allclose(np.median(covered), 1.0, rtol=0.02)
    # each ray counts about equally, so that a pixel of few rays is off by less than a factor of four
    assert covered.max() < 4.0


HALF = MixSurface(0.5, Transparent(), Diffuse(gray(0.5)))
NAMES = ("Depth", "Object Index", "Normal", "CryptoObject", "Diffuse Color")


def _behind(veil, *, is_holdout):
    """Passes of the middle pixel of a wall behind a veil."""
    materials = Material("paint", Diffuse(gray(0.5))), Material("veil", veil, outputs=(("mark", 0.75),))
    instances = (
        Instance("wall", "square", at(0, 0, -6, 9.0), ("paint",), index=2),
        Instance("veil", "square", at(0, 0, -4, 9.0), ("veil",), index=7, is_holdout=is_holdout),
    )
    found = _render(materials, instances, NAMES, size=5, samples=16, aovs=(("mark", "VALUE"),))
    return {name: picture[2, 2] for name, picture in found.items()}


def _coverage(found, name):
    shown = found["CryptoObject00"]
    return sum(shown[k + 1] for k in (0, 2) if shown[k] == id_of(name) and shown[k + 1] > 0)


@pytest.mark.parametrize(("veil", "is_holdout"), [(HALF, True), (MixSurface(0.5, Transparent(), Holdout()), False)])
def test_a_holdout_that_is_transparent_in_part_has_data_and_so_has_what_is_behind(veil, is_holdout):
    found = _behind(veil, is_holdout=is_holdout)
    np.testing.assert_allclose(found["Depth"], 4.0, rtol=1e-4)
    assert found["Object Index"] == 7
    np.testing.assert_allclose([_coverage(found, name) for name in ("veil", "wall")], 0.5, atol=0.01)
    np.testing.assert_allclose(found["Diffuse Color"], 0.25, atol=0.01)
    np.testing.assert_allclose(found["mark"], 0.75, atol=0.01)


@pytest.mark.parametrize(("veil", "is_holdout"), [(Diffuse(gray(0.5)), True), (Holdout(), False)])
def test_a_whole_holdout_has_no_data_but_aovs(veil, is_holdout):
    found = _behind(veil, is_holdout=is_holdout)
    assert found["Depth"] == np.float32(1e10)
    assert found["Object Index"] == 0
    assert not found["Normal"].any()
    assert not found["CryptoObject00"].any()
    np.testing.assert_allclose(found["mark"], 0.75, atol=0.01)


def test_surfaces_in_fog_count_by_the_light_that_passes_it():
    fog = ScatteringMedium(0.5, gray(0.2))
    materials = Material("paint", Diffuse(gray(0.5))), Material("fog", None, medium=fog)
    instances = (
        Instance("wall", "square", at(0, 0, -6, 9.0), ("paint",)),
        Instance("fog", "box", at(0, 0, -4, 1.0), ("fog",)),
    )
    found = _render(materials, instances, ("Diffuse Color", "Normal", "CryptoObject"), size=5, samples=16)
    middle = {name: picture[2, 2] for name, picture in found.items()}
    thickness = float(np.ptp(box().positions[:, 2]))
    passes = np.exp(-0.5 * thickness)
    np.testing.assert_allclose(middle["Diffuse Color"], 0.5 * passes, rtol=0.03)
    np.testing.assert_allclose(middle["Normal"], (0, 0, passes), atol=0.03)
    np.testing.assert_allclose(_coverage(middle, "wall"), passes, rtol=0.03)
