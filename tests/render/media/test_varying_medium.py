# SPDX-License-Identifier: GPL-3.0-or-later
"""Media that vary on a grid: the integral along a ray, equal pictures of equal media, emission, bounds of blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Color,
    Film,
    Instance,
    LightPaths,
    Material,
    MediumGrid,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    World,
    gray,
)
from spectral_core.spectra.catalogue import illuminant
from tests.render.media.test_medium import box
from tests.render.scenes import matrix

pytest.importorskip("mitsuba")

LAMP = PointLight(name="lamp", world_from_light=matrix((0.4, 0.1, 3.0)), power_w=300.0)
SIZE = np.array([4.0, 4.0, 2.0])
"""The box of a medium: x and y from -2 to 2, z from -1 to 1."""


def grid_of(shape, **values):
    """A grid over the box."""
    world_from_index = np.eye(4)
    world_from_index[:3, :3] = np.diag(SIZE / np.array(shape))
    world_from_index[:3, 3] = -SIZE / 2 + SIZE / np.array(shape) / 2
    return MediumGrid(world_from_index, **{name: np.asarray(v, np.float32) for name, v in values.items()})


def column(medium, *, lamps=(LAMP,), transport="rgb", world=None, transparent=False, samples=1024, among=()):
    """A narrow view down through the box; single scattering.

    ``among``: media, the box's own too, of which the others are far off; scenes of equal ones share their kernel.
    """
    media = among or (medium,)
    places = [np.diag([*SIZE, 1.0]) for _ in media]
    for k, place in enumerate(places):
        place[0, 3] = 0.0 if media[k] is medium else 500.0 * (k + 1)
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 4.0)), field_of_view_rad=5e-4, near=0.01),
        film=Film(16, 16, samples=samples, transparent=transparent),
        meshes=(box(),),
        materials=tuple(Material(f"fog {k}", None, each) for k, each in enumerate(media)),
        instances=tuple(Instance(f"cube {k}", "box", place, (f"fog {k}",)) for k, place in enumerate(places)),
        lights=lamps,
        world=World(color=gray(0.0)) if world is None else world,
        settings=RenderSettings(transport=transport, max_bounces=0, light_paths=LightPaths(volume=0)),
    )


def layers(nz=40):
    """Densities in layers along z: a smooth hump and an empty part."""
    z = (np.arange(nz) + 0.5) / nz
    return np.where(z > 0.2, np.sin(np.pi * z) ** 2, 0.0)


def profile(values, z):
    """Values at heights z of the box, linear between the layers."""
    nz = len(values)
    return np.interp(z, -1 + (np.arange(nz) + 0.5) * 2 / nz, values)


def test_single_scattering_is_the_integral_along_the_ray():
    values, density, albedo = layers(), 3.0, 0.7
    level = np.broadcast_to(values, (3, 2, 40))
    made = ScatteringMedium(density, gray(albedo), grid=grid_of(level.shape, scattering=level, absorption=level))
    pixels = render_scene(column(made)).pixels[..., :3]
    z = np.linspace(-1, 1, 4001)
    extinction = density * profile(values, z)
    depth = np.concatenate([[0.0], np.cumsum((extinction[1:] + extinction[:-1]) / 2 * np.diff(z))])
    above = depth[-1] - depth
    away = np.linalg.norm(np.stack([0 * z + 0.4, 0 * z + 0.1, 3.0 - z], axis=1), axis=1)
    slant = away / (3.0 - z)  # the layers are level, so a slanted way is longer by this factor
    light = albedo * extinction / (4 * np.pi) * 300.0 / (4 * np.pi) / away**2 * np.exp(-above * (1 + slant))
    assert pixels.mean() == pytest.approx(float(np.sum((light[1:] + light[:-1]) / 2 * np.diff(z))), rel=0.01)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_grid_of_ones_is_the_homogeneous_medium(transport):
    color, extinction = Color(np.array([0.9, 0.5, 0.2])), Color(np.array([0.5, 0.8, 1.0]))
    plain = ScatteringMedium(1.5, color, extinction, emission_color=Color(np.array([0.2, 0.4, 0.1])))
    plain = replace(plain, emission_strength=0.3, anisotropy=0.4)
    ones = np.ones((9, 7, 5))
    varying = replace(plain, grid=grid_of(ones.shape, scattering=ones, absorption=ones, emission=ones))
    white, pair = World(color=gray(0.5)), (plain, varying)
    free = RenderSettings(transport=transport)
    one, two = (
        render_scene(replace(column(m, transport=transport, world=white, among=pair), settings=free))
        .pixels[..., :3]
        .mean((0, 1))
        for m in pair
    )
    np.testing.assert_allclose(two, one, rtol=0.015)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_colors_of_a_grid_scatter_absorb_and_emit(transport):
    """Colored grids without variation: the medium that their constant colors make."""
    scatters, absorbs, glows = (np.array(c) for c in ((0.8, 0.5, 0.3), (0.1, 0.1, 0.6), (0.7, 0.3, 0.1)))
    extinction = scatters + absorbs
    plain = ScatteringMedium(
        1.2, Color(scatters / extinction), Color(extinction), emission_color=Color(glows), emission_strength=0.5
    )
    whole = lambda color: np.broadcast_to(color, (4, 4, 4, 3))  # noqa: E731
    varying = replace(
        plain, grid=grid_of((4, 4, 4), scattering=whole(scatters), absorption=whole(absorbs), emission=whole(glows))
    )
    one, two = (
        render_scene(column(m, transport=transport, among=(plain, varying))).pixels[..., :3].mean((0, 1))
        for m in (plain, varying)
    )
    # a product of upsampled colors is another spectrum than their sums, so spectral colors differ a little
    np.testing.assert_allclose(two, one, rtol=0.01 if transport == "rgb" else 0.03)


def test_the_transparent_film_shows_the_transmittance():
    values = layers()
    made = ScatteringMedium(1.5, gray(0.0), grid=grid_of(
        (2, 2, 40), scattering=np.zeros((2, 2, 40)), absorption=np.broadcast_to(values, (2, 2, 40))))  # fmt: skip
    alpha = render_scene(column(made, lamps=(), transparent=True, samples=4096)).pixels[..., 3]
    z = np.linspace(-1, 1, 4001)
    depth = float(np.mean(profile(values, z))) * 2 * 1.5
    assert alpha.mean() == pytest.approx(1 - np.exp(-depth), rel=0.01)


def test_a_medium_that_only_emits_shows_its_integral():
    values = layers()
    made = ScatteringMedium(
        0.0, gray(0.0), emission_strength=0.5, grid=grid_of((2, 2, 40), emission=np.broadcast_to(values, (2, 2, 40)))
    )
    pixels = render_scene(column(made, lamps=())).pixels[..., :3]
    z = np.linspace(-1, 1, 4001)
    assert pixels.mean() == pytest.approx(0.5 * 2 * float(np.mean(profile(values, z))), rel=0.01)


def test_a_spectral_medium_varies_in_its_amount_alone():
    """Absorption by a sharp spectrum under a grid: Beer and Lambert's law per wavelength."""
    from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

    nm = np.array([360.0, 540.0, 550.0, 830.0])
    line = Spectrum("edge", SpectralGrid(nm), np.array([0.0, 0.0, 2.0, 2.0]))
    values = layers()
    made = ScatteringMedium(1.0, gray(0.0), line, grid=grid_of(
        (2, 2, 40), scattering=np.zeros((2, 2, 40)), absorption=np.broadcast_to(values, (2, 2, 40))))  # fmt: skip
    depth = float(np.mean(profile(values, np.linspace(-1, 1, 4001)))) * 2
    plain = replace(made, density=depth / 2, grid=None)
    lit = World(color=illuminant("A"), strength=1.0)
    one, two = (
        render_scene(column(m, lamps=(), transport="spectral", world=lit, among=(plain, made)))
        .pixels[..., :3]
        .mean((0, 1))
        for m in (plain, made)
    )
    np.testing.assert_allclose(two, one, rtol=0.02, atol=0.006)


def test_bounds_hold_between_voxels():
    from spectral_core.render.trace.media.grids import blockwise_maxima

    values = np.random.default_rng(5).random((37, 5, 20))
    for edge in (1, 3, 4):
        blocks = blockwise_maxima(values, edge)
        assert blocks.shape == tuple(-(-n // edge) for n in values.shape)
        for i, j, k in np.ndindex(blocks.shape):
            near = tuple(slice(max(n * edge - 1, 0), (n + 1) * edge + 1) for n in (i, j, k))
            assert blocks[i, j, k] == values[near].max()


@pytest.mark.parametrize("values", [np.zeros((0, 2, 2)), np.full((2, 2, 2), -1.0), np.full((2, 2, 2), np.nan)])
def test_a_bad_grid_is_refused(values):
    with pytest.raises(InvalidInputError, match="MediumGrid has values"):
        grid_of((2, 2, 2), scattering=values)


@pytest.mark.parametrize("values", ["dense", [[1.0], [2.0, 3.0]], {"a": 1.0}])
def test_a_grid_of_other_things_than_numbers_is_refused(values):
    with pytest.raises(InvalidInputError, match="MediumGrid absorption is of type .*; expected numbers"):
        MediumGrid(np.eye(4), absorption=values)


def test_a_grid_may_be_given_as_lists():
    """It was accepted, and ended the render with an AttributeError."""
    made = MediumGrid(np.eye(4).tolist(), scattering=[[[0.5, 1.0]]])
    assert made.shape == (1, 1, 2) and made.scattering.dtype == np.float32


def test_a_grid_above_one_is_refused():
    with pytest.raises(InvalidInputError, match="put their scale into its density"):
        ScatteringMedium(grid=grid_of((2, 2, 2), scattering=np.full((2, 2, 2), 1.5)))


def test_a_lamp_within_a_varying_medium_is_dimmed_up_to_itself_alone():
    """It was dimmed up to the next surface behind it, and lost with the paths that scatter there."""
    density = layers()
    filled = grid_of((1, 1, 40), scattering=density.reshape(1, 1, -1), absorption=density.reshape(1, 1, -1))
    ball = PointLight(
        name="ball", world_from_light=np.eye(4), power_w=30.0, radius=0.4, soft_falloff=False, camera_visible=True
    )
    made = render_scene(column(ScatteringMedium(1.5, gray(0.0), grid=filled), lamps=(ball,), samples=256))
    z = np.linspace(0.4, 1.0, 2001)
    before = np.exp(-1.5 * 0.6 * profile(density, z).mean())
    lamp = 30.0 / (4 * np.pi**2 * 0.4**2) * before
    np.testing.assert_allclose(made.pixels[..., :3].mean(), lamp, rtol=0.02)


def test_a_medium_ends_with_its_voxels():
    """A block is two voxels wide, along z as well; the border of a volume is a tenth of a voxel beyond its voxels."""
    ones = np.ones((17, 1, 1))
    fog = ScatteringMedium(0.5, gray(0.0), grid=grid_of(ones.shape, scattering=ones, absorption=ones))
    made = column(fog, lamps=(), world=World(color=gray(1.0)), samples=256)
    (cube,) = made.instances
    border = np.diag([4.4, 4.4, 2.4, 1.0])
    seen = render_scene(replace(made, instances=(replace(cube, world_from_object=border),))).pixels[..., :3]
    assert seen.mean() == pytest.approx(np.exp(-1.0), rel=0.015)
