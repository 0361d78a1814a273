# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan's bounds count light that is reflected often: closed rooms, panes in a row, corners, and thin haze."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spectral_core.render.plan.bounds import error_of_share
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.render.plan.errors.spectral import rgb_transport_error
from spectral_core.render.plan.light.reflections import direct_radiance, is_linear, ways_of_light
from spectral_core.scene import (
    AreaLight,
    Color,
    Diffuse,
    Glass,
    Material,
    Metal,
    PointLight,
    Principled,
    ScatteringMedium,
    SunLight,
    Surface,
    gray,
)
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, linear_rgb_from_xyz
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid
from tests.render.scenes import lit_plane, matrix, plane

NM = np.arange(380.0, 781.0, 5.0)
LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 2)), power_w=10.0)


def _paint(values: Any) -> Reflectance:
    return Reflectance("paint", SpectralGrid(NM), np.clip(values, 0.0, 1.0))


def _seen(values: Any) -> Any:
    """Linear sRGB under equal energy, white at 1: a Riemann sum, on its own."""
    viewer = observer("cie_1931_2deg")
    cmfs = np.stack([np.interp(NM, viewer.wavelengths_nm, row) for row in viewer.cmfs])
    white = linear_rgb_from_xyz(cmfs.sum(axis=1))
    return linear_rgb_from_xyz(cmfs @ values) / white


def _error(spectral: Any, rgb: Any) -> float:
    """At the exposure of white."""
    scale = 1.0 / max(1.0, float(np.max(rgb)))
    pair = (lab_from_linear_rgb(np.maximum(scale * each, 0.0)) for each in (spectral, rgb))
    return float(delta_e_2000(*pair))


def test_white_paint_in_a_closed_room_differs_more_than_after_two_reflections() -> None:
    """Titanium white absorbs violet: its room differed by ΔE 3 from spectra, stated as 0.2."""
    values = 0.9 - 0.4 * np.exp(-(((NM - 380) / 35) ** 2))
    inside = _error(_seen(values / (1 - values)), _seen(values) / (1 - _seen(values)))
    assert 2.0 < inside < rgb_transport_error(lit_plane(LAMP, surface=Diffuse(_paint(values))))
    twice = rgb_transport_error(lit_plane(LAMP, surface=Diffuse(_paint(values))), 2)
    assert twice < 0.5 < inside


def test_eight_pale_panes_in_a_row_differ_more_than_one() -> None:
    """Sixteen sides: light through them differed by ΔE 0.5, stated as 0.05."""
    dips = np.exp(-(((NM - 590) / 25) ** 2)) + np.exp(-(((NM - 440) / 25) ** 2))
    values = 0.985 - 0.03 * dips
    behind = _error(_seen(values**16), _seen(values) ** 16)
    stated = rgb_transport_error(lit_plane(LAMP, surface=Glass(_paint(values))))
    assert 0.1 < behind < stated < 10 * behind


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        (Diffuse(Color((0.8, 0.2, 0.1))), True),  # type: ignore[arg-type]
        (Diffuse(Color((0.8, 0.2, 0.1)), roughness=1.0), False),  # type: ignore[arg-type]
        (Metal(Color((0.8, 0.2, 0.1))), False),  # type: ignore[arg-type]
        (Principled(Color((0.8, 0.2, 0.1))), True),  # type: ignore[arg-type]
        (Principled(coat_weight=1.0, coat_tint=Color((0.8, 0.2, 0.1))), False),  # type: ignore[arg-type]
        (Principled(coat_tint=Color((0.8, 0.2, 0.1))), True),  # type: ignore[arg-type]
        (Principled(subsurface_weight=0.1), False),
    ],
)
def test_some_surfaces_reflect_light_several_times_themselves(surface: Surface, expected: bool) -> None:
    """Rough metal and Oren-Nayar paint differed by ΔE 2.2 and 0.8 where 6e-14 was stated."""
    assert is_linear([Material("m", surface)]) is expected


def test_direct_light_is_that_of_the_nearest_point() -> None:
    """A plane of 60 % under a point lamp beside its middle, a sun, and a panel that touches it."""

    def found(*lights: Any) -> float:
        scene = lit_plane(*lights, surface=Diffuse(gray(0.6)))
        return direct_radiance(scene, list(scene.materials), 0.6)

    aside = replace(LAMP, world_from_light=matrix((3.0, 1.0, 0.25)))
    assert found(aside) == pytest.approx(0.6 / np.pi * 10 / (4 * np.pi) / 0.25**2)
    sun = SunLight(name="sun", world_from_light=np.eye(4), irradiance=3.0)
    assert found(aside, sun) == pytest.approx(found(aside) + 0.6 / np.pi * 3.0)
    panel = AreaLight(name="panel", world_from_light=matrix((0, 0, 1e-6)), power_w=10.0, size=(2.0, 2.0))
    assert found(panel) == pytest.approx(0.6 * 10.0 / (4.0 * np.pi))  # its radiance over the hemisphere
    beyond = replace(LAMP, world_from_light=matrix((50.0 + 3.0, 0.0, 4.0)))  # over no point of the plane
    assert found(beyond) == pytest.approx(0.6 / np.pi * 10 / (4 * np.pi) / 25.0)
    assert found() == 0.0 and np.isfinite(found(replace(LAMP, world_from_light=np.eye(4))))


def test_distances_of_a_dense_mesh_are_those_of_its_vertices() -> None:
    scene = lit_plane(LAMP, surface=Diffuse(gray(0.6)))
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 65)] * 2), axis=-1).reshape(-1, 2)
    corner = (np.arange(64)[:, None] * 65 + np.arange(64)).ravel()
    triangles = np.concatenate([corner[:, None] + [0, 1, 66], corner[:, None] + [0, 66, 65]]).astype(np.uint32)
    positions = np.concatenate([grid, np.zeros((len(grid), 1))], axis=1).astype(np.float32)
    dense = replace(scene, meshes=(replace(plane(), positions=positions, triangles=triangles, uvs=None),))
    values = [direct_radiance(each, list(each.materials), 0.6) for each in (scene, dense)]
    assert values[0] == pytest.approx(values[1], rel=1e-6)


def test_light_behind_a_corner_is_followed_as_far_as_bright_lamps_reach() -> None:
    """Planned from data, a corridor behind two corners had 7 bounces and lost 21 % of its light, stated as ΔE 0.16."""

    def bounces(power: float, exposure: float = 1.0) -> int:
        scene = lit_plane(replace(LAMP, power_w=power), surface=Diffuse(gray(0.5)))
        return plan_from_data(replace(scene, film=replace(scene.film, exposure=exposure))).bounces

    assert 7 <= bounces(1e-6) <= bounces(10.0) < bounces(1e4) == bounces(100.0, 100.0)
    shown = 0.5 / np.pi * 1e4 / (4 * np.pi) / 2.0**2 * 0.5 ** (bounces(1e4) + 1) / 0.5
    assert 903.3 * shown < 0.5  # L* of all later light at the brightest point


def test_haze_in_a_white_room_is_passed_many_times() -> None:
    """Paths in a room of 95 % pass its haze 21 times: 2 % of the light was lost, stated as ΔE 0.12."""
    assert ways_of_light([]) == 2.0
    assert ways_of_light([Material("m", Diffuse(gray(0.95)))]) == pytest.approx(2 + 0.95 / 0.05)
    haze = Material("haze", None, ScatteringMedium(1e-4, gray(0.0)))
    for wall, mirrors in ((gray(0.95), False), (gray(0.0), False), (gray(0.95), True)):
        scene = lit_plane(LAMP, surface=Metal(wall) if mirrors else Diffuse(wall))
        air = replace(scene.instances[0], name="air", world_from_object=matrix((0, 0, 1), 0.1), materials=("haze",))
        scene = replace(scene, materials=(*scene.materials, haze), instances=(*scene.instances, air))
        ways = 2.0 if wall.linear_rgb[0] == 0 else 21.0
        depth = 1e-4 * 100 * 0.1 * np.sqrt(2)
        assert plan_from_data(scene)["media"].error == pytest.approx(error_of_share(ways * depth), rel=1e-6)
