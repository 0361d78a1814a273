# SPDX-License-Identifier: GPL-3.0-or-later
"""Light later: relit pictures equal renders of the same paths, files refuse what is not theirs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError
from spectral_core.render import render_scene
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.dial import MOST_BULBS
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.mix import LiveMix, relight
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.render.relight.storages import STORAGE_NAMES, storage_named, storage_of_document
from spectral_core.render.relight.transport import (
    SAMPLING_LIGHTS,
    light_groups,
    one_group_per_light,
    record_transport,
    under_lights,
)
from spectral_core.render.relight.transport_file import read_transport, write_transport
from spectral_core.scene import (
    AreaLight,
    Color,
    Diffuse,
    Emission,
    Film,
    Glass,
    ImageTexture,
    Instance,
    Material,
    PointLight,
    Principled,
    Scene,
    World,
    gray,
    scene_hash,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import linear_rgb_from_xyz, luminance_from_linear_rgb
from spectral_core.spectra.observer import xyz_from_spectrum, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh

pytest.importorskip("mitsuba")
GRID = SpectralGrid.uniform(380, 780, 20)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Two lights and surroundings over a painted floor, a glass ball and a red ball: several bounces."""
    above = matrix((0.5, 0, 3))
    scene = lit_plane(
        PointLight(name="Key", world_from_light=above, power_w=60, radius=0.3, color=Color([1, 0.6, 0.3]), group="Key"),
        AreaLight(name="Fill", world_from_light=matrix((-1, 1, 3)), power_w=40, group="Fill"),
        world=World(gray(0.4), group="Sky"),
        camera=looking_down(8, 0.5),
        film=Film(20, 16, samples=32, seed=3, exposure=1.5),
    )
    floor = np.random.default_rng(1).uniform(0.1, 0.9, (4, 4, 3)).astype(np.float32)
    return replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(16)),
        materials=(
            *scene.materials,
            Material("glass", Glass(gray(0.95))),
            Material("red", Diffuse(Color([0.7, 0.1, 0.1]))),
            Material("painted", Diffuse(ImageTexture("floor", floor, "linear"))),
        ),
        instances=(
            *scene.instances,
            Instance("ball", "sphere", matrix((0, 1, 1), 0.7), ("glass",)),
            Instance("apple", "sphere", matrix((0, -1, 1), 0.7), ("red",)),
            Instance("carpet", "sphere", matrix((2, 0, 0.3), 0.6), ("painted",)),
        ),
    )


def relative_error(picture: np.ndarray, reference: np.ndarray) -> float:
    return float(np.abs(picture - reference)[..., :3].max() / np.abs(reference[..., :3]).max())


def test_a_dial_is_exact_for_every_mixture(scene: Scene) -> None:
    transport = record_transport(scene, MixtureStorage())
    dimmed = replace(scene, lights=(replace(scene.lights[0], power_w=18.0), scene.lights[1]),
                     world=replace(scene.world, strength=0.25))  # fmt: skip

    assert set(transport.groups) == {"Key", "Fill", "Sky"}
    assert relative_error(relight(transport), render_scene(scene).pixels) < 1e-5
    mixed = relight(transport, mix={"Key": 0.3, "Sky": 0.25})
    assert relative_error(mixed, render_scene(dimmed).pixels) < 1e-5


def test_exact_storage_equals_rendering_with_new_spectra(scene: Scene) -> None:
    """Sodium, a triphosphor lamp and a laser line on one grid, all bounces included."""
    line = Illuminant("line", GRID, np.where(GRID.wavelengths_nm == 540, 1.0, 0.0))
    lights = {"Key": catalogue.illuminant("HP1").resampled(GRID), "Fill": catalogue.illuminant("FL11").resampled(GRID),
              "Sky": line}  # fmt: skip
    transport = record_transport(scene, ExactStorage(GRID))
    worn = under_lights(replace(scene, settings=replace(scene.settings, transport="spectral")), lights)
    rendered = render_scene(worn, groups=True, sampling_lights=SAMPLING_LIGHTS)

    assert relative_error(relight(transport, lights=lights), rendered.pixels) < 1e-5
    for group in lights:
        alone = relight(transport, lights=lights, mix={name: float(name == group) for name in lights})
        assert relative_error(alone, rendered.group_pixels[group]) < 1e-5


@pytest.mark.parametrize("count", [31, 121])
def test_bands_are_near_for_smooth_lights(scene: Scene, count: int) -> None:
    """In the mean color of the picture: in a pixel's few samples a band's noise is not that of the light's."""
    lights = {name: catalogue.illuminant("A") for name in ("Key", "Fill", "Sky")}
    worn = under_lights(replace(scene, settings=replace(scene.settings, transport="spectral")), lights)
    rendered = render_scene(worn, sampling_lights=SAMPLING_LIGHTS).pixels.mean(axis=(0, 1))
    relit = relight(record_transport(scene, BandStorage(count)), lights=lights).mean(axis=(0, 1))

    np.testing.assert_allclose(relit, rendered, rtol=0.01)


def test_lights_that_are_not_renamed_shine_as_in_the_scene(scene: Scene) -> None:
    """A white light's own spectrum is kept; mixed spectra in one group are asked for."""
    transport = record_transport(scene, ExactStorage(SpectralGrid.uniform(360, 830, 5)))
    rendered = render_scene(
        replace(scene, settings=replace(scene.settings, transport="spectral")),
        groups=True,
        sampling_lights=SAMPLING_LIGHTS,
    )
    alone = relight(transport, mix={"Key": 0, "Sky": 0})
    assert relative_error(alone, rendered.group_pixels["Fill"]) < 3e-5  # 32-bit sums in another order

    merged = replace(scene, lights=tuple(replace(light, group="all") for light in scene.lights))
    mixed = record_transport(replace(merged, film=Film(4, 4, samples=1)), BandStorage())
    with pytest.raises(InvalidInputError, match="the lights of group 'all' had different spectra"):
        relight(mixed)


def test_files_come_back_to_the_bit(scene: Scene, tmp_path: Path) -> None:
    small = replace(scene, film=Film(8, 6, samples=2))
    for storage in (MixtureStorage(), BandStorage(31), ExactStorage(GRID)):
        transport = record_transport(small, storage)
        path = tmp_path / f"{storage.kind}.exr"
        write_transport(path, transport)
        back = read_transport(path, scene_hash=scene_hash(small))

        np.testing.assert_array_equal(back.channels, transport.channels)
        np.testing.assert_array_equal(back.coverage, transport.coverage)
        assert back.groups == transport.groups
        assert back.scene_hash == transport.scene_hash
        expected = relight(transport, mix={"Key": 0.0} if storage.kind == "dial" else {"Key": 0})
        np.testing.assert_allclose(relight(back, mix={"Key": 0}), expected, rtol=1e-6, atol=1e-7)


def test_cut_edited_and_foreign_files_are_refused(scene: Scene, tmp_path: Path) -> None:
    import OpenEXR

    path = tmp_path / "transport.exr"
    write_transport(path, record_transport(replace(scene, film=Film(8, 6, samples=1)), MixtureStorage()))
    whole = path.read_bytes()

    with pytest.raises(FileFormatError, match="was recorded from another scene"):
        read_transport(path, scene_hash="0" * 64)
    for share in (0.3, 0.6, 0.9):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(FileFormatError, match="record"):
            read_transport(path)
    path.write_bytes(whole)
    edited = OpenEXR.File(str(path), separate_channels=True)
    edited.parts[0].channels["G"].pixels[2, 3] += 0.25
    edited.write(str(path))
    with pytest.raises(FileFormatError, match="edited or damaged"):
        read_transport(path)
    with pytest.raises(FileFormatError, match="there is no file .*absent.exr; make one with"):
        read_transport(tmp_path / "absent.exr")
    OpenEXR.File({}, {"R": np.zeros((2, 2), np.float32)}).write(str(path))
    with pytest.raises(FileFormatError, match="but no transport"):
        read_transport(path)


def test_wrong_wishes_say_what_is_known(scene: Scene) -> None:
    transport = record_transport(replace(scene, film=Film(4, 4, samples=1)), MixtureStorage())

    with pytest.raises(UnknownNameError, match="no light group of this transport is named 'Kay'; did you mean 'Key'"):
        relight(transport, mix={"Kay": 1.0})
    with pytest.raises(InvalidInputError, match="a light cannot take light away"):
        relight(transport, mix={"Key": -1.0})
    with pytest.raises(InvalidInputError, match="a 'dial' transport holds no spectra"):
        LiveMix(transport).set_light("Key", catalogue.illuminant("A"))
    with pytest.raises(InvalidInputError, match="whole nm within 360 to 830"):
        ExactStorage(SpectralGrid(np.linspace(400, 700, 100)))
    with pytest.raises(InvalidInputError, match="one of"):
        BandStorage(40)


def test_memory_is_stated_before_rendering(scene: Scene) -> None:
    """What is stated is what the arrays take, to the byte."""
    small = replace(scene, film=Film(10, 7, samples=1))
    for storage in (MixtureStorage(), BandStorage(31), ExactStorage(GRID)):
        transport = record_transport(small, storage)
        assert storage.bytes_needed(10, 7, 3) == transport.channels.nbytes + transport.coverage.nbytes
    assert "829 MB" in MixtureStorage().describe(3840, 2160, 8)


def test_a_recording_that_memory_cannot_hold_is_refused_with_what_fits(scene, monkeypatch):
    from spectral_core.render.relight import memory

    storage = ExactStorage(SpectralGrid.uniform(380, 780, 10))
    assert storage.bytes_needed(3840, 2160, 8) == 4 * 3840 * 2160 * (3 * 41 * 8 + 1)
    monkeypatch.setattr(memory, "available_bytes", lambda: 24e9)
    memory.require_memory(MixtureStorage(), (3840, 2160), 8)
    with pytest.raises(InvalidInputError, match=r"3840×2160 for 8 light groups.*24.0 GB are free. What fits: dial"):
        memory.require_memory(storage, (3840, 2160), 8)
    monkeypatch.setattr(memory, "available_bytes", lambda: 1e6)
    with pytest.raises(InvalidInputError, match="are free"):
        record_transport(scene, storage, render=lambda *_, **__: pytest.fail("it must not render"))


def test_a_colored_light_is_as_bright_from_bands_as_it_was(scene):
    """A light's color dims it: what it is relit with is the same, not one of the luminance of white."""
    rendered = render_scene(replace(scene, settings=replace(scene.settings, transport="spectral"))).pixels
    relit = relight(record_transport(scene, BandStorage(31)))
    assert relit[..., :3].mean() == pytest.approx(rendered[..., :3].mean(), rel=0.05)


@pytest.fixture(scope="module")
def image_world() -> Scene:
    """A colored image around a red floor, a lamp, and a patterned glowing ball."""
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


@pytest.mark.parametrize(
    ("storage", "tolerance"),
    [(ExactStorage(SpectralGrid.uniform(360, 830, 5)), 2e-4), (ExactStorage(GRID), 0.02), (BandStorage(61), 0.02)],
    ids=["exact 5 nm", "exact 20 nm", "bands"],
)
def test_images_that_shine_are_relit_in_their_own_color(image_world: Scene, storage: Storage, tolerance: float) -> None:
    """Nothing changed: the relit picture is the render, group by group, image world and glowing image included."""
    rendered = render_scene(image_world, groups=True, sampling_lights=SAMPLING_LIGHTS).group_pixels
    transport = record_transport(image_world, storage)
    assert set(transport.groups) == {"Key", "Lamp", "Sky"}
    for group in transport.groups:
        relit = relight(transport, mix={name: float(name == group) for name in transport.groups})
        np.testing.assert_allclose(
            relit[..., :3].mean(axis=(0, 1)), rendered[group][..., :3].mean(axis=(0, 1)), rtol=tolerance
        )


def test_an_image_world_takes_a_new_lamp_in_place_of_daylight(image_world: Scene) -> None:
    """Its colors filter the new light, as a render with that white has it."""
    lamp = catalogue.illuminant("A").resampled(SpectralGrid.uniform(360, 830, 5))
    transport = record_transport(image_world, ExactStorage(lamp.grid))
    relit = relight(transport, lights={"Sky": lamp}, mix={"Key": 0, "Lamp": 0})
    worn = replace(image_world, settings=replace(image_world.settings, white=lamp))
    rendered = render_scene(worn, groups=True, sampling_lights=SAMPLING_LIGHTS).group_pixels["Sky"]
    assert relative_error(relit, rendered) < 1e-5


def test_a_light_between_the_knots_keeps_its_power(scene: Scene) -> None:
    """A line at 550 nm on a grid of 20 nm, and a measured lamp: the power of white stays within a percent."""
    storage = ExactStorage(GRID)
    for light in (
        Illuminant("line", SpectralGrid(np.array([545.3, 545.4, 545.5])), np.array([0.0, 1, 0])),
        catalogue.illuminant("FL11"),
        catalogue.illuminant("D65"),
    ):
        cmfs = xyz_from_spectrum(GRID)  # of each hat: what a white surface's channels hold
        shown = np.einsum("cnk,kn->c", storage.rgb_from_channels(light).reshape(3, -1, 3), cmfs)
        assert luminance_from_linear_rgb(shown) == pytest.approx(float(xyz_of(light)[1]), rel=0.01)


def test_too_many_lights_are_refused_before_anything_is_rendered(scene: Scene) -> None:
    lamp = scene.lights[0]
    crowd = replace(scene, lights=tuple(replace(lamp, name=f"l{k}", group=f"l{k}") for k in range(70)))
    with pytest.raises(InvalidInputError, match="71 light groups, and a dial has up to 64 lights"):
        record_transport(
            crowd, MixtureStorage(), most_groups=MOST_BULBS, render=lambda *_, **__: pytest.fail("it must not render")
        )


def test_things_of_one_name_stay_apart(scene: Scene) -> None:
    ember = Material("ember", Emission(gray(1.0), 1.0))
    twice = replace(
        scene,
        lights=(replace(scene.lights[0], name="World"),),
        materials=(*scene.materials, ember),
        instances=(*scene.instances, Instance("World", "sphere", np.eye(4), ("ember",))),
        world=replace(scene.world, group=""),
    )
    assert light_groups(one_group_per_light(twice)) == ("World", "World.001", "World.002")


def test_a_principled_surface_that_glows_is_a_light(scene: Scene) -> None:
    """Its emission color is what its group shines with, and it is recorded without it."""
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


def test_commands_name_the_storages_that_there_are() -> None:
    from blender_addon.commands import transport as command

    assert command.KINDS == STORAGE_NAMES
    for name in STORAGE_NAMES:
        storage = storage_named(name)
        back = storage_of_document(storage.kind, None if storage.grid is None else storage.grid.wavelengths_nm.tolist())
        assert back.channel_names() == storage.channel_names()
    with pytest.raises(UnknownNameError, match="storage"):
        storage_named("band31")
    with pytest.raises(InvalidInputError, match="none of dial"):
        storage_of_document("bands", list(np.linspace(390, 700, 31)))


def test_the_smaller_picture_that_is_offered_fits(monkeypatch) -> None:
    """The size in the message is the largest that memory holds, to a percent of its edge."""
    import re

    from spectral_core.render.relight import memory

    monkeypatch.setattr(memory, "available_bytes", lambda: 12e9)
    storage = BandStorage(121)
    with pytest.raises(InvalidInputError, match="a picture of") as refused:
        memory.require_memory(storage, (3840, 2160), 6)
    width, height = map(int, re.findall(r"picture of (\d+)×(\d+)", str(refused.value))[0])
    assert 0.97 * 12e9 < memory.peak_bytes(storage, width, height, 6) <= 12e9
