# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of a Scene through ``render_scene``: closed forms in both transports, surfaces, coverage, light groups."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import InvalidInputError
from spectral_core.render import plan_effects, render_scene
from spectral_core.scene import (
    Camera,
    Color,
    Emission,
    Film,
    Instance,
    Mesh,
    PointLight,
    RenderSettings,
    Scene,
    VolumeObject,
    World,
    gray,
)
from spectral_core.scene import Material as SurfaceMaterial
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid
from spectral_core.volume.transfer import Material, TransferFunction

DEPTH = 1.2
OPACITY = 1 - np.exp(-DEPTH)
COLOR = np.array([0.8, 0.5, 0.2])


def slab(transfer, lighting="even", quality=50.0):
    """A constant field, one unit thick along the view and larger than it across."""
    matrix = np.diag([2.0, 2.0, 0.25, 1.0])
    matrix[:3, 3] = [-3.0, -3.0, -0.375]
    field = np.full((4, 4, 4), 1.0, np.float32)
    return VolumeObject("slab", field, matrix, transfer, quality=quality, lighting=lighting)


def constant(color=COLOR, *, wavelengths=None, lit=True, extinction=DEPTH, emission=0.0):
    material = Material("m", [0.0, 2.0], [extinction] * 2, color, [emission] * 2, lit)
    return TransferFunction((material,), wavelengths)


def scene(*volumes, **rest):
    matrix = np.eye(4)
    matrix[2, 3] = 4.0
    camera = Camera(world_from_camera=matrix, kind="orthographic", orthographic_scale=1.0)
    film = rest.pop("film", Film(8, 6, samples=8, filter_kind="box", filter_width=1.0))
    return Scene(camera=camera, film=film, volumes=volumes, **rest)


def mean_rgb(pixels):
    return pixels[..., :3].reshape(-1, 3).mean(axis=0)


def glowing_wall(z=-2.0, strength=1.0):
    corners = np.array([[-5, -5, z], [5, -5, z], [5, 5, z], [-5, 5, z]], np.float32)
    mesh = Mesh("wall", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    material = SurfaceMaterial("glow", Emission(gray(1.0), strength))
    return {"meshes": (mesh,), "materials": (material,), "instances": (Instance("wall", "wall", np.eye(4), ("glow",)),)}


def test_a_slab_shows_its_color_in_proportion_to_its_opacity():
    result = render_scene(scene(slab(constant())))
    assert result.variant.endswith("rgb")
    assert np.abs(result.pixels[..., :3] - COLOR * OPACITY).max() < 2e-3


def test_spectral_transport_shows_the_same_color():
    settings = RenderSettings(transport="spectral")
    film = Film(8, 6, samples=256, filter_kind="box", filter_width=1.0)
    result = render_scene(scene(slab(constant()), settings=settings, film=film))
    assert result.variant.endswith("spectral")
    assert mean_rgb(result.pixels) == pytest.approx(COLOR * OPACITY, abs=0.01)


def test_spectra_of_materials_require_spectral_transport():
    grid = SpectralGrid.uniform(360, 830, 5)
    flat = constant(np.full(grid.size, 0.6), wavelengths=grid.wavelengths_nm)
    film = Film(8, 6, samples=256, filter_kind="box", filter_width=1.0)
    plan = plan_effects(scene(slab(flat)))
    assert plan.is_spectral
    assert "slab" in plan["transport"].reason
    result = render_scene(scene(slab(flat), film=film))
    assert mean_rgb(result.pixels) == pytest.approx([0.6 * OPACITY] * 3, abs=0.01)


def test_x_rays_emit_light_and_absorb_nothing():
    xray = constant(lit=False, extinction=0.0, emission=0.5)
    behind = render_scene(scene(slab(xray), **glowing_wall(strength=0.7)))
    assert np.abs(behind.pixels[..., :3] - (COLOR * 0.5 + 0.7)).max() < 4e-3


def test_surfaces_behind_are_dimmed_and_those_in_front_occlude():
    behind = render_scene(scene(slab(constant()), **glowing_wall(-2.0)))
    assert np.abs(behind.pixels[..., :3] - (COLOR * OPACITY + 1 - OPACITY)).max() < 4e-3
    before = render_scene(scene(slab(constant()), **glowing_wall(2.0)))
    assert np.abs(before.pixels[..., :3] - 1.0).max() < 4e-3
    inside = render_scene(scene(slab(constant()), **glowing_wall(0.0)))
    half = 1 - np.exp(-DEPTH / 2)
    assert np.abs(inside.pixels[..., :3] - (COLOR * half + 1 - half)).max() < 4e-3


def test_the_coverage_before_a_transparent_background_is_the_opacity():
    film = Film(8, 6, samples=8, filter_kind="box", filter_width=1.0, transparent=True)
    world = World(Color(np.array([0.3, 0.3, 0.3])))
    result = render_scene(scene(slab(constant()), film=film, world=world))
    assert np.abs(result.pixels[..., 3] - OPACITY).max() < 1e-3
    assert np.abs(result.pixels[..., :3] - COLOR * OPACITY).max() < 2e-3


def test_the_lights_of_the_scene_light_it_and_their_shares_add_up():
    place = np.eye(4)
    place[:3, 3] = [0, 0, 2.0]
    lamps = tuple(
        PointLight(name=name, world_from_light=place, power_w=watts, group=name)
        for name, watts in (("two", 80.0), ("one", 40.0))
    )
    glow = Material("glow", [0.0, 2.0], [0.1, 0.1], np.array([0.2, 0.2, 0.9]), lit=False)
    paint = Material("paint", [0.0, 2.0], [DEPTH] * 2, COLOR)
    both = slab(TransferFunction((paint, glow)), "scene")
    film = Film(8, 6, samples=256, filter_kind="box", filter_width=1.0)
    result = render_scene(scene(both, lights=lamps, film=film), groups=True)
    shares = result.group_pixels
    total = sum(share[..., :3] for share in shares.values())
    assert np.abs(total - result.pixels[..., :3]).max() < 1e-5
    # emission counts once, to the first group by name; without it the second lamp gives twice the light of the first
    own = 0.1 * glow.color * (1 - np.exp(-DEPTH - 0.1)) / (DEPTH + 0.1)
    single, double = mean_rgb(shares["one"]) - own, mean_rgb(shares["two"])
    assert double / single == pytest.approx([2.0] * 3, rel=0.1)  # each step samples one lamp at random


def test_a_volume_in_even_light_stays_so_beside_one_that_lamps_light():
    """It was black without lamps, because the lighting of one volume was that of all."""
    beside = replace(slab(constant(), "scene"), name="beside", world_from_index=np.diag([1e-3, 1e-3, 1e-3, 1.0]))
    shown = render_scene(scene(slab(constant()), beside)).pixels
    assert np.abs(shown[0, :, :3] - COLOR * OPACITY).max() < 2e-3


@pytest.mark.parametrize("is_spectral", [False, True])
def test_materials_that_shine_in_even_light_look_as_lit_ones(is_spectral):
    from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
    from spectral_core.volume.mitsuba_integrator.scene_colors import in_even_light

    grid = SpectralGrid.uniform(380, 780, 5)
    color = catalogue.reflectance("orange").resampled(grid).values if is_spectral else COLOR
    lit = constant(color, wavelengths=grid.wavelengths_nm if is_spectral else None)
    glow = replace(lit.materials[0], name="glow", lit=False)
    both = replace(lit, materials=(*lit.materials, glow))
    even = in_even_light(both)
    assert not any(each.lit for each in even.materials)
    np.testing.assert_allclose(display_matrix(even), display_matrix(both), atol=2e-3)


@pytest.mark.parametrize(
    ("lighting", "expected"), [("even", (True, False)), ("scene", (True, False)), ("shadows", (True, True))]
)
def test_only_volumes_with_shadows_cast_them(lighting, expected):
    from spectral_core.render.volumes import _item

    made = _item(slab(constant(), lighting), "shadows", spectral=False, own_light=True)
    assert (made.in_camera, made.in_shadow) == expected
    assert [each.lit for each in made.transfer.materials] == [lighting != "even"]


def test_a_volume_that_the_plan_omits_is_not_rendered():
    settings = RenderSettings(overrides=(("volumes", "off"),))
    result = render_scene(scene(slab(constant()), settings=settings))
    assert np.abs(result.pixels[..., :3]).max() == 0


def test_a_painted_volume_under_a_sodium_lamp_has_its_spectral_color():
    """Scene light in spectral transport: the ratio of a paint's color to that of white, under the lamp's spectrum."""
    from spectral_core.spectra.observer import linear_rgb_from_product

    lamp = catalogue.illuminant("HP1")
    grid = SpectralGrid.uniform(380, 780, 5)
    orange = catalogue.reflectance("orange").resampled(grid).values
    place = np.eye(4)
    place[:3, 3] = [0, 0, 2.0]
    light = PointLight(name="sodium", world_from_light=place, power_w=100.0, color=lamp)
    film = Film(8, 6, samples=512, filter_kind="box", filter_width=1.0)
    shown = []
    for reflectance in (orange, np.ones(grid.size)):
        transfer = constant(reflectance, wavelengths=grid.wavelengths_nm)
        shown.append(mean_rgb(render_scene(scene(slab(transfer, "scene"), lights=(light,), film=film)).pixels))
    matrix = linear_rgb_from_product(lamp, grid)
    expected = (matrix @ orange) / (matrix @ np.ones(grid.size))
    assert (shown[0] / shown[1])[:2] == pytest.approx(expected[:2], rel=0.03)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"quality": 5.0}, "the quality of volume 'slab' is 5.0 dB"),
        ({"rule": "best"}, "no step rule is named 'best'"),
        ({"lighting": "evn"}, "no volume lighting is named 'evn'; did you mean 'even'"),
    ],
)
def test_invalid_settings_are_reported(change, message):
    with pytest.raises(InvalidInputError, match=message):
        render_scene(scene(replace(slab(constant()), **change)))


def test_the_box_of_a_volume_among_media_is_larger_than_its_voxels():
    """Faces that coincide with a floor lost the medium above it."""
    from spectral_core.render.volumes_as_media import volumes_as_media

    volume = slab(constant(), lighting="scene")
    (item,) = volumes_as_media(scene(volume)).instances
    corners = np.linalg.inv(volume.world_from_index) @ item.world_from_object @ np.array([(0, 0, 0, 1), (1, 1, 1, 1)]).T
    np.testing.assert_allclose(corners[:3].T, [(-0.6,) * 3, (3.6,) * 3], atol=1e-9)


def test_a_volume_among_media_takes_the_ultraviolet_light_that_excites_dyes():
    from spectral_core.render.volumes_as_media import volumes_as_media

    given = constant(np.full(31, 0.5), wavelengths=np.arange(400.0, 701.0, 10.0))
    (item,) = volumes_as_media(scene(slab(given, lighting="scene")), spectral=True).materials
    assert sum(part[0].at(340.0) for part in item.medium.grid.spectra[:2]) == 1.0


def test_samples_of_a_volume_among_media_have_its_peaks():
    """A grid twice as fine as the voxels had no samples at their centers, and cut a peak of one voxel to 0.42."""
    from spectral_core.render.volumes_as_media import volumes_as_media

    peak = np.zeros((5, 5, 5), np.float32)
    peak[2, 2, 2] = 1.0
    ramp = TransferFunction((Material("m", [0.0, 1.0], [0.0, 2.0], COLOR, lit=False),))
    (item,) = volumes_as_media(scene(replace(slab(ramp), data=peak))).materials
    assert item.medium.emission_strength == pytest.approx(2.0 * COLOR.max(), rel=1e-6)
    assert item.medium.grid.shape == (15, 15, 15)


def test_each_volume_has_the_step_rule_that_it_states():
    import mitsuba as mi

    from spectral_core.render.volumes import sampled_volumes

    mi.set_variant("llvm_ad_rgb")
    volumes = [replace(slab(constant()), name=rule, rule=rule) for rule in ("uniform", "error", "auto")]
    made = sampled_volumes(scene(*volumes), None, spectral=False)
    ways = [plan.stepping.rule for plan in made.fields.plans]
    assert ways[:2] == ["uniform", "error"]
    tried = {trial.stepping.rule for trial in made.fields.plans[2].trials}
    assert tried == {"uniform", "error", "cells"}


def test_a_camera_of_a_very_wide_angle_sees_a_volume():
    wide = Camera(world_from_camera=np.eye(4), kind="perspective", field_of_view_rad=np.radians(175.0))
    volume = slab(constant())
    result = render_scene(replace(scene(volume), camera=wide))
    assert np.isfinite(result.pixels).all()
    # Inside a slab half its thickness is ahead along the axis, and more at an angle.
    assert (result.pixels[..., :3] > 0.99 * COLOR * (1 - np.exp(-0.6))).all()


@pytest.mark.parametrize("quality", [np.nan, np.inf, 9.0, 91.0])
def test_a_quality_out_of_range_names_its_volume(quality):
    with pytest.raises(InvalidInputError, match="the quality of volume 'slab'"):
        slab(constant(), quality=quality)


def test_notes_name_volumes_whose_quality_is_not_reached_or_does_not_count_shadows():
    from types import SimpleNamespace

    from spectral_core.render.volumes import WITHOUT_SHADOWS, missed_qualities

    items = [SimpleNamespace(volume=SimpleNamespace(name=name), in_camera=True) for name in ("good", "short")]
    plans = [SimpleNamespace(shortfall=None), SimpleNamespace(shortfall="it is not reached")]
    for shadows, planned, expected in ((False, False, 1), (True, True, 1), (True, False, 3)):
        settings = SimpleNamespace(shadows=shadows)
        fields = SimpleNamespace(items=items, plans=plans, settings=settings, shadows_planned=planned)
        notes = missed_qualities(fields)
        assert [(note.subject, note.message) for note in notes][:1] == [("short", "it is not reached")]
        assert len(notes) == expected
    assert {note.message for note in notes[1:]} == {WITHOUT_SHADOWS}


@pytest.mark.parametrize(
    ("lamps", "sky", "expected"), [(1, False, True), (3, False, True), (4, False, False), (1, True, False)]
)
def test_pilot_rays_see_the_shadows_of_a_few_lamps(lamps, sky, expected):
    import mitsuba as mi

    from spectral_core.volume.mitsuba_integrator.unit_light import sees_shadows

    mi.set_variant("llvm_ad_rgb")
    things = {f"lamp{number}": {"type": "point", "position": [number, 0, 5]} for number in range(lamps)}
    made = mi.load_dict({"type": "scene"} | things | ({"sky": {"type": "constant"}} if sky else {}))
    assert sees_shadows(made) == expected
