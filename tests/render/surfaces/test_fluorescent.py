# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent surfaces in a render: color by formula, mixes, omission by the plan, and RGB transport."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from benchmarks.render.cases.meshes import at, box, square
from spectral_core.errors import InvalidInputError
from spectral_core.palette.paint.fluorescence import FluorescentSurface, led
from spectral_core.render.job import RenderJob
from spectral_core.render.mitsuba_scene.fluorescent import MOST_TIMES, emission_spectra
from spectral_core.render.plan.effects import plan_effects, plan_from_data
from spectral_core.scene import (
    AddSurface,
    Camera,
    Diffuse,
    Film,
    Fluorescent,
    Glass,
    ImageTexture,
    Instance,
    Material,
    MixSurface,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum

GRID = SpectralGrid.uniform(360, 780, 10)
DYE = FluorescentDye.gaussian("green", 405, 530)
DYE_OF_ULTRAVIOLET = FluorescentDye.gaussian("ultraviolet", 345, 530, widths_nm=(12.0, 20.0))
PAINT = FluorescentSurface(
    "paint", Reflectance("paint", GRID, 0.3 + 0.1 * np.sin(GRID.wavelengths_nm / 40)), (DYE,), np.array([0.4])
)


def closure(paint: FluorescentSurface) -> Fluorescent:
    """The surface of a palette as a material, with its dyes at the palette's wavelengths."""
    known = tuple(
        FluorescentDye(dye.name, Spectrum("excitation", paint.grid, dye.excitation_on(paint.grid)), dye.emission)
        for dye in paint.dyes
    )
    return Fluorescent(paint.reflectance, known, tuple(paint.amounts))


def lit(surface, light, *, samples=256, **settings) -> Scene:
    """A tile under a uniform world that fills the picture."""
    return Scene(
        camera=Camera(world_from_camera=at(0, 0, 5), kind="orthographic", orthographic_scale=0.01),
        film=Film(8, 8, samples, filter_kind="box", filter_width=1.0),
        meshes=(square(),),
        materials=(Material("paint", surface),),
        instances=(Instance("tile", "square", at(), ("paint",)),),
        world=World(light),
        settings=RenderSettings(**settings),
    )


def shown(scene):
    """Mean color, its standard error, and the job."""
    job = RenderJob(scene, plan_effects(scene, pilot=False))
    job.trace(scene.film.samples)
    pixels = job.picture()[..., :3].reshape(-1, 3).astype(float)
    return pixels.mean(axis=0), pixels.std(axis=0, ddof=1) / np.sqrt(len(pixels)), job


def unit(light: Illuminant) -> Illuminant:
    return normalized(light)


@pytest.mark.parametrize("light", [catalogue.illuminant("D65"), catalogue.illuminant("FL2"), led(405)])
def test_a_surface_of_a_palette_renders_in_its_designed_color(light):
    """Oracle: the palette's sum over the bispectral matrix, which shares no code with the renderer."""
    found, noise, _ = shown(lit(closure(PAINT), light))
    expected = PAINT.linear_rgb(unit(light))
    assert np.all(np.abs(found - expected) <= 4.5 * noise + 2e-3 * np.abs(expected).max())
    plain = replace(PAINT, amounts=np.array([0.0])).linear_rgb(unit(light))
    assert np.abs(plain - expected).max() > 20 * noise.max()  # noise is smaller than the effect of the dyes


def test_mixed_and_added_dyes_count_by_their_share():
    light = unit(led(405))
    other = FluorescentDye.gaussian("red", 420, 620)
    first = Fluorescent(gray(0.0), (DYE,), (0.5,))
    second = Fluorescent(gray(0.0), (other,), (0.4,))
    found, noise, _ = shown(lit(MixSurface(0.25, first, AddSurface(second, Diffuse(gray(0.1)))), light))
    colors = [surface.sent_out(light, np.arange(360.0, 831.0)) for surface in (first, second)]
    nm = np.arange(360.0, 831.0)
    from spectral_core.spectra.observer import xyz_of

    power = 0.75 * colors[0] + 0.25 * colors[1] + 0.025 * light.at(nm)
    expected = RGB_FROM_XYZ @ xyz_of(Spectrum("sum", SpectralGrid(nm), power))
    assert np.all(np.abs(found - expected) <= 4.5 * noise + 5e-3 * np.abs(expected).max())


def test_a_surface_without_dye_is_diffuse():
    light = catalogue.illuminant("A")
    bare, _, _ = shown(lit(Fluorescent(PAINT.reflectance), light, samples=16, transport="spectral"))
    matt, _, _ = shown(lit(Diffuse(PAINT.reflectance), light, samples=16, transport="spectral"))
    np.testing.assert_array_equal(bare, matt)


def test_the_plan_turns_fluorescence_on_and_off():
    scene = lit(closure(PAINT), led(405))
    plan = plan_from_data(scene)
    row = plan["fluorescence"]
    assert (row.value, plan["transport"].value) == ("on", "spectral")
    assert row.error > 20 and row.how == "bounded" and "'paint'" in row.reason
    off = replace(scene, settings=RenderSettings(overrides=(("fluorescence", "off"),), transport="spectral"))
    dark, _, _ = shown(off)
    matt, _, _ = shown(lit(Diffuse(PAINT.reflectance), led(405), transport="spectral"))
    np.testing.assert_allclose(dark, matt, rtol=0.15, atol=2e-3)
    faint = lit(replace(closure(PAINT), amounts=(1e-7,)), catalogue.illuminant("D65"))
    assert plan_from_data(faint)["fluorescence"].value == "off"
    assert plan_from_data(lit(Diffuse(), led(405)))["fluorescence"].reason == "no material holds a fluorescent dye"


def test_rgb_transport_shows_the_color_in_daylight_with_a_note():
    found, _, job = shown(lit(closure(PAINT), catalogue.illuminant("D65"), transport="rgb", samples=16))
    expected = PAINT.linear_rgb(unit(catalogue.illuminant("D65")))
    np.testing.assert_allclose(found, expected, rtol=0.02)
    assert any("under daylight: RGB transport knows no other wavelengths" in note.message for note in job.notes)


def test_dyes_are_unchanged_beside_a_medium():
    scene = lit(closure(PAINT), led(405), transport="spectral")
    settings = replace(scene.settings, overrides=(("media", "on"),))
    fog = Material("fog", None, ScatteringMedium(1.0))
    far = replace(
        scene,
        settings=settings,
        materials=(*scene.materials, fog),
        instances=(*scene.instances, Instance("cube", "square", at(500, 0, 0), ("fog",))),
    )
    alone, noise, _ = shown(scene)
    beside, more, job = shown(far)
    assert not job.notes
    assert np.all(np.abs(beside - alone) <= 4.5 * np.hypot(noise, more)), (beside, alone, noise, more)


def test_emission_above_the_absorbed_light_is_refused_with_a_remedy():
    with pytest.raises(InvalidInputError, match=r"returns 1\.\d+ of the light at \d+ nm.*multiply the amounts") as told:
        Fluorescent(gray(0.5), (DYE,), (0.6,))
    factor = float(str(told.value).partition("dyes by ")[2].partition(",")[0])
    Fluorescent(gray(0.5), (DYE,), (0.6 * factor,))
    assert Fluorescent.largest_share(gray(0.5), (DYE,), (0.6,)) == pytest.approx(factor, abs=2e-3)
    with pytest.raises(InvalidInputError, match="1 dye and 2 amounts; give one per dye"):
        Fluorescent(gray(0.5), (DYE,), (0.1, 0.1))


def test_a_dye_brighter_than_white_gets_more_wavelengths():
    """Violet light is dark to the eye and the dye's green is bright; in daylight it is not brighter than white."""
    scene = lit(closure(PAINT), led(405))
    counts = [len(emission_spectra(scene, [unit(light)])) for light in (led(405), catalogue.illuminant("D65"))]
    assert counts == [MOST_TIMES, 1] and emission_spectra(scene, []) == [DYE.emission]


def test_a_dye_under_lines_of_unlike_brightness_renders_in_its_color():
    """A line that nobody sees excites it, beside one that the paint reflects: the sum is that of the palette."""
    grid = SpectralGrid.uniform(360, 780, 10)
    nm = grid.wavelengths_nm
    light = unit(Illuminant("two lines", grid, np.where(nm == 400, 60.0, np.where(nm == 660, 1.0, 0.0))))
    found, noise, _ = shown(lit(closure(PAINT), light))
    expected = PAINT.linear_rgb(light)
    assert np.all(np.abs(found - expected) <= 4.5 * noise + 2e-3 * np.abs(expected).max())
    assert noise.max() < 0.01 * expected.max()


VIOLET = Illuminant("violet", SpectralGrid([404.9, 405.3, 405.7]), [0.0, 1.0, 0.0])
"""A laser whose file has no other wavelengths."""


def line(center: float, half_width: float) -> Spectrum:
    return Spectrum("line", SpectralGrid(center + half_width * np.array([-1.0, 0.0, 1.0])), np.array([0.0, 1.0, 0.0]))


def test_a_lamp_without_the_wavelengths_of_the_emission_excites_dyes():
    """The plan switched the dyes off, and their surface was black."""
    scene = lit(Fluorescent(gray(0.0), (DYE,), (0.5,)), VIOLET)
    assert plan_from_data(scene)["fluorescence"].value == "on"
    found, noise, _ = shown(scene)
    expected = 0.5 * np.exp(-0.5 * (0.3 / 20) ** 2) / luminance_of_violet() * DYE.emitted_rgb()
    assert np.all(np.abs(found - expected) <= 4.5 * noise + 5e-3 * np.abs(expected).max())


def luminance_of_violet() -> float:
    """Luminance of the laser over its power: ȳ of CIE 1931 at 405.3 nm, from its values at 405 and 406 nm."""
    return 0.7 * 0.0006400 + 0.3 * 0.0007234


def test_lines_that_dyes_absorb_and_emit_have_their_power():
    """Of an emitted line of 0.2 nm, whole nm showed five times its power, or nothing; so with an absorbed one."""
    dye = FluorescentDye("dye", line(405.5, 0.3), line(612.0, 0.2))
    found, noise, _ = shown(lit(Fluorescent(gray(0.0), (dye,), (0.5,)), VIOLET))
    nm = np.linspace(404.9, 405.8, 90_001)
    shapes = [np.maximum(0.0, 1 - np.abs(nm - middle) / width) for middle, width in ((405.3, 0.4), (405.5, 0.3))]
    absorbed = 0.5 * np.mean(shapes[0] * shapes[1]) / np.mean(shapes[0])
    expected = absorbed / luminance_of_violet() * dye.emitted_rgb()
    assert np.all(np.abs(found - expected) <= 4.5 * noise + 5e-3 * np.abs(expected).max())
    with pytest.raises(InvalidInputError, match=r"returns 1\.\d+ of the light at 405.5 nm"):
        Fluorescent(gray(0.5), (dye,), (0.5,))


@pytest.mark.parametrize("width", [0.1, 0.5, 2.0, 20.0])
def test_a_bell_of_any_width_keeps_its_area(width):
    """Knots of 5 nm had nothing of a narrow one."""
    dye = FluorescentDye.gaussian("bell", 403, 532, widths_nm=(width, width))
    for bell in (dye.excitation, dye.emission):
        nm = bell.grid.wavelengths_nm
        area = np.sum(np.diff(nm) * (bell.values[1:] + bell.values[:-1]) / 2)
        assert area == pytest.approx(width * np.sqrt(2 * np.pi), rel=1e-3)
    assert dye.emission_mean_nm == pytest.approx(532, abs=0.01)


def test_dispersive_panes_pass_the_ultraviolet_light_that_excites_dyes():
    """An index that is given from 360 nm on was 0 below, so that all light was reflected: the dye was dark."""
    nm = np.arange(300.0, 831.0, 2.0)
    power = np.exp(-0.5 * ((nm - 335) / 6) ** 2) + 1e-3 * (np.abs(nm - 550) < 50)
    light = Illuminant("black light", SpectralGrid(nm), power)
    dye = FluorescentDye.gaussian("dye", 335, 530, widths_nm=(10.0, 20.0))
    kept = (("dispersion", "on"),)  # the same index at all wavelengths calls for none
    scene = lit(Fluorescent(gray(0.0), (dye,), (0.5,)), light, samples=64, max_bounces=16)
    faces = (Instance("outer", "square", at(0, 0, 1), ("pane",)),
             Instance("inner", "square", at(0, 0, 0.9, turn=("x", 180.0)), ("pane",)))  # fmt: skip
    colors = []
    for first in (300.0, 360.0):
        index = Spectrum("glass", SpectralGrid.uniform(first, 830.0, 10.0), np.full(int((830 - first) / 10) + 1, 1.5))
        materials = (*scene.materials, Material("pane", Glass(gray(1.0), 0.0, index)))
        behind = replace(scene, materials=materials, instances=(*scene.instances, *faces),
                         settings=replace(scene.settings, overrides=kept))  # fmt: skip
        colors.append(shown(behind)[0])
    bare = shown(scene)[0]
    assert colors[0][1] > 0.7 * bare[1]
    np.testing.assert_allclose(colors[1], colors[0], rtol=1e-4)


def test_ultraviolet_light_of_an_environment_image_excites_dyes():
    """Below 360 nm an image had no light: a dye of 345 nm had an eighth of its light in a world of one color."""
    closure = Fluorescent(gray(0.0), (DYE_OF_ULTRAVIOLET,), (0.5,))
    image = ImageTexture("sky", np.full((8, 16, 3), 1.0, np.float32), "linear")
    (found, noise, _), (expected, more, _) = (shown(lit(closure, world, samples=64)) for world in (image, gray(1.0)))
    assert expected[1] > 20 * more[1]
    assert np.all(np.abs(found - expected) <= 4.5 * np.hypot(noise, more) + 1e-3)


def test_fog_takes_the_ultraviolet_light_that_excites_dyes():
    """Media began at 360 nm and were clear below, so that a dye of 345 nm behind dark fog was 6.4 times too bright."""
    sun = SunLight(name="sun", world_from_light=np.eye(4), irradiance=np.pi, angle_rad=0.0)
    scene = replace(lit(Fluorescent(gray(0.0), (DYE_OF_ULTRAVIOLET,), (0.5,)), gray(0.0), samples=64), lights=(sun,))
    colors = []
    for density in (0.0, 2.0):
        fog = Material("fog", None, ScatteringMedium(density, gray(0.0)))
        slab = Instance("slab", "box", at(0, 0, 10, scale=(50, 50, 0.5)), ("fog",))
        behind = replace(
            scene,
            meshes=(*scene.meshes, box()),
            materials=(*scene.materials, fog),
            instances=(*scene.instances, slab),
        )
        colors.append(shown(behind)[0])
    assert colors[1] == pytest.approx(np.exp(-2.0) * colors[0], rel=0.02)
