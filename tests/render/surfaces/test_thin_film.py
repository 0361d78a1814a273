# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin films: Airy's formula in kernels compared with transfer matrices, its mean in RGB transport, energy, plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.render.checks import furnace_scenes
from benchmarks.render.checks.film_forms import reflected
from spectral_core.errors import InvalidInputError
from spectral_core.render import plan_from_data, render_scene
from spectral_core.render.plan.errors.thin_film import KNOTS_NM, layers_of, reflectance
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.render.variant import activate, choose_backend
from spectral_core.scene import Film as Raster
from spectral_core.scene import (
    Glass,
    ImageTexture,
    Instance,
    Material,
    Metal,
    PointLight,
    Principled,
    RenderSettings,
    World,
    gray,
    leaves,
)
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import observer
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")
NM = np.arange(400.0, 701.0, 7.0)
LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)


def film(thickness, index, transport="spectral", wavelengths=NM):
    """A film in a kernel with one wavelength per lane."""
    mi = activate(choose_backend(transport))
    import drjit as dr

    from spectral_core.render.plugins.closures.facets.film import FilmAt, response

    class Table:
        def entry(self, place):
            return dr.gather(mi.Float, mi.Float(response().ravel()), place)

    waves = mi.Spectrum(*[mi.Float(wavelengths)] * 4) if transport == "spectral" else None
    return mi, dr, FilmAt(mi, dr, mi.Float(thickness), mi.Float(index), waves, Table())


@pytest.mark.parametrize("degrees", [0.0, 35.0, 70.0, 88.0])
@pytest.mark.parametrize("index", [1.25, 1.38, 2.3])
@pytest.mark.parametrize("inside", [False, True])
def test_the_reflection_of_a_film_on_glass_equals_its_transfer_matrix(index, degrees, inside):
    sides = (1.5, 1.0) if inside else (1.0, 1.5)
    mi, _, upon = film(370.0, index)
    found = np.array(upon.on_dielectric(mi.Float(np.cos(np.radians(degrees))), *map(mi.Float, sides)))[0]
    expected = reflected((sides[0], index, sides[1]), 370.0, np.radians(degrees))(NM)
    np.testing.assert_allclose(found, expected, atol=3e-6)


def test_transmission_through_a_film_is_equal_in_both_directions():
    mi, _, upon = film(520.0, 1.7)
    outer = np.cos(np.radians(50.0))
    inner = np.sqrt(1 - (np.sin(np.radians(50.0)) / 1.5) ** 2)
    into = np.array(upon.on_dielectric(mi.Float(outer), mi.Float(1.0), mi.Float(1.5)))
    out = np.array(upon.on_dielectric(mi.Float(inner), mi.Float(1.5), mi.Float(1.0)))
    np.testing.assert_allclose(into, out, atol=3e-6)


@pytest.mark.parametrize("degrees", [0.0, 60.0, 85.0])
@pytest.mark.parametrize("metal", [0.2 + 3.4j, 2.9 + 3.1j, 1.4 + 0.1j])
def test_the_reflection_of_a_film_on_metal_equals_its_transfer_matrix(metal, degrees):
    mi, _, upon = film(250.0, 1.8)
    pair = mi.Spectrum(metal.real), mi.Spectrum(metal.imag)
    found = np.array(upon.on_metal(mi.Float(np.cos(np.radians(degrees))), pair))[0]
    np.testing.assert_allclose(found, reflected((1.0, 1.8, metal), 250.0, np.radians(degrees))(NM), atol=5e-6)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 75.0])
@pytest.mark.parametrize("base", [1.52 + 0j, 0.2 + 3.4j, 2.9 + 3.1j])
def test_the_plan_computes_the_reflection_of_a_film_by_its_transfer_matrix(base, degrees):
    colors = {"thin_film_thickness": 310.0, "thin_film_ior": 1.7}
    if base.imag:
        # Gulbrandsen 2014: the color at normal incidence, and the edge's tint between the least and the largest index
        facing = abs((base - 1) / (base + 1)) ** 2
        most, least = (1 + facing**0.5) / (1 - facing**0.5), (1 - facing) / (1 + facing)
        tints = (gray(facing), gray((most - base.real) / (most - least)))
        closure = Metal(color=tints[0], edge_tint=tints[1], **colors)
    else:
        closure = Glass(ior=base.real, **colors)
    ((indices, thickness),) = layers_of(closure)
    found = reflectance(indices, np.cos(np.radians(degrees)), thickness)
    expected = reflected((1.0, 1.7, base), 310.0, np.radians(degrees))(KNOTS_NM)
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(("thickness", "index"), [(120.0, 1.33), (500.0, 1.33), (300.0, 1.8), (3000.0, 1.5)])
def test_three_channels_show_the_mean_over_their_sensitivities(thickness, index):
    mi, _, upon = film(thickness, index, "rgb")
    viewer = observer("cie_1931_2deg")
    channels = RGB_FROM_XYZ @ viewer.cmfs
    for degrees in (0.0, 50.0):
        found = np.array(upon.on_dielectric(mi.Float(np.cos(np.radians(degrees))), mi.Float(1.0), mi.Float(1.5)))
        share = reflected((1.0, index, 1.5), thickness, np.radians(degrees))(viewer.wavelengths_nm)
        np.testing.assert_allclose(found.ravel(), channels @ share / channels.sum(axis=1), atol=1.5e-3)


def test_a_film_of_zero_thickness_changes_nothing():
    mi, _, upon = film(0.0, 2.0, "rgb")
    found = np.array(upon.on_dielectric(mi.Float(0.5), mi.Float(1.0), mi.Float(1.5))).ravel()
    np.testing.assert_allclose(found, reflected((1.0, 1.0, 1.5), 0.0, np.radians(60.0))(np.full(3, 550.0)), atol=1e-5)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_an_image_sets_the_thickness(transport):
    """Of metal and of a dark coat: six planes side by side, seen one at a time with one kernel."""
    texture = ImageTexture("film", np.full((2, 2, 1), 420.0, np.float32), "linear")
    surfaces = Metal(gray(0.6), gray(0.5), 0.1), Principled(gray(0.0), roughness=0.1)
    coated = [
        replace(surface, thin_film_thickness=thickness, thin_film_ior=1.8)
        for surface in surfaces
        for thickness in (420.0, texture, 0.0)
    ]
    table = lit_plane(transport=transport, world=World(gray(1.0)), film=Raster(4, 4, samples=64))
    scene = replace(
        table,
        materials=tuple(Material(f"m{k}", each) for k, each in enumerate(coated)),
        instances=tuple(Instance(f"i{k}", "plane", matrix((100.0 * k, 0, 0)), (f"m{k}",)) for k in range(6)),
    )
    cameras = [replace(table.camera, world_from_camera=matrix((100.0 * k, 0, 2.0))) for k in range(6)]
    shown = [render_scene(replace(scene, camera=each)).pixels[..., :3].mean(axis=(0, 1)) for each in cameras]
    for first in (0, 3):
        np.testing.assert_allclose(shown[first], shown[first + 1], rtol=0.03)
        assert np.abs(shown[first] - shown[first + 2]).max() > 0.02


@pytest.mark.parametrize("name", ["Glass, thin film", "Metal, thin film", "Principled, thin film"])
def test_a_film_adds_no_energy(name):
    from benchmarks.render.checks.furnace_scenes import SURFACES, tile_albedos

    albedo, noise, lost = tile_albedos(SURFACES[name], 64, "spectral")
    assert (albedo.mean(axis=-1) - 4.5 * noise.mean(axis=-1)).max() < 1.004 and lost == 0


@pytest.mark.parametrize("surface", [Glass(), Metal(), Principled()])
def test_the_plan_lists_films(surface):
    plain = plan_from_data(lit_plane(LAMP, surface=surface))["thin_film"]
    assert (plain.value, plain.reason) == ("off", "no surface has a thin film")
    scene = lit_plane(LAMP, surface=replace(surface, thin_film_thickness=400.0, thin_film_ior=1.7))
    row = plan_from_data(scene)["thin_film"]
    assert row.value == "on" and row.how == "bounded" and row.error > 1 and "'paper'" in row.reason
    faint = lit_plane(LAMP, surface=replace(surface, thin_film_thickness=400.0, thin_film_ior=1.0))
    if not isinstance(surface, Metal):  # a film with the index of air on metal is visible only through interference
        assert plan_from_data(faint)["thin_film"].value == "off"
    chosen = replace(scene, settings=RenderSettings(overrides=(("thin_film", "off"),)))
    kept = [leaf for item in simulated_scene(chosen, plan_from_data(chosen)).materials for leaf in leaves(item.surface)]
    assert [leaf.thin_film_thickness for leaf in kept] == [0.0]


def test_impossible_thicknesses_are_refused():
    with pytest.raises(InvalidInputError, match="Glass thin film thickness"):
        Glass(thin_film_thickness=-1.0)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_rough_glass_keeps_its_energy_under_a_film(monkeypatch, transport):
    """From behind, facets past the angle of total reflection decide: two means of their cosines missed 3 %."""
    monkeypatch.setattr(furnace_scenes, "ROUGHNESS", (0.8, 1.0))
    glass = Glass(gray(1.0), 1.0, 1.5, thin_film_thickness=700.0, thin_film_ior=2.0)
    found, _, lost = furnace_scenes.tile_albedos(lambda rough: replace(glass, roughness=rough), 1024, transport)
    assert lost == 0
    assert np.abs(found.mean(axis=-1) - 1).max() < 0.009


VARYING = ImageTexture("film", np.array([1.1, 1.9], np.float32).reshape(1, 2, 1), "linear")


@pytest.mark.parametrize(
    "surface",
    [
        Principled(gray(0.8), metallic=0.4, ior=1.33),
        Principled(gray(0.8), metallic=VARYING, ior=1.33),
        Principled(gray(0.8), ior=1.33, thin_film_ior=VARYING),
        Glass(ior=1.33, thin_film_ior=VARYING),
    ],
)
def test_a_film_that_only_a_part_of_a_surface_hides_is_kept(surface):
    """Water below a film of its own index shows no film, but the metal in it does, and so do other indices."""
    plan = plan_from_data(lit_plane(LAMP, surface=replace(surface, thin_film_thickness=400.0)))
    assert plan["thin_film"].value == "on" and plan["thin_film"].error > 10


def test_a_film_of_the_index_below_it_is_left_out():
    plan = plan_from_data(lit_plane(LAMP, surface=Glass(ior=1.33, thin_film_thickness=400.0)))
    assert plan["thin_film"].value == "off"
