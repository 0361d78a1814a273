# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixes of many shaders: their leaves are rows of tables, without a difference in the picture."""

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
    Instance,
    Material,
    MixSurface,
    PointLight,
    Translucent,
    Transparent,
    World,
)
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, matrix
from tests.render.surfaces.test_programs import noise_program

pytest.importorskip("mitsuba")


def _mixed(leaves, rng, factor=None):
    surface = leaves[0]
    for leaf in leaves[1:]:
        share = float(rng.random()) if factor is None else factor(rng)
        surface = AddSurface(surface, leaf) if rng.random() < 0.1 else MixSurface(share, surface, leaf)
    return surface


def _glossy(rng):
    return Glossy(Color(rng.random(3)), 0.1 + 0.8 * float(rng.random()))


def _picture(surface, transport="rgb", samples=8):
    lamp = PointLight(name="lamp", world_from_light=matrix((1, 0, 2)), power_w=100.0)
    scene = lit_plane(lamp, surface=surface, film=Film(8, 8, samples=samples), transport=transport)
    return render_scene(replace(scene, world=World(Color([0.3, 0.4, 0.5])))).pixels


def _chain(leaves, factors):
    surface = leaves[0]
    for leaf, factor in zip(leaves[1:], factors, strict=True):
        surface = MixSurface(factor, surface, leaf)
    return surface


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_mix_renders_as_the_weighted_sum_of_its_leaves(transport):
    """One kernel renders every mix: a factor of 0 or 1 shows one leaf, any other factor the weighted sum."""
    rng = np.random.default_rng(5)
    leaves = [
        _glossy(rng),
        Diffuse(Color(rng.random(3))),
        Transparent(Color(rng.random(3))),
        Diffuse(Computed(noise_program(2.0))),
        _glossy(rng),
        Glossy(Color([0.2, 0.3, 0.4]), 0.0),
    ]
    factors = [0.3, 0.4, 0.25, 0.5, 0.2]
    weights, rest = [], 1.0
    for factor in reversed(factors):
        weights.insert(0, rest * factor)
        rest *= 1 - factor
    weights.insert(0, rest)
    alone = []
    for chosen in range(len(leaves)):
        only = [1 - 1e-6 if k == chosen else 1e-6 for k in range(1, len(leaves))]
        alone.append(_picture(_chain(leaves, only), transport, 64)[..., :3].mean((0, 1)))
    assert np.std(alone, axis=0).min() > 0.05
    together = _picture(_chain(leaves, factors), transport, 64)[..., :3].mean((0, 1))
    np.testing.assert_allclose(together, np.array(weights) @ np.array(alone), rtol=0.03)


def test_more_leaves_of_equal_structure_need_no_new_kernel():
    import drjit

    rng = np.random.default_rng(7)
    _picture(_mixed([_glossy(rng) for _ in range(12)], rng))
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        drjit.kernel_history_clear()
        for count in (40, 120):
            assert np.isfinite(_picture(_mixed([_glossy(rng) for _ in range(count)], rng))).all()
        history = drjit.kernel_history()
    traced = [kernel for kernel in history if kernel.get("operation_count", 0) > 500]
    assert len(traced) >= 2
    assert all(kernel["cache_hit"] for kernel in traced)


CLOSURES = (Diffuse, lambda paint: Glossy(paint, 0.4), Translucent)


def _programs(count):
    """Programs of different structures: coordinates, numbers, a ramp and a vector in arithmetic."""
    made = []
    for number in range(count):
        build = Builder()
        place = build.add("vector_input", (), "position" if number % 2 else "uv", 0)
        scale = build.number((0.4, 0.3, 0.2))
        value = build.as_width(build.add("vector_math", (place, scale, scale, build.number(1.0)), "MULTIPLY"), 1)
        for digit in range(4):
            operation = ("ADD", "MULTIPLY", "SINE")[(number // 3**digit) % 3]
            value = build.add("math", (value, build.number(0.3 + 0.1 * digit), build.number(0.0)), operation)
        ramp = np.linspace((0.1, 0.2, 0.3, 1), (0.9, 0.5, 0.1 * (number % 4), 1), 16)
        color = build.add("ramp_color", (value,), data=ramp)
        made.append(Computed(build.program(color if number % 3 else value)))
    return made


def _scene_of(paints, transport, closures=(Diffuse,)):
    plain = lit_plane(PointLight(name="lamp", world_from_light=matrix((1, 0, 2)), power_w=100.0), transport=transport)
    materials = tuple(Material(f"m{k}", closures[k % len(closures)](paint)) for k, paint in enumerate(paints))
    width = 2.0 / len(paints)
    scale, mesh = np.diag([0.5 * width, 1.0, 1.0, 1.0]), plain.meshes[0].name
    placed = tuple(
        Instance(f"o{k}", mesh, matrix((width * (k + 0.5) - 1, 0, 0)) @ scale, (f"m{k}",)) for k in range(len(paints))
    )
    return replace(plain, materials=materials, instances=placed, film=Film(24, 8, samples=4))


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_interpreted_programs_equal_their_compiled_code(monkeypatch, transport):
    from spectral_core.render.plugins.surfaces import slots

    scene = _scene_of(_programs(9), transport, CLOSURES)
    pictures = []
    for most in (0, 1000):
        monkeypatch.setattr(slots, "MOST_PROGRAMS", most)
        pictures.append(render_scene(scene).pixels)
    assert pictures[0][..., :3].std() > 0.01
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=1e-4, atol=1e-5)


def test_the_kernel_holds_the_interpreter_once_for_all_types_of_closures(monkeypatch):
    """Each use of a surface runs it before the kernel branches by type, not once in each branch."""
    from spectral_core.render.plugins.paints.interpreter import Interpreter
    from spectral_core.render.plugins.surfaces import slots

    monkeypatch.setattr(slots, "MOST_PROGRAMS", 0)
    run, runs = Interpreter.run, []
    monkeypatch.setattr(Interpreter, "run", lambda *given: runs.append(1) or run(*given))

    def count(closures):
        runs.clear()
        render_scene(_scene_of(_programs(9), "rgb", closures))
        return len(runs)

    assert 0 < count(CLOSURES) <= count((Diffuse,))


def test_programs_run_once_for_a_drawn_and_an_asked_direction(monkeypatch):
    """Few programs have code of their own, which a kernel contains once for all uses of a surface at a hit."""
    from spectral_core.render.plugins.surfaces.at_hit import SurfaceAt
    from spectral_core.render.plugins.surfaces.slots import ProgramReader

    read, reads = ProgramReader.__call__, []
    monkeypatch.setattr(ProgramReader, "__call__", lambda *given: reads.append(1) or read(*given))

    def count(closures):
        reads.clear()
        pixels = render_scene(_scene_of(_programs(3), "rgb", closures)).pixels
        return len(reads), pixels

    once = [count(closures) for closures in ((Diffuse,), CLOSURES)]
    monkeypatch.setattr(SurfaceAt, "compute", lambda *_: None)
    for (few, pixels), closures in zip(once, ((Diffuse,), CLOSURES), strict=True):
        often, same = count(closures)
        assert few <= often / 2
        np.testing.assert_allclose(pixels, same, rtol=1e-5, atol=1e-6)


def test_many_registers(monkeypatch):
    """A program that keeps more results at one time than most do equals its compiled code."""
    from spectral_core.render.plugins.paints import interpreter

    scene = _scene_of(_programs(9), "rgb")
    few = render_scene(scene).pixels
    monkeypatch.setattr(interpreter, "REGISTERS", (10, 10))
    np.testing.assert_allclose(render_scene(scene).pixels, few, rtol=1e-5, atol=1e-6)


def test_more_programs_of_the_same_operations_add_no_code():
    import drjit

    from spectral_core.render.job import RenderJob
    from spectral_core.render.plan.effects import plan_from_data

    def operations(count):
        paints = [paint for paint in _programs(3 * count) if paint.program.width == 1][:count]
        scene = _scene_of(paints, "rgb")
        job = RenderJob(scene, plan_from_data(scene, 0.0))
        with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
            drjit.kernel_history_clear()
            job.trace(1)
            return max(kernel.get("operation_count", 0) for kernel in drjit.kernel_history())

    assert operations(27) <= 1.02 * operations(12)
