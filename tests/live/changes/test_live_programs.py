# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of shading programs in recorded launches: a replay reads what a fresh launch reads, whatever else is loaded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.passes import Launcher
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.render.plugins.numbers import table
from spectral_core.render.plugins.paints import tables
from spectral_core.scene import (
    Computed,
    Diffuse,
    Emission,
    ImageTexture,
    Instance,
    LightPaths,
    Material,
    Principled,
    Rays,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    gray,
)
from spectral_core.scene.geometry import Attribute
from spectral_core.scene.shading import Builder
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid
from tests.live import test_live_session as session
from tests.live.test_live_session import HEIGHT, WIDTH, at

scene = session.scene


def _generated(scene: Scene) -> Scene:
    """The red balls show their generated coordinates, which are read in the space of the object."""
    build = Builder()
    color = Computed(build.program(build.add("vector_input", (), "generated", 0)))
    materials = [replace(m, surface=Diffuse(color)) if m.name == "red" else m for m in scene.materials]
    meshes = [replace(m, attributes=(Attribute("generated", (m.positions + 1) / 2),)) for m in scene.meshes]
    return replace(scene, materials=tuple(materials), meshes=tuple(meshes))


def _pictured(stage: Stage, scene: Scene, samples: int = 3) -> np.ndarray:
    stage.show(scene)
    stage.activate()
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    picture = ViewPicture(stage.launcher, ViewRequest("stage", viewpoint, WIDTH, HEIGHT, samples, 0), 4)
    stage.look_from(viewpoint)
    while not picture.is_done:
        picture.step()
    return picture.pixels()


def _looked_up() -> tuple[Material, Material]:
    """Materials that read an image and a ramp."""
    rng = np.random.default_rng(2)
    pixels, table = rng.uniform(0, 1, (4, 4, 3)).astype(np.float32), rng.uniform(0, 1, (5, 3))
    image, ramp = Builder(), Builder()
    colors = image.add(
        "image_color", (image.add("vector_input", (), "position", 0),), False, data=ImageTexture("made", pixels)
    )
    steps = ramp.add("ramp_color", (ramp.add("mean", (ramp.add("vector_input", (), "position", 0),)),), data=table)
    return (
        Material("picture", Diffuse(Computed(image.program(colors)))),
        Material("ramp", Diffuse(Computed(ramp.program(steps)))),
    )


def test_a_replayed_launch_makes_no_numbers_of_its_own(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A number that a program made within a recorded launch was read after it was freed: another object's data."""
    import drjit as dr

    made: list[float] = []
    launch, opaque = Launcher._launch, dr.opaque

    def launched(*arguments: object) -> object:
        monkeypatch.setattr(dr, "opaque", lambda kind, value=0, *rest: made.append(value) or opaque(kind, value, *rest))
        try:
            return launch(*arguments)
        finally:
            monkeypatch.setattr(dr, "opaque", opaque)

    monkeypatch.setattr(Launcher, "_launch", launched)
    plain = _generated(scene)
    fog = ScatteringMedium(0.2, gray(0.8))
    special = replace(
        plain,
        materials=(
            *plain.materials,
            Material("glow", Emission(gray(0.5), 2.0)),
            Material("fog", Diffuse(gray(0.5)), medium=fog),
            *_looked_up(),
        ),
        instances=(
            *(
                replace(x, unlit_by=("fill",), clear_for=("key",), terminator_cosine=0.1, terminator_shift=0.3)
                for x in plain.instances
            ),
            Instance("framed", "one", at(-3, 2, 2), ("picture",)),
            Instance("striped", "two", at(-3, 3, 2), ("ramp",)),
            Instance("lamp", "two", at(0, 2, 2), ("glow",), hidden_from=Rays.CAMERA),
            Instance("cloud", "two", at(3, 2, 2), ("fog",)),
        ),
        lights=(
            *(replace(x, max_bounces=2, hidden_from=Rays.GLOSSY) for x in plain.lights),
            SunLight(name="sun", world_from_light=np.eye(4), irradiance=1.0, angle_rad=0.0),
        ),
        film=replace(plain.film, transparent=True),
        settings=replace(plain.settings, light_paths=LightPaths(clamp_direct=5.0, clamp_indirect=3.0)),
    )
    for each in (plain, special):
        _pictured(Stage(), each, 1)
    assert made == []


def test_a_launch_makes_no_arrays_of_another_scene(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Made within a recording they ended the process: a split view of a pattern that shines, when both sides loaded."""
    made: list[object] = []

    def noted(kind: object, values: object) -> object:
        made.append(values)
        return table(kind, values)

    build = Builder()
    place = build.add("transformed", (build.add("vector_input", (), "position", 0),), "POINT", "OBJECT", False)
    shining = Emission(Computed(build.program(place)), 2.0)
    materials = tuple(replace(m, surface=shining) if m.name == "red" else m for m in scene.materials)
    first, second = Stage(), Stage()
    first.show(replace(scene, materials=materials))
    second.show(replace(scene, materials=materials, lights=scene.lights[:1]))
    first.launcher.is_recorded = False  # so that the fault is an array, not the end of this process
    monkeypatch.setattr(tables, "device_table", noted)
    first.activate()
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, 1, 0)
    ViewPicture(first.launcher, request, 4).step()
    assert made == []


def test_an_edit_in_place_of_an_attribute_is_visible(scene: Scene) -> None:
    seen, stage = _generated(scene), Stage()
    before = _pictured(stage, seen)
    turned = [
        replace(m, attributes=(Attribute("generated", m.attributes[0].values[:, ::-1].copy()),)) for m in seen.meshes
    ]
    edited = replace(seen, meshes=tuple(turned))
    after = _pictured(stage, edited)
    assert stage.how == "meshes"
    assert np.abs(after - before).max() > 0.05
    np.testing.assert_allclose(after, _pictured(Stage(), edited), atol=1e-4)


def test_edits_of_a_material_with_a_spectrum_are_visible(scene: Scene) -> None:
    """Of its other numbers, and of the spectrum itself, more than once."""
    low, high = (
        Reflectance("paint", SpectralGrid(np.array([400.0, 550, 700])), np.array(values))
        for values in ([0.1, 0.2, 0.9], [0.8, 0.7, 0.1])
    )
    stage = Stage()
    for color, roughness in ((low, 0.5), (low, 0.9), (high, 0.9), (low, 0.2)):
        surface = Principled(color, roughness=roughness)
        materials = [replace(m, surface=surface) if m.name in ("red", "gray") else m for m in scene.materials]
        seen = replace(scene, materials=tuple(materials), settings=RenderSettings(transport="spectral"))
        # wavelengths are drawn by the spectra that a scene was loaded with, so that the noise differs
        shown, true = (_pictured(each, seen, 32).mean(axis=(0, 1)) for each in (stage, Stage()))
        np.testing.assert_allclose(shown, true, rtol=0.02)
    assert stage.loads == 1


def test_a_table_can_be_made_while_a_loop_is_recorded() -> None:
    """A view of a scene whose contents were exchanged makes some at their first use, within the loop over a path."""
    import drjit as dr
    import mitsuba as mi

    def step(count: mi.UInt32, total: mi.Float) -> tuple[mi.UInt32, mi.Float]:
        return count + 1, total + dr.gather(mi.Float, table(mi.Float, np.arange(8.0)), count)

    count, total = dr.while_loop((dr.opaque(mi.UInt32, 0), mi.Float(0.0)), lambda count, _: count < 8, step)
    assert (count[0], total[0]) == (8, 28.0)


def test_light_along_a_path_may_come_as_a_plain_array(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dr.Jit gives some products of spectra the type of four plain numbers; a view was then not traced."""
    import drjit as dr
    import mitsuba as mi

    from spectral_core.render.trace.path.integrator import scene_path_class

    shown = replace(scene, settings=replace(scene.settings, transport="spectral"))
    before = _pictured(Stage(), shown, 1)  # activates the variant
    seen = []

    def plain(_integrator: object, value: object, _indirect: object) -> object:
        seen.append(dr.llvm.ad.Array4f(*(value[k] for k in range(4))))  # type: ignore[index]
        return seen[-1]

    monkeypatch.setattr(scene_path_class(mi.variant()), "clamped", plain)
    np.testing.assert_allclose(_pictured(Stage(), shown, 1), before, atol=1e-6)
    assert len(seen) > 1 and mi.Spectrum is not dr.llvm.ad.Array4f
