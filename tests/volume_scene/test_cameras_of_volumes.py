# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of volumes for cameras with a shift, for panoramas, and for volumes beside the picture."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

pytest.importorskip("mitsuba")

from benchmarks.volume.checks.oracle import march_oracle
from spectral_core.render import render_scene
from spectral_core.render.volumes import view_of
from spectral_core.scene import Camera, Film, Panorama, PointLight, Scene, VolumeObject
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.mitsuba_integrator.scene_fields import SceneFields, sensor_view
from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, VolumeSettings
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View

FILM = Film(32, 24, samples=2, filter_kind="box", filter_width=1.0)
EVERYWHERE = Panorama("equirectangular", (-np.pi, np.pi, -np.pi / 2, np.pi / 2))
LAMP = PointLight(name="lamp", world_from_light=np.eye(4), power_w=50.0)


def rough(middle):
    """A field of noise, one unit wide."""
    values = gaussian_filter(np.random.default_rng(5).normal(size=(14, 14, 14)), 1.5)
    matrix = np.diag([1 / 14] * 3 + [1.0])
    matrix[:3, 3] = np.array(middle) - 0.5 + 0.5 / 14
    return ScalarVolume("noise", ((values - values.min()) / np.ptp(values)).astype(np.float32), matrix)


def camera(**rest):
    """At z = 4, looking along -z."""
    matrix = np.eye(4)
    matrix[2, 3] = 4.0
    return Camera(world_from_camera=matrix, **rest)


@pytest.fixture(scope="module")
def empty():
    """The picture without a volume."""
    return render_scene(Scene(camera=camera(), film=FILM, lights=(LAMP,))).pixels


@pytest.mark.parametrize(
    ("middle", "lighting"),
    [((4, 0, 0), "even"), ((-4, 0, 0), "scene"), ((0, 4, 0), "shadows"), ((0, 0, 8), "scene")],
)
def test_volumes_beside_the_picture_show_nothing(empty, middle, lighting):
    """Those on its left and right ended the render with an error."""
    field = rough(middle)
    item = VolumeObject("v", field.data, field.world_from_index, preset("narrow", field), lighting=lighting)
    pixels = render_scene(Scene(camera=camera(), film=FILM, volumes=(item,), lights=(LAMP,))).pixels
    assert np.array_equal(pixels, empty)


def test_the_plan_of_a_field_beside_the_picture_ends():
    field = rough((0, 0, 0))
    view = View.looking((0, 0, 4), (0, 0, 0), (0, 1, 0), width=32, height=24, shift=(5.0, 0.0))
    assert plan(VolumeRenderer(field), view, preset("opaque", field)).estimate_db == math.inf


@pytest.mark.parametrize(
    ("made", "middle"),
    [
        (camera(shift=(0.8, 0.0)), (2.4, 0, 0)),
        (camera(shift=(-0.1, -0.7)), (0, -2.0, 0)),
        (camera(kind="orthographic", orthographic_scale=2.0, shift=(1.5, 0.0)), (3.0, 0, 0)),
        (camera(kind="panoramic", panorama=EVERYWHERE), (0, 0, 6.0)),
        (camera(kind="panoramic", panorama=EVERYWHERE), (0, 1.5, 4.0)),
    ],
    ids=["right", "below", "orthographic", "behind", "above"],
)
def test_what_a_camera_shows_has_the_wanted_quality(made, middle):
    """Steps were those for a picture without shift, and for the middle of a panorama: 9 dB for 50."""
    field = rough(middle)
    transfer = preset("narrow", field)
    view = view_of(made, FILM, field)
    fields = SceneFields([SceneVolume(field, transfer)], VolumeSettings(quality=45.0))
    fields.prepare([view])
    seen = view if made.panorama is None else View.looking((0, 0, 4), middle, (0.1, 1, 0.2), width=24, height=24)
    exact = march_oracle(field, transfer, seen.rays_world(), 0.02, -np.inf if seen.fov_deg is None else 0.0)
    exact = exact.amounts @ transfer.colors
    shown = VolumeRenderer(field).render(seen, transfer, fields.plans[0].stepping).amounts @ transfer.colors
    assert np.any(exact)
    snr = 10 * math.log10(np.sum(exact**2) / np.sum((exact - shown.reshape(exact.shape)) ** 2))
    assert snr > 41.0


def test_the_steps_of_a_field_beside_the_picture_have_the_wanted_quality_around_it():
    field = rough((4, 0, 0))
    transfer = preset("narrow", field)
    fields = SceneFields([SceneVolume(field, transfer)], VolumeSettings())
    fields.prepare(view_of(camera(), FILM, field))
    beside = fields.plans[0]
    assert math.isfinite(beside.estimate_db) and beside.is_reached
    assert beside.stepping != Stepping("uniform", "midpoint")


def test_the_view_of_a_sensor_knows_its_principal_point():
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    view = View.looking((1, 2, 3), (0, 0, 0), width=8, height=6, shift=(0.3, -0.2))
    film = {"type": "hdrfilm", "width": 8, "height": 6}
    found = sensor_view(mi.load_dict(view.mitsuba_sensor() | {"film": film}))
    assert found.shift == pytest.approx((0.3, -0.2), abs=1e-6)
    for one, other in zip(found.rays_world(), view.rays_world(), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)
