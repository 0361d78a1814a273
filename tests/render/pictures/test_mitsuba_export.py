# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene written for Mitsuba is loaded by Mitsuba alone, and its picture is ours within the noise."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render import render_scene
from spectral_core.render.mitsuba_export import write_mitsuba
from spectral_core.scene import (
    AddSurface,
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    Holdout,
    ImageTexture,
    Instance,
    Material,
    Metal,
    MixSurface,
    PointLight,
    Principled,
    Rays,
    RenderSettings,
    ScatteringMedium,
    Scene,
    Sheen,
    SpotLight,
    Subsurface,
    SunLight,
    Toon,
    Translucent,
    Transparent,
    VolumeObject,
    World,
    gray,
)
from spectral_core.scene.surface import Closure
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction
from tests.render.scenes import lit_plane, matrix, plane, sphere_mesh

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

PLAIN = """
import sys, numpy, mitsuba
mitsuba.set_variant(sys.argv[1])
for path in sys.argv[4:]:
    numpy.save(path + sys.argv[2], numpy.array(mitsuba.render(mitsuba.load_file(path), spp=int(sys.argv[3]), seed=3)))
assert not [name for name in sys.modules if name.startswith(("spectral_core", "blender_addon"))]
"""
GRID = SpectralGrid(np.arange(380.0, 781.0, 5.0))


def plain_pictures(scenes: dict[Path, Scene], *, variant: str, samples: int) -> list[Any]:
    """Pixels (height, width, 3) by folder, row 0 at the bottom, by a Python that never sees this package."""
    paths = [str(write_mitsuba(scene, folder).scene) for folder, scene in scenes.items()]
    command = [sys.executable, "-c", PLAIN, variant, ".npy", str(samples), *paths]
    done = subprocess.run(command, capture_output=True, text=True, cwd=next(iter(scenes)).parent)
    assert done.returncode == 0, done.stderr
    return [np.load(path + ".npy")[::-1, :, :3] for path in paths]


def plain_picture(scene: Scene, folder: Path, **how: Any) -> Any:
    return plain_pictures({folder: scene}, **how)[0]


def turned(axis: int, degrees: float, translation: tuple[float, float, float]) -> Any:
    angle = np.radians(degrees)
    result = np.eye(4)
    first, second = (k for k in range(3) if k != axis)
    result[first, first] = result[second, second] = np.cos(angle)
    result[first, second], result[second, first] = -np.sin(angle), np.sin(angle)
    result[:3, 3] = translation
    return result


def box(*, transport: str = "rgb", samples: int = 256) -> Scene:
    """A room with colored walls, a mirror ball, a glass ball, an image and a lamp, seen off center."""
    bump = 0.1 + 0.5 * np.exp(-(((GRID.wavelengths_nm - 550) / 40) ** 2))
    checks = np.kron(np.eye(2), np.ones((4, 4)))[..., None] * np.array([0.6, 0.4, 0.2]) + 0.1
    checks[:4, :4, 0] = 0.9  # one corner differs, so that a flipped image is seen
    image = ImageTexture("checks", checks.astype(np.float32), "linear", interpolation="nearest")
    mirror = Glossy(Color(np.array([0.9, 0.8, 0.7])), roughness=0.4, multiple_scattering=False)
    materials = {
        "floor": Diffuse(image),
        "left": Diffuse(Color(np.array([0.6, 0.05, 0.05]))),
        "right": Diffuse(Reflectance("leaf", GRID, bump)),
        "back": MixSurface(0.3, Diffuse(gray(0.6)), replace(mirror, roughness=0.3)),
        "ball": Glass(ior=1.45),
        "metal": mirror,
    }
    places = {
        "floor": matrix(), "left": turned(1, 90, (-1, 0, 1)), "right": turned(1, -90, (1, 0, 1)),
        "back": turned(0, 90, (0, 1, 1)),
    }  # fmt: skip
    instances = [Instance(name, "plane", place, (name,)) for name, place in places.items()]
    instances += [
        Instance("ceiling", "plane", matrix((0, 0, 2)), ("left",)),
        Instance("ball", "sphere", matrix((0.4, -0.3, 0.35), 0.35), ("ball",)),
        Instance("metal", "sphere", matrix((-0.4, 0.2, 0.4), 0.4), ("metal",)),
    ]
    sodium = Illuminant("sodium", GRID, 0.2 + 5.0 * (np.abs(GRID.wavelengths_nm - 590) < 8))
    lamp = AreaLight(
        name="lamp", world_from_light=matrix((0, 0, 1.99)), power_w=20, size=(0.6, 0.4), camera_visible=True,
        color=sodium if transport == "spectral" else Color(np.array([1.0, 0.9, 0.7])),
    )  # fmt: skip
    return Scene(
        camera=Camera(world_from_camera=turned(0, 90, (0, -3.9, 1)), field_of_view_rad=0.7, shift=(0.05, -0.03)),
        film=Film(48, 36, samples=samples, exposure=1.5),
        meshes=(plane(1.0), sphere_mesh(24)),
        materials=tuple(Material(name, surface) for name, surface in materials.items()),
        instances=tuple(instances),
        lights=(lamp,),
        world=World(gray(0.3)),
        settings=RenderSettings(transport=transport, max_bounces=5),  # type: ignore[arg-type]
    )


def tiles(pixels: Any, size: int = 6) -> Any:
    """Means of squares of pixels."""
    height, width = (length // size for length in pixels.shape[:2])
    return pixels[: height * size, : width * size].reshape(height, size, width, size, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_mitsuba_alone_renders_the_same_box(tmp_path: Path, transport: str) -> None:
    """Means of 6 × 6 pixels agree within the noise, the whole within 1.5 %; a flipped image or a shift is far off."""
    scene = box(transport=transport)
    theirs = plain_picture(scene, tmp_path / "scene", variant=f"llvm_ad_{transport}", samples=512)
    ours = render_scene(scene).pixels[..., :3]

    assert theirs.mean(axis=(0, 1)) == pytest.approx(ours.mean(axis=(0, 1)), rel=0.015)
    difference = np.abs(tiles(theirs) - tiles(ours)) / tiles(ours).max(axis=-1, keepdims=True)
    assert difference.max() < 0.15 and difference.mean() < 0.02


def test_lights_have_the_brightness_of_ours(tmp_path: Path) -> None:
    """A plane under each kind of light, within 1 % (2 % for the spot's edge)."""
    down = matrix((0, 0, 3))
    lights = {
        "point": PointLight(name="L", world_from_light=down, power_w=100),
        "ball": PointLight(name="L", world_from_light=down, power_w=100, radius=0.3, soft_falloff=False),
        "spot": SpotLight(name="L", world_from_light=down, power_w=100, cone_angle_rad=1.0, blend=0.0),
        "sun": SunLight(name="L", world_from_light=turned(0, 40, (0, 0, 3)), irradiance=2.0, angle_rad=0.2),
        "sharp sun": SunLight(name="L", world_from_light=turned(0, 40, (0, 0, 3)), irradiance=2.0, angle_rad=0.0),
        "ellipse": AreaLight(name="L", world_from_light=down, power_w=50, size=(1.0, 0.5), shape="ellipse"),
    }
    scenes = {name: lit_plane(light, film=Film(4, 4, samples=256)) for name, light in lights.items()}
    by_folder = {tmp_path / name: scene for name, scene in scenes.items()}
    pictures = plain_pictures(by_folder, variant="scalar_rgb", samples=1024)
    for (name, scene), theirs in zip(scenes.items(), pictures, strict=True):
        assert theirs.mean() == pytest.approx(render_scene(scene).pixels[..., :3].mean(), rel=0.015), name


def everything() -> Scene:
    """A scene with one object for each closure, light and medium."""
    half = gray(0.5)
    surfaces: list[Any] = [
        Diffuse(half, roughness=0.5), Glossy(half, roughness=0.0), Glossy(half, anisotropy=0.5),
        Glossy(half, distribution="ashikhmin"), Glass(roughness=0.3), Glass(reflects=False), Glass(ior=1.0),
        Translucent(half), Toon(half), Metal(half), Metal(half, physical=True, roughness=0.2), Transparent(half),
        Transparent(gray(1.0)), Sheen(half), Holdout(), Emission(half, 2.0), Subsurface(half), Principled(half),
        Principled(half, metallic=1.0), Principled(half, transmission=1.0), Principled(half, transmission=0.5),
        Principled(half, alpha=0.5, coat_weight=0.5, sheen_weight=0.2, emission_strength=1.0),
        MixSurface(0.4, Transparent(gray(1.0)), Diffuse(half)), AddSurface(Diffuse(half), Glossy(half)),
        AddSurface(Emission(half), Diffuse(half)), None,
    ]  # fmt: skip
    fog = ScatteringMedium(0.5, Color(np.array([0.9, 0.5, 0.2])), lobes=((0.5, 0.3, 0.0), (0.5, -0.2, 1.0)))
    materials = [Material(f"m{k}", surface) for k, surface in enumerate(surfaces)]
    materials[-1] = replace(materials[-1], medium=fog)
    instances = [
        Instance(f"ball {k}", "sphere", matrix((k % 6 - 2.5, k // 6 - 2.0, 0), 0.4), (material.name,))
        for k, material in enumerate(materials)
    ]
    down = matrix((0, 0, 3))
    lights = (
        PointLight(name="point", world_from_light=down, hidden_from=Rays.GLOSSY),
        PointLight(name="ball", world_from_light=down, radius=0.2),
        SpotLight(name="spot", world_from_light=down, blend=0.5, radius=0.1, casts_shadow=False),
        SunLight(name="sun", world_from_light=down),
        AreaLight(name="area", world_from_light=down, spread_rad=1.0),
    )
    data = np.linspace(0, 1, 5 * 4 * 3).reshape(5, 4, 3)
    mist = VolumeMaterial("mist", np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.array([0.8, 0.4, 0.2]))
    volume = VolumeObject("cloud", data, matrix((0, 0, 2), 0.3), TransferFunction((mist,)))
    sky = ImageTexture("sky", np.full((4, 8, 3), 0.5, np.float32), "linear")
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 9)), aperture_radius=0.05, focus_distance=9.0),
        film=Film(16, 12, samples=4),
        meshes=(sphere_mesh(8),),
        materials=tuple(materials),
        instances=tuple(instances),
        lights=lights,
        volumes=(volume,),
        world=World(sky, medium=ScatteringMedium(0.01, half)),
        notes=(),
    )


@pytest.mark.parametrize("variant", ["rgb", "spectral"])
def test_everything_loads_and_what_mitsuba_lacks_is_named(tmp_path: Path, variant: str) -> None:
    pixels = plain_picture(everything(), tmp_path / "scene", variant=f"llvm_ad_{variant}", samples=16)
    assert np.isfinite(pixels).all() and pixels.mean() > 0.05
    listed = json.loads((tmp_path / "scene" / "export.json").read_text("utf-8"))
    notes = {f"{note['subject']}: {note['message']}" for note in listed["notes"]}
    for subject, part in (
        ("m0", "roughness"), ("m2", "anisotropy"), ("m3", "Ashikhmin"), ("m5", "Refraction"), ("m8", "Toon"),
        ("m13", "Sheen"), ("m14", "Holdout"), ("m16", "below the surface"), ("m17", "Principled"), ("m23", "adds two"),
        ("m25", "Draine"), ("point", "hidden from"), ("ball", "soft falloff"), ("spot", "casts shadow"),
        ("spot", "radius"), ("area", "spread"), ("cloud", "voxels"),
    ):  # fmt: skip
        assert any(note.startswith(f"{subject}: ") and part in note for note in notes), (subject, part, notes)
    assert not any(note.startswith(("m1:", "m15: Emission", "m12:")) for note in notes)


def test_every_closure_has_a_translation() -> None:
    from spectral_core.render.mitsuba_export.closures import CLOSURES

    assert set(CLOSURES) == set(get_args(Closure))


def test_foreign_and_changed_files_are_never_replaced(tmp_path: Path) -> None:
    folder, scene = tmp_path / "scene", lit_plane(SunLight(name="sun", world_from_light=np.eye(4)))
    folder.mkdir()
    (folder / "diary.txt").write_text("mine")
    with pytest.raises(InvalidInputError, match=r"diary\.txt"):
        write_mitsuba(scene, folder)
    assert [path.name for path in folder.iterdir()] == ["diary.txt"]
    (folder / "diary.txt").unlink()

    first = write_mitsuba(scene, folder)
    again = write_mitsuba(replace(scene, instances=()), folder)
    assert "meshes/table.ply" in first.files and again.files == ("scene.xml", "export.json")
    assert sorted(path.name for path in folder.rglob("*") if path.is_file()) == ["export.json", "scene.xml"]

    (folder / "scene.xml").write_text("<scene/>")
    with pytest.raises(InvalidInputError, match="was changed"):
        write_mitsuba(scene, folder)
    assert (folder / "scene.xml").read_text() == "<scene/>"
    assert [path.name for path in tmp_path.iterdir()] == ["scene"]


@pytest.mark.parametrize(
    "content", ["[1, 2]", "3", "{}", '{"format": "spectral-scene, scene for Mitsuba 3"}', "[" * 9999]
)
def test_a_list_of_another_program_is_a_foreign_file(tmp_path: Path, content: str) -> None:
    """Another program's export.json that is no table ended in an AttributeError."""
    (tmp_path / "export.json").write_text(content)
    with pytest.raises(InvalidInputError, match=r"contains export\.json, which is not of an export to Mitsuba"):
        write_mitsuba(box(), tmp_path)
    assert (tmp_path / "export.json").read_text() == content


def test_a_failed_export_leaves_the_earlier_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, scene = tmp_path / "scene", lit_plane(SunLight(name="sun", world_from_light=np.eye(4)))
    write_mitsuba(scene, folder)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("spectral_core.render.mitsuba_export.bodies.write_ply", full)
    with pytest.raises(Exception, match="No space left"):
        write_mitsuba(scene, folder)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["scene"]


def test_a_note_names_what_an_artist_has_set_and_nothing_at_its_default() -> None:
    from spectral_core.render.mitsuba_export.draft import Draft
    from spectral_core.scene import AreaLight, Instance

    draft, here = Draft(), np.eye(4)
    blender_half_turn = 3.1415927410125732  # 180° in single precision, as Blender states it
    used = {"name", "world_from_light"}
    draft.leftover("Fill", AreaLight(name="Fill", world_from_light=here, spread_rad=blender_half_turn), used)
    assert draft.notes == []
    draft.leftover("Slit", AreaLight(name="Slit", world_from_light=here, spread_rad=1.0), used)
    ball = Instance("Ball", "mesh", here, ("paint",), terminator_cosine=0.1)
    draft.leftover("Ball", ball, {"name", "mesh", "world_from_object", "world_from_mesh", "materials"})
    told = [note.message for note in draft.notes]
    assert told[0].endswith(": spread") and told[1].endswith(": Shadow Terminator: Geometry Offset"), told
