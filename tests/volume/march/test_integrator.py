# SPDX-License-Identifier: GPL-3.0-or-later
"""`adaptive_volume` in Mitsuba: same picture as the march alone, surfaces, several fields, lights and shadows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.llvm_library import use_newest_llvm
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import luminance_from_linear_rgb
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, combine
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
from spectral_core.volume.mitsuba_integrator.settings import (
    SceneVolume,
    VolumeSettings,
    integrator_dict,
    release,
    share,
)
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.view import View
from tests.volume.cases import blob, two_tents

pytest.importorskip("mitsuba")
use_newest_llvm()
FIXED = {"rule": "error", "quadrature": "midpoint", "scale": 0.5}


def load(variant: str) -> Any:
    import mitsuba

    from spectral_core.volume.mitsuba_integrator.plugin import register_integrator

    mitsuba.set_variant(variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    register_integrator()
    return mitsuba


def render(mi: Any, integrator: dict[str, Any], view: View, samples: int = 64, **things: Any) -> np.ndarray:
    film = {"type": "hdrfilm", "width": view.width, "height": view.height, "rfilter": {"type": "box"}}
    film["component_format"] = "float32"
    sensor = view.mitsuba_sensor() | {"film": film, "sampler": {"type": "independent", "sample_count": samples}}
    scene = mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **things})
    return np.array(mi.render(scene, spp=samples, seed=3))


def smooth_view(volume: ScalarVolume, **rest: Any) -> View:
    return View.around(volume, 30.0, 25.0, width=8, height=6, **rest)


def averaged(volume: ScalarVolume, view: View, stepping: Stepping) -> tuple[np.ndarray, np.ndarray]:
    """Amounts and transmittance of the march alone, averaged over 16² positions in each pixel."""
    n = 16
    image = VolumeRenderer(volume).render(view.resized(view.width * n, view.height * n), two_tents(), stepping)
    amounts = image.amounts.reshape(view.height, n, view.width, n, -1).mean(axis=(1, 3))
    return amounts, image.transmittance.reshape(view.height, n, view.width, n).mean(axis=(1, 3))


@pytest.mark.parametrize("fov", [30.0, None])
def test_picture_and_channels_equal_those_of_the_march_alone(fov):
    mi = load("llvm_ad_rgb")
    volume = blob()
    view = smooth_view(volume, fov_deg=fov)
    picture = render(mi, integrator_dict([SceneVolume(volume, two_tents())], channels=True, **FIXED), view, 4096)
    amounts, passed = averaged(volume, view, Stepping("error", "midpoint", 0.5))
    assert picture.shape == (6, 8, 3 + 1 + 2)
    assert np.abs(picture[..., 4:] - amounts).max() < 0.02
    assert np.abs(picture[..., 3] - passed).max() < 0.02
    assert np.allclose(picture[..., :3], combine(picture[..., 4:], display_matrix(two_tents())), atol=1e-5)


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_mono"])
def test_every_variant_gives_the_same_picture(variant):
    mi = load("llvm_ad_rgb")
    volume = blob(12)
    view = smooth_view(volume)
    item = [SceneVolume(volume, two_tents(2.0))]
    wanted = render(mi, integrator_dict(item, **FIXED), view, 256)
    mi = load(variant)
    shown = render(mi, integrator_dict(item, **FIXED), view, 1024)
    if mi.is_monochromatic:
        wanted = luminance_from_linear_rgb(wanted)[..., None]
    # A spectral ray samples few wavelengths; the average over the picture has little noise.
    assert np.allclose(shown.mean((0, 1)), wanted.mean((0, 1)), rtol=0.03)


def test_relighting_the_channels_equals_a_new_render():
    mi = load("llvm_ad_rgb")
    volume = blob()
    view, item = smooth_view(volume), [SceneVolume(volume, two_tents())]
    first = render(mi, integrator_dict(item, channels=True, **FIXED), view)
    again = render(mi, integrator_dict(item, channels=True, light="FL11", **FIXED), view)
    relit = combine(first[..., 4:], display_matrix(two_tents(), catalogue.illuminant("FL11")))
    assert np.abs(relit - again[..., :3]).max() < 3e-6 * again[..., :3].max()


def test_a_grid_volume_with_a_preset_is_rendered():
    mi = load("llvm_ad_rgb")
    grid = mi.VolumeGrid(mi.TensorXf(np.ascontiguousarray(blob(10, np.float32).data.transpose(2, 1, 0))[..., None]))
    placed = {"type": "gridvolume", "grid": grid, "to_world": mi.ScalarTransform4f().scale(10)}
    made = {"type": "adaptive_volume", "volume_a": placed, "transfer_a": "preset:opaque", "quality": 45.0}
    view = smooth_view(ScalarVolume("box", blob(10, np.float32).data, np.diag([1.0, 1, 1, 1]) + 0.5 * np.eye(4, k=3)))
    picture = render(mi, made, view, 4)
    assert picture.max() > 0.3 and np.isfinite(picture).all()


def test_xml_with_a_volume_file_is_rendered(tmp_path):
    pytest.importorskip("nrrd")
    from spectral_core.volume.files import write_volume

    mi = load("llvm_ad_rgb")
    write_volume(blob(10), tmp_path / "blob.nrrd")
    scene = mi.load_string(f"""<scene version="3.0.0"><integrator type="adaptive_volume">
        <string name="file" value="{tmp_path / "blob.nrrd"}"/><string name="transfer" value="preset:opaque"/>
        <float name="quality" value="45"/><boolean name="channels" value="true"/></integrator></scene>""")
    assert scene.integrator().aov_names() == ["transmittance", "amount.skin", "amount.solid"]


def wall(mi: Any, x: float) -> dict[str, Any]:
    """An emissive square across the x axis."""
    place = mi.ScalarTransform4f().translate([x, 12, 12]).rotate([0, 1, 0], -90).scale(200)
    return {
        "type": "rectangle",
        "to_world": place,
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 2.0}},
    }


@pytest.mark.parametrize("shadows", [False, True])
def test_surfaces_in_front_inside_and_behind(shadows):
    mi = load("llvm_ad_rgb")
    volume = ScalarVolume("fog", np.full((24, 24, 24), 100, np.uint8))
    fog = two_tents(0.5)
    view = View.looking([-60, 12, 12], [12, 12, 12], width=4, height=4, fov_deg=4.0)
    settings = {**FIXED, "channels": True, "shadows": shadows}
    seen = {}
    for name, x in (("front", -10.0), ("inside", 11.5), ("behind", 40.0)):
        picture = render(
            mi, integrator_dict([SceneVolume(volume, fog)], {"type": "path"}, **settings), view, 4, wall=wall(mi, x)
        )
        seen[name] = picture[..., 3].mean()
        assert np.allclose(picture[..., :3].mean(), combine(picture[..., 4:], display_matrix(fog)).mean() + 2.0 * seen[name], rtol=1e-3)  # fmt: skip  # noqa: E501
    assert seen["front"] == 1.0
    assert seen["inside"] ** 2 == pytest.approx(seen["behind"], rel=5e-3)  # half the path has half the optical depth


def test_two_fields_in_sequence_and_overlapping():
    mi = load("llvm_ad_rgb")
    first = ScalarVolume("first", np.full((8, 8, 8), 100, np.uint8))
    shift = np.eye(4)
    shift[0, 3] = 20.0
    second = ScalarVolume("second", first.data, shift)
    view = View.looking([-60, 3.5, 3.5], [12, 3.5, 3.5], width=2, height=2, fov_deg=1.0)
    passed = {}
    for name, fields in (("one", [first]), ("two", [first, second]), ("same", [first, first])):
        items = [SceneVolume(field, two_tents()) for field in fields]
        picture = render(mi, integrator_dict(items, channels=True, **FIXED), view, 4)
        passed[name] = picture[..., 3].mean()
    assert passed["two"] == pytest.approx(passed["one"] ** 2, rel=2e-3)
    assert passed["same"] == pytest.approx(passed["one"] ** 2, rel=2e-3)


def test_a_field_shadows_the_floor_only_if_requested():
    mi = load("llvm_ad_rgb")
    volume = ScalarVolume("fog", np.full((12, 12, 12), 120, np.uint8))
    up = mi.ScalarTransform4f()
    floor = {"type": "rectangle", "to_world": up.translate([6, 6, -8]).scale(3), "bsdf": {"type": "diffuse"}}
    lamp = {"type": "rectangle", "to_world": up.translate([6, 6, 60]).rotate([1, 0, 0], 180).scale(1),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 900.0}}}  # fmt: skip
    view = View.looking([30, 6, -5], [6, 6, -8], width=4, height=4, fov_deg=3.0)
    item, things = [SceneVolume(volume, two_tents())], {"floor": floor, "lamp": lamp}
    light = [
        render(mi, integrator_dict(item, {"type": "path"}, shadows=on, **FIXED), view, 64, **things).mean()
        for on in (False, True)
    ]
    depth = 12 * float(two_tents().curves(np.array(120.0))[0].sum())
    assert light[1] / light[0] == pytest.approx(np.exp(-depth), rel=0.02)


@pytest.mark.parametrize("lamp", ["directional", "constant"])
def test_fields_that_reach_beyond_all_surfaces_shadow_them_in_full(lamp):
    mi = load("llvm_ad_rgb")
    volume = ScalarVolume("fog", np.full((12, 12, 12), 120, np.uint8))
    up = mi.ScalarTransform4f()
    floor = {"type": "rectangle", "to_world": up.translate([6, 6, 1]).scale(0.5), "bsdf": {"type": "diffuse"}}
    amount = {"type": "rgb", "value": 1.0}
    own = {"direction": [0.0, 0.0, -1.0], "irradiance": amount} if lamp == "directional" else {"radiance": amount}
    # a black ball far below, which takes no part in the picture, enlarges what Mitsuba counts as the scene
    far = {
        "type": "sphere",
        "center": [0, 0, -2000],
        "bsdf": {"type": "diffuse", "reflectance": amount | {"value": 0.0}},
    }
    view = View.looking([6.5, 6, 30], [6, 6, 1], width=4, height=4, fov_deg=0.3)
    settings = integrator_dict([SceneVolume(volume, two_tents(0.2))], {"type": "path"}, shadows=True, **FIXED)
    near, wide = (
        render(mi, settings, view, 256, floor=floor, lamp={"type": lamp} | own, **more).mean()
        for more in ({}, {"f": far})
    )
    assert near == pytest.approx(wide, rel=1e-3)


@pytest.mark.parametrize("shadows", [False, True])
def test_an_environment_behind_a_field_covers_the_picture(shadows):
    mi = load("llvm_ad_rgb")
    volume = blob(12)
    view, sky = smooth_view(volume), {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
    film = {"type": "hdrfilm", "width": 8, "height": 6, "rfilter": {"type": "box"}, "pixel_format": "rgba"}
    made = integrator_dict([SceneVolume(volume, two_tents())], {"type": "path"}, shadows=shadows, **FIXED)
    scene = {"type": "scene", "integrator": made, "sensor": view.mitsuba_sensor() | {"film": film}}
    alone, before_sky = (np.array(mi.render(mi.load_dict(scene | more), spp=16)) for more in ({}, {"sky": sky}))
    assert alone[..., 3].min() == 0.0
    assert before_sky[..., 3].min() == 1.0


def test_shading_follows_the_light():
    mi = load("llvm_ad_rgb")
    volume = blob()
    item = [SceneVolume(volume, two_tents(5.0))]
    view = View.looking([12, -80, 12], [12, 12, 12], width=16, height=16, fov_deg=18.0)
    from_left = {"type": "directional", "direction": [1.0, 0.0, 0.0], "irradiance": {"type": "rgb", "value": 3.0}}
    picture = render(mi, integrator_dict(item, shading=True, shadows=True, **FIXED), view, 64, sun=from_left)
    columns = picture.sum(axis=(0, 2))
    left, right = columns[:8].sum(), columns[8:].sum()
    assert max(left, right) > 1.5 * min(left, right)  # the far side lies in the field's own shadow
    black = render(mi, integrator_dict(item, shading=True, **FIXED), view, 4)
    assert black.max() == 0.0  # shaded materials need a light


def test_jitter_does_not_change_the_mean():
    mi = load("llvm_ad_rgb")
    volume = blob()
    item, view = [SceneVolume(volume, two_tents())], smooth_view(volume)
    pictures = [render(mi, integrator_dict(item, jitter=on, **FIXED), view, 16) for on in (False, True)]
    assert pictures[0].mean() == pytest.approx(pictures[1].mean(), rel=1e-2)
    assert not np.array_equal(*pictures)


def test_wrong_input_is_reported():
    mi = load("llvm_ad_rgb")
    with pytest.raises(InvalidInputError, match="at least one field"):
        integrator_dict([])
    with pytest.raises(InvalidInputError, match="max_depth is 0"):
        VolumeSettings(max_depth=0)
    with pytest.raises(RuntimeError, match="has no field"):
        mi.load_dict({"type": "adaptive_volume"})
    handle = share(SceneVolume(blob(4), two_tents()))
    release(handle)
    with pytest.raises(RuntimeError, match="it was released"):
        mi.load_dict({"type": "adaptive_volume", "handles": handle})


@pytest.mark.parametrize("settings", [{}, {"shadows": True}])
def test_scalar_variants_are_refused_with_the_package_to_install(settings):
    mi = load("scalar_rgb")
    with pytest.raises(RuntimeError, match=r"scalar_rgb is set; set llvm_ad_rgb .* install LLVM"):
        mi.load_dict(integrator_dict([SceneVolume(blob(4), two_tents())], **settings))
    load("llvm_ad_rgb")
