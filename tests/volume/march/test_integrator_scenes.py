# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes in scenes: alpha, shading, several fields, properties and plans."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spectral_core.llvm_library import use_newest_llvm
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.mitsuba_integrator.settings import (
    SceneVolume,
    VolumeSettings,
    integrator_dict,
)
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View
from tests.volume.cases import blob, two_tents
from tests.volume.march.test_integrator import load, render, smooth_view

pytest.importorskip("mitsuba")
use_newest_llvm()
FIXED = {"rule": "error", "quadrature": "midpoint", "scale": 0.5}


def with_alpha(mi: Any, integrator: dict[str, Any], view: View, samples: int = 16, **things: Any) -> np.ndarray:
    film = {"type": "hdrfilm", "width": view.width, "height": view.height, "rfilter": {"type": "box"}}
    film |= {"component_format": "float32", "pixel_format": "rgba"}
    sensor = view.mitsuba_sensor() | {"film": film, "sampler": {"type": "independent", "sample_count": samples}}
    scene = mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **things})
    return np.array(mi.render(scene, spp=samples, seed=3))


def test_alpha_is_one_minus_the_transmittance():
    mi = load("llvm_ad_rgb")
    volume = blob()
    picture = with_alpha(
        mi, integrator_dict([SceneVolume(volume, two_tents(0.2))], channels=True, **FIXED), smooth_view(volume)
    )
    assert 0.02 < picture[..., 3].mean() < 0.5
    assert np.allclose(picture[..., 3], 1 - picture[..., 4], atol=1e-5)


def test_alpha_is_one_before_a_surface_and_right_on_average_inside_another_integrator():
    mi = load("llvm_ad_rgb")
    volume = blob()
    fields = integrator_dict([SceneVolume(volume, two_tents(0.2))], {"type": "path"}, **FIXED)
    square = mi.ScalarTransform4f().translate([12, 12, -40]).scale(300)
    covered = with_alpha(mi, fields, smooth_view(volume), floor={"type": "rectangle", "to_world": square})
    assert np.allclose(covered[..., 3], 1.0, atol=1e-6)
    alone = with_alpha(mi, integrator_dict([SceneVolume(volume, two_tents(0.2))], **FIXED), smooth_view(volume), 256)
    around = {
        "type": "aov",
        "aovs": "dd.y:depth",
        "inner": integrator_dict([SceneVolume(volume, two_tents(0.2))], **FIXED),
    }
    nested = with_alpha(mi, around, smooth_view(volume), 4096)
    assert nested[..., 3].mean() == pytest.approx(alone[..., 3].mean(), rel=0.02)


def isosurface(peak: float = 400.0) -> TransferFunction:
    return TransferFunction((Material("skin", [99.0, 100.0, 101.0], [0, peak, 0], [1, 1, 1]),))


def sun(direction: list[float]) -> dict[str, Any]:
    return {"type": "directional", "direction": direction, "irradiance": {"type": "rgb", "value": np.pi}}


@pytest.mark.parametrize("several", [False, True])
def test_a_narrow_peak_is_found_under_shading_and_among_several_fields(several):
    """Midpoint steps of a third of a voxel miss most of a peak with a width of a hundredth of the range."""
    mi = load("llvm_ad_rgb")
    volume = blob(24, np.float32)
    view = smooth_view(volume)
    away = ScalarVolume("away", volume.data, np.diag([1.0, 1, 1, 1]) + 500 * np.eye(4, k=3) * [0, 0, 0, 1])
    items = [SceneVolume(v, isosurface(2.0)) for v in ([volume, away] if several else [volume])]
    way = {"rule": "error", "quadrature": "preintegrated", "scale": 0.4, "channels": True}
    shaded = render(mi, integrator_dict(items, shading=not several, **way), view, 512, sun=sun([1, 0, 0]))
    alone = {"rule": "uniform", "quadrature": "preintegrated", "scale": 0.02, "channels": True}
    exact = render(mi, integrator_dict(items[:1], **alone), view, 512)  # equal rays by an equal seed
    assert np.allclose(shaded[..., 4], exact[..., 4], atol=0.02 * exact[..., 4].max())
    way |= {"quadrature": "midpoint"}
    missed = render(mi, integrator_dict(items, shading=not several, **way), view, 512, sun=sun([1, 0, 0]))
    assert not np.allclose(missed[..., 4], exact[..., 4], atol=0.02 * exact[..., 4].max())


@pytest.mark.parametrize("quadrature", ["midpoint", "preintegrated"])
def test_overlapping_fields_add_their_extinctions(quadrature):
    mi = load("llvm_ad_rgb")
    volume = blob()
    view = smooth_view(volume)
    way = {"rule": "error", "quadrature": quadrature, "scale": 0.1, "channels": True}
    first, second = two_tents(0.5), two_tents(0.3)
    both = render(mi, integrator_dict([SceneVolume(volume, first), SceneVolume(volume, second)], **way), view, 256)
    one = render(mi, integrator_dict([SceneVolume(volume, two_tents(0.8))], **way), view, 256)
    assert np.allclose(both[..., 3], one[..., 3], atol=5e-3)
    assert np.allclose(both[..., 4:6] + both[..., 6:8], one[..., 4:6], atol=8e-3)


def test_shading_uses_the_world_gradient_of_a_rotated_and_sheared_field():
    """A slab's isosurface is a plane; its normal under any placement is the covector of the slab's axis."""
    mi = load("llvm_ad_rgb")
    ramp = np.broadcast_to(np.linspace(0, 200, 24, dtype=np.float32)[:, None, None], (24, 24, 24)).copy()
    matrix = np.eye(4)
    matrix[:3, :3] = [[0.8, 0.5, 0.3], [-0.4, 1.1, 0.2], [0.1, -0.6, 0.9]]
    volume = ScalarVolume("ramp", ramp, matrix)
    middle = volume.corners_world.mean(axis=0)
    normal = np.linalg.inv(matrix[:3, :3])[0]
    normal /= np.linalg.norm(normal)
    toward = np.array([0.3, -0.7, 0.65])
    toward /= np.linalg.norm(toward)
    view = View.looking(middle + 80 * normal, middle, [0.2, 0.9, 0.1], width=4, height=4, fov_deg=None, ortho_width=2.0)
    opaque = TransferFunction((Material("skin", [99, 100], [0, 500.0], [1, 1, 1]),))
    item = [SceneVolume(volume, opaque)]
    way = {"rule": "error", "quadrature": "preintegrated", "scale": 0.1, "shading": True}
    picture = render(mi, integrator_dict(item, **way), view, 16, sun=sun(list(-toward)))
    assert picture.mean() == pytest.approx(abs(float(normal @ toward)), rel=0.01)


@pytest.mark.parametrize(("given", "words"), [
    ({"qualty": 60.0}, "did you mean 'quality'"),
    ({"Rule": "error"}, "did you mean 'rule'"),
    ({"transfer_bone": "preset:wide"}, "'transfer_bone' belongs to no field"),
])  # fmt: skip
def test_unknown_properties_are_refused(given, words):
    mi = load("llvm_ad_rgb")
    with pytest.raises(RuntimeError, match=words):
        mi.load_dict(integrator_dict([SceneVolume(blob(4), two_tents())]) | given)


def test_a_plan_is_kept_per_sensor(monkeypatch):
    from spectral_core.volume.mitsuba_integrator import scene_fields

    load("llvm_ad_rgb")
    calls = []
    planned = scene_fields.plan
    monkeypatch.setattr(scene_fields, "plan", lambda *a, **k: calls.append(1) or planned(*a, **k))
    volume = blob(12)
    fields = scene_fields.SceneFields([SceneVolume(volume, two_tents())], VolumeSettings())
    views = [View.around(volume, angle, width=16, height=16) for angle in (0.0, 40.0)]
    for view in (views[0], views[1], views[0], View(views[1].world_from_camera, 16, 16, 30.0)):
        fields.prepare(view)
    assert len(calls) == 2
    fields.prepare(views[0].resized(32, 16))
    assert len(calls) == 3


def test_an_unreachable_quality_and_lost_channels_are_reported():
    mi = load("llvm_ad_rgb")
    lines: list[str] = []

    class Listener(mi.Appender):
        def append(self, level: Any, text: str) -> None:
            lines.append(text)

        def log_progress(self, *_: Any) -> None:
            pass

    logger = mi.logger()
    listener = Listener()
    logger.add_appender(listener)
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Warn)
    try:
        inner = {"type": "aov", "aovs": "dd.y:depth", "path": {"type": "path"}}
        mi.load_dict(integrator_dict([SceneVolume(blob(4), two_tents())], inner))
        from spectral_core.volume.mitsuba_integrator.scene_fields import SceneFields

        data = np.zeros((12, 12, 12), np.uint8)
        data[6:] = 255
        step = ScalarVolume("edge", data)
        narrow = TransferFunction((Material("m", [127, 128, 129], [0, 20, 0], [1, 1, 1]),))
        item = SceneVolume(step, narrow)
        SceneFields([item], VolumeSettings(rule="uniform", quadrature="midpoint")).prepare(
            View.around(step, width=16, height=16)
        )
    finally:
        mi.set_log_level(level)
        logger.remove_appender(listener)
    text = "\n".join(lines)
    assert "dd.y" in text and "are not recorded" in text
    assert "'edge'" in text and "50 dB is not reached" in text


def test_an_orthographic_sensor_of_any_scale_is_the_same_view():
    """Mitsuba scales the picture by the camera's matrix; the view has unit axes and a width of its own."""
    from spectral_core.volume.mitsuba_integrator.scene_fields import sensor_view

    mi = load("llvm_ad_rgb")
    film = {"type": "hdrfilm", "width": 12, "height": 6}
    look = mi.ScalarTransform4f().look_at(origin=[3, -4, 2], target=[0, 1, 0], up=[0, 0, 1])
    for kind, more, scale in (("orthographic", {}, 2.5), ("perspective", {"fov": 40.0}, 1.0)):
        sensor = mi.load_dict(
            {"type": kind, "to_world": look @ mi.ScalarTransform4f().scale(scale), "film": film, **more}
        )
        view = sensor_view(sensor)
        assert view is not None and (view.width, view.height) == (12, 6)
        assert np.linalg.norm(view.world_from_camera[:3, :3], axis=0) == pytest.approx(np.ones(3), abs=1e-6)
        starts, toward = view.rays_world()
        for x, y in ((0, 0), (7, 4), (11, 5)):
            ray, _ = sensor.sample_ray(0.0, 0.5, [(x + 0.5) / 12, (y + 0.5) / 6], [0.5, 0.5])
            ahead = np.array(ray.d).ravel()
            assert toward[y, x] == pytest.approx(ahead, abs=1e-5)
            apart = np.array(ray.o).ravel() - starts[y, x]
            assert apart - ahead * (apart @ ahead) == pytest.approx(np.zeros(3), abs=1e-4)
    assert view.fov_deg == pytest.approx(40.0, abs=1e-4)
    assert (
        sensor_view(mi.load_dict({"type": "radiancemeter", "film": {"type": "hdrfilm", "width": 1, "height": 1}}))
        is None
    )


def test_a_bright_lamp_is_seen_through_dark_filters():
    """As the sun through two welding glasses: a path of a small throughput may end at a bright lamp."""
    mi = load("llvm_ad_rgb")
    volume, radiance, passed = blob(), 1e6, 0.005
    view = smooth_view(volume)

    def across(distance: float) -> Any:
        """A square across all rays of the view, so far from the camera, which it faces."""
        placed = mi.ScalarTransform4f(view.world_from_camera).translate([0, 0, distance])
        return placed.rotate([1, 0, 0], 180).scale(300)

    through = {"type": "rgb", "value": [passed] * 3}
    glass = {"type": "thindielectric", "int_ior": 1.0, "ext_ior": 1.0, "specular_transmittance": through}
    panes = {f"pane{k}": {"type": "rectangle", "to_world": across(150.0 + k), "bsdf": glass} for k in range(2)}
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": [radiance] * 3}}
    lamp = {"type": "rectangle", "to_world": across(160.0), "emitter": emitter}
    fields = integrator_dict([SceneVolume(volume, two_tents(1e-9))], shadows=True, **FIXED)
    picture = with_alpha(mi, fields, view, 4, lamp=lamp, **panes)
    assert picture[..., :3] == pytest.approx(radiance * passed**2, rel=1e-3)
