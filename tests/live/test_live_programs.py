# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of shading programs in recorded launches: a replay reads what a fresh launch reads, whatever else is loaded."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.passes import Launcher
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.render.plugins.numbers import CACHE_LINE, table
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
    Surface,
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


def _contents(rng: np.random.Generator) -> list[Surface | ImageTexture]:
    """Random contents of images and ramps: surfaces that read them as color, roughness or emission, and a world."""

    def computed(operation: str, data: object, *flags: bool) -> Computed:
        build = Builder()
        place = build.add("vector_input", (), "position", 0)
        read = place if operation == "image_color" else build.add("mean", (place,))
        return Computed(build.program(build.add(operation, (read,), *flags, data=data)))

    pixels = rng.uniform(0, 1, (8, 16, 3)).astype(np.float32)
    image = computed("image_color", ImageTexture("made", pixels[:4]), False)
    bytes_of = computed("image_color", ImageTexture("bytes", (255 * pixels[4:]).astype(np.uint8)), False)
    ramp = computed("ramp_color", rng.uniform(0, 1, (5, 3)))
    return [
        Diffuse(ramp),
        Diffuse(image),
        Diffuse(bytes_of),
        Principled(image, roughness=ramp),
        Emission(ramp, 2.0),
        ImageTexture("sky", pixels),
    ]


def _with_contents(scene: Scene, contents: list[Surface | ImageTexture]) -> Scene:
    """The scene with one more ball for each surface, and with the world."""
    *surfaces, sky = contents
    assert isinstance(sky, ImageTexture)
    materials = tuple(Material(f"with {k}", surface) for k, surface in enumerate(surfaces))  # type: ignore[arg-type]
    balls = tuple(Instance(m.name, "one", at(1.5 * k - 3, -2, 0.7), (m.name,)) for k, m in enumerate(materials))
    return replace(
        scene,
        materials=(*scene.materials, *materials),
        instances=(*scene.instances, *balls),
        world=replace(scene.world, color=sky),
    )


def test_contents_that_are_replaced_in_place_are_visible_whatever_else_was_loaded(scene: Scene) -> None:
    """After other scenes had been loaded, replays showed images and ramps from before the edit, or freed memory.

    Some read the same image or ramp until one of them gets its own: all of them then showed that, or the process ended.
    """
    rng, stage = np.random.default_rng(0), Stage()
    contents = _contents(rng)
    before = _pictured(stage, _with_contents(scene, contents), 1)
    for kind in (*range(6), slice(6), 0):
        contents[kind] = _contents(rng)[kind]  # then of all, which share them again, and of one
        edited = _with_contents(scene, contents)
        shown = _pictured(stage, edited, 1)
        np.testing.assert_array_equal(shown, _pictured(Stage(), edited, 1), err_msg=str(kind))
        assert np.abs(shown - before).max() > 0.01, kind
        before = shown
    assert stage.loads == 1
    kept = stage._job.loaded.scene.parts.context.tables._images  # type: ignore[union-attr]
    assert len(kept) <= 6, "earlier contents stay in memory"


def test_no_array_of_a_view_lies_in_the_memory_of_numpy(scene: Scene) -> None:
    """A replay may read a mapped array that has been replaced. Dr.Jit's own memory begins at cache lines."""
    import drjit as dr

    from spectral_core.render.live.held import held

    stage = Stage()
    contents = _contents(np.random.default_rng(6))
    for shown in (_with_contents(_generated(scene), contents), _with_contents(scene, contents)):
        _pictured(stage, shown, 1)
        inputs, launcher = stage.launcher._inputs, stage.launcher
        roots = [inputs[0], [launcher._offsets], *(getattr(plugin, "held_numbers", []) for plugin in inputs[1])]
        arrays = [item for item in held([roots], launcher._mi) if dr.is_array_v(item) and dr.depth_v(item) == 1]
        arrays = [array for array in arrays if dr.is_jit_v(array) and array.state == dr.VarState.Evaluated]
        assert len(arrays) > 20
        assert [len(array) for array in arrays if dr.detach(array).numpy().ctypes.data % CACHE_LINE] == []


def test_the_search_for_arrays_finds_all_of_them(scene: Scene) -> None:
    """It passes over data that hold none: a search of every plain object finds the same arrays."""
    import drjit as dr

    from spectral_core.render.live.held import held

    def reached(item: object, seen: dict[int, object]) -> None:
        # through a module every object of the process would be reached, those of tests before this one, too
        if id(item) in seen or isinstance(item, (np.ndarray, str, bytes, mitsuba.Object, type, ModuleType)):
            return
        seen[id(item)] = item
        if dr.is_array_v(item) or type(item).__module__.startswith(("drjit", "mitsuba")):
            return
        slots = {name for kind in type(item).__mro__ for name in getattr(kind, "__slots__", ())} - {"__weakref__"}
        held_here = [getattr(item, name) for name in slots if hasattr(item, name)]
        for value in [*getattr(item, "__dict__", {}).values(), *held_here]:
            reached(value, seen)
        if isinstance(item, (dict, list, tuple)):
            for value in item.values() if isinstance(item, dict) else item:
                reached(value, seen)

    stage, count = Stage(), 0
    contents = _contents(np.random.default_rng(9))
    for shown in (_with_contents(_generated(scene), contents), _with_contents(scene, contents)):
        _pictured(stage, shown, 1)
        mitsuba = stage.launcher._mi
        for plugin in stage.launcher._loaded.scene.parts.context.made:
            roots = [value for name, value in getattr(plugin, "__dict__", {}).items() if name != "held_numbers"]
            seen: dict[int, object] = {}
            for root in roots:
                reached(root, seen)
            arrays = {key for key, item in seen.items() if dr.is_array_v(item)} - {id(root) for root in roots}
            assert {id(item) for item in held(roots, mitsuba) if dr.is_array_v(item)} == arrays
            count += len(arrays)
    assert count > 100


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

    from spectral_core.render.trace import path_limits

    shown = replace(scene, settings=replace(scene.settings, transport="spectral"))
    before = _pictured(Stage(), shown, 1)
    seen = []

    def plain(_clamps: object, value: object, _indirect: object) -> object:
        seen.append(dr.llvm.ad.Array4f(*(value[k] for k in range(4))))  # type: ignore[index]
        return seen[-1]

    monkeypatch.setattr(path_limits, "clamped", plain)
    np.testing.assert_allclose(_pictured(Stage(), shown, 1), before, atol=1e-6)
    assert len(seen) > 1 and mi.Spectrum is not dr.llvm.ad.Array4f
