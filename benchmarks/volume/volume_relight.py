# SPDX-License-Identifier: GPL-3.0-or-later
"""Re-illumination and re-palette of K material channels at 1080p against rendering again at 16 samples per pixel.

Mitsuba renders once with the channels; then the light, and then the colors, change by one matrix product. The same
seed rendered anew under the new light must give the same picture within float rounding.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from spectral_core.llvm_library import use_newest_llvm
from spectral_core.spectra import catalogue
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import combine
from spectral_core.volume.mitsuba_integrator.illumination import display_matrix
from spectral_core.volume.presets import preset
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View


def run(options: Options) -> dict[str, Any]:
    use_newest_llvm()
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    from spectral_core.volume.mitsuba_integrator.plugin import register_integrator

    register_integrator()
    width, height, samples = (96, 54, 4) if options.quick else (1920, 1080, 16)
    volume = sample_volume("engine", 32 if options.quick else 96)
    transfer = preset("wide", volume)
    view = View.around(volume, width=width, height=height)
    first, seconds = render(mi, volume, transfer, view, samples, "D65")
    amounts = np.ascontiguousarray(first[..., 4:])
    figures: dict[str, Any] = {"render_s": seconds, "materials": amounts.shape[-1]}

    fresh, _ = render(mi, volume, transfer, view, samples, "A")
    matrix = display_matrix(transfer, catalogue.illuminant("A"))
    figures |= compare("relight", amounts, matrix, fresh[..., :3], seconds)

    colors = np.array([[0.1, 0.9, 0.3], [0.8, 0.1, 0.7], [0.2, 0.2, 1.0]])
    painted = replace(
        transfer, materials=tuple(replace(m, color=c) for m, c in zip(transfer.materials, colors, strict=True))
    )
    fresh, _ = render(mi, volume, painted, view, samples, "D65")
    figures |= compare("repalette", amounts, display_matrix(painted), fresh[..., :3], seconds)
    both = ("relight", "repalette")
    return figures | {
        "holds": {
            "a new light and new colors give the picture of a render within 1e-6 of its peak": all(
                figures[f"{what}_difference"] < 1e-6 for what in both
            ),
            "a new light and new colors take a hundredth of its time": all(
                figures[f"{what}_times_faster"] > 100 for what in both
            ),
        }
    }


def render(
    mi: Any, volume: ScalarVolume, transfer: TransferFunction, view: View, samples: int, light: str
) -> tuple[np.ndarray, float]:
    """(picture with channels, least seconds of two renders after the first)."""
    from spectral_core.volume.mitsuba_integrator.settings import SceneVolume, integrator_dict

    film = {"type": "hdrfilm", "width": view.width, "height": view.height, "rfilter": {"type": "box"}, "component_format": "float32"}  # fmt: skip  # noqa: E501
    settings = {"channels": True, "scale": 0.7, "rule": "error", "quadrature": "midpoint", "light": light}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator_dict([SceneVolume(volume, transfer)], **settings),
            "sensor": view.mitsuba_sensor()
            | {"film": film, "sampler": {"type": "independent", "sample_count": samples}},
        }
    )
    seconds = np.inf
    for _ in range(3):
        start = time.perf_counter()
        picture = np.array(mi.render(scene, spp=samples, seed=1))
        seconds = min(seconds, time.perf_counter() - start)
    return picture, seconds


def compare(what: str, amounts: np.ndarray, matrix: np.ndarray, fresh: np.ndarray, seconds: float) -> dict[str, float]:
    """Time of one matrix product over that of a render, and the greatest difference relative to the picture's peak."""
    times = []
    for _ in range(9):
        start = time.perf_counter()
        again = combine(amounts, matrix)
        times.append(time.perf_counter() - start)
    error = float(np.abs(again - fresh).max() / np.abs(fresh).max())
    ratio = seconds / min(times)
    print(f"{what}: {1e3 * min(times):.1f} ms, {ratio:.0f} times faster than rendering ({seconds:.2f} s), "
          f"greatest difference {error:.1e} of the peak")  # fmt: skip
    return {f"{what}_ms": 1e3 * min(times), f"{what}_times_faster": ratio, f"{what}_difference": error}
