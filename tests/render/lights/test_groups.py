# SPDX-License-Identifier: GPL-3.0-or-later
"""Light groups add up to the picture, bands to its light, and equal seeds give equal pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import Bands, render_scene
from spectral_core.render.mitsuba_scene.paint import emitted_spectrum, white_light
from spectral_core.scene import (
    AreaLight,
    Color,
    Diffuse,
    Emission,
    Film,
    Glass,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    MixSurface,
    PointLight,
    ScatteringMedium,
    SpotLight,
    SunLight,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh

pytest.importorskip("mitsuba")


def _many_lights(**changes):
    """Every type of light in a separate group, with several bounces, glass and an emissive mesh."""
    above = matrix((0.5, 0, 3))
    sky = np.linspace(0, 1, 8 * 16 * 3, dtype=np.float32).reshape(8, 16, 3)
    scene = lit_plane(
        PointLight(name="point", world_from_light=above, power_w=50, group="a"),
        PointLight(name="ball", world_from_light=above, power_w=50, radius=0.2, color=Color([1, 0.5, 0.2]), group="b"),
        SpotLight(name="spot", world_from_light=above, power_w=50, radius=0.1, group="a"),
        SunLight(name="sun", world_from_light=matrix(), irradiance=0.3, group="c"),
        AreaLight(name="area", world_from_light=above, power_w=50, spread_rad=2.0),
        world=World(ImageTexture("sky", sky, "linear"), 0.5, group="sky"),
        camera=looking_down(8, 0.5),
        film=Film(12, 10, samples=16, seed=5),
    )
    return replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(12)),
        materials=(
            *scene.materials,
            Material("glow", MixSurface(0.5, Emission(Color([0.2, 0.3, 1]), 3.0), Diffuse(gray(0.5)))),
            Material("glass", Glass(gray(0.9), 0.2)),
        ),
        instances=(
            *scene.instances,
            Instance("glowing", "sphere", matrix((-1, 0, 1), 0.5), ("glow",), group="c"),
            Instance("glass", "sphere", matrix((0, 1, 1), 0.5), ("glass",)),
        ),
        **changes,
    )


@pytest.mark.parametrize("spectral", [False, True])
def test_groups_add_up_to_the_ordinary_render(spectral):
    """With equal seed and sampling lights the paths are equal: the sum differs from the picture by rounding only."""
    scene = _many_lights()
    lights = [catalogue.illuminant("HP1")]
    bands = Bands.uniform(400, 700, 5) if spectral else None
    grouped = render_scene(scene, groups=True, bands=bands, sampling_lights=lights)
    plain = render_scene(scene, bands=bands, sampling_lights=lights)
    assert set(grouped.group_pixels) == {"a", "b", "c", "", "sky"}
    assert all(part[..., :3].max() > 0 for part in grouped.group_pixels.values())
    np.testing.assert_allclose(grouped.pixels, plain.pixels, rtol=2e-5, atol=2e-6)
    total = sum(part[..., :3] for part in grouped.group_pixels.values())
    np.testing.assert_allclose(total, plain.pixels[..., :3], rtol=2e-5, atol=2e-6)
    if spectral:
        np.testing.assert_allclose(sum(grouped.group_band_pixels.values()), plain.band_pixels, rtol=2e-5, atol=2e-8)


def test_equal_seeds_give_equal_bits_and_other_seeds_do_not():
    scene = _many_lights()
    first, second = render_scene(scene).pixels, render_scene(scene).pixels
    assert np.array_equal(first, second)
    other = render_scene(replace(scene, film=replace(scene.film, seed=6))).pixels
    assert not np.array_equal(first, other)


def test_passes_do_not_change_the_pixels(monkeypatch):
    """Sums and random numbers continue from the last pass."""
    from spectral_core.render import still

    scene = _many_lights()
    whole = render_scene(scene).pixels
    monkeypatch.setattr(still, "pass_sizes", lambda scene, **_: [7, scene.film.samples - 7])
    np.testing.assert_allclose(render_scene(scene).pixels, whole, rtol=1e-6, atol=1e-7)


def test_a_small_picture_of_groups_is_traced_once(monkeypatch):
    """Each pass records the kernel of each group anew, which took most of the time of a small recording."""
    from spectral_core.render.trace.accumulate import Accumulator

    traced, usual = [], Accumulator.add
    monkeypatch.setattr(Accumulator, "add", lambda *given: traced.append(given[-1]) or usual(*given))
    scene = _many_lights()
    render_scene(scene, groups=True, on_progress=lambda _: None)
    assert traced and set(traced) == {scene.film.samples}


def test_tiles_do_not_leave_seams(monkeypatch):
    """A picture in many tiles equals one in a single tile within the noise."""
    from spectral_core.render.trace import accumulate

    scene = lit_plane(PointLight(name="l", world_from_light=matrix((0, 0, 3))), film=Film(16, 16, samples=256))
    whole = render_scene(scene).pixels
    monkeypatch.setattr(accumulate, "TILE_PIXELS", 37)
    tiled = render_scene(scene).pixels
    np.testing.assert_allclose(tiled, whole, rtol=2e-3)


@pytest.mark.parametrize("name", ["D65", "HP1", "FL11"])
def test_bands_have_the_spectrum_of_the_light(name):
    """A plane of reflectance 0.5 under one lamp: each band is the mean of the lamp over the band, times ρ I / π h²."""
    lamp = catalogue.illuminant(name)
    light = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100, color=lamp)
    bands = Bands.uniform(400, 700, 31)
    result = render_scene(lit_plane(light, film=Film(8, 8, samples=256)), bands=bands)
    factor = 0.5 / np.pi * 100 / (4 * np.pi) / 9
    from spectral_core.render.trace.wavelengths import WAVELENGTHS_NM

    expected = factor * bands.responses @ emitted_spectrum(lamp).at(WAVELENGTHS_NM)
    actual = result.band_pixels.mean(axis=(0, 1))
    np.testing.assert_allclose(actual, expected, rtol=0.02, atol=2e-3 * expected.max())


def test_white_light_has_unit_luminance():
    from spectral_core.spectra.observer import xyz_of

    assert xyz_of(white_light())[1] == pytest.approx(1.0, abs=1e-12)


def test_no_light_at_all_is_black():
    scene = lit_plane(film=Film(4, 4, samples=4))
    result = render_scene(scene, groups=True)
    assert result.pixels[..., :3].max() == 0 and result.pixels[..., 3].min() == 1


def test_a_mesh_without_triangles_is_no_error():
    empty = Mesh("empty", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))
    scene = lit_plane(film=Film(4, 4, samples=4))
    scene = replace(
        scene, meshes=(*scene.meshes, empty), instances=(*scene.instances, Instance("nothing", "empty", np.eye(4)))
    )
    assert render_scene(scene).status == "done"


@pytest.mark.parametrize("fog", [False, True])
def test_a_lamp_far_from_all_it_lights_is_recorded_beside_a_sun_and_a_world(fog):
    """One lamp of the usual power at 20 m got a sample in a hundred: its group was black but for single pixels."""
    height = 20.0
    medium = ScatteringMedium(density=0.004, color=gray(0.9)) if fog else None
    scene = lit_plane(
        PointLight(name="lamp", world_from_light=matrix((6, 0, height)), power_w=8e3, group="lamp"),
        SunLight(name="sun", world_from_light=matrix(), irradiance=0.3, group="sun"),
        world=World(gray(1.0), 0.5, group="sky", medium=medium),
        camera=looking_down(8, 0.5),
        film=Film(24, 24, samples=16, seed=5),
    )
    groups = render_scene(scene, groups=True).group_pixels
    alone = replace(scene, lights=scene.lights[:1], world=replace(scene.world, strength=0.0))
    expected = render_scene(replace(alone, film=replace(scene.film, samples=256))).pixels[..., 1]
    lamp = groups["lamp"][..., 1]
    assert lamp.mean() == pytest.approx(expected.mean(), rel=0.02)
    assert np.sqrt(np.mean((lamp - expected) ** 2)) < 0.2 * expected.mean()
    if not fog:  # which no light from infinitely far away passes
        assert all(np.std(groups[name][..., 1]) < 0.25 * groups[name][..., 1].mean() for name in ("sun", "sky"))
