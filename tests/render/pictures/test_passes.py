# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes: shares of the light add up to the picture; data passes, names and ids are those of the scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from benchmarks.render.cases.meshes import at, box, sphere, square
from spectral_core.errors import UnknownNameError
from spectral_core.render.passes.cryptomatte import id_of, murmur_hash
from spectral_core.render.still import render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    Glass,
    Instance,
    Material,
    Mist,
    MixSurface,
    Moment,
    Passes,
    PointLight,
    Principled,
    RenderSettings,
    ScatteringMedium,
    Scene,
    Subsurface,
    Transparent,
    World,
    gray,
)
from spectral_core.scene.passes import LIGHT_PASSES, LOBES

LIT = (*(name for name in LIGHT_PASSES if "Volume" not in name), *(f"{lobe} Color" for lobe in LOBES))


def room(wanted: Passes, *, samples: int = 8, **settings) -> Scene:
    """Objects of every type under a panel, a point and a dim world, in groups."""
    surfaces = {
        "floor": Diffuse(Color([0.5, 0.4, 0.3])),
        "gloss": Principled(Color([0.1, 0.5, 0.2]), roughness=0.3, coat_weight=0.5),
        "glass": Glass(),
        "veil": MixSurface(0.6, Transparent(), Diffuse(gray(0.7))),
        "skin": Subsurface(gray(0.6), (0.3, 0.2, 0.1), 0.2),
        "glow": Emission(Color([1.0, 0.6, 0.2]), 2.0),
    }
    places = {
        "floor": ("square", at(scale=5.0)), "gloss": ("sphere", at(-1.2, 0, 0.7, 0.7)),
        "glass": ("sphere", at(0.6, -0.6, 0.6, 0.6)), "veil": ("square", at(1.6, -1.6, 1.0, 0.8, ("x", 80))),
        "skin": ("box", at(1.5, 1.0, 0.5, 0.5)), "glow": ("sphere", at(0.2, 1.4, 1.8, 0.3)),
    }  # fmt: skip
    return Scene(
        camera=Camera(world_from_camera=at(0, -6, 4, turn=("x", 58)), field_of_view_rad=0.8),
        film=Film(40, 30, samples),
        meshes=(square(), box(), sphere()),
        materials=tuple(Material(name, surface, index=5 + k) for k, (name, surface) in enumerate(surfaces.items())),
        instances=tuple(
            Instance(name, mesh, place, (name,), group="warm" if name == "glow" else "", index=20 + k)
            for k, (name, (mesh, place)) in enumerate(places.items())
        ),
        lights=(
            AreaLight(name="panel", world_from_light=at(1, -1, 4), power_w=80, size=(1.0, 1.0), group="cold"),
            PointLight(name="point", world_from_light=at(-2, -2, 3), power_w=40),
        ),
        world=World(gray(0.1), group="sky"),
        settings=RenderSettings(passes=wanted, **settings),
    )


def test_shares_of_the_light_add_up_to_the_picture():
    """The sum over lobes of color · (direct + indirect), emission and environment uses the paths of the picture."""
    result = render_scene(room(Passes(LIT), transport="rgb"))  # a later test has spectra, and fog
    total = result.passes["Emission"] + result.passes["Environment"]
    for lobe in LOBES:
        light = result.passes[f"{lobe} Direct"] + result.passes[f"{lobe} Indirect"]
        total = total + result.passes[f"{lobe} Color"] * light
    picture = result.pixels[..., :3]
    error = np.abs(total - picture)
    assert (
        np.quantile(error, 0.98) < 2e-3 * picture.max()
    )  # by chance a pixel may have light of a lobe without samples of its color
    assert not result.passes["Transmission Direct"].any()  # light crosses two faces of the glass
    for name in set(LIT) - {"Transmission Direct"}:
        assert result.passes[name].max() > 0, name


@pytest.fixture(scope="module")
def grouped() -> Scene:
    """The room with light groups and cryptomattes; it has no tolerance, so that its plan keeps what is dim."""
    wanted = Passes(("CryptoObject", "CryptoMaterial"), levels=4, light_groups=("cold", "warm", "sky"))
    return room(wanted, transport="rgb", samples=16, tolerance_delta_e=0.0)


@pytest.fixture(scope="module")
def picture(grouped):
    return render_scene(grouped)


def test_light_groups_and_the_rest_add_up(grouped, picture):
    groups = {name: picture.passes[f"Combined_{name}"] for name in ("cold", "warm", "sky")}
    left = picture.pixels[..., :3] - sum(groups.values())
    assert left.min() > -1e-4  # light of the point lamp
    # the others are dim instead of absent: the same kernel renders both
    panel, point = grouped.lights
    glow = Emission(Color([1.0, 0.6, 0.2]), 1e-6)
    alone = replace(
        grouped,
        lights=(replace(panel, power_w=1e-5), point),
        world=replace(grouped.world, color=gray(1e-7)),
        materials=tuple(replace(m, surface=glow) if m.name == "glow" else m for m in grouped.materials),
        film=replace(grouped.film, samples=64),
    )
    expected = render_scene(alone).pixels[..., :3]
    assert abs(left.mean() - expected.mean()) < 0.1 * expected.mean()
    assert all(group.max() > 0.02 for group in groups.values())


def test_data_passes_have_position_normal_and_indices_of_surfaces():
    names = ("Depth", "Position", "Normal", "Object Index", "Material Index", "UV", "Mist", "Diffuse Color")
    scene = room(Passes(names, mist=Mist(2.0, 10.0, "LINEAR")), samples=16, transport="rgb")
    scene = replace(
        scene, instances=scene.instances[:1], film=replace(scene.film, filter_kind="box", filter_width=1e-3)
    )
    passes = render_scene(scene).passes
    place = passes["Position"]
    on_floor = passes["Object Index"][..., 0] == 20
    assert on_floor.sum() > 600
    assert np.abs(place[on_floor, 2]).max() < 1e-4
    eye = scene.camera.world_from_camera
    np.testing.assert_allclose(
        passes["Depth"][on_floor, 0], -(place[on_floor] - eye[:3, 3]) @ eye[:3, 2], rtol=1e-4, atol=1e-4
    )
    assert np.all(passes["Depth"][~on_floor] == 1e10)
    away = np.linalg.norm(place[on_floor] - eye[:3, 3], axis=1)
    np.testing.assert_allclose(passes["Mist"][on_floor, 0], np.clip((away - 2) / 10, 0, 1), atol=2e-3)
    np.testing.assert_allclose(passes["Normal"][on_floor], np.broadcast_to([0, 0, 1], (on_floor.sum(), 3)), atol=1e-5)
    np.testing.assert_allclose(passes["UV"][on_floor, :2], place[on_floor, :2] / 10 + 0.5, atol=2e-3)
    assert set(np.unique(passes["Material Index"])) == {0.0, 5.0}
    np.testing.assert_allclose(passes["Diffuse Color"][on_floor], [[0.5, 0.4, 0.3]] * on_floor.sum(), rtol=1e-5)


def test_cryptomattes_list_the_objects_that_cover_a_pixel(picture):
    layers = [picture.passes[f"CryptoObject{k:02d}"] for k in range(2)]
    weights = sum(layer[..., 1] + layer[..., 3] for layer in layers)
    coverage = picture.pixels[..., 3]
    assert coverage.min() > 0.99  # the world counts, too
    assert weights.min() >= 0 and weights.max() < 1.001
    floor = sum(np.where(layer[..., k] == id_of("floor"), layer[..., k + 1], 0.0) for layer in layers for k in (0, 2))
    assert 0.3 < floor.mean() < 0.95
    assert np.all(layers[0][..., 1] >= layers[0][..., 3] - 1e-6)
    veil = sum(np.where(layer[..., k] == id_of("veil"), layer[..., k + 1], 0.0) for layer in layers for k in (0, 2))
    assert veil.max() == pytest.approx(0.6, abs=0.02)  # it covers 60 % of the background


def test_murmur_hash_equals_the_published_one():
    """Oracle: the test vectors of SMHasher and of the cryptomatte specification."""
    assert murmur_hash("") == 0
    assert murmur_hash("test") == 0xBA6BD213
    assert murmur_hash("Hello, world!") == 0xC0363E43
    assert np.float32(id_of("hello")).view(np.uint32) == 0x248BFA47


def test_other_passes_and_unknown_names():
    result = render_scene(room(Passes(("Debug Sample Count",)), transport="rgb", samples=3))
    assert np.all(result.passes["Debug Sample Count"] == 3)
    assert set(result.passes) == {"Debug Sample Count"}
    with pytest.raises(UnknownNameError, match="Dept"):
        Passes(("Dept",))


def test_a_render_with_a_target_error_has_passes():
    scene = room(Passes(("Diffuse Direct", "Debug Sample Count")), transport="rgb", target_error=20.0)
    result = render_scene(scene)
    counts = result.passes["Debug Sample Count"]
    assert counts.mean() == pytest.approx(result.samples, abs=0.51)
    assert result.passes["Diffuse Direct"].max() > 0
    assert any("traced beside the picture" in note.message for note in result.notes)


def test_light_in_a_medium_is_volume_and_adds_up():
    names = (*LIT, "Volume Direct", "Volume Indirect")
    scene = room(Passes(names), transport="spectral")
    fog = Material("fog", None, ScatteringMedium(0.15, gray(0.9), emission_color=gray(1.0), emission_strength=0.02))
    scene = replace(
        scene,
        materials=(*scene.materials, fog),
        instances=(*scene.instances, Instance("fog", "box", at(0, 0, 1.1, (3.0, 3.0, 1.0)), ("fog",))),
    )
    result = render_scene(scene)
    total = sum(result.passes[n] for n in ("Emission", "Environment", "Volume Direct", "Volume Indirect"))
    for lobe in LOBES:
        light = result.passes[f"{lobe} Direct"] + result.passes[f"{lobe} Indirect"]
        total = total + result.passes[f"{lobe} Color"] * light
    picture = result.pixels[..., :3]
    assert np.quantile(np.abs(total - picture), 0.98) < 4e-3 * picture.max()
    assert result.passes["Volume Direct"].mean() > 0.01 and result.passes["Volume Indirect"].max() > 0


def test_a_moving_scene_has_the_passes_of_all_its_moments():
    wanted = Passes(("Diffuse Direct", "Diffuse Color", "Object Index", "Debug Sample Count"))
    scene = room(wanted, transport="rgb", samples=8)
    moved = [replace(i, world_from_object=at(0.8, 0, 0.7, 0.7)) if i.name == "gloss" else i for i in scene.instances]
    moments = tuple(Moment(scene.camera, instances) for instances in (scene.instances, tuple(moved)))
    result = render_scene(replace(scene, moments=moments))
    assert np.all(result.passes["Debug Sample Count"] == 8)
    still = render_scene(scene).passes
    assert np.abs(result.passes["Diffuse Color"] - still["Diffuse Color"]).max() > 0.1
    assert any("of one moment" in note.message for note in result.notes)
