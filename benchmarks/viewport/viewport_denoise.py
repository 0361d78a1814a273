# SPDX-License-Identifier: GPL-3.0-or-later
"""A live view with and without denoising: error of what it shows against time, for a room with and without patterns.

480×360 (160×120 with ``--quick``), one soft lamp, RGB transport; the error is the relative mean square error against a
view of 2,048 samples (256) with another seed: (x - r)² / (r² + (mean r / 10)²). Both views trace the same samples; the
denoised one stands still while the filter runs. "patterned": an image of 128 × 128 random cells on floor and block,
which the filter may blur. Needs the package ``pyoidn``.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.render.render_noise import room_scene
from spectral_core.errors import MissingDependencyError
from spectral_core.render.denoise import how_to_install, is_installed
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.messages import Shown
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Color, Diffuse, Film, ImageTexture, Material, Scene

MOMENTS_S = (1.0, 2.0, 4.0, 8.0, 16.0)
PATIENCE_S = 600.0


def run(options: Options) -> dict[str, Any]:
    """Print the table and return it."""
    if not is_installed():
        raise MissingDependencyError(f"nothing is measured: {how_to_install()}")
    size, samples, converged = ((160, 120), 16, 256) if options.quick else ((480, 360), 128, 2048)
    figures: dict[str, Any] = {"holds": {}}
    print(f"{'room':10} {'seconds':>8} {'noisy':>18} {'denoised':>18} {'noisy over denoised':>20}")
    for name, scene in rooms(size).items():
        truth = _shown(scene, converged, is_denoised=False, seed=9)[-1][1].pixels
        seen = {kind: _shown(scene, samples, is_denoised=kind == "denoised") for kind in ("noisy", "denoised")}
        rows = []
        for moment in MOMENTS_S:
            found = {kind: _at(shown, moment) for kind, shown in seen.items()}
            if not all(found.values()):
                continue
            errors = {kind: error(each.pixels, truth) for kind, each in found.items()}
            counts = {kind: each.frame.samples for kind, each in found.items()}
            ratio = errors["noisy"] / errors["denoised"]
            rows.append({"seconds": moment, "errors": errors, "samples": counts, "ratio": ratio})
            told = {kind: f"{errors[kind]:.5f} ({counts[kind]})" for kind in errors}
            print(f"{name:10} {moment:8.0f} {told['noisy']:>18} {told['denoised']:>18} {ratio:20.2f}")
        last = {kind: error(shown[-1][1].pixels, truth) for kind, shown in seen.items()}
        ends = {kind: shown[-1][0] for kind, shown in seen.items()}
        print(f"{name:10} complete, {samples} samples: noisy {last['noisy']:.6f} after {ends['noisy']:.1f} s, "
              f"denoised {last['denoised']:.6f} after {ends['denoised']:.1f} s")  # fmt: skip
        figures[name] = {"rows": rows, "last": last, "ends_s": ends}
        first = next(each for _, each in seen["denoised"] if each.frame.is_denoised)
        noisy = next(each for _, each in seen["noisy"] if each.frame.samples >= first.frame.samples)
        before, after = error(noisy.pixels, truth), error(first.pixels, truth)
        print(f"{name:10} first denoised picture, {first.frame.samples} samples: {after:.5f}, noisy {before:.5f}")
        figures[name]["first"] = {"noisy": before, "denoised": after}
        figures["holds"][f"{name}: the first denoised picture has less error than the noisy one"] = after < before
    return figures


def rooms(size: tuple[int, int]) -> dict[str, Scene]:
    """The room, and the same with a pattern."""
    plain = room_scene(size[0], Color([1.0, 0.9, 0.8]))
    plain = replace(plain, film=Film(*size))
    cells = np.random.default_rng(5).integers(40, 230, (128, 128, 3), np.uint8)
    pattern = ImageTexture("cells", cells, interpolation="nearest")
    square = replace(plain.meshes[0], uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32))
    materials = (Material("gray", Diffuse(pattern)), *plain.materials[1:])
    return {"plain": plain, "patterned": replace(plain, meshes=(square,), materials=materials)}


def error(pixels: np.ndarray, truth: np.ndarray) -> float:
    """Relative mean square error."""
    shown, true = pixels[..., :3].astype(np.float64), truth[..., :3].astype(np.float64)
    return float((np.square(shown - true) / (np.square(true) + (true.mean() / 10) ** 2)).mean())


def _shown(scene: Scene, samples: int, *, is_denoised: bool, seed: int = 1) -> list[tuple[float, Shown]]:
    """Full pictures of a view, each with the seconds since its request; programs are compiled before."""
    link, found = LiveLink(), []
    scene = replace(scene, film=replace(scene.film, seed=seed))
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    request = ViewRequest("stage", viewpoint, *scene.film.size, samples, 0, denoise=is_denoised)
    try:
        link.show("stage", scene)
        _until_done(link, replace(request, samples=2), [])
        _until_done(link, replace(request, exposure=0.999), found)
    finally:
        link.close()
    return found


def _until_done(link: LiveLink, request: ViewRequest, found: list[tuple[float, Shown]]) -> None:
    start, generation = time.monotonic(), 0

    def hear() -> None:
        shown = link.latest("view")
        if shown is not None and shown.frame.generation >= generation and shown.frame.samples:
            found.append((time.monotonic() - start, shown))

    generation = link.look("view", request, hear)
    while not found or not found[-1][1].frame.is_done:
        if time.monotonic() - start > PATIENCE_S or link.trouble("view"):
            raise TimeoutError(f"no picture within {PATIENCE_S:g} s: {link.trouble('view')}")
        time.sleep(0.02)


def _at(shown: list[tuple[float, Shown]], moment: float) -> Shown | None:
    """What a view shows at a moment after its request; None before its first full picture."""
    return next((each for seconds, each in reversed(shown) if seconds <= moment), None)
