# SPDX-License-Identifier: GPL-3.0-or-later
"""A texture of reflectances renders in the colors of its spectra under each light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import InvalidInputError
from spectral_core.render import render_scene
from spectral_core.scene import Diffuse, Film, Material, RenderSettings, Scene, SpectralImage, SunLight
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import SpectralGrid
from tests.render.scenes import lit_plane, looking_down, matrix, plane

GRID = SpectralGrid.uniform(380, 780, 10)


def image(**rest) -> SpectralImage:
    """Two by two texels of two complementary bands."""
    band = np.clip((GRID.wavelengths_nm - 520) / 60, 0, 1)
    weights = np.array([[[0.9, 0.1], [0.5, 0.0]], [[0.1, 0.8], [0.5, 1.0]]], np.float16)
    return SpectralImage("bands", weights, np.stack([band, 1 - band]), GRID, interpolation="nearest", **rest)


def picture(texture: SpectralImage, lamp: str, transport: str) -> np.ndarray:
    sun = SunLight(
        name="sun", world_from_light=matrix((0, 0, 5)), color=illuminant(lamp), irradiance=np.pi, angle_rad=0.0
    )
    scene: Scene = lit_plane(
        sun, transport=transport, film=Film(2, 2, samples=4096, filter_kind="box", filter_width=1.0),
        camera=replace(looking_down(10.0), kind="orthographic", orthographic_scale=2.0),
    )  # fmt: skip
    scene = replace(
        scene, meshes=(plane(1.0),), materials=(Material("paper", Diffuse(texture)),),
        settings=RenderSettings(transport=transport, max_bounces=1),  # type: ignore[arg-type]
    )  # fmt: skip
    return render_scene(scene).pixels[..., :3]


@pytest.mark.parametrize("lamp", ["D65", "HP1"])
def test_spectral_transport_shows_each_texel_under_each_light(lamp: str) -> None:
    texture = image()
    nm = np.arange(3800, 7801) / 10
    power = np.interp(nm, illuminant(lamp).grid.wavelengths_nm, illuminant(lamp).values, left=0, right=0)
    cmfs = np.stack([np.interp(nm, observer().wavelengths_nm, row) for row in observer().cmfs])
    full = np.arange(3600, 8301) / 10
    luminance = np.interp(full, observer().wavelengths_nm, observer().cmfs[1]) @ np.interp(
        full, illuminant(lamp).grid.wavelengths_nm, illuminant(lamp).values, left=0, right=0
    )
    reflectances = np.einsum("khw,kn->hwn", texture.weights.astype(float), texture.spectra)
    fine = np.apply_along_axis(lambda row: np.interp(nm, GRID.wavelengths_nm, row), 2, reflectances)
    expected = (fine * power) @ cmfs.T / luminance @ RGB_FROM_XYZ.T
    np.testing.assert_allclose(picture(texture, lamp, "spectral"), expected, atol=0.02 * np.abs(expected).max())


def test_rgb_transport_shows_the_colors_under_daylight() -> None:
    texture = image()
    expected = np.clip(texture.linear_rgb(illuminant("D65").scaled(1 / _luminance("D65"))), 0, 1)
    np.testing.assert_allclose(picture(texture, "D65", "rgb"), expected, atol=0.01)


def _luminance(lamp: str) -> float:
    light = illuminant(lamp)
    return float(observer().cmfs[1] @ light.at(observer().wavelengths_nm))


def test_values_that_are_no_reflectance_are_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"outside \[0, 1\]"):
        replace(image(), weights=np.full((2, 1, 1), 1.5, np.float16))
    with pytest.raises(InvalidInputError, match=r"outside \[0, 1\]"):
        replace(image(), weights=np.full((2, 1, 1), np.nan, np.float16))
    with pytest.raises(InvalidInputError, match="sum reaches 2"):
        replace(image(), spectra=np.ones((2, GRID.size)))
    with pytest.raises(InvalidInputError, match="1 to 8 spectra"):
        replace(image(), weights=np.zeros((9, 1, 1), np.float16))
