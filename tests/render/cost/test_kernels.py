# SPDX-License-Identifier: GPL-3.0-or-later
"""An animation does not compile a kernel per frame: numbers of the scene are data, not code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    AddSurface,
    Color,
    Computed,
    Diffuse,
    Film,
    Glossy,
    ImageTexture,
    Material,
    MixSurface,
    PointLight,
    Principled,
    SpotLight,
    World,
)
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")


def _frame(number):
    light = SpotLight(
        name="spot",
        world_from_light=matrix((0.1 * number, 0, 3)),
        power_w=100 + number,
        radius=0.1 + 0.01 * number,
        blend=0.1 + 0.01 * number,
    )
    lamp = PointLight(name="lamp", world_from_light=matrix((0, number, 3)), color=Color([1, 0.1 * number, 0.5]))
    surface = Principled(Color([0.8, 0.1 * number, 0.2]), roughness=0.3 + 0.01 * number, ior=1.4 + 0.01 * number)
    scene = lit_plane(light, lamp, surface=surface, film=Film(8, 8 + number, samples=4, seed=number))
    camera = replace(
        scene.camera, world_from_camera=matrix((0.05 * number, 0, 2 + number)), aperture_radius=0.01 * (1 + number)
    )
    return replace(scene, camera=camera)


def renders_with_the_kernels_of_the_first(scenes, transport):
    """Scenes that differ in numbers alone: Dr.Jit compiles for the first one, and for no other."""
    import drjit

    first, *others = (replace(each, settings=replace(each.settings, transport=transport)) for each in scenes)
    render_scene(first)
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        drjit.kernel_history_clear()
        for each in others:
            assert np.isfinite(render_scene(each).pixels).all()
        history = drjit.kernel_history()
    traced = [kernel for kernel in history if kernel.get("operation_count", 0) > 500]
    assert len(traced) >= len(others)
    assert all(kernel["cache_hit"] for kernel in traced)


def test_a_moving_scene_uses_one_kernel():
    """By its wavelengths, it is part of the scene of every type of paint below."""
    renders_with_the_kernels_of_the_first([_frame(number) for number in range(3)], "rgb")


def _tree(number):
    """A node tree from coordinates to a color and a roughness with variable numbers and ramp."""
    build = Builder()
    place = build.add("vector_input", (), "position", 0)
    numbers = (build.number(0.3 + 0.1 * number), build.number(0.2 * number))
    height = build.add("math", (build.as_width(place, 1), *numbers), "MULTIPLY_ADD")
    ramp = np.linspace((0, 0, 0, 1), (1, 0.5, 0.1 * number, 1), 256)
    color = build.add("ramp_color", (height,), data=ramp)
    blended = build.add(
        "blend", (build.number(0.1 + 0.1 * number), color, build.number((0.2, 0.1 * number, 0.3))), "MIX"
    )
    return Principled(Computed(build.program(blended)), roughness=Computed(build.program(height)))


def test_editing_numbers_of_a_node_tree_keeps_its_structure():
    """Also if an edited number becomes equal to another one, as with 0.4 and 0.2."""
    shapes = {(_tree(n).base_color.program.shape, _tree(n).roughness.program.shape) for n in range(1, 8)}
    assert len(shapes) == 1


def _scene_of(number):
    """Every type of paint with variable numbers: noise, an image, a ramp, mixes, instances, a world."""
    from tests.render.surfaces.test_programs import noise_program

    rng = np.random.default_rng(number)
    gray = [0.2, 0.2, 0.2] if number % 2 else [0.1 * number, 0.2, 0.3]
    build = Builder()
    pixels = (rng.random((4, 4, 3)) * 255).astype(np.uint8)
    image = build.add("image_color", (build.add("vector_input", (), "uv", 0),), False, data=ImageTexture("i", pixels))
    surface = MixSurface(
        Computed(noise_program(2.0 + number)),
        replace(_tree(number), coat_weight=0.1 * number, emission_strength=0.1 * number),
        AddSurface(
            Diffuse(Computed(build.program(image)), roughness=0.1 * number),
            Glossy(Color(gray), 0.2 + 0.1 * number, anisotropy=0.0),
        ),
    )
    world = World(Color(gray), strength=0.5 * number)
    scene = _frame(number)
    lights = (replace(scene.lights[0], color=Color(gray)), scene.lights[1])
    placed = [replace(scene.instances[0], name=str(k), materials=("m",), color=(0.1 * number, 0, 0, 1)) for k in (0, 1)]
    turned = replace(placed[1], world_from_object=matrix((0, 0, -0.1 * number), 0.5), index=number)
    return replace(
        scene, lights=lights, world=world, materials=(Material("m", surface),), instances=(placed[0], turned)
    )


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_editing_any_number_of_trees_lamps_world_and_objects_compiles_nothing(transport):
    renders_with_the_kernels_of_the_first([_scene_of(number) for number in range(1, 4)], transport)


def test_a_rendered_scene_is_released():
    """Its BSDFs leave the renderer's registry; otherwise every later scene would trace them and keep their memory."""
    import drjit
    import mitsuba as mi

    def next_number():
        made = mi.load_dict({"type": "diffuse"})
        return int(drjit.reinterpret_array(mi.UInt32, mi.BSDFPtr(made))[0])

    render_scene(_scene_of(1))
    before = next_number()
    for number in (2, 3):
        render_scene(_scene_of(number))
    assert next_number() == before


def test_the_closure_of_a_material_is_a_number():
    """The kernel is unchanged if a roughness becomes that of a mirror and changes back."""
    import drjit

    def frame(roughnesses):
        scene = lit_plane(PointLight(name="lamp", world_from_light=matrix((0, 0, 3))), film=Film(8, 8, samples=1))
        mesh = scene.meshes[0].name
        materials = tuple(Material(f"m{k}", Glossy(roughness=value)) for k, value in enumerate(roughnesses))
        placed = tuple(
            replace(scene.instances[0], name=f"o{k}", mesh=mesh, materials=(f"m{k}",)) for k in range(len(materials))
        )
        return render_scene(replace(scene, materials=materials, instances=placed)).pixels

    frame([0.2, 0.01, 0.3])
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        drjit.kernel_history_clear()
        for roughnesses in ([0.01, 0.2, 0.3], [0.01, 0.02, 0.3], [0.4, 0.02, 0.01]):
            assert np.isfinite(frame(roughnesses)).all()
        history = drjit.kernel_history()
    traced = [kernel for kernel in history if kernel.get("operation_count", 0) > 500]
    assert len(traced) >= 3
    assert all(kernel["cache_hit"] for kernel in traced)


def test_launches_for_chosen_pixels_use_one_kernel():
    """However many pixels they have, and wherever their numbers are in memory."""
    import drjit

    from spectral_core.render.job import RenderJob
    from spectral_core.render.plan.effects import plan_from_data

    scene = _frame(1)
    pixels = RenderJob(scene, plan_from_data(scene)).chosen_pixels()
    kernels = set()
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        for count in (64, 63, 40, 17, 16, 8, 33, 50, 5, 64):
            drjit.kernel_history_clear()
            chosen, none = np.arange(count), np.zeros(count, np.int64)
            pixels.trace_halves(chosen, none, none + count)
            kernels |= {each["hash"] for each in drjit.kernel_history() if each.get("operation_count", 0) > 500}
    assert len(kernels) == 1


def test_the_programs_of_a_hit_run_once_for_its_light_and_its_next_direction(monkeypatch):
    """If every material has one closure; the picture is that of programs with code of their own."""
    from spectral_core.render.plugins.paints.interpreter import Interpreter
    from spectral_core.render.plugins.surfaces import slots
    from spectral_core.render.plugins.surfaces.at_hit import SurfaceAt

    def program(number):
        build = Builder()
        value = build.add("vector_input", (), "position", 0)
        for step in range(3):
            kind = ("bright_contrast", (value, build.number(0.1), build.number(0.2)))
            if (number >> step) % 2:
                kind = ("gamma", (value, build.number(1.5)))
            value = build.add(*kind)
        return Computed(build.program(value))

    scene = _frame(1)
    places = [matrix((0.2 * k - 0.8, 0, 0.01 * k), 0.01) for k in range(8)]
    tiles = [
        replace(scene.instances[0], name=str(k), world_from_object=places[k], materials=(str(k),)) for k in range(8)
    ]
    paints = [Material(str(k), Principled(program(k))) for k in range(8)]
    scene = replace(
        scene, materials=(Material("paper", Diffuse(Color([0.5, 0.5, 0.5]))), *paints),
        instances=(*scene.instances, *tiles), film=Film(16, 16, samples=1),
    )  # fmt: skip
    runs, run = [], Interpreter.run
    monkeypatch.setattr(Interpreter, "run", lambda *given: runs.append(1) or run(*given))
    picture = render_scene(scene).pixels
    once = len(runs)
    assert np.ptp(picture) > 0.05
    monkeypatch.setattr(SurfaceAt, "compute", lambda *_: None)
    np.testing.assert_allclose(render_scene(scene).pixels, picture, rtol=1e-4, atol=1e-5)
    assert len(runs) == 3 * once > 0
    monkeypatch.setattr(slots, "MOST_PROGRAMS", 100)
    np.testing.assert_allclose(render_scene(scene).pixels, picture, rtol=1e-4, atol=1e-5)
    assert len(runs) == 3 * once
