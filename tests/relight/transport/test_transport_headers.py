# SPDX-License-Identifier: GPL-3.0-or-later
"""Headers of transport files, light groups and parts that are kept, without any rendering."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import FileFormatError, InvalidInputError, RenderCancelled
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.groups import group_light, light_groups, one_group_per_light
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import Transport, record_transport, under_flat_light
from spectral_core.render.relight.transport_file import is_transport, read_transport, write_transport
from spectral_core.render.relight.view_transform import ViewTransform
from spectral_core.scene import (
    Color,
    Emission,
    Film,
    ImageTexture,
    Instance,
    Material,
    MixSurface,
    PointLight,
    Principled,
    Scene,
    World,
    gray,
)
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.relight.test_page import transport_of
from tests.render.scenes import lit_plane, looking_down, matrix

OpenEXR = pytest.importorskip("OpenEXR")
GRID = SpectralGrid([400.0, 550.0, 700.0])


def some_transport() -> Transport:
    rng = np.random.default_rng(3)
    lamp = Illuminant("lamp", GRID, [0.5, 1.0, 2.0])
    view = ViewTransform("v", rng.uniform(0, 1, (2, 2, 2, 3)))
    plain = transport_of(rng.uniform(0, 1, (2, 3, 5, 4)))
    return replace(
        plain, lights=(lamp, None), groups=("a", ""), exposure=1.75, view=view, samples=17, seed=23,
        coverage=rng.uniform(0, 1, (5, 4)).astype(np.float32),
    )  # fmt: skip


def test_every_entry_of_a_transport_is_read_back(tmp_path: Path) -> None:
    transport = some_transport()
    path = tmp_path / "t.exr"
    write_transport(path, transport)
    back = read_transport(path, scene_hash="0" * 64)
    np.testing.assert_array_equal(back.channels, transport.channels)
    np.testing.assert_array_equal(back.coverage, transport.coverage)
    assert (back.groups, back.exposure, back.samples, back.seed) == (("a", ""), 1.75, 17, 23)
    assert back.storage == MixtureStorage() and back.lights[1] is None
    assert back.lights[0].name == "lamp" and back.lights[0].grid.same_as(GRID)
    np.testing.assert_array_equal(back.lights[0].values, [0.5, 1.0, 2.0])
    assert back.view.name == "v"
    bare = tmp_path / "bare.exr"
    write_transport(bare, replace(transport, view=None))
    assert read_transport(bare).view is None
    # pictures are stored from the top down, as EXR has them
    stored = OpenEXR.File(str(path), separate_channels=True).parts[0].channels["G"].pixels
    np.testing.assert_array_equal(stored, transport.channels[0, 1, ::-1])


def rewritten(path: Path, **changed: Any) -> None:
    """Change entries of the header, and leave the pixels."""
    whole = OpenEXR.File(str(path), separate_channels=True)
    for part in whole.parts:
        if "spectralSceneTransport" in part.header:
            meaning = json.loads(part.header["spectralSceneTransport"])
            part.header["spectralSceneTransport"] = json.dumps({**meaning, **changed})
    whole.write(str(path))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"version": 0}, "is of version 0"),
        ({"version": 2}, "is of version 2"),
        ({"version": True}, "is of version True"),
        ({"version": 1.0}, "is of version 1.0"),
        ({"kind": "other"}, "is of version 1"),
        ({"seed": 24}, "edited or damaged"),
        ({"exposure": 2.0}, "edited or damaged"),
        ({"checksum": None}, "edited or damaged"),
        ({"groups": ["a"]}, "has 3 parts, but its header needs 2"),
        ({"groups": ["a", "b", "c"]}, "has 3 parts, but its header needs 4"),
        ({"groups": ["a", 2]}, "its light groups are no list of names"),
        ({"storage": "exact"}, "describes no transport"),
        ({"lights": 3}, "describes no transport"),
        ({"samples": float("inf")}, "describes no transport"),
    ],
)
def test_edited_headers_are_refused(tmp_path: Path, changed: dict[str, Any], message: str) -> None:
    path = tmp_path / "t.exr"
    write_transport(path, some_transport())
    rewritten(path)
    assert read_transport(path).seed == 23  # written again, it is the same
    rewritten(path, **changed)
    with pytest.raises(FileFormatError, match=message):
        read_transport(path)


def test_a_cut_file_is_called_truncated_wherever_it_ends(tmp_path: Path) -> None:
    path = tmp_path / "t.exr"
    write_transport(path, some_transport())
    whole = path.read_bytes()
    for missing in (1, 5, 40):  # the header is whole, the pixels of the last parts are not
        path.write_bytes(whole[:-missing])
        with pytest.raises(
            FileFormatError, match=r"truncated or damaged: the pixels of \d of its 3 parts cannot be read"
        ):
            read_transport(path)


def test_only_transports_are_replaced_on_request(tmp_path: Path) -> None:
    path = tmp_path / "t.exr"
    transport = some_transport()
    write_transport(path, transport, only_over_transports=True)
    write_transport(path, replace(transport, seed=5), only_over_transports=True)
    assert read_transport(path).seed == 5 and is_transport(path)
    picture = tmp_path / "picture.exr"
    OpenEXR.File({}, {"R": np.zeros((2, 2), np.float32)}).write(str(picture))
    text = tmp_path / "notes.txt"
    text.write_text("mine")
    for other in (picture, text):
        before = other.read_bytes()
        assert not is_transport(other)
        with pytest.raises(InvalidInputError):
            write_transport(other, transport, only_over_transports=True)
        assert other.read_bytes() == before
    write_transport(picture, transport)
    assert is_transport(picture)


def small_scene(**rest: Any) -> Scene:
    lamp = PointLight(
        name="Key", world_from_light=matrix((0, 0, 3)), power_w=60, group="Key", color=Color([1, 0.5, 0.2])
    )
    return lit_plane(lamp, camera=looking_down(6, 1), film=Film(4, 3, samples=8, seed=2, exposure=2.0), **rest)


def fake(**channels: float) -> Any:
    """A renderer that returns constant pictures, and what it was asked for."""
    asked: list[dict[str, Any]] = []

    def render(scene: Scene, *, groups: Any, bands: Any, **options: Any) -> Any:
        asked.append({"scene": scene, "groups": groups, "bands": bands, **options})
        count = 4 if bands is None else len(bands.names)
        pictures = {name: np.full((3, 4, count), value, np.float32) for name, value in channels.items()}
        return SimpleNamespace(
            status="done", group_pixels=dict(pictures), group_band_pixels=dict(pictures),
            pixels=np.full((3, 4, 4), 0.25, np.float32), notes=(),
        )  # fmt: skip

    return render, asked


@pytest.mark.parametrize("storage", [MixtureStorage(), BandStorage(31), ExactStorage(GRID)], ids=lambda s: s.kind)
def test_a_recording_divides_pictures_by_the_exposure_and_keeps_bands(storage: Any) -> None:
    scene = small_scene(world=World(gray(0.5), group="Sky"))
    render, asked = fake(Key=3.0, Sky=5.0)
    transport = record_transport(scene, storage, render=render)
    factor = 0.5 if storage.kind == "dial" else 1.0
    assert transport.groups == ("Key", "Sky") and transport.channels.shape == (2, storage.channel_count, 3, 4)
    np.testing.assert_allclose(transport.channels[0], 3.0 * factor)
    np.testing.assert_allclose(transport.channels[1], 5.0 * factor)
    np.testing.assert_allclose(transport.coverage, 0.25)
    assert (transport.exposure, transport.samples, transport.seed) == (2.0, 8, 2)
    (call,) = asked
    assert call["groups"] is True
    assert ("sampling_lights" in call) == (storage.kind != "dial")
    assert (call["bands"] is None) == (storage.kind == "dial")
    assert (call["scene"] is scene) == (storage.kind == "dial")


def test_only_groups_that_light_the_picture_are_kept() -> None:
    scene = small_scene(world=World(gray(0.5), group="Sky"))
    render, _ = fake(Sky=5.0)
    assert record_transport(scene, MixtureStorage(), render=render).groups == ("Sky",)
    nothing, _ = fake()
    with pytest.raises(InvalidInputError, match="no light of the scene reaches the picture"):
        record_transport(scene, MixtureStorage(), render=nothing)
    with pytest.raises(InvalidInputError, match="the scene has no light"):
        record_transport(replace(scene, lights=(), world=World(gray(0.0))), MixtureStorage(), render=nothing)
    with pytest.raises(InvalidInputError, match="has 2 light groups, and a dial has up to 1"):
        record_transport(scene, MixtureStorage(), most_groups=1, render=nothing)
    assert len(record_transport(scene, MixtureStorage(), most_groups=2, render=fake(Key=1, Sky=1)[0]).groups) == 2

    def stopped(*_: Any, **__: Any) -> Any:
        return SimpleNamespace(status="stopped")

    with pytest.raises(RenderCancelled):
        record_transport(scene, MixtureStorage(), render=stopped)


def test_kept_groups_are_not_rendered_again() -> None:
    scene = small_scene(world=World(gray(0.5), group="Sky"))
    kept = record_transport(scene, MixtureStorage(), render=fake(Key=2.0, Sky=4.0)[0])
    render, asked = fake(Key=8.0)
    mixed = record_transport(scene, MixtureStorage(), kept=kept, again=("Key",), render=render)
    assert asked[0]["groups"] == ("Key",)
    np.testing.assert_allclose(mixed.channels[:, 0, 0, 0], [4.0, 2.0])
    render, asked = fake(Key=8.0, Sky=6.0)
    whole = record_transport(scene, MixtureStorage(), kept=kept, again=None, render=render)
    assert asked[0]["groups"] is True
    np.testing.assert_allclose(whole.channels[:, 0, 0, 0], [4.0, 3.0])
    for other in (Film(3, 4, samples=8, seed=2), Film(4, 3, samples=9, seed=2), Film(4, 3, samples=8, seed=3)):
        with pytest.raises(InvalidInputError, match="record all lights again"):
            record_transport(replace(scene, film=other), MixtureStorage(), kept=kept, again=("Key",), render=render)


def test_flat_light_removes_colors_and_keeps_patterns() -> None:
    pattern = ImageTexture("p", np.ones((2, 2, 3), np.float32), "linear")
    both = MixSurface(0.5, Emission(Color([1, 0, 0]), 2.0), Principled(emission_color=pattern, emission_strength=1.0))
    scene = small_scene(world=World(Color([0.2, 0.3, 0.4]), group="Sky"))
    scene = replace(scene, materials=(Material("glow", both), Material("none", None), *scene.materials))
    flat = under_flat_light(scene)
    white = gray(1.0).linear_rgb
    np.testing.assert_array_equal(flat.lights[0].color.linear_rgb, white)
    np.testing.assert_array_equal(flat.world.color.linear_rgb, white)
    surface = flat.materials[0].surface
    np.testing.assert_array_equal(surface.first.color.linear_rgb, white)
    assert surface.second.emission_color is pattern and surface.first.strength == 2.0
    assert flat.materials[1].surface is None
    assert flat.settings.transport == "spectral" and flat.settings.white.name == "flat"
    dark = under_flat_light(replace(scene, world=World(gray(0.0))))
    assert dark.world.is_black


def glowing_scene() -> Scene:
    scene = small_scene(world=World(gray(0.0), group="Sky"))
    red, blue = Color([0.8, 0.1, 0.1]), Color([0.1, 0.1, 0.9])
    return replace(
        scene,
        materials=(*scene.materials, Material("red", Emission(red, 1.0)), Material("blue", Emission(blue, 1.0)),
                   Material("off", Principled(emission_color=red, emission_strength=0.0))),
        instances=(*scene.instances, Instance("a", "plane", np.eye(4), ("red",), group="G"),
                   Instance("b", "plane", np.eye(4), ("blue",), group="H"),
                   Instance("c", "plane", np.eye(4), ("off",), group="I")),
    )  # fmt: skip


def test_groups_are_those_of_sources_that_emit() -> None:
    scene = glowing_scene()
    assert light_groups(scene) == ("G", "H", "Key")
    assert light_groups(replace(scene, world=World(gray(0.1), group="Sky"))) == ("G", "H", "Key", "Sky")
    apart = one_group_per_light(replace(scene, world=World(gray(0.1))))
    assert light_groups(apart) == ("Key", "World", "a", "b")
    named = replace(scene, lights=(replace(scene.lights[0], name="a"), replace(scene.lights[0], name="a.001")))
    assert light_groups(one_group_per_light(named)) == ("a", "a.001", "a.002", "b")


def test_a_group_has_a_spectrum_if_all_its_sources_share_it() -> None:
    scene = glowing_scene()
    key = group_light(scene, "Key")
    assert key is not None
    assert (
        group_light(scene, "nobody") is None and group_light(scene, "Sky") is None and group_light(scene, "I") is None
    )
    second = replace(scene.lights[0], name="Second")
    same = replace(scene, lights=(scene.lights[0], replace(second, power_w=3.0)))
    np.testing.assert_array_equal(group_light(same, "Key").values, key.values)
    other = replace(scene, lights=(scene.lights[0], replace(second, color=Color([1, 0.5, 0.3]))))
    assert group_light(other, "Key") is None
    grids = replace(scene, lights=(
        replace(scene.lights[0], color=Illuminant("x", GRID, [1.0, 1, 1])),
        replace(second, color=Illuminant("x", SpectralGrid([400.0, 560.0, 700.0]), [1.0, 1, 1]))))  # fmt: skip
    assert group_light(grids, "Key") is None
    joined = replace(scene, world=World(Color([1, 0.5, 0.2]), group="Key"))
    np.testing.assert_allclose(group_light(joined, "Key").values, key.values)
    merged = replace(scene, instances=tuple(replace(each, group="G") for each in scene.instances))
    assert group_light(merged, "G") is None  # red and blue
