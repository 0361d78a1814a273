# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of a recording: emissive images, lamps between the knots, names, counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.dial import MOST_BULBS
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.groups import (
    changed_groups,
    fingerprint,
    light_groups,
    one_group_per_light,
    several_colors,
)
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.render.relight.storages import STORAGES, storage_named, storage_of_document
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import (
    Color,
    Diffuse,
    Emission,
    Film,
    ImageTexture,
    Instance,
    Material,
    PointLight,
    Principled,
    Scene,
    World,
    gray,
)
from spectral_core.scene.surface import AddSurface
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import linear_rgb_from_xyz, luminance_from_linear_rgb
from spectral_core.spectra.observer import xyz_from_spectrum, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.relight.comparison import relative_error
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh

pytest.importorskip("mitsuba")
GRID = SpectralGrid.uniform(380, 780, 20)


@pytest.fixture(scope="module")
def image_world() -> Scene:
    """A red floor in an image world, a lamp, and an emissive ball with a pattern."""
    rng = np.random.default_rng(4)
    sky = rng.uniform(0.1, 2, (8, 16, 3)).astype(np.float32) * np.array([0.3, 0.8, 1.9], np.float32)
    glow = ImageTexture("glow", rng.uniform(0, 1, (4, 8, 3)).astype(np.float32), "linear")
    scene = lit_plane(
        PointLight(name="Key", world_from_light=matrix((1, 0, 3)), power_w=60, radius=0.2, group="Key"),
        world=World(ImageTexture("sky", sky, "linear"), 0.8, group="Sky"),
        surface=Diffuse(Color([0.7, 0.3, 0.2])),
        camera=looking_down(8, 1.2),
        film=Film(16, 12, samples=32, seed=5),
    )
    return replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(16)),
        materials=(*scene.materials, Material("lamp", Emission(glow, 3.0))),
        instances=(*scene.instances, Instance("lantern", "sphere", matrix((-1, 0, 1), 0.5), ("lamp",), group="Lamp")),
        settings=replace(scene.settings, transport="spectral"),
    )


@pytest.fixture(scope="module")
def rendered_groups(image_world: Scene) -> dict[str, np.ndarray]:
    return render_scene(image_world, groups=True, sampling_lights=SAMPLING_LIGHTS).group_pixels


@pytest.mark.parametrize(
    ("storage", "tolerance"),
    [(ExactStorage(SpectralGrid.uniform(360, 830, 5)), 2e-4), (ExactStorage(GRID), 0.02), (BandStorage(31), 0.02)],
    ids=["exact 5 nm", "exact 20 nm", "bands"],
)
def test_emissive_images_are_relit_in_their_own_colors(
    image_world: Scene, rendered_groups: dict[str, np.ndarray], storage: Storage, tolerance: float
) -> None:
    """Without changes the relit picture equals the render for each group, including image world and emissive image."""
    rendered = rendered_groups
    transport = record_transport(image_world, storage)
    assert set(transport.groups) == {"Key", "Lamp", "Sky"}
    for group in transport.groups:
        relit = relight(transport, mix={name: float(name == group) for name in transport.groups})
        np.testing.assert_allclose(
            relit[..., :3].mean(axis=(0, 1)), rendered[group][..., :3].mean(axis=(0, 1)), rtol=tolerance
        )


def test_an_object_that_shines_in_two_colors_is_relit_in_them() -> None:
    """It had no single spectrum, so that a recording with bands could not be shown. Its red is that of another object,
    which shares a material of two colors below: then that filters white, too.
    """
    red, blue = Emission(Color([1, 0.2, 0.1]), 3.0), Emission(Color([0.1, 0.3, 1]), 2.0)
    scene = lit_plane(surface=Diffuse(Color([0.7, 0.3, 0.2])), camera=looking_down(8, 1.2), film=Film(8, 6, samples=16))
    both = Instance("lantern", "sphere", matrix((-1, 0, 1), 0.5), ("both",), group="Lantern")
    tube = Instance("tube", "sphere", matrix((1, 0.8, 1), 0.3), ("one",), group="Tube")
    scene = replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(8)),
        materials=(*scene.materials, Material("both", AddSurface(red, blue)), Material("one", red)),
        instances=(*scene.instances, both, tube),
        settings=replace(scene.settings, transport="spectral"),
    )
    rendered = render_scene(scene, groups=True, sampling_lights=SAMPLING_LIGHTS).group_pixels
    transport = record_transport(scene, BandStorage(31))
    for group in ("Lantern", "Tube"):
        relit = relight(transport, mix={name: float(name == group) for name in transport.groups})
        shown, wanted = (each[..., :3].mean(axis=(0, 1)) for each in (relit, rendered[group]))
        np.testing.assert_allclose(shown, wanted, rtol=0.02)
    assert several_colors(scene) == {"both"}
    sharing = replace(tube, materials=("one", "both"))
    assert several_colors(replace(scene, instances=(*scene.instances[:-1], sharing))) == {"both", "one"}
    assert several_colors(replace(scene, instances=(*scene.instances[:-2], tube))) == frozenset()


def test_an_image_world_uses_a_new_lamp_in_place_of_daylight(image_world: Scene) -> None:
    """Its colors filter the new light, as in a render with that white."""
    lamp = catalogue.illuminant("A").resampled(SpectralGrid.uniform(360, 830, 5))
    transport = record_transport(image_world, ExactStorage(lamp.grid))
    relit = relight(transport, lights={"Sky": lamp}, mix={"Key": 0, "Lamp": 0})
    lit = replace(image_world, settings=replace(image_world.settings, white=lamp))
    rendered = render_scene(lit, groups=True, sampling_lights=SAMPLING_LIGHTS).group_pixels["Sky"]
    assert relative_error(relit, rendered) < 1e-5


def test_a_line_between_the_knots_keeps_its_power(scene: Scene) -> None:
    """A line at 550 nm on a grid of 20 nm, and a measured lamp: the power of white is kept within a percent."""
    storage = ExactStorage(GRID)
    for light in (
        Illuminant("line", SpectralGrid(np.array([545.3, 545.4, 545.5])), np.array([0.0, 1, 0])),
        catalogue.illuminant("FL11"),
        catalogue.illuminant("D65"),
    ):
        cmfs = xyz_from_spectrum(GRID)  # power of each hat: the channels of a white surface
        shown = np.einsum("cnk,kn->c", storage.rgb_from_channels(light).reshape(3, -1, 3), cmfs)
        assert luminance_from_linear_rgb(shown) == pytest.approx(float(xyz_of(light)[1]), rel=0.01)


def test_too_many_lights_are_refused_before_anything_is_rendered(scene: Scene) -> None:
    lamp = scene.lights[0]
    crowd = replace(scene, lights=tuple(replace(lamp, name=f"l{k}", group=f"l{k}") for k in range(70)))
    with pytest.raises(InvalidInputError, match="71 light groups, and a dial has up to 64 lights"):
        record_transport(
            crowd, MixtureStorage(), most_groups=MOST_BULBS, render=lambda *_, **__: pytest.fail("it must not render")
        )


def test_lights_of_equal_names_stay_separate(scene: Scene) -> None:
    ember = Material("ember", Emission(gray(1.0), 1.0))
    twice = replace(
        scene,
        lights=(replace(scene.lights[0], name="World"),),
        materials=(*scene.materials, ember),
        instances=(*scene.instances, Instance("World", "sphere", np.eye(4), ("ember",))),
        world=replace(scene.world, group=""),
    )
    assert light_groups(one_group_per_light(twice)) == ("World", "World.001", "World.002")


def test_an_emissive_principled_surface_is_a_light(scene: Scene) -> None:
    """The emission color is the color of its group's light, and the recording is made without it."""
    glowing = Material("ember", Principled(emission_color=Color([1.0, 0.2, 0.1]), emission_strength=4.0))
    lit = replace(
        scene,
        lights=(),
        world=World(gray(0.0)),
        materials=(*scene.materials, glowing),
        instances=(*scene.instances, Instance("ember", "sphere", matrix((-1, 0, 1), 0.5), ("ember",), group="Ember")),
        film=Film(6, 4, samples=4),
    )
    assert light_groups(lit) == ("Ember",)
    transport = record_transport(lit, BandStorage(31))
    own = linear_rgb_from_xyz(xyz_of(transport.lights[0]))
    np.testing.assert_allclose(own, [1.0, 0.2, 0.1], atol=0.02)
    rendered = render_scene(replace(lit, settings=replace(lit.settings, transport="spectral")), groups=True)
    relit, there = relight(transport)[..., :3].mean(axis=(0, 1)), rendered.pixels[..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(relit / relit.max(), there / there.max(), atol=0.05)


def test_commands_list_the_available_storages() -> None:
    from blender_addon.commands import transport as command

    assert tuple(STORAGES) == command.STORAGE_NAMES
    for name in STORAGES:
        storage = storage_named(name)
        back = storage_of_document(storage.kind, None if storage.grid is None else storage.grid.wavelengths_nm.tolist())
        assert back.channel_names() == storage.channel_names()
    with pytest.raises(UnknownNameError, match="storage"):
        storage_named("band31")
    with pytest.raises(InvalidInputError, match="none of dial"):
        storage_of_document("bands", list(np.linspace(390, 700, 31)))


def test_the_suggested_smaller_picture_fits(monkeypatch) -> None:
    """The suggested size is the largest that fits into memory, to a percent of its edge."""
    import re

    from spectral_core.render.relight import memory

    monkeypatch.setattr(memory, "available_bytes", lambda: 12e9)
    storage = BandStorage(121)
    with pytest.raises(InvalidInputError, match="a picture of") as refused:
        memory.require_memory(storage, (3840, 2160), 6)
    width, height = map(int, re.findall(r"picture of (\d+)×(\d+)", str(refused.value))[0])
    assert 0.97 * 12e9 < memory.peak_bytes(storage, width, height, 6) <= 12e9


def test_only_changed_lights_are_rendered_again(image_world: Scene) -> None:
    """Changed groups equal a full recording of the edited scene, the others are unchanged, both to the bit."""
    storage = BandStorage(31)
    spare = PointLight(name="Spare", world_from_light=matrix((-1, 1, 3)), power_w=20, group="Spare")
    before = replace(image_world, lights=(*image_world.lights, spare))
    kept = record_transport(before, storage)
    key = replace(before.lights[0], world_from_light=matrix((0, 1, 2)), power_w=90.0)
    rim = PointLight(name="Rim", world_from_light=matrix((2, 2, 2)), power_w=10, group="Rim")
    after = replace(before, lights=(key, *before.lights[1:-1], rim))
    again = changed_groups(fingerprint(before), fingerprint(after))
    assert again is not None and set(again) == {"Key", "Rim"}
    asked = []

    def render(scene, *, groups, **options):
        asked.append(groups)
        return render_scene(scene, groups=groups, **options)

    partial = record_transport(after, storage, kept=kept, again=again, render=render)
    whole = record_transport(after, storage)
    assert [set(groups) for groups in asked] == [{"Key", "Rim"}]
    assert partial.groups == whole.groups and "Spare" not in partial.groups
    for name in partial.groups:
        source = whole if name in ("Key", "Rim") else kept
        np.testing.assert_array_equal(
            partial.channels[partial.index_of(name)], source.channels[source.index_of(name)], err_msg=name
        )
        share, there = (each.channels[each.index_of(name)].mean() for each in (partial, whole))
        assert share == pytest.approx(there, rel=0.05)  # the choice among lamps differs: other noise, the same light
    np.testing.assert_array_equal(partial.coverage, whole.coverage)
    assert partial.scene_hash == whole.scene_hash


def test_a_change_other_than_lights_requires_a_full_recording(image_world: Scene) -> None:
    before = fingerprint(image_world)
    assert changed_groups(before, fingerprint(image_world)) == ()
    moved = replace(image_world.instances[0], world_from_object=matrix((0, 0, -1)))
    for edited in (
        replace(image_world, instances=(moved, *image_world.instances[1:])),
        replace(image_world, camera=replace(image_world.camera, far=77.0)),
        replace(image_world, film=replace(image_world.film, samples=7)),
        replace(image_world, materials=(*image_world.materials, Material("more", Diffuse(gray(0.1))))),
    ):
        assert changed_groups(before, fingerprint(edited)) is None
    sky = replace(image_world, world=replace(image_world.world, strength=2.0))
    assert changed_groups(before, fingerprint(sky)) == ("Sky",)


def test_a_fingerprint_traces_nothing(image_world: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is computed in Blender's process, where Mitsuba must not run: it could end the artist's session."""

    def run_pilot(*_given: object) -> None:
        raise AssertionError("a pilot was traced")

    monkeypatch.setattr("spectral_core.render.plan.effects.run_pilot", run_pilot)
    assert fingerprint(image_world).groups


def test_an_earlier_recording_with_other_settings_is_refused(image_world: Scene) -> None:
    kept = record_transport(image_world, BandStorage(31))
    with pytest.raises(InvalidInputError, match="record all lights again"):
        record_transport(image_world, MixtureStorage(), kept=kept, again=("Key",))
    again = record_transport(image_world, BandStorage(31), kept=kept, again=())
    np.testing.assert_array_equal(again.channels, kept.channels)
