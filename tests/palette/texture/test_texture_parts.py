# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures, stored weights and lattices of spectral textures, each against direct computation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture import texture as module
from spectral_core.palette.texture.basis import design_basis
from spectral_core.palette.texture.fit import Fitter
from spectral_core.palette.texture.project import TextureSettings
from spectral_core.palette.texture.reach import TEXTURE_GRID, corner_colors, reachable_scales, stimulus_matrix
from spectral_core.palette.texture.texture import Picture, SpectralTexture, design_texture, half_from_unit
from spectral_core.palette.texture.uplift import Pin, _difference, _LatticeSolver, design_uplift
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import linear_from_display_rgb

D65, HP1 = illuminant("D65"), illuminant("HP1")
HATS = np.stack([np.interp(np.arange(TEXTURE_GRID.size), [0, 20, 40, 60, 80], row) for row in np.eye(5)])


@pytest.mark.parametrize(("dtype", "top"), [(np.uint8, 255), (np.uint16, 65535)])
def test_integer_pixels_are_display_values(dtype: type, top: int) -> None:
    pixels = np.array([[[0, top // 3, top]], [[top // 2, 1, top - 1]]], dtype)
    picture = Picture("p", pixels)
    linear = linear_from_display_rgb(pixels / top)
    np.testing.assert_allclose(picture.linear_rows(0, 2), linear.reshape(-1, 3).T, rtol=1e-6)
    np.testing.assert_allclose(picture.linear_rows(1, 2, 0.1, 0.5), 0.1 + 0.5 * linear[1].T, rtol=1e-6)


def test_floating_pixels_are_linear_and_within_a_surface() -> None:
    pixels = np.linspace(0, 1, 12).reshape(2, 2, 3)
    picture = Picture("p", pixels)
    np.testing.assert_allclose(picture.linear_rows(0, 1), pixels[0].T, rtol=1e-6)
    np.testing.assert_allclose(picture.linear_rows(0, 2, 0.25, 0.5), 0.25 + 0.5 * pixels.reshape(-1, 3).T, rtol=1e-6)
    for wrong in (pixels * 1.01, pixels - 0.01):
        with pytest.raises(InvalidInputError, match="a surface shows linear values"):
            Picture("p", wrong)
    for wrong in (np.zeros((2, 2)), np.zeros((2, 2, 4)), np.zeros((0, 2, 3)), np.zeros((2, 2, 3), np.int32)):
        with pytest.raises(InvalidInputError):
            Picture("p", wrong)


def test_a_texture_mixes_its_spectra(rng: np.random.Generator) -> None:
    weights = rng.uniform(0, 1, (5, 3, 4)).astype(np.float16)
    texture = SpectralTexture(weights, HATS, (D65,))
    np.testing.assert_allclose(texture.reflectances(2, 1), weights[:, 2, 1].astype(float) @ HATS, rtol=1e-12)
    shown = texture.picture(HP1)
    assert shown.shape == (3, 4, 3)
    np.testing.assert_allclose(shown[2, 1], stimulus_matrix([HP1]) @ texture.reflectances(2, 1), atol=1e-5)
    np.testing.assert_allclose(texture.rows(HP1, 1, 3), shown[1:3], rtol=1e-5)
    assert not texture.weights.flags.writeable
    for wrong in (-0.01, 1.001, np.nan, np.inf):
        bad = weights.copy()
        bad[0, 0, 0] = wrong
        with pytest.raises(InvalidInputError, match="weights are outside"):
            SpectralTexture(bad, HATS, (D65,))
    SpectralTexture(np.ones((5, 1, 1), np.float16), HATS, ())
    for spectra in (HATS * 1.00001, HATS - 1e-8):
        with pytest.raises(InvalidInputError, match="no weight is outside"):
            SpectralTexture(weights, spectra, ())
    with pytest.raises(InvalidInputError, match="expected"):
        SpectralTexture(weights[0], HATS, ())


def test_half_floats_are_rounded_to_the_nearest(rng: np.random.Generator) -> None:
    values = np.concatenate([rng.uniform(0, 1, 5000), [0.0, -0.0, 1.0, 2.0**-14, 2.0**-15, 1 - 2.0**-12]]).astype(
        np.float32
    )
    found = np.empty(values.size, np.float16)
    half_from_unit(values, found)
    step = np.spacing(found.astype(np.float16)).astype(float)
    assert np.all(np.abs(found.astype(float) - values) <= step / 2 + 1e-12)
    assert found[-5] == 0 and not np.signbit(found[-5]) and found[-4] == 1.0


def test_corners_are_reached_between_gray_and_the_farthest_color() -> None:
    matrix = stimulus_matrix([D65]) @ HATS.T
    reach = reachable_scales(matrix, corner_colors(1), 0.1)
    slope = 0.5 * reach.scales.min()
    weights = module._corner_weights(matrix, 0.1, slope)
    corners = np.concatenate([np.zeros((1, 3)), corner_colors(1)])
    np.testing.assert_allclose(weights @ matrix.T, 0.1 + slope * corners, atol=1e-7)
    assert weights.min() >= -1e-9 and weights.max() <= 1 + 1e-9


def test_floor_and_slope_of_a_design() -> None:
    rng = np.random.default_rng(1)
    picture = Picture("p", rng.integers(0, 256, (6, 7, 3)).astype(np.uint8))
    found = design_texture([picture], [D65], floor=0.1)
    assert (found.floor, found.slope) == (0.1, pytest.approx(0.87))
    exact = design_texture([picture], [D65], floor=0.1, mapping="uniform_contrast", basis=found.basis)
    own = stimulus_matrix([D65]) @ found.basis.spectra.T
    assert exact.slope == exact.stated_slope
    assert exact.slope == pytest.approx(reachable_scales(own, corner_colors(1), 0.1).scales.min(), rel=1e-9)
    target = 0.1 + exact.slope * linear_from_display_rgb(picture.pixels / 255)
    np.testing.assert_allclose(exact.texture.picture(D65), target, atol=3e-3)
    assert exact.compressed == 0.0 and exact.losses[0].largest < 0.2
    for wrong in ({"floor": -0.1}, {"floor": 0.51}, {"slope": 0.95, "floor": 0.1}, {"slope": -0.1}):
        with pytest.raises(InvalidInputError):
            design_texture([picture], [D65], basis=found.basis, **wrong)
    design_texture([picture], [D65], basis=found.basis, floor=0.1, slope=0.9)
    for pictures, lights in (([], []), ([picture] * 3, [D65] * 3), ([picture], [D65, HP1])):
        with pytest.raises(InvalidInputError, match="give one or two pictures"):
            design_texture(pictures, lights)
    with pytest.raises(InvalidInputError, match=r"'p' 7×6, 'q' 6×7"):
        design_texture([picture, Picture("q", picture.pixels.transpose(1, 0, 2))], [D65, HP1])


@pytest.mark.parametrize("tile", [1, 10, 1 << 20])
def test_tiles_do_not_change_a_texture(monkeypatch: pytest.MonkeyPatch, tile: int) -> None:
    rng = np.random.default_rng(2)
    picture = Picture("p", rng.integers(0, 256, (5, 4, 3)).astype(np.uint8))
    fitter = Fitter(stimulus_matrix([D65]) @ HATS.T, (1.0,))
    whole = module._fit_tiles([picture], fitter, (0.1, 0.8), None)
    monkeypatch.setattr(module, "TILE", tile)
    done: list[float] = []
    tiled = module._fit_tiles([picture], fitter, (0.1, 0.8), done.append)
    np.testing.assert_allclose(tiled[0].astype(float), whole[0].astype(float), atol=2e-3)
    assert abs(tiled[2] - whole[2]) <= 1 and done[-1] == pytest.approx(1.0)


def test_nodes_of_the_lattice_are_the_smoothest_reflectances() -> None:
    nodes = _LatticeSolver(D65, None, np.eye(TEXTURE_GRID.size), 1.0)
    chosen = np.array([(6 * 13 + 5) * 13 + 7])
    (found,) = nodes.solve(None, chosen)
    np.testing.assert_allclose(nodes.first @ found, nodes.colors[chosen[0]], atol=1e-6)
    bends, steps = np.diff(found, 2), np.diff(found)

    def roughness(r: np.ndarray) -> float:
        return float(np.sum(np.diff(r, 2) ** 2) + 1e-4 * np.sum(np.diff(r) ** 2) + 1e-9 * np.sum(r**2))

    assert found.min() >= 0 and found.max() <= 1 and np.sum(bends**2) < 1 and np.sum(steps**2) < 1
    rng = np.random.default_rng(3)
    inner = (found > 1e-6) & (found < 1 - 1e-6)
    for _ in range(20):  # no small change that keeps the color is smoother
        change = rng.normal(size=found.size) * inner
        change -= (
            np.linalg.lstsq(nodes.first[:, inner], nodes.first @ change, rcond=None)[0] @ np.eye(found.size)[inner]
        )
        assert np.abs(nodes.first @ change).max() < 1e-9
        assert roughness(found + 1e-5 * change) >= roughness(found) - 1e-12


def test_pins_have_colors_from_0_to_1_and_do_not_contradict() -> None:
    Pin([0.0, 0.5, 1.0], [1.0, 0.0, 0.5])
    for wrong in ([-0.01, 0, 0], [0, 1.01, 0]):
        for pair in ((wrong, [0.5] * 3), ([0.5] * 3, wrong)):
            with pytest.raises(InvalidInputError, match="expected linear RGB from 0 to 1"):
                Pin(*pair)
    near = [Pin([0.5, 0.5, 0.5], [0.1] * 3), Pin([0.5, 0.5, 0.54], [0.9] * 3)]
    with pytest.raises(InvalidInputError, match="should look like two different"):
        design_uplift(D65, HP1, near)
    with pytest.raises(InvalidInputError, match="1 pin without a second light"):
        design_uplift(D65, None, near[:1])
    assert _difference(np.array([0.2, 0.3, 0.4]), np.array([0.2, 0.3, 0.4])) == 0.0
    for slope in (1e-4, 1.1):
        with pytest.raises(InvalidInputError, match="slope"):
            design_uplift(D65, slope=slope)


def test_arguments_of_a_design_that_nothing_can_follow_are_refused() -> None:
    """NaN, infinite and no weights, an unknown mapping and 0 spectra were taken for the defaults."""
    pictures = [Picture(name, np.full((2, 2, 3), value)) for name, value in (("a", 0.5), ("b", 0.3))]
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"importance": (float("nan"), 1.0)}, "importance holds 1 .* not finite"),
        ({"importance": (float("inf"), 1.0)}, "importance holds 1 .* not finite"),
        ({"importance": ()}, "one positive number per light"),
        ({"mapping": "exact"}, "no mapping is named 'exact'"),
        ({"count": 0}, "spectra"),
    ]
    for arguments, words in wrong:
        with pytest.raises(InvalidInputError, match=words):
            design_texture(pictures, [D65, HP1], **arguments)
    with pytest.raises(InvalidInputError, match="no mapping of TextureSettings is named 'exact'"):
        TextureSettings(mapping="exact")  # type: ignore[arg-type]
    basis = design_basis(stimulus_matrix([D65, HP1]), 6, iterations=1)
    first, second = (
        design_texture(pictures, [D65, HP1], importance=each, basis=basis)
        for each in ((2.0, 1.0), np.array([2.0, 1.0]))
    )
    np.testing.assert_array_equal(first.texture.weights, second.texture.weights)
