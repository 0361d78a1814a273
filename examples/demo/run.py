# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo from end to end: build the set, design two glazes, render it under each light, measure, report."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from spectral_core.errors import MissingDependencyError, RenderError
from spectral_core.files.whole import require_writable
from spectral_core.palette import PaletteReflectance, PaletteSolution, solve_palette
from spectral_core.palette.files import write_palette
from spectral_core.palette.files.swatches import swatches_of, write_swatches
from spectral_core.palette.presets import hidden_mark
from spectral_core.render import Bands, RenderProcess, RenderResult
from spectral_core.render.images.spectral_exr import write_spectral_exr
from spectral_core.scene import Scene
from spectral_core.spectra import catalogue
from spectral_core.spectra.files import write_spectra

from . import materials, still_life
from .measure import MarkContrast, coverage_scene, mark_contrast

GLAZE_COLOR = (0.42, 0.43, 0.38)
"""Color of both glazes in daylight, linear RGB: a warm off-white."""
CONTRAST = 2.6
"""Ratio of brightness of the ground to the mark under sodium."""
SIZE = (900, 788)


@dataclass(frozen=True)
class DemoLight:
    """A light of the demo. ``name``: of the catalogue; ``exposure``: how bright it is set, as for a photograph."""

    name: str
    title: str
    exposure: float


LIGHTS = (DemoLight("D65", "daylight", 1.0), DemoLight("HP1", "high-pressure sodium lamp", 0.6))


@dataclass(frozen=True, eq=False)
class Rendered:
    """One light's picture, and the visibility of the mark in it."""

    light: DemoLight
    picture: Path
    spectral: Path
    result: RenderResult
    contrast: MarkContrast


@dataclass(frozen=True, eq=False)
class DemoResult:
    """Results of the demo. ``seconds`` by stage."""

    out: Path
    solution: PaletteSolution
    rendered: tuple[Rendered, ...]
    seconds: dict[str, float]


def run_demo(out: Path, *, samples: int, percentage: int, say: Callable[[str], None]) -> DemoResult:
    """Make everything into ``out``. Raises MissingDependencyError without bpy, RenderError if a render failed."""
    bpy = _blender()
    require_writable(out / "report.json")
    seconds: dict[str, float] = {}

    def staged(name: str, work: Callable[[], Any]) -> Any:
        start = time.perf_counter()
        done = work()
        seconds[name] = round(time.perf_counter() - start, 2)
        return done

    say("building the set")
    staged("build", lambda: still_life.build(bpy))
    say("designing the two glazes")
    solution = staged("design", lambda: _design(bpy, out))
    _prepare(bpy, samples, percentage)
    rendered = []
    coverage = None
    for light in LIGHTS:
        _switch_on(bpy, light)
        if light is LIGHTS[0]:
            bpy.ops.wm.save_as_mainfile(filepath=str((out / "hidden_branch.blend").resolve()))
        say(f"rendering under {light.name}, {light.title}")
        picture = out / f"under_{light.name}.png"
        result, scene = staged(f"render {light.name}", partial(_render, bpy, picture))
        if coverage is None:
            coverage = staged("mask", lambda: _coverage(scene))  # noqa: B023 - called at once
        spectral = write_spectral_exr(out / f"under_{light.name}.spectral.exr", result)
        contrast = mark_contrast(result.pixels, coverage)
        rendered.append(Rendered(light, picture, spectral, result, contrast))
    return DemoResult(out, solution, tuple(rendered), seconds)


def _blender() -> Any:
    """An empty Blender with the extension enabled."""
    try:
        import bpy
    except ImportError as error:
        raise MissingDependencyError.package("bpy", "the demo", "blender") from error
    from blender_addon import registration

    bpy.ops.wm.read_factory_settings(use_empty=True)
    registration.register_once()
    return bpy


def _design(bpy: Any, out: Path) -> PaletteSolution:
    """Solve for the glazes, assign them to the vase, and write palette, spectra and swatches."""
    from blender_addon.translate.spectra.stored import store_spectrum

    problem = hidden_mark(conceal=LIGHTS[0].name, reveal=LIGHTS[1].name, color=GLAZE_COLOR, contrast=CONTRAST)
    # The preset's brighter paint is its mark; on this vase the branch is the dark one, so the names are exchanged.
    problem = replace(problem, reflectances=(PaletteReflectance("ground"), PaletteReflectance("mark")))
    solution = solve_palette(problem)
    ground, mark = solution.reflectances
    nodes = bpy.data.materials[materials.VASE].node_tree.nodes
    store_spectrum(nodes[materials.GROUND].spectral, ground)
    store_spectrum(nodes[materials.MARK].spectral, mark)
    write_palette(
        out / "palette.toml", problem, comment="The demo's palette: equal in daylight, different under sodium light"
    )
    write_spectra(out / "glazes.csv", solution.reflectances)
    for suffix in ("ase", "gpl"):
        write_swatches(out / f"swatches.{suffix}", swatches_of(solution), clip=True)
    return solution


def _prepare(bpy: Any, samples: int, percentage: int) -> None:
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = percentage
    scene.spectral.render.samples = samples
    # The window is behind the camera: its shadow on the dim room behind it is invisible, and a transparent window would
    # cost several times the whole render.
    choice = scene.spectral.render.overrides.add()
    choice.name, choice.value = "transparency", "off"
    scene.view_settings.view_transform = "Standard"  # AgX would change the compared colors


def _switch_on(bpy: Any, light: DemoLight) -> None:
    """Window and environment get the light's spectrum, with the luminance of white of the same power."""
    from blender_addon.translate.spectra.stored import store_spectrum

    measured = catalogue.illuminant(light.name)
    window, world = bpy.data.lights["Key"], bpy.data.worlds["World"]
    window.energy = still_life.KEY_POWER_W * light.exposure
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = still_life.WORLD_STRENGTH * light.exposure
    for owner in (window, world):
        store_spectrum(owner.spectral, measured, "CATALOGUE")
        owner.spectral.catalogue_name = light.name


def _render(bpy: Any, picture: Path) -> tuple[RenderResult, Scene]:
    """F12 from a script; the translated scene and the linear pixels are kept beside the PNG."""
    from blender_addon import jobs

    seen: list[Scene] = []

    def keep(scene: Scene) -> Scene:
        seen.append(scene)
        return scene

    bpy.context.scene.render.filepath = str(picture.resolve())
    with jobs.request(jobs.RenderRequest(options={"bands": Bands.uniform(400, 700, 31)}, translated=keep)):
        try:
            bpy.ops.render.render(write_still=True)
        except RuntimeError as error:
            raise RenderError(f"the demo's render failed: {str(error).strip()}") from error
    last = jobs.records[-1] if jobs.records else None
    if last is None or last.result is None or last.status != "done":
        raise RenderError(f"the demo's render failed: {last.message if last else 'it did not start'}")
    return last.result, seen[-1]


def _coverage(scene: Scene) -> Any:
    with RenderProcess() as renderer:
        return renderer.render(coverage_scene(scene, materials.VASE)).pixels
