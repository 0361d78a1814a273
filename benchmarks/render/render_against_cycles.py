# SPDX-License-Identifier: GPL-3.0-or-later
"""Time to the same error as Cycles, RGB, on the same machine in one run, for several types of scenes.

Each engine renders each scene three times at one number of samples, after a render that warms it, and its error is the
mean of their relative mean square errors against its own converged picture: (x - r)² / (r² + (mean r / 10)²), the worst
0.1 % of pixels left out. Error falls as one over time, so the ratio of times at equal error is (ours · our error) /
(Cycles' · its error). Neither engine denoises, clamps or ends paths before 12 bounces. ``--denoised``: both denoise
their pictures (not the converged ones), each with its own denoiser. Times are of the whole render
command, in seconds of the processor's cores together (work), which other programs on the machine do not change; those
on the wall are printed beside. ``--only WORDS``: scenes of these names, or whose name has the word, separated by
commas; ``--more``: eight others (hair, textures, a lens, a tiny sun); ``--other``: five of a third kind (leaves with
alpha, fire behind glass); ``--strange``: nine of a fourth (fur, a terrain, a forest of instances). ``--medium``:
smaller pictures with the full number of samples, where fixed costs are as small a part as at full size.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options

MEDIUM, DENOISED = "--medium", "--denoised"
OPTIONS = ("--only NAMES…", "--more", "--other", "--strange", MEDIUM, DENOISED)
BOUNCES = 12
SIZES = {"full": ((240, 135), 64, 2048), "medium": ((160, 90), 64, 192), "quick": ((96, 54), 16, 256)}
"""Pixels, samples per pixel, and samples of the converged picture."""
SEEDS = (2, 3, 4)
"""Seeds of the pictures whose error is measured: of one picture, it depends on a few bright paths."""


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    import blender_addon
    from benchmarks.render.cases.cycles_more import MORE
    from benchmarks.render.cases.cycles_other import OTHER
    from benchmarks.render.cases.cycles_scenes import SCENES
    from benchmarks.render.cases.cycles_strange import STRANGE

    scenes = {**SCENES, **MORE, **OTHER, **STRANGE}

    blender_addon.register_once()
    size, samples, many = SIZES["quick" if options.quick else "medium" if MEDIUM in options.extra else "full"]
    denoised = DENOISED in options.extra
    options = replace(options, extra=[word for word in options.extra if word not in (MEDIUM, DENOISED)])
    figures: dict[str, Any] = {}
    print(
        f"{'scene':18} {'our work':>8} {'its work':>8} {'our s':>7} {'its s':>7} {'our error':>10} {'its error':>10} "
        f"{'ratio':>6} {'wall':>6}"
    )
    sets = {"": SCENES, "--more": MORE, "--other": OTHER, "--strange": STRANGE}
    one = sets.get(" ".join(options.extra))
    names = options.only(scenes) if one is None else list(one)
    for name in names:
        _prepare(size)
        scenes[name]()
        ours, cycles = (figures_of(engine, samples, many, denoised) for engine in ("SPECTRAL", "CYCLES"))
        errors = ours[1] / cycles[1]
        ratio, on_wall = (of / than * errors for of, than in zip(ours[0], cycles[0], strict=True))
        figures[name] = {
            "ours_work": ours[0][0],
            "cycles_work": cycles[0][0],
            "ours_s": ours[0][1],
            "cycles_s": cycles[0][1],
            "ratio_on_wall": on_wall,
            "our_error": ours[1],
            "cycles_error": cycles[1],
            "mean_difference": ours[2] / cycles[2] - 1,
            "ratio": ratio,
        }
        print(
            f"{name:18} {ours[0][0]:8.2f} {cycles[0][0]:8.2f} {ours[0][1]:7.2f} {cycles[0][1]:7.2f} {ours[1]:10.5f} "
            f"{cycles[1]:10.5f} {ratio:6.2f} {on_wall:6.2f}",
            flush=True,
        )
    ratios = [row["ratio"] for row in figures.values()]
    print(f"median ratio {np.median(ratios):.2f}, largest {max(ratios):.2f}")
    found = {"scenes": figures, "median": float(np.median(ratios)), "largest": float(max(ratios))}
    return found | {"holds": holds(found)}


def holds(figures: dict[str, Any]) -> dict[str, bool]:
    """Claims of the documentation."""
    return {
        "at most half of Cycles' time in the median": figures["median"] <= 0.5,
        "never more than Cycles' time": figures["largest"] <= 1.0,
    }


def _prepare(size: tuple[int, int]) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = BOUNCES
    cycles.volume_bounces = BOUNCES


def figures_of(engine: str, samples: int, many: int, denoised: bool) -> tuple[tuple[float, float], float, float]:
    """Work and seconds (medians), mean error, and mean of the converged picture."""
    _render(engine, 1, 9, denoised=denoised)  # loads and compiles
    reference, _ = _render(engine, many, 1)
    errors, spent = [], []
    for seed in SEEDS:
        picture, seconds = _render(engine, samples, seed, denoised=denoised)
        square = (picture - reference) ** 2 / (reference**2 + (0.1 * reference.mean()) ** 2)
        error = np.sort(square.mean(axis=2).ravel())
        errors.append(float(error[: max(1, int(error.size * 0.999))].mean()))
        spent.append(seconds)
    work, wall = np.median(spent, axis=0)
    return (float(work), float(wall)), float(np.mean(errors)), float(reference.mean())


def _render(
    engine: str, samples: int, seed: int, *, denoised: bool = False
) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """A picture (height, width, 3), and the work and the seconds of the render command."""
    import bpy

    from blender_addon import compat, jobs
    from spectral_core.render.cost.work import Meter

    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cycles.samples = scene.spectral.render.samples = samples
    scene.cycles.seed = scene.spectral.render.seed = seed
    scene.cycles.use_denoising = scene.spectral.render.denoise = denoised
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "frame.exr")
        compat.set_image_format(scene.render.image_settings, "OPEN_EXR", color_depth="32", color_mode="RGBA")
        meter = Meter()
        bpy.ops.render.render(write_still=True)
        spent = meter.read()
        # a separate process does it for ours
        other = jobs.records[-1].result.work if engine == "SPECTRAL" and jobs.records[-1].result else 0.0
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        pixels = np.array(image.pixels[:]).reshape(*reversed(image.size[:]), 4)
        bpy.data.images.remove(image)
    return pixels[..., :3].astype(np.float64), (spent.work + other, spent.wall)
