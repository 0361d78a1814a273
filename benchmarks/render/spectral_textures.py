# SPDX-License-Identifier: GPL-3.0-or-later
"""Two photographs in one surface: designed and given lights, every pair of display colors, bounds, time, memory.

``--pictures A B`` measures two other pictures of one size instead of the photographs that Matplotlib and Blender ship.
``--large`` runs the command on 8192 × 8192 texels, ``--realism`` prints the table that the slider in Blender reads.
"""

from __future__ import annotations

import itertools
import resource
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.render.checks.texture_large import large_picture, measured
from benchmarks.render.checks.texture_rendered import rendered_errors
from spectral_core.errors import UnknownNameError
from spectral_core.files.guarded import no_file
from spectral_core.palette.texture.basis import TextureBasis, design_basis
from spectral_core.palette.texture.fit import Fitter
from spectral_core.palette.texture.lights import LightDesign, design_lights, led_range
from spectral_core.palette.texture.reach import TEXTURE_GRID, reachable_contrast, stimulus_matrix
from spectral_core.palette.texture.realism import DAYLIGHT_SHARES, LED_WIDTHS_NM, realism_cost, rendering_delta_e
from spectral_core.palette.texture.texture import Picture, SpectralTexture, design_texture
from spectral_core.render.images.pictures import read_picture
from spectral_core.spectra.catalogue import illuminant, reflectance, reflectance_names
from spectral_core.spectra.color import (
    delta_e_2000,
    display_rgb_from_linear,
    lab_from_linear_rgb,
    linear_from_display_rgb,
)

OPTIONS = ("--pictures A B", "--large", "--realism")


def photographs(extra: list[str], size: int) -> list[Picture]:
    """The two pictures that were named, or a portrait and a landscape that are on every machine with the packages."""
    if "--pictures" in extra:
        names = extra[extra.index("--pictures") + 1 :][:2]
        if len(names) < 2:
            raise UnknownNameError(
                f"expected the files of two pictures after --pictures; got {' '.join(names) or 'none'}"
            )
        for name in names:
            if not Path(name).is_file():
                raise UnknownNameError(no_file(name))
        return [Picture(Path(name).stem, read_picture(Path(name))) for name in names]
    import importlib.util

    import matplotlib

    portrait = read_picture(Path(matplotlib.get_data_path()) / "sample_data" / "grace_hopper.jpg")
    spec = importlib.util.find_spec("bpy")
    if spec is not None and spec.origin is not None:
        folder = next(Path(spec.origin).parent.glob("*/datafiles/studiolights/world"))
        sky = np.asarray(read_picture(folder / "courtyard.exr"), dtype=np.float32)
        sky = np.clip(sky / np.percentile(sky, 97), 0, 1)
        landscape: NDArray[Any] = sky[: sky.shape[0], : sky.shape[0]]
    else:
        landscape = portrait[::-1, ::-1]
    return [Picture("portrait", _fitted(portrait, size)), Picture("landscape", _fitted(landscape, size))]


def _fitted(pixels: NDArray[Any], size: int) -> NDArray[Any]:
    """Pixels (size, size, 3), nearest neighbor: no new colors, and any size can be measured."""
    rows = np.arange(size) * pixels.shape[0] // size
    columns = np.arange(size) * pixels.shape[1] // size
    return np.ascontiguousarray(pixels[rows][:, columns])


def run(options: Options) -> dict[str, Any]:
    """Every figure of acceptance lines 1 to 3 of the spectral textures."""
    if "--large" in options.extra:
        return _large(options)
    if "--realism" in options.extra:
        rows = _realism(options, LED_WIDTHS_NM, DAYLIGHT_SHARES)
        return {"realism": rows, "holds": _slider_holds(options, rows)}
    pictures = photographs(options.extra, 256 if options.quick else 512)
    few = {"iterations": 12} if options.quick else {}
    started = time.process_time()
    designed = design_lights(**few)
    light_seconds = time.process_time() - started
    matrix = stimulus_matrix(designed.lights)
    started = time.process_time()
    basis = design_basis(matrix, 6, **few)
    basis_seconds = time.process_time() - started
    print(
        f"lights: {light_seconds:.1f} s of processor time ({designed.seconds:.1f} s), white ΔE2000 "
        f"{max(designed.white_delta_e):.4f}, slope {designed.slope:.3f} (starts "
        f"{', '.join(f'{slope:.3f}' for slope in designed.starts)}); basis of 6: {basis_seconds:.1f} s of processor "
        f"time, slope {basis.slope:.3f}"
    )
    pairs = _every_pair(matrix @ basis.spectra.T, 2000 if options.quick else 20_000)
    photo_basis = design_basis(matrix, 6, floor=0.02, **few)
    found = design_texture(pictures, designed.lights, floor=0.02, slope=0.95, basis=photo_basis)
    for loss in found.losses:
        print(
            f"{loss.name}: ΔE2000 mean {loss.mean:.3f}, p99 {loss.p99:.2f}, max {loss.largest:.2f}; "
            f"details {loss.contrast:.2f}, ghost {loss.ghost:.4f}"
        )
    outside = _outside(found.texture.weights, found.texture.spectra)
    rendered = _by_f12(found.texture, options)
    given = _given_lamps(pictures, options)
    times = _times(designed, photo_basis, 512 if options.quick else 2048)
    realism = _realism(options, (20.0, 40.0), (0.0, 0.1, 0.3))
    worst = {name: max(getattr(loss, name) for loss in found.losses) for name in ("mean", "p99", "ghost")}
    holds = {
        "white within ΔE2000 0.1 of D65": max(designed.white_delta_e) < 0.1,
        "every pair of display colors within ΔE2000 0.1 at 19:1": pairs["largest_delta_e"] < 0.1,
        "photographs mean <= 0.2, p99 <= 4, ghost <= 0.02": worst["mean"] <= 0.2
        and worst["p99"] <= 4
        and worst["ghost"] <= 0.02,
        "rendered by F12, 8×8 means within ΔE2000 1.0 beyond noise": all(row["beyond_noise"] < 1 for row in rendered),
        "reflectances within [0, 1] at every texel": outside == 0,
        "contrast of given lamps stated in under 1 s and met": all(
            row["seconds"] < 1 and row["largest_delta_e"] < 0.1 for row in given.values()
        ),
        "2048² in under 1 s on two cores (1.5 s of processor time)": times["processor_seconds_2048"] < 1.5,
        "lights and basis in under 10 s each (processor time)": max(light_seconds, basis_seconds) < 10,
        **_slider_holds(options, realism),
    }
    return {
        "white_delta_e": max(designed.white_delta_e),
        "slope": designed.slope,
        "basis_slope": basis.slope,
        "light_processor_seconds": light_seconds,
        "basis_processor_seconds": basis_seconds,
        "pairs": pairs,
        "photographs": worst | {"compressed_share": found.compressed, "texels_outside": outside},
        "rendered": rendered,
        "given_lamps": given,
        "times": times,
        "realism": realism,
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "holds": holds,
    }


def _every_pair(color_from_weights: NDArray[np.float64], count: int) -> dict[str, float]:
    """Random pairs of display colors at contrast 19:1, and all pairs of corners."""
    rng = np.random.default_rng(7)
    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 6)).reshape(6, -1).T
    wanted = 0.05 + 0.9 * np.concatenate([linear_from_display_rgb(rng.random((count, 6))), corners])
    weights, outside = Fitter(color_from_weights, (1.0, 1.0)).solve(np.ascontiguousarray(wanted.T, dtype=np.float32))
    shown = (color_from_weights @ weights).T
    errors = [
        delta_e_2000(lab_from_linear_rgb(shown[:, k : k + 3]), lab_from_linear_rgb(wanted[:, k : k + 3]))
        for k in (0, 3)
    ]
    print(f"{len(wanted)} pairs at 19:1: largest ΔE2000 {np.max(errors):.2e}, {outside} outside")
    return {"count": len(wanted), "largest_delta_e": float(np.max(errors)), "outside": outside}


def _outside(weights: NDArray[np.float16], spectra: NDArray[np.float64]) -> int:
    """Texels whose reflectance leaves [0, 1] at any knot, each computed."""
    flat = weights.reshape(len(weights), -1)
    count = 0
    for start in range(0, flat.shape[1], 1 << 16):
        reflectances = flat[:, start : start + (1 << 16)].T.astype(np.float64) @ spectra
        count += int(((reflectances < 0) | (reflectances > 1 + 1e-12)).any(axis=1).sum())
    return count


def _by_f12(texture: SpectralTexture, options: Options) -> list[dict[str, float]]:
    """Every second or fourth texel of the texture, rendered in Blender under each of its lights."""
    step = 4 if options.quick else 2
    small = SpectralTexture(texture.weights[:, ::step, ::step], texture.spectra, texture.lights)
    rows = rendered_errors(small, 16 if options.quick else 64)
    for number, row in enumerate(rows, 1):
        print(
            f"F12 under light {number}: 8×8 means ΔE2000 {row['mean']:.2f} (p95 {row['p95']:.2f}), noise "
            f"{row['noise']:.2f}, beyond noise {row['beyond_noise']:.2f}"
        )
    return rows


def _given_lamps(pictures: list[Picture], options: Options) -> dict[str, dict[str, float]]:
    """The contrast that given lamps allow, stated and then met by every texel of both pictures."""
    small = [Picture(picture.name, picture.pixels[::4, ::4]) for picture in pictures]
    rows = {}
    for name in ("HP1", "LED-B5", "FL11"):
        lights = [illuminant("D65"), illuminant(name)]
        started = time.perf_counter()
        reach = reachable_contrast(lights, 0.1)
        seconds = time.perf_counter() - started
        found = design_texture(small, lights, floor=0.1, mapping="uniform_contrast", count=8)
        largest = max(loss.largest for loss in found.losses)
        rows[f"D65 + {name}"] = {
            "stated_slope": reach.slope, "stated_contrast": reach.contrast, "seconds": seconds,
            "slope_of_8": found.slope, "largest_delta_e": largest,
        }  # fmt: skip
        print(
            f"D65 + {name}: all pairs reach slope {reach.slope:.3f} at floor 0.1 (stated in {seconds:.2f} s); "
            f"8 spectra {found.slope:.3f}, met within ΔE2000 {largest:.3f}"
        )
    return rows


def _times(designed: LightDesign, basis: TextureBasis, size: int) -> dict[str, float]:
    """Seconds to design a texture of size² texels of photographs once lights and basis are known, scaled to 2048²."""
    pictures = photographs([], size)
    bytes_of = [
        Picture(p.name, np.round(255 * display_rgb_from_linear(p.pixels)).astype(np.uint8))
        if p.pixels.dtype.kind == "f"
        else p
        for p in pictures
    ]
    seconds, processor = [], []
    for _ in range(3):
        started, busy = time.perf_counter(), time.process_time()
        design_texture(bytes_of, designed.lights, floor=0.02, slope=0.95, basis=basis)
        seconds.append(time.perf_counter() - started)
        processor.append(time.process_time() - busy)
    scale = (2048 / size) ** 2
    print(
        f"{size}² texels, from pictures to weights and losses: {min(processor):.2f} s of processor time, "
        f"{min(seconds):.2f} s (2048²: {scale * min(processor):.2f} s, {scale * min(seconds):.2f} s)"
    )
    return {
        "size": size, "seconds": min(seconds), "processor_seconds": min(processor),
        "seconds_2048": scale * min(seconds), "processor_seconds_2048": scale * min(processor),
    }  # fmt: skip


def _realism(options: Options, widths: Iterable[float], shares: Iterable[float]) -> list[dict[str, float]]:
    """Loss of contrast by daylight in both lights and by the width of the LEDs, and their effect on other surfaces."""
    patches = [reflectance(name) for name in reflectance_names()[:24]]
    values = np.stack([patch.at(TEXTURE_GRID.wavelengths_nm) for patch in patches])
    rows = []
    for width, share in itertools.product(map(float, widths), map(float, shares)):
        found = design_lights(led_range(width), daylight_share=share, iterations=6 if options.quick else 40)
        contrast = (found.floor + found.slope) / found.floor
        off = max(rendering_delta_e(light, values, TEXTURE_GRID) for light in found.lights)
        rows.append({"led_width_nm": width, "daylight_share": share, "contrast": contrast, "rendering_delta_e": off})
        stated = realism_cost(share, width)
        print(
            f"LED width {width:.0f} nm, daylight {share:.0%}: contrast {contrast:.1f}:1 (slider: "
            f"{stated.contrast:.1f}), other surfaces off by ΔE2000 {off:.1f}"
        )
    return rows


def _slider_holds(options: Options, rows: list[dict[str, float]]) -> dict[str, bool]:
    """Whether Blender's slider states what designs have; the few iterations of ``--quick`` end before."""
    if options.quick:
        return {}
    stated = [realism_cost(row["daylight_share"], row["led_width_nm"]) for row in rows]
    pairs = list(zip(rows, stated, strict=True))
    return {
        "the slider states contrasts to 2 %": all(abs(a["contrast"] / b.contrast - 1) < 0.02 for a, b in pairs),
        "the slider states the error of other surfaces to ΔE2000 0.3": all(
            abs(a["rendering_delta_e"] - b.rendering_delta_e) < 0.3 for a, b in pairs
        ),
    }


def _large(options: Options) -> dict[str, Any]:
    """The command on two large pictures, memory of its whole process tree."""
    size = 1024 if options.quick else 8192
    names = []
    for seed, picture in enumerate(photographs([], 512)):
        pixels = picture.pixels
        if pixels.dtype.kind == "f":
            pixels = np.round(255 * np.clip(display_rgb_from_linear(pixels), 0, 1)).astype(np.uint8)
        names.append(large_picture(options.out / f"{picture.name}.png", pixels, size, seed))
    found = measured(names, options.out / "texture")
    print(
        f"{size}²: {found['seconds']:.0f} s, at most {found['peak_gb']:.2f} GB in all processes, {found['steps']} "
        "steps of progress"
    )
    return found | {"holds": {"8k within 4 GB, with progress": found["peak_gb"] < 4 and found["rising"]}}
