# SPDX-License-Identifier: GPL-3.0-or-later
"""Two pictures in one surface: reachable colors, lights, basis, texels, file."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares, linprog

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.palette.texture.basis import TextureBasis, design_basis
from spectral_core.palette.texture.file import ATTRIBUTE, read_texture, write_texture
from spectral_core.palette.texture.fit import Fitter
from spectral_core.palette.texture.lights import LightDesign, design_lights, led, led_range
from spectral_core.palette.texture.reach import (
    TEXTURE_GRID,
    corner_colors,
    reachable_contrast,
    reachable_scales,
    stimulus_matrix,
)
from spectral_core.palette.texture.texture import Picture, design_texture
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import (
    RGB_FROM_XYZ,
    WHITE_XYZ,
    delta_e_2000,
    lab_from_linear_rgb,
    linear_from_display_rgb,
)
from spectral_core.spectra.observer import observer


@pytest.fixture(scope="module")
def design() -> LightDesign:
    return design_lights()


@pytest.fixture(scope="module")
def basis(design: LightDesign) -> TextureBasis:
    return design_basis(stimulus_matrix(design.lights), 6)


def dense_colors(reflectances, light):
    """Linear RGB under a light by a plain sum at 0.1 nm, which shares no code with the library's integrals."""
    nm = np.arange(3600, 8300) / 10
    cmfs = np.stack([np.interp(nm, observer().wavelengths_nm, row, left=0, right=0) for row in observer().cmfs])
    power = np.interp(nm, light.grid.wavelengths_nm, light.values, left=0, right=0)
    r = np.stack(
        [np.interp(nm, TEXTURE_GRID.wavelengths_nm, row, left=0, right=0) for row in np.atleast_2d(reflectances)]
    )
    inside = np.interp(nm, TEXTURE_GRID.wavelengths_nm, np.ones(TEXTURE_GRID.size), left=0, right=0)
    white = cmfs @ (power * inside)
    return (r * power) @ cmfs.T / white * WHITE_XYZ @ RGB_FROM_XYZ.T


def pairs(count: int, seed: int = 3) -> np.ndarray:
    """Pairs of display colors (count, 6), linear, drawn uniformly in display values."""
    return linear_from_display_rgb(np.random.default_rng(seed).random((count, 6)))


def test_reachable_scales_agree_with_one_linear_program_per_color() -> None:
    lights = [illuminant("D65"), illuminant("FL11")]
    matrix, wanted = stimulus_matrix(lights), pairs(20)
    found = reachable_scales(matrix, wanted, 0.1)
    for color, scale, reflectance in zip(wanted, found.scales, found.reflectances, strict=True):
        alone = linprog(
            np.append(np.zeros(matrix.shape[1]), -1), A_eq=np.hstack([matrix, -color[:, None]]),
            b_eq=0.1 * matrix.sum(axis=1), bounds=[(0, 1)] * matrix.shape[1] + [(0, 0.9)], method="highs-ipm",
        )  # fmt: skip
        assert scale == pytest.approx(alone.x[-1], abs=1e-7)
        for number, light in enumerate(lights):
            shown = dense_colors(reflectance, light)[0]
            np.testing.assert_allclose(shown, 0.1 + scale * color[3 * number : 3 * number + 3], atol=5e-3)


@pytest.mark.parametrize(("lamp", "slope"), [("HP1", 0.054), ("FL11", 0.084), ("LED-B5", 0.009)])
def test_given_lamps_allow_little_contrast(lamp: str, slope: float) -> None:
    assert reachable_contrast([illuminant("D65"), illuminant(lamp)]).slope == pytest.approx(slope, abs=0.001)


def test_designed_lights_are_white_and_reach_the_stated_contrast(design: LightDesign) -> None:
    assert design.slope > 0.9
    for light in design.lights:
        nm = observer().wavelengths_nm
        white = observer().cmfs @ np.interp(nm, light.grid.wavelengths_nm, light.values, left=0, right=0)
        expected = lab_from_linear_rgb(np.ones(3))
        assert delta_e_2000(lab_from_linear_rgb(RGB_FROM_XYZ @ (white / white[1])), expected) < 0.1
    assert reachable_contrast(design.lights, design.floor).slope == pytest.approx(design.slope, abs=1e-9)


def test_every_pair_of_display_colors_is_exact_at_contrast_19(design: LightDesign, basis: TextureBasis) -> None:
    wanted = (0.05 + 0.9 * pairs(2000)).astype(np.float32)
    fitter = Fitter(stimulus_matrix(design.lights) @ basis.spectra.T, (1.0, 1.0))
    weights, outside = fitter.solve(np.ascontiguousarray(wanted.T))
    assert outside == 0
    reflectances = weights.T.astype(np.float64) @ basis.spectra
    assert reflectances.min() >= 0
    assert reflectances.max() <= 1 + 1e-7
    for number, light in enumerate(design.lights):
        shown = dense_colors(reflectances, light)
        target = wanted[:, 3 * number : 3 * number + 3]
        assert delta_e_2000(lab_from_linear_rgb(shown), lab_from_linear_rgb(target)).max() < 0.1


def test_basis_is_bounded_smooth_and_sums_to_one(basis: TextureBasis) -> None:
    assert basis.spectra.min() >= 0
    np.testing.assert_allclose(basis.spectra.sum(axis=0), 1, atol=1e-9)
    assert np.abs(np.diff(basis.spectra, 2, axis=1)).max() < 0.26


def test_a_low_floor_keeps_more_than_half_the_contrast(design: LightDesign) -> None:
    basis = design_basis(stimulus_matrix(design.lights), 6, floor=0.02)
    assert basis.slope > 0.55  # 0.43 without the search from a higher floor


def test_a_picture_without_details_has_no_ghost(design: LightDesign, basis: TextureBasis) -> None:
    y, x = np.mgrid[0:60, 0:60] / 59
    ramp = Picture("ramp", np.round(255 * np.stack([x, y, x * y], axis=-1)).astype(np.uint8))
    noise = Picture("noise", np.random.default_rng(2).integers(0, 256, (60, 60, 3), dtype=np.uint8))
    found = design_texture([ramp, noise], design.lights, floor=0.05, slope=0.85, basis=basis)
    assert max(loss.mean for loss in found.losses) < 0.1
    assert max(loss.ghost for loss in found.losses) < 0.01


def test_unreachable_texels_are_as_near_as_those_of_a_bounded_search(design: LightDesign, basis: TextureBasis) -> None:
    matrix = stimulus_matrix(design.lights) @ basis.spectra.T
    wanted = pairs(400, 5)
    weights, outside = Fitter(matrix, (1.0, 1.0)).solve(np.ascontiguousarray(wanted.T, dtype=np.float32))
    assert 20 < outside < 400

    def residual(w, color):
        return (lab_from_linear_rgb((matrix @ w).reshape(2, 3)) - lab_from_linear_rgb(color.reshape(2, 3))).ravel()

    excess = []
    for color, found in list(zip(wanted, weights.T.astype(np.float64), strict=True))[:80]:
        best = min(
            least_squares(residual, start, bounds=(-1e-9, 1 + 1e-9), method="dogbox", args=(color,)).cost
            for start in (np.full(6, 0.5), np.clip(found, 0.01, 0.99))
        )
        excess.append(np.sqrt(2 * residual(found, color) @ residual(found, color) / 2) - np.sqrt(2 * best))
    assert np.mean(excess) < 0.1


@pytest.mark.parametrize("count", [6, 8])
def test_uniform_contrast_shows_every_texel_exactly(count: int) -> None:
    lights = [illuminant("D65"), illuminant("HP1")]
    pictures = [
        Picture(name, np.random.default_rng(k).integers(0, 256, (24, 17, 3), dtype=np.uint8))
        for k, name in enumerate("ab")
    ]
    basis = design_basis(stimulus_matrix(lights), count, floor=0.1, iterations=4)
    found = design_texture(pictures, lights, floor=0.1, mapping="uniform_contrast", basis=basis)
    assert found.compressed == 0
    for picture, light in zip(pictures, lights, strict=True):
        wanted = 0.1 + found.slope * linear_from_display_rgb(picture.pixels / 255)
        assert delta_e_2000(lab_from_linear_rgb(found.texture.picture(light)), lab_from_linear_rgb(wanted)).max() < 0.1


@pytest.mark.parametrize(("floor", "slope"), [(0.07, 0.93), (0.02, 0.98)])
def test_black_and_contrast_may_be_1_together(basis: TextureBasis, floor: float, slope: float) -> None:
    """1 - 0.07 is less than 0.93 in binary numbers, and was refused."""
    lights = [illuminant("D65"), illuminant("HP1")]
    pictures = [Picture(name, np.full((2, 2, 3), 90 * k, dtype=np.uint8)) for k, name in enumerate("ab")]
    assert design_texture(pictures, lights, floor=floor, slope=slope, basis=basis).slope == slope
    with pytest.raises(InvalidInputError, match="slope is"):
        design_texture(pictures, lights, floor=floor, slope=slope + 1e-3, basis=basis)


def test_texture_of_any_pictures_stays_within_bounds_under_filters(design: LightDesign, basis: TextureBasis) -> None:
    rng = np.random.default_rng(0)
    flat = np.zeros((9, 14, 3), np.uint8)
    noise = rng.integers(0, 256, (9, 14, 3), dtype=np.uint8)
    extremes = np.where(rng.random((9, 14, 3)) < 0.5, 0, 255).astype(np.uint8)
    for first, second in ((flat, 255 - flat), (noise, extremes), (extremes, flat)):
        found = design_texture(
            [Picture("a", first), Picture("b", second)], design.lights, floor=0.0, slope=1.0, basis=basis
        )
        weights = found.texture.weights.astype(np.float64)
        shares = rng.random((50, 9 * 14))
        filtered = (shares / shares.sum(axis=1, keepdims=True)) @ weights.reshape(6, -1).T
        for values in (weights.reshape(6, -1).T, filtered):
            reflectances = values @ found.texture.spectra
            assert reflectances.min() >= 0
            assert reflectances.max() <= 1 + 1e-9
        assert all(np.isfinite(loss.largest) for loss in found.losses)


def test_importance_reduces_the_error_of_a_picture() -> None:
    lights = [illuminant("D65"), illuminant("HP1")]
    pictures = [
        Picture(name, np.random.default_rng(k).integers(0, 256, (16, 16, 3), dtype=np.uint8))
        for k, name in enumerate("ab")
    ]
    basis = design_basis(stimulus_matrix(lights), 8, floor=0.05, iterations=8)
    even = design_texture(pictures, lights, floor=0.05, basis=basis)
    first = design_texture(pictures, lights, floor=0.05, basis=basis, importance=(25.0, 1.0))
    assert first.losses[0].mean < 0.7 * even.losses[0].mean
    assert first.losses[1].mean > even.losses[1].mean


def test_file_round_trip_and_damage(tmp_path, design: LightDesign, basis: TextureBasis) -> None:
    pytest.importorskip("OpenEXR")
    import OpenEXR

    picture = Picture("a", np.random.default_rng(1).integers(0, 256, (8, 5, 3), dtype=np.uint8))
    texture = design_texture([picture, picture], design.lights, basis=basis).texture
    path = write_texture(tmp_path / "t.exr", texture)
    again = read_texture(path)
    np.testing.assert_array_equal(again.weights, texture.weights)
    np.testing.assert_array_equal(again.spectra, texture.spectra)
    np.testing.assert_array_equal(again.lights[1].values, texture.lights[1].values)

    with pytest.raises(InvalidInputError, match=r"ending in \.exr"):
        write_texture(tmp_path / "t.png", texture)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(FileFormatError, match="truncated, damaged"):
        read_texture(path)
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    plane = {"weight.0": np.ones((4, 4), np.float16)}
    for about, words in (
        (None, "without the attribute"),
        ("{", "damaged"),
        (json.dumps({"version": 1, "spectra": [[1]] * 99}), "99 spectra"),
        (json.dumps({"version": 1, "spectra": [[1], [1]]}), "lacks the channels weight.1"),
    ):
        OpenEXR.File(header | ({ATTRIBUTE: about} if about else {}), plane).write(str(tmp_path / "d.exr"))
        with pytest.raises(FileFormatError, match=words):
            read_texture(tmp_path / "d.exr")


def test_impossible_requests_are_refused(design: LightDesign, basis: TextureBasis) -> None:
    small, large = (Picture(name, np.zeros((n, n, 3), np.uint8)) for name, n in (("small", 4), ("large", 5)))
    with pytest.raises(InvalidInputError, match="differ in size: 'small' 4×4, 'large' 5×5"):
        design_texture([small, large], design.lights, basis=basis)
    with pytest.raises(InvalidInputError, match="a light for each"):
        design_texture([small], design.lights, basis=basis)
    with pytest.raises(InvalidInputError, match="not finite"):
        Picture("nan", np.full((2, 2, 3), np.nan))
    with pytest.raises(InvalidInputError, match="linear values from 0 to 1"):
        Picture("hdr", np.full((2, 2, 3), 1.5))
    with pytest.raises(InvalidInputError, match="at least 6 primaries"):
        design_lights([led(450, 20), led(550, 20)])
    with pytest.raises(InvalidInputError, match="6 to 8"):
        design_basis(stimulus_matrix(design.lights), 5)
    texture = design_texture([small, small], design.lights, basis=basis).texture
    with pytest.raises(InvalidInputError, match=r"outside \[0, 1\]"):
        replace(texture, weights=texture.weights.astype(np.float32) + 1)
    with pytest.raises(InvalidInputError, match="has the white XYZ"):
        stimulus_matrix([led(690, 5)])


def test_a_share_of_daylight_reduces_contrast() -> None:
    leds = led_range(20, step_nm=10)
    plain, mixed = design_lights(leds, iterations=2), design_lights(leds, daylight_share=0.3, iterations=2)
    assert mixed.slope < plain.slope
    assert max(mixed.white_delta_e) < 0.1


def test_corners_are_all_display_corners_except_black() -> None:
    assert corner_colors(1).shape == (7, 3)
    assert corner_colors(2).shape == (63, 6)
