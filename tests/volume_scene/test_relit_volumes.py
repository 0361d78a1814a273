# SPDX-License-Identifier: GPL-3.0-or-later
"""Lit volumes under a dial: steps do not depend on strengths and colors, so that relit pictures equal new renders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

pytest.importorskip("mitsuba")

from benchmarks.relight.cases.scenes import under_lights
from spectral_core.render import render_scene
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Film,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
    VolumeObject,
    World,
    gray,
)
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from spectral_core.volume.transfer import Material, TransferFunction
from tests.relight.comparison import relative_error

HAZE = Material("haze", [0.2, 0.5, 0.8], [0.0, 6.0, 0.0], np.array([0.9, 0.5, 0.2]))
GLOW = Material("glow", [0.7, 1.0], [0.0, 3.0], np.array([0.1, 0.2, 0.4]), lit=False)
RANDOM = np.random.default_rng(3)


def lamps(kinds):
    place = np.eye(4)
    place[:3, 3] = 0.3, 0.2, 1.5
    turned = np.eye(4)
    turned[:3, :3] = [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]
    every = {
        "point": PointLight(name="point", world_from_light=place, power_w=40.0, group="point"),
        "ball": PointLight(name="ball", world_from_light=place, power_w=40.0, radius=0.2, group="ball"),
        "sun": SunLight(name="sun", world_from_light=turned, irradiance=3.0, angle_rad=0.0, group="sun"),
        "spot": SpotLight(name="spot", world_from_light=place, power_w=80.0, cone_angle_rad=0.4, group="spot"),
        "area": AreaLight(name="area", world_from_light=place, power_w=30.0, group="area"),
    }
    return tuple(every[kind] for kind in kinds)


def clouded(lights, *materials, lighting="scene", world=None):
    rough = gaussian_filter(np.random.default_rng(5).normal(size=(12, 11, 10)), 1.4)
    values = ((rough - rough.min()) / np.ptp(rough)).astype(np.float32)
    matrix, before = np.diag([0.1, 0.1, 0.1, 1.0]), np.eye(4)
    matrix[:3, 3], before[2, 3] = -0.5, 4.0
    transfer = TransferFunction(materials)
    return Scene(
        camera=Camera(world_from_camera=before, kind="orthographic", orthographic_scale=1.2),
        film=Film(16, 12, samples=4, filter_kind="box", filter_width=1.0),
        volumes=(VolumeObject("cloud", values, matrix, transfer, quality=40.0, lighting=lighting),),
        lights=lights,
        world=world or World(gray(0.0)),
    )


def changed(light, factor):
    strength = "irradiance" if isinstance(light, SunLight) else "power_w"
    return replace(light, **{strength: getattr(light, strength) * factor})


@pytest.mark.parametrize(
    ("kinds", "sky", "lighting"),
    [(("point", "ball", "sun", "spot", "area"), True, "scene"), (("point", "sun"), False, "shadows")],
)
def test_lit_volumes_are_relit_exactly(kinds, sky, lighting):
    """The steps for six emitters are found in four groups of them, those for two lamps by each."""
    lights = lamps(kinds)
    world = World(gray(0.3), group="Sky") if sky else None
    base = clouded(lights, *((HAZE, GLOW) if sky else (HAZE,)), lighting=lighting, world=world)
    factors = 10.0 ** RANDOM.uniform(-2, 2, len(lights))
    tints = RANDOM.uniform(0.05, 1.0, (len(lights), 3))
    if sky:
        factors[-1] = tints[-1] = 1.0  # the first group by name has the light that the volume emits
    stronger = tuple(
        replace(changed(light, factor), color=Color(tint))
        for light, factor, tint in zip(lights, factors, tints, strict=True)
    )
    transport = record_transport(base, MixtureStorage())
    rendered = render_scene(replace(base, lights=stronger), sampling_lights=SAMPLING_LIGHTS).pixels
    assert [note.subject for note in transport.notes if "shines by itself" in note.message] == ["cloud"] * sky
    scaled = {light.name: factor * tint for light, factor, tint in zip(lights, factors, tints, strict=True)}
    assert set(scaled) <= set(transport.groups)
    mixed = sum(
        relight(transport, mix={each: float(each == name) for each in transport.groups})[..., :3]
        * scaled.get(name, np.ones(3))
        for name in transport.groups
    )
    assert relative_error(mixed, rendered[..., :3]) < 1e-5


def test_lit_volumes_have_the_same_steps_under_new_spectra():
    grid = SpectralGrid.uniform(380, 780, 20)
    base = clouded(lamps(("point", "spot")), HAZE)
    lines = {
        name: Illuminant(name, grid, np.where(np.isin(grid.wavelengths_nm, at), 1.0, 0.0))
        for name, at in (("point", (580, 600)), ("spot", (440, 540, 620)))
    }
    lit = under_lights(replace(base, settings=replace(base.settings, transport="spectral")), lines)
    rendered = render_scene(lit, groups=True, sampling_lights=SAMPLING_LIGHTS).pixels
    assert relative_error(relight(record_transport(base, ExactStorage(grid)), lights=lines), rendered) < 1e-5
