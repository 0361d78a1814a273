# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoising: less error, unchanged brightness and coverage, a message without the package, and correct guides.

Tests of the filter are skipped if it is not installed; tests of its use in a render replace it by a stand-in.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, MissingDependencyError, RenderError
from spectral_core.render.denoise import PACKAGE, Guides, denoise, denoise_planes, how_to_install, is_installed
from spectral_core.scene import Diffuse, Film, PointLight, RenderSettings, World, gray

from ..scenes import lit_plane, matrix

needs_filter = pytest.mark.skipif(not is_installed(), reason="needs Open Image Denoise: pip install pyoidn")


def steps(height: int = 96, width: int = 128) -> np.ndarray:
    """A picture of flat patches and a ramp, all of them colored."""
    row, column = np.mgrid[0:height, 0:width]
    return np.stack([0.2 + 0.5 * (column > width / 2), 0.1 + row / height, np.full(row.shape, 0.4)], axis=-1).astype(
        np.float32
    )


def noisy(picture: np.ndarray, seed: int = 3) -> np.ndarray:
    return (picture * np.random.default_rng(seed).gamma(1.0, 1.0, picture.shape)).astype(np.float32)


def error(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(np.square(picture.astype(np.float64) - truth).mean())


@needs_filter
def test_denoising_reduces_noise_and_keeps_brightness_and_coverage():
    truth = steps()
    coverage = np.random.default_rng(0).random((*truth.shape[:2], 1), dtype=np.float32)
    given = np.concatenate([noisy(truth), coverage], axis=2)
    kept = given.copy()
    made = denoise(given)
    assert made.dtype == np.float32 and made.shape == given.shape
    assert error(made[..., :3], truth) < 0.05 * error(given[..., :3], truth)
    assert made[..., :3].mean() == pytest.approx(given[..., :3].mean(), rel=0.05)
    np.testing.assert_array_equal(made[..., 3], coverage[..., 0])
    np.testing.assert_array_equal(given, kept)


@needs_filter
def test_a_color_outside_srgb_is_unchanged():
    """The orange of a sodium lamp has a negative blue channel."""
    truth = np.broadcast_to(np.float32([1.0, 0.4, -0.1]), (64, 64, 3))
    spread = np.random.default_rng(1).gamma(2.0, 0.5, (64, 64, 1)).astype(np.float32)
    made = denoise(truth * spread)
    np.testing.assert_allclose(made.mean(axis=(0, 1)), truth[0, 0] * spread.mean(), atol=0.05)  # 0.1 with clipping
    assert error(made, truth) < 0.1 * error(truth * spread, truth)


@needs_filter
def test_albedo_keeps_an_edge_that_noise_hides():
    row, column = np.mgrid[0:96, 0:96]
    checks = ((row // 3 + column // 3) % 2).astype(np.float32)
    albedo = np.repeat((0.35 + 0.3 * checks)[..., None], 3, axis=2)
    normal = np.broadcast_to(np.float32([0, 0, 1]), albedo.shape)
    given = noisy(albedo)
    assert error(denoise(given, Guides(albedo, normal)), albedo) < 0.5 * error(denoise(given), albedo)


@needs_filter
def test_all_planes_are_denoised_equally():
    truth = steps()
    given = noisy(truth) * np.float32(1e-4)  # radiance per nm is a small number
    made = denoise_planes(given)
    assert error(made * 1e4, truth) < 0.1 * error(given * 1e4, truth)
    np.testing.assert_array_equal(denoise_planes(given[..., 1:2])[..., 0], made[..., 1])


@pytest.mark.parametrize(
    ("given", "guides", "message"),
    [
        (np.zeros((4, 4), np.float32), None, r"shape \(4, 4\); expected \(height, width, 3\)"),
        (np.zeros((4, 0, 3), np.float32), None, "shape"),
        (np.full((4, 4, 3), np.nan, np.float32), None, "not finite"),
        (np.ones((4, 4, 3), np.float32), (np.ones((4, 5, 3)), np.ones((4, 4, 3))), "albedo guide has shape"),
        (np.ones((4, 4, 3), np.float32), (np.ones((4, 4, 3)), np.full((4, 4, 3), np.inf)), "normal guide holds"),
    ],
)
def test_an_error_names_wrong_input(stand_in, given, guides, message):
    with pytest.raises(InvalidInputError, match=message):
        denoise(given, None if guides is None else Guides(*guides))


@pytest.fixture
def stand_in(monkeypatch):
    """Replace the filter by a stand-in that halves its input; returns the list of its keyword arguments."""
    calls = []

    def halve(color, **options):
        calls.append(options)
        return (color * np.float32(0.5)).astype(np.float32)

    monkeypatch.setitem(sys.modules, PACKAGE, SimpleNamespace(denoise=halve, __spec__=SimpleNamespace()))
    return calls


def test_without_the_package_one_sentence_names_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, PACKAGE, None)
    assert not is_installed()
    with pytest.raises(MissingDependencyError, match="88 MB to download.* -m pip install pyoidn"):
        denoise(np.ones((4, 4, 3), np.float32))
    assert "\n" not in how_to_install()


def test_a_package_without_its_own_packages_is_named_as_installed(monkeypatch, tmp_path):
    """As after ``pip install --no-deps``."""
    (tmp_path / f"{PACKAGE}.py").write_text("import a_package_that_nobody_has\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, PACKAGE, raising=False)
    with pytest.raises(MissingDependencyError, match="is installed and does not load.*a_package_that_nobody_has"):
        denoise(np.ones((4, 4, 3), np.float32))


def test_a_filter_that_fails_is_an_error_of_the_render(monkeypatch):
    def fail(*_, **__):
        raise RuntimeError("out of memory")

    monkeypatch.setitem(sys.modules, PACKAGE, SimpleNamespace(denoise=fail))
    with pytest.raises(RenderError, match="Open Image Denoise failed: out of memory"):
        denoise(np.ones((4, 4, 3), np.float32))


class TestRendered:
    """Render with denoising."""

    @pytest.fixture(autouse=True)
    def mitsuba(self):
        pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

    @staticmethod
    def scene(transport="rgb", **rest):
        lamp = PointLight(name="lamp", group="key", world_from_light=matrix((0, 0, 2)), power_w=60.0)
        rest.setdefault("surface", Diffuse(gray(0.5)))
        settings = RenderSettings(transport=transport, denoise=True)
        return lit_plane(lamp, settings=settings, film=Film(12, 8, samples=4), world=World(gray(0.2)), **rest)

    def test_a_missing_package_is_reported_before_tracing(self, monkeypatch):
        from spectral_core.render import render_scene

        monkeypatch.setitem(sys.modules, PACKAGE, None)
        seen = []
        with pytest.raises(MissingDependencyError, match="pip install pyoidn"):
            render_scene(self.scene(), on_progress=seen.append)
        assert not seen

    def test_the_picture_its_groups_and_bands_are_denoised_with_the_same_guides(self, stand_in):
        from spectral_core.render import Bands, render_scene

        scene = self.scene()
        bands = Bands.uniform(count=3)
        plain = render_scene(replace(scene, settings=replace(scene.settings, denoise=False)), groups=True, bands=bands)
        assert not stand_in and plain.denoised == "" and "spectral.denoised" not in plain.header
        made = render_scene(scene, groups=True, bands=bands)
        assert set(made.group_pixels) == {"key", ""}
        assert len(stand_in) == 2 + 2 * 3
        albedo = stand_in[0]["albedo"]
        assert all(call["hdr"] and call["albedo"].tobytes() == albedo.tobytes() for call in stand_in)
        np.testing.assert_allclose(made.pixels[..., :3], plain.pixels[..., :3] / 2, rtol=1e-4)
        np.testing.assert_array_equal(made.pixels[..., 3], plain.pixels[..., 3])
        np.testing.assert_allclose(made.band_pixels, plain.band_pixels / 2, rtol=1e-4)
        np.testing.assert_allclose(sum(made.group_pixels.values())[..., :3], made.pixels[..., :3], rtol=1e-5)
        assert made.header["spectral.denoised"].endswith("albedo and normals as guides")

    def test_a_render_with_a_target_error_is_denoised(self, stand_in):
        from spectral_core.render import render_scene

        scene = self.scene()
        made = render_scene(replace(scene, settings=replace(scene.settings, target_error=20.0)))
        assert len(stand_in) == 1 and made.denoised and made.outcome is not None

    def test_a_stopped_render_is_not_denoised_with_a_note(self, stand_in):
        from spectral_core.render import render_scene

        made = render_scene(self.scene(), should_stop=lambda: True)
        assert made.status == "cancelled" and not stand_in and made.denoised == ""
        assert "not denoised" in made.notes[-1].message

    @pytest.mark.parametrize("transport", ["rgb", "spectral"])
    def test_guides_are_albedo_and_normal_of_the_visible_surface(self, transport):
        guides = job_of(self.scene(transport)).guides()
        assert guides.albedo.shape == guides.normal.shape == (8, 12, 3)
        np.testing.assert_allclose(guides.albedo, 0.5, atol=0.02)
        np.testing.assert_allclose(guides.normal, np.broadcast_to([0, 0, 1], guides.normal.shape), atol=1e-5)

    def test_guides_are_zero_without_a_surface(self):
        scene = self.scene()
        guides = job_of(replace(scene, instances=(replace(scene.instances[0], world_from_object=matrix((200, 0, 0))),)))
        made = guides.guides()
        assert not made.albedo.any() and not made.normal.any()


def job_of(scene):
    from spectral_core.render.job import RenderJob
    from spectral_core.render.plan.effects import plan_effects

    return RenderJob(scene, plan_effects(scene, pilot=False))
