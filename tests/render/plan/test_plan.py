# SPDX-License-Identifier: GPL-3.0-or-later
"""Decisions of the plan from a scene, their reasons, and the artist's overrides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import plan_from_data, render_scene
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    ImageTexture,
    Material,
    MixSurface,
    PointLight,
    Principled,
    Rays,
    RenderSettings,
    ScatteringMedium,
    Transparent,
    VolumeObject,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum
from spectral_core.volume.transfer import Material as Stuff
from spectral_core.volume.transfer import TransferFunction
from tests.render.scenes import lit_plane, matrix

LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)
CLOUD = VolumeObject(
    "cloud",
    np.ones((2, 2, 2)),
    matrix((0, 0, 1)),
    TransferFunction((Stuff("cloud", np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.array([0.9, 0.6, 0.3])),)),
)
IMAGE = ImageTexture("wood", np.full((2, 2, 3), 0.5, np.float32), "linear")


def _values(scene):
    return {decision.name: decision.value for decision in plan_from_data(scene, 1.0).decisions}


def _with_material(surface, medium=None, **changes):
    scene = lit_plane(LAMP, settings=RenderSettings(), **changes)
    return replace(scene, materials=(Material("paper", surface, medium),))


def test_a_gray_plane_needs_no_effects():
    assert _values(_with_material(Diffuse(gray(0.5)))) == {
        "transport": "rgb",
        "dispersion": "off",
        "fluorescence": "off",
        "thin_film": "off",
        "media": "off",
        "volumes": "off",
        "transparency": "off",
        "environment": "none",
        "emissive_meshes": "off",
        "textures": "off",
        "depth_of_field": "off",
        "lamp_bodies": "off",
        "reflective_caustics": "off",
        "refractive_caustics": "off",
        "diffuse_bounces": "64",
        "glossy_bounces": "64",
        "transmission_bounces": "64",
        "bounces": "7",
    }


@pytest.mark.parametrize(
    ("surface", "effect", "value"),
    [
        (Diffuse(catalogue.reflectance("red")), "transport", "spectral"),
        (MixSurface(0.5, Diffuse(catalogue.reflectance("red")), Glossy()), "transport", "spectral"),
        (Diffuse(catalogue.reflectance("dark skin")), "transport", "rgb"),
        (Diffuse(IMAGE), "textures", "on"),
        (Emission(gray(1.0), 2.0), "emissive_meshes", "on"),
        (Principled(emission_strength=1.0), "emissive_meshes", "on"),
        (Principled(emission_strength=1.0, emission_color=gray(0.0)), "emissive_meshes", "off"),
        (MixSurface(0.5, Diffuse(), Transparent()), "transparency", "on"),
        (Principled(alpha=0.5), "transparency", "on"),
        (Glass(), "bounces", "64"),
        (Principled(transmission=1.0), "bounces", "64"),
        (Principled(), "bounces", "64"),
        (Diffuse(gray(0.0)), "bounces", "2"),
    ],
)
def test_materials_determine_effects(surface, effect, value):
    decision = plan_from_data(_with_material(surface), 1.0)[effect]
    assert decision.value == value and decision.source == "scene" and decision.reason


def test_brighter_rooms_need_more_bounces_and_coarser_tolerance_fewer():
    def bounces(reflectance, tolerance=1.0):
        return plan_from_data(_with_material(Diffuse(gray(reflectance))), tolerance).bounces

    assert bounces(0.2) < bounces(0.5) < bounces(0.9)
    assert bounces(0.6, 5.0) < bounces(0.6, 1.0) < bounces(0.6, 0.1)


def test_an_unused_material_has_no_influence():
    scene = lit_plane(LAMP)
    idle = Material("unused", Diffuse(catalogue.reflectance("dark skin")), ScatteringMedium())
    assert _values(replace(scene, materials=(*scene.materials, idle))) == _values(scene)


def test_lights_camera_and_world_determine_effects():
    scene = _with_material(Diffuse(gray(0.5)))
    sodium = replace(LAMP, color=catalogue.illuminant("HP1"))
    assert (
        plan_from_data(replace(scene, lights=(sodium,)))["transport"].value == "rgb"
    )  # a gray surface needs no spectral transport
    red = replace(scene, materials=(Material("paper", Diffuse(Color([0.6, 0.1, 0.1]))),), lights=(sodium,))
    assert plan_from_data(red)["transport"].value == "spectral"
    assert "'lamp'" in plan_from_data(red)["transport"].reason
    assert plan_from_data(replace(scene, world=World(gray(0.2))))["environment"].value == "constant"
    assert plan_from_data(replace(scene, world=World(IMAGE)))["environment"].value == "image"
    assert plan_from_data(replace(scene, world=World(gray(0.2), 0.0)))["environment"].value == "none"
    dark = ImageTexture("dark", np.full((2, 4, 3), -0.2, np.float32), color_space="linear")
    assert plan_from_data(replace(scene, world=World(dark)))["environment"].value == "image"  # it takes light away
    opened = Camera(world_from_camera=scene.camera.world_from_camera, aperture_radius=0.1)
    assert plan_from_data(replace(scene, camera=opened))["depth_of_field"].value == "on"
    area = AreaLight(name="area", world_from_light=matrix((0, 0, 3)))
    assert plan_from_data(replace(scene, lights=(area,)))["transparency"].value == "off"
    pair = replace(scene, lights=(area, LAMP))
    assert plan_from_data(pair)["transparency"].value == "off"  # lamps are no objects that shade
    assert plan_from_data(replace(pair, volumes=(CLOUD,)))["transparency"].value == "on"  # where they are


def test_dispersion_that_no_eye_sees_calls_for_no_spectra():
    knots = np.arange(380.0, 781.0, 10.0)
    scene = lambda slope: _with_material(Glass(ior=Spectrum("n", SpectralGrid(knots), 1.5 - slope * knots)))  # noqa: E731
    assert plan_from_data(scene(1e-10), 1.0)["transport"].value == "rgb"
    assert plan_from_data(scene(1e-4), 1.0)["transport"].value == "spectral"
    settings = RenderSettings(overrides=(("dispersion", "on"),))
    asked = plan_from_data(replace(scene(1e-10), settings=settings), 1.0)
    assert asked["dispersion"].value == "on" and asked["transport"].value == "spectral"
    for tolerance in np.geomspace(1e-3, 100, 26):  # three channels have no dispersion
        plan = plan_from_data(scene(1e-8), float(tolerance))
        assert plan["transport"].value == "spectral" or plan["dispersion"].value == "off"


@pytest.mark.parametrize("lighting", ["even", "scene", "shadows"])
def test_a_volume_too_thin_to_see_is_omitted(lighting):
    """Its error is bounded by what the data reach of the transfer function, and by the lamps."""
    stuff = CLOUD.transfer.materials[0]

    def planned(extinction, data=CLOUD.data):
        curve = TransferFunction((replace(stuff, extinction=np.array(extinction)),))
        cloud = replace(CLOUD, transfer=curve, data=data, lighting=lighting)
        return plan_from_data(_with_material(Diffuse(gray(0.5)), volumes=(cloud,)), 1.0)["volumes"]

    assert planned([0.0, 1.0]).value == "on" and planned([0.0, 1.0]).how == "not known"
    assert planned([0.0, 1e-9]).value == "off" and 0 < planned([0.0, 1e-9]).error < 0.01
    assert planned([0.0, 1.0], 0 * CLOUD.data).error == 0.0
    assert planned([0.0, 0.02]).value == "on" and planned([0.0, 0.02]).how == "bounded"


def test_omitted_effects_are_removed_from_the_simulated_scene():
    scene = _with_material(
        MixSurface(0.5, Emission(gray(1.0), 2.0), Principled(emission_strength=3.0)),
        ScatteringMedium(),
        world=World(IMAGE),
        camera=Camera(world_from_camera=matrix((0, 0, 3)), aperture_radius=0.2),
    )
    off = tuple((name, "off") for name in ("emissive_meshes", "media", "depth_of_field"))
    scene = replace(scene, settings=RenderSettings(overrides=(*off, ("environment", "none"))))
    plan = plan_from_data(scene)
    left = simulated_scene(scene, plan)
    assert left.camera.aperture_radius == 0 and left.world.is_black and left.materials[0].medium is None
    surface = left.materials[0].surface
    assert surface.first.strength == 0 and surface.second.emission_strength == 0
    untouched = replace(scene, settings=RenderSettings())
    assert simulated_scene(untouched, plan_from_data(untouched)) is untouched


def test_the_number_of_bounces_is_that_of_the_plan():
    """Two facing white planes: each further bounce adds light, and no bounces give direct light alone."""
    pytest.importorskip("mitsuba")
    ceiling = np.diag([1.0, -1, -1, 1])
    ceiling[2, 3] = 4
    scene = lit_plane(LAMP, surface=Diffuse(gray(0.9)), film=Film(4, 4, samples=256))
    scene = replace(
        scene, instances=(*scene.instances, replace(scene.instances[0], name="roof", world_from_object=ceiling))
    )
    means = [
        render_scene(replace(scene, settings=RenderSettings(max_bounces=n))).pixels[..., 0].mean() for n in (0, 1, 2, 4)
    ]
    direct = 0.9 / np.pi * 100 / (4 * np.pi) / 9
    assert means[0] == pytest.approx(direct, rel=1e-3)
    assert means[0] < means[1] < means[2] < means[3]


def test_the_plan_as_rows():
    rows = plan_from_data(_with_material(Diffuse(Color([0.5, 0.5, 0.5])))).as_rows()
    assert len(rows) == len(_values(_with_material(Diffuse(gray(0.5)))))
    errors = {"error_if_left_out", "error_is", "error_accepted", "time_share"}
    assert set(rows[0]) == {"effect", "value", "reason", "cost_if_left_out", "decided_by", "overridable"} | errors


def test_unused_slots_and_invisible_objects_have_no_influence():
    """An unused glass slot and an invisible glass object do not change the number of bounces of a diffuse scene."""
    scene = lit_plane(LAMP)
    glass = Material("glass", Glass())
    floor = scene.instances[0]
    matt = plan_from_data(scene).bounces
    with_slot = replace(
        scene,
        materials=(*scene.materials, glass),
        instances=(replace(floor, materials=(*floor.materials, "glass")),),
    )
    assert plan_from_data(with_slot).bounces == matt
    hidden = replace(floor, name="hidden", materials=("glass",), hidden_from=Rays.ALL)
    assert plan_from_data(replace(with_slot, instances=(floor, hidden))).bounces == matt
    seen = replace(hidden, hidden_from=Rays.CAMERA)
    assert plan_from_data(replace(with_slot, instances=(floor, seen))).bounces > matt


def test_the_scenes_limit_on_bounces_holds_with_a_reason():
    scene = lit_plane(LAMP)
    limited = replace(scene, settings=replace(scene.settings, scene_bounces=1))
    assert plan_from_data(limited).bounces == 1
    assert "the scene's light paths end there" in plan_from_data(limited)["bounces"].reason
    assert plan_from_data(replace(scene, settings=replace(scene.settings, scene_bounces=500))).bounces > 1


def test_a_color_temperature_alone_needs_no_spectral_transport():
    warm = replace(LAMP, color=catalogue.blackbody(3000), is_planckian=True)
    red = Diffuse(Color([0.7, 0.1, 0.05]))
    plan = lambda lamp: plan_from_data(lit_plane(lamp, surface=red, settings=RenderSettings()))  # noqa: E731
    assert not plan(warm).is_spectral
    assert plan(replace(warm, is_planckian=False)).is_spectral
