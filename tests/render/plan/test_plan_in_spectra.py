# SPDX-License-Identifier: GPL-3.0-or-later
"""What the plan says of scenes whose colors only spectra tell: paints for one lamp, colored media, filters in a row."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spectral_core.render.plan.effects import pilot_plan, plan_effects, plan_from_data
from spectral_core.render.plan.errors.spectral import rgb_transport_error
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Film,
    Instance,
    Material,
    MediumGrid,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Transparent,
)
from spectral_core.scene.geometry import VolumeObject, unit_box
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid
from spectral_core.spectra.upsample import upsampled
from spectral_core.volume import transfer
from tests.render.scenes import lit_plane, matrix

SODIUM = Illuminant("sodium", SpectralGrid(np.array([588.0, 589.0, 590.0])), np.array([0.0, 1.0, 0.0]))
LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 2)), power_w=10.0, color=SODIUM)
BLACK_BY_DAY = Reflectance(
    "black by day", SpectralGrid(np.array([380.0, 585.0, 587.0, 591.0, 593.0, 780.0])),
    np.array([0.01, 0.01, 0.9, 0.9, 0.01, 0.01]),
)  # fmt: skip
GREEN = (1.0, 0.1, 1.0)


def test_the_pilot_sees_a_paint_as_the_lamp_does() -> None:
    """A paint that reflects one line: its surface is ρ/π · Φ/(4π d²), and its room keeps 90 % of the lamp's light.

    In three channels it was nearly black: a room lost 40 % of its light, stated as ΔE 0.004.
    """
    pytest.importorskip("mitsuba")
    from spectral_core.render.plan.pilot import run_pilot

    flat = lit_plane(LAMP, surface=Diffuse(BLACK_BY_DAY), settings=RenderSettings())
    seen = run_pilot(flat, pilot_plan(flat, spectral=True), samples=32)
    shown = float(luminance_from_linear_rgb(seen.picture.mean(axis=(0, 1, 2))))
    assert shown == pytest.approx(0.9 / np.pi * 10.0 / (4 * np.pi) / 2.0**2, rel=0.01)

    room = replace(
        flat, meshes=(replace(unit_box(), name="plane"),),
        instances=(replace(flat.instances[0], world_from_object=matrix((-2, -2, 0), 4.0)),),
        film=Film(16, 16), camera=Camera(world_from_camera=matrix((0, 0, 3.9)), field_of_view_rad=1.0),
    )  # fmt: skip
    plan = plan_effects(room)
    assert plan.is_spectral and plan["bounces"].how == "measured" and plan.bounces >= 32


def _with_medium(medium: ScatteringMedium) -> Any:
    scene = lit_plane(LAMP, settings=RenderSettings())
    item = Instance("liquid", "box", matrix((-0.5, -0.5, 0.5)), ("liquid",))
    return replace(
        scene, meshes=(*scene.meshes, replace(unit_box(), name="box")),
        materials=(*scene.materials, Material("liquid", None, medium)), instances=(*scene.instances, item),
    )  # fmt: skip


def _error_behind(depth: float) -> float:
    """ΔE2000 between three channels and the line, of a white sheet under sodium behind green liquid."""
    from spectral_core.render.mitsuba_scene.paint import emitted_rgb

    rgb = np.array(GREEN)
    lamp = emitted_rgb(SODIUM)
    line = float(upsampled(rgb, np.array([589.0]))[0])
    pair = [lamp * np.exp(-depth * line), lamp * np.exp(-depth * rgb)]
    return float(delta_e_2000(*(lab_from_linear_rgb(np.maximum(each, 0.0)) for each in pair)))


def test_a_colored_medium_is_compared_at_the_depths_of_its_body() -> None:
    """Green liquid under sodium was rendered in three channels, stated as ΔE 0; places differed by up to 28."""
    medium = ScatteringMedium(0.5, Color(np.zeros(3)), extinction=Color(np.array(GREEN)))
    seen = _error_behind(0.5 * np.sqrt(3.0))
    plan = plan_from_data(_with_medium(medium))
    assert plan.is_spectral and rgb_transport_error(_with_medium(medium)) >= seen > 5.0
    thin = _with_medium(replace(medium, density=1e-7))
    assert rgb_transport_error(thin) < 1e-3 and not plan_from_data(thin).is_spectral
    gray = _with_medium(replace(medium, extinction=Color(np.full(3, 0.4))))
    assert rgb_transport_error(gray) < 1e-6


def test_voxels_of_their_own_colors_keep_spectra() -> None:
    grid = MediumGrid(np.eye(4), absorption=np.full((2, 2, 2, 3), (1.0, 0.1, 1.0), np.float32))
    scene = _with_medium(ScatteringMedium(0.5, Color(np.zeros(3)), grid=grid))
    assert rgb_transport_error(scene) == np.inf and plan_from_data(scene).is_spectral


@pytest.mark.parametrize(("lit", "lighting", "spectral"), [(True, "scene", True), (True, "even", False),
                                                           (False, "scene", False)])  # fmt: skip
def test_the_colors_of_a_lit_volume_are_compared(lit: bool, lighting: str, spectral: bool) -> None:
    """A green volume under sodium was green in three channels, ΔE 25 from the orange of the lamp, stated as 0."""
    material = transfer.Material("green", np.array([0.0, 1.0]), np.ones(2), np.array([0.2, 0.8, 0.3]), lit=lit)
    volume = VolumeObject(
        "cloud", np.ones((2, 2, 2), np.float32), matrix((0, 0, 1)), transfer.TransferFunction((material,)),
        lighting=lighting,
    )  # fmt: skip
    scene = replace(lit_plane(LAMP, settings=RenderSettings()), volumes=(volume,))
    assert plan_from_data(scene).is_spectral is spectral


def test_two_filters_in_a_row_differ_by_their_product() -> None:
    """A blue and a red filter: ΔE 29 between spectra and three channels, stated as 12."""
    nm = np.arange(380.0, 781.0, 5.0)
    grid, even = SpectralGrid(nm), Illuminant("even", SpectralGrid(nm), np.ones(nm.size))
    first = Reflectance("first", grid, 0.02 + 0.93 * np.exp(-(((nm - 434) / 59) ** 2)))
    second = Reflectance("second", grid, 0.02 + 0.93 * np.exp(-(((nm - 637) / 58) ** 2)))
    scene = lit_plane(replace(LAMP, color=even), surface=Transparent(first), settings=RenderSettings())
    scene = replace(
        scene, materials=(*scene.materials, Material("other", Transparent(second))),
        instances=(*scene.instances, Instance("other", "plane", matrix((0, 0, 1)), ("other",))),
    )  # fmt: skip
    from spectral_core.render.mitsuba_scene.paint import daylight_rgb, emitted_rgb, emitted_spectrum
    from spectral_core.spectra.color import RGB_FROM_XYZ
    from spectral_core.spectra.observer import observer

    lamp, viewer = emitted_spectrum(even, None), observer("cie_1931_2deg")
    weights = viewer.cmfs * lamp.at(viewer.wavelengths_nm) / (viewer.cmfs[1] @ lamp.at(viewer.wavelengths_nm))
    exact = RGB_FROM_XYZ @ (weights @ (first.at(viewer.wavelengths_nm) * second.at(viewer.wavelengths_nm)))
    simple = (
        daylight_rgb(first) * daylight_rgb(second) * emitted_rgb(even) / luminance_from_linear_rgb(emitted_rgb(even))
    )
    pair = (lab_from_linear_rgb(np.maximum(each, 0.0)) for each in (exact, simple))
    assert rgb_transport_error(scene, 2) >= 0.99 * float(delta_e_2000(*pair)) > 20.0


def test_the_table_of_a_plan_has_the_tolerance_of_its_render() -> None:
    """A render to ΔE 0.4 tolerates 0.1; the table of the button and of the command stated 0.25."""
    pytest.importorskip("mitsuba")
    from spectral_core.render.process.worker import call

    scene = lit_plane(settings=RenderSettings(target_error=0.4))  # without a light: no pilot is traced
    assert call("plan", (scene, None)).tolerance_delta_e == 0.1
    assert call("plan", (scene, 2.0)).tolerance_delta_e == 2.0
    assert call("plan", (replace(scene, settings=RenderSettings()), None)).tolerance_delta_e == 0.25
