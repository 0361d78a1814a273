# SPDX-License-Identifier: GPL-3.0-or-later
"""Images, ramps and curves of programs in recorded launches: exchanged in place, and held where replays find them."""

from __future__ import annotations

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.stage import Stage
from spectral_core.render.plugins.numbers import CACHE_LINE
from spectral_core.scene import (
    Computed,
    Diffuse,
    Emission,
    ImageTexture,
    Instance,
    Material,
    Principled,
    Scene,
    Surface,
)
from spectral_core.scene.shading import Builder
from tests.live import test_live_session as session
from tests.live.changes.test_live_programs import _generated, _pictured
from tests.live.test_live_session import at

scene = session.scene


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
