# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of sources other than lamps: media that emit light, the camera's view of the world, moving objects; and of
sources that are dark.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.groups import (
    changed_groups,
    fingerprint,
    group_light,
    light_groups,
    one_group_per_light,
)
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.render.relight.transport import Transport, record_transport
from spectral_core.scene import (
    AddSurface,
    Color,
    Diffuse,
    Emission,
    Film,
    Fluorescent,
    Instance,
    Light,
    Material,
    MixSurface,
    Moment,
    PointLight,
    Principled,
    ScatteringMedium,
    Scene,
    VolumeObject,
    World,
    gray,
)
from spectral_core.scene.geometry import unit_box
from spectral_core.scene.look import Look
from spectral_core.spectra import catalogue
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh

pytest.importorskip("mitsuba")
STORAGES = (MixtureStorage(), ExactStorage(SpectralGrid.uniform(360, 830, 5)))
SODIUM = catalogue.illuminant("HP1")


def _lamp(name: str, x: float = 0.0, **rest: object) -> PointLight:
    return PointLight(name=name, world_from_light=matrix((x, 0, 3)), power_w=100, **rest)  # type: ignore[arg-type]


def _scene(*lights: Light, **rest: object) -> Scene:
    rest.setdefault("film", Film(5, 4, samples=16, seed=2))
    return lit_plane(*lights, transport="spectral", **rest)


def _with_fire(scene: Scene, group: str = "") -> Scene:
    box = unit_box()
    fire = ScatteringMedium(0.5, gray(0.5), emission_strength=1.0, emission_color=Color([1, 0.4, 0.1]))
    return replace(
        scene,
        camera=looking_down(5.0),
        meshes=(*scene.meshes, box),
        materials=(*scene.materials, Material("fire", None, fire)),
        instances=(*scene.instances, Instance("fire", box.name, matrix((-0.5, -0.5, 0.5)), ("fire",), group)),
    )


def _mean(pixels: np.ndarray) -> np.ndarray:
    return pixels[..., :3].mean(axis=(0, 1))


def _assert_as_rendered(scene: Scene, storage: Storage, *, one_per_light: bool = True) -> Transport:
    transport = record_transport(scene, storage, one_per_light=one_per_light)
    lights = SAMPLING_LIGHTS if storage.keeps_spectra else None
    rendered = render_scene(scene, sampling_lights=lights)
    np.testing.assert_allclose(_mean(relight(transport)), _mean(rendered.pixels), rtol=0.02, atol=2e-3)
    return transport


@pytest.mark.parametrize("storage", STORAGES, ids=lambda storage: storage.kind)
def test_a_medium_that_emits_light_counts_once(storage: Storage) -> None:
    """It is a light of its own, whatever the number of lamps, and keeps its color; so is the fog of the world."""
    fog = ScatteringMedium(0.1, gray(0.5), emission_strength=0.1, emission_color=Color([0.1, 0.4, 1]))
    scene = _with_fire(_scene(_lamp("a", -1), _lamp("b", 1), world=World(medium=fog)))
    transport = _assert_as_rendered(scene, storage)
    assert transport.groups == ("World", "a", "b", "fire")
    dark = relight(transport, mix={"fire": 0.0, "World": 0.0})
    assert _mean(dark)[0] == pytest.approx(_mean(dark)[2], rel=0.05)
    assert _mean(relight(transport, mix={"a": 0.0, "b": 0.0, "fire": 0.0}))[2] > 0.01


def test_the_emission_of_one_material_is_in_the_group_of_each_object() -> None:
    scene = _with_fire(_scene(_lamp("a", group="lamps")), "first")
    floor, fire = scene.instances
    beside = [replace(fire, name=name, group=name, world_from_object=matrix((x, -0.5, 0.5)))
              for name, x in (("first", -1.1), ("second", 0.1))]  # fmt: skip
    transport = record_transport(replace(scene, instances=(floor, *beside)), MixtureStorage())
    assert transport.groups == ("first", "lamps", "second")
    each, other = (
        _mean(relight(transport, mix={"lamps": 0.0, "first": 0.0, "second": 0.0} | {name: 1.0}))[0]
        for name in ("first", "second")
    )
    assert each > 0.01 and each == pytest.approx(other, rel=0.15)  # they mirror each other


@pytest.mark.parametrize(
    ("brightness", "storage"), [(0.5, STORAGES[0]), (0.0, STORAGES[1])], ids=["lit-dial", "black-exact"]
)
def test_the_world_that_the_camera_sees_is_recorded(brightness: float, storage: Storage) -> None:
    upward = np.diag([1.0, -1, -1, 1])
    upward[2, 3] = 2.0
    camera = replace(looking_down(), world_from_camera=upward)
    world = World(Color([1, 0.5, 0.1]), brightness, camera_view=World(Color([0.1, 0.2, 1.0]), 2.0))
    transport = _assert_as_rendered(_scene(_lamp("a"), world=world, camera=camera), storage)
    assert transport.groups == ("World", "a")


@pytest.mark.parametrize("storage", STORAGES, ids=lambda storage: storage.kind)
def test_a_moving_light_is_recorded(storage: Storage) -> None:
    scene = _scene(_lamp("a", -1), camera=looking_down(5.0, 0.6))
    ball = Instance("ball", "sphere", matrix((0, 0, 0.5), 0.3), ("ember",))
    moved = [replace(ball, world_from_object=matrix((x, 0, 0.5), 0.3)) for x in (-0.5, 0.5)]
    scene = replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(12)),
        materials=(*scene.materials, Material("ember", Emission(Color([1, 0.3, 0.1]), 2.0))),
        instances=(*scene.instances, ball),
        moments=tuple(Moment(scene.camera, (item,)) for item in moved),
        film=Film(8, 8, samples=64),
    )
    transport = record_transport(scene, storage, one_per_light=True)
    assert transport.groups == ("a", "ball")
    own = _mean(relight(transport, mix={"a": 0.0}))
    only = _mean(render_scene(replace(scene, lights=())).pixels)
    np.testing.assert_allclose(own, only, rtol=0.15)
    if storage.keeps_spectra:  # the rest renders no recording
        return
    alone = Look(lamps=frozenset({"a"})).on(scene)
    assert _mean(render_scene(alone).pixels)[0] < 0.7 * _mean(render_scene(scene).pixels)[0]


DARK = [
    Emission(strength=0.0),
    Emission(gray(0.0), 3.0),
    Principled(emission_color=gray(0.0), emission_strength=1.0),
    MixSurface(0.0, Diffuse(), Emission()),
]


def test_dark_surfaces_are_no_lights() -> None:
    """Neither bulbs nor other spectra in the group of the lamp."""
    for surface in DARK:
        scene = _scene(_lamp("a", color=SODIUM), surface=AddSurface(Diffuse(), surface))
        assert light_groups(one_group_per_light(scene)) == ("a",), surface
        assert group_light(scene, "") is not None, surface  # None if its lights differ
    scene = _scene(_lamp("a", color=SODIUM), surface=AddSurface(AddSurface(Diffuse(), DARK[0]), DARK[3]))
    assert record_transport(scene, BandStorage(31), one_per_light=True).groups == ("a",)
    floor, *_ = scene.instances
    others = [Material(f"dark {k}", AddSurface(Diffuse(), each)) for k, each in enumerate(DARK[1:3])]
    placed = [replace(floor, name=each.name, world_from_object=matrix((x, 0, 0.01), 0.001), materials=(each.name,))
              for x, each in zip((-0.03, 0.03), others, strict=True)]  # fmt: skip
    scene = replace(scene, materials=(*scene.materials, *others), instances=(floor, *placed))
    _assert_as_rendered(scene, STORAGES[1], one_per_light=False)


def test_dark_lamps_do_not_change_the_spectrum_of_their_group() -> None:
    dark = _lamp("black", color=gray(0.0)), replace(_lamp("off"), power_w=0.0)
    _assert_as_rendered(_scene(_lamp("a", color=SODIUM), *dark), STORAGES[1], one_per_light=False)


def test_a_black_lamp_can_get_a_spectrum_later() -> None:
    transport = record_transport(_scene(_lamp("off", color=gray(0.0))), BandStorage(31))
    assert _mean(relight(transport)).max() == 0
    assert _mean(relight(transport, lights={"": SODIUM})).max() > 0.1


def test_an_exposure_of_0_is_no_division_by_0() -> None:
    transport = record_transport(_scene(_lamp("a"), film=Film(4, 4, samples=4, exposure=0.0)), MixtureStorage())
    assert transport.channels.max() > 0
    assert relight(transport)[..., :3].max() == 0


def test_fog_of_the_world_concerns_every_light() -> None:
    def foggy(density: float) -> Scene:
        return _scene(_lamp("a"), world=World(gray(0.1), medium=ScatteringMedium(density)))

    before, after = (fingerprint(foggy(density), one_per_light=True) for density in (0.1, 0.4))
    assert changed_groups(before, after) is None
    assert changed_groups(before, before) == ()


def test_the_notes_of_the_render_belong_to_the_recording() -> None:
    grid = SpectralGrid(np.array([400.0, 450, 500, 550, 600]))
    bells = [Spectrum(name, grid, np.array(v)) for name, v in (("in", [0.0, 1, 0, 0, 0]), ("out", [0.0, 0, 0, 1, 0]))]
    dye = FluorescentDye("dye", *bells)
    scene = _scene(_lamp("a"), surface=Fluorescent(gray(0.2), (dye,), (0.5,)), film=Film(3, 3, samples=2))
    notes = [note.message for note in render_scene(scene, groups=True, bands=BandStorage(31).measured()).notes]
    assert any("the stored bands hold for lamps of the spectra" in note for note in notes)
    catcher = replace(scene.instances[0], is_shadow_catcher=True)
    shadowed = replace(_scene(_lamp("a"), film=Film(3, 3, samples=2)), instances=(catcher,))
    notes = [note.message for note in record_transport(_with_fire(shadowed), MixtureStorage()).notes]
    assert any("without its shadow catchers" in note for note in notes)


def test_a_sampled_volume_among_media_is_recorded_once() -> None:
    """Its own light is in the first group, also where it becomes a medium."""
    ember = VolumeMaterial("ember", [0.0, 2.0], [1.0, 1.0], [0.8, 0.5, 0.2], [1.0, 1.0], False)
    transfer = TransferFunction((ember,), None)
    place = np.diag([0.5, 0.5, 0.5, 1.0])
    place[:3, 3] = (-0.75, -0.75, 2.0)
    scene = _scene(
        _lamp("a", -1, group="a"),
        _lamp("b", 1, group="b"),
        world=World(medium=ScatteringMedium(0.2, gray(0.5))),
        volumes=(VolumeObject("cloud", np.ones((4, 4, 4), np.float32), place, transfer),),
        camera=looking_down(6.0, 0.3),
    )
    transport = _assert_as_rendered(scene, MixtureStorage(), one_per_light=False)
    assert transport.groups == ("a", "b")
    assert _mean(relight(transport, mix={"b": 0.0}))[0] > 3 * _mean(relight(transport, mix={"a": 0.0}))[0]


@pytest.mark.parametrize("storage", STORAGES, ids=lambda storage: storage.kind)
def test_a_world_that_removes_light_is_recorded_with_its_spectrum(storage: Storage) -> None:
    transport = _assert_as_rendered(_scene(_lamp("a"), world=World(SODIUM, -0.02, group="Sky")), storage)
    lit = _mean(relight(transport, mix={"Sky": 0.0}))
    assert _mean(relight(transport))[0] < lit[0] - 0.005
