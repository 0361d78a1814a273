# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampling bound of g(f(x)) against the product bound: samples, energy beyond, error; makes Figs. 4.1 to 4.4.

``--pictures DIR`` writes the pictures there (default: the output folder).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.pictures import analysis as drawings
from spectral_core.files.whole import make_folder
from spectral_core.volume.analysis import (
    SampledFunction,
    composite_bandlimit,
    cone_edges,
    energy_beyond,
    frequency_transfer_kernel,
    reconstruction_snr,
    sample_composition,
)

Function = Callable[[np.ndarray], np.ndarray]


def two_tones(x: np.ndarray) -> np.ndarray:
    """f of Fig. 4.1a: a slow sinusoid with a small fast one on top."""
    return 0.5 + 9 / 20 * np.sin(2 * np.pi / 4 * x) + 1 / 20 * np.sin(4 * np.pi * x)


def slow_tone(x: np.ndarray) -> np.ndarray:
    """f of Fig. 4.4: the slow sinusoid of Fig. 4.1a alone, over the whole range 0 to 1."""
    return 0.5 + 0.5 * np.sin(2 * np.pi / 4 * x)


def ten_tones(x: np.ndarray) -> np.ndarray:
    """Ten harmonics with amplitudes 1/k², similar to smooth measured data along a ray."""
    total = sum(np.cos(np.pi / 2 * k * x + k * k) / k**2 for k in range(1, 11))
    return 0.5 + total / 3.2


def raised_cosine(y: np.ndarray) -> np.ndarray:
    """g of Fig. 4.1b."""
    return 0.5 * (1 - np.cos(2 * np.pi * y))


def three_peaks(y: np.ndarray) -> np.ndarray:
    """A busier transfer function: three peaks over the data range."""
    return 0.5 * (1 - np.cos(6 * np.pi * y))


CASES: dict[str, tuple[Function, Function]] = {
    "two tones, one peak (Fig. 4.1)": (two_tones, raised_cosine),
    "one tone, one peak (Fig. 4.4)": (slow_tone, raised_cosine),
    "two tones, three peaks": (two_tones, three_peaks),
    "ten tones, one peak": (ten_tones, raised_cosine),
    "ten tones, three peaks": (ten_tones, three_peaks),
}
PERIOD = 4.0


def case_figures(f: Function, g: Function, count: int) -> dict[str, float]:
    """Both bounds, their samples over six units, and their errors at one and two times the Nyquist rate."""

    def composed(x: np.ndarray) -> np.ndarray:
        return g(f(x))

    limit = composite_bandlimit(
        SampledFunction.of(f, 0, PERIOD, count, periodic=True),
        SampledFunction.of(g, 0, 1, count, periodic=True),
        energy=1 - 1e-9,
    )
    mapped = SampledFunction.of(composed, 0, PERIOD, count, periodic=True)
    figures = {
        "bound_rad": limit.frequency,
        "product_bound_rad": limit.product_frequency,
        "energy_beyond_bound": energy_beyond(mapped, limit.frequency),
        "energy_beyond_twice": energy_beyond(mapped, 2 * limit.frequency),
    }
    for name, frequency in (("bound", limit.frequency), ("product", limit.product_frequency)):
        for oversampling in (1, 2, 4):
            samples = sample_composition(f, g, (-3.0, 3.0), frequency, oversampling=oversampling)
            figures[f"{name}_samples_{oversampling}x"] = samples.count_inside
            figures[f"{name}_snr_db_{oversampling}x"] = reconstruction_snr(samples, composed)
    return figures


def gaussian(mean: float, deviation: float, x: np.ndarray) -> np.ndarray:
    """The non-normalized Gaussian φ of Fig. 4.2."""
    return np.exp(-((x - mean) ** 2) / (2 * deviation**2))


GAUSSIANS: dict[str, Function] = {
    "one": lambda x: gaussian(1 / 2, 1 / 12, x),
    "two": lambda x: gaussian(1 / 2, 1 / 12, x) + gaussian(1 / 4, 1 / 30, x),
}


def edge_figures(f: Function, nu: float, count: int) -> dict[str, float]:
    """Slopes of the cone, and the decay of the kernel at ``nu`` beyond the Airy edge, from ``count`` samples."""
    signal = SampledFunction.of(f, -1, 2, count)
    kernel = frequency_transfer_kernel(signal, [nu])
    power = np.abs(kernel.values[0]) ** 2
    lower, upper = cone_edges(signal)
    figures = {"slope_low": lower.slope, "slope_high": upper.slope}
    distance = (kernel.omega - nu * upper.slope) / upper.decay_length(nu)
    near = np.abs(distance) < 1
    predicted = upper.airy_kernel(kernel.omega[near], nu)
    error = np.abs(predicted - kernel.values[0][near]).max() / np.abs(predicted).max()
    figures["airy_relative_error"] = float(error)
    # A constant stretch of f adds a peak at ω = 0; what crosses the edge is judged on the upper half plane without it.
    right = kernel.omega > 20
    for lengths in (0, 2, 4):
        outside = power[distance > lengths].sum() / power[right].sum()
        figures[f"energy_beyond_edge_plus_{lengths}_airy_lengths"] = float(outside)
    return figures


OPTIONS = ("--pictures FOLDER",)


def run(options: Options) -> dict[str, Any]:
    parser = argparse.ArgumentParser(prog="python -m benchmarks volume-analysis", add_help=False)
    parser.add_argument("--pictures", type=Path, default=options.out)
    pictures = parser.parse_args(options.extra).pictures
    count = 1024 if options.quick else 8192
    cases = {name: case_figures(f, g, count) for name, (f, g) in CASES.items()}
    edge = (300.0, 1 << 14) if options.quick else (2000.0, 1 << 17)
    edges = {name: edge_figures(f, *edge) for name, f in GAUSSIANS.items()}
    _print(cases, edges)
    make_folder(pictures)
    written = drawings.write(pictures, two_tones, slow_tone, raised_cosine, GAUSSIANS, dpi=40 if options.quick else 130)
    print("pictures: " + ", ".join(path.name for path in written))
    return {
        "cases": cases, "kernel_edges": edges, "pictures": [str(path) for path in written],
        "holds": {
            "ω_h is never above the product of the band limits": all(
                row["bound_rad"] <= 1.001 * row["product_bound_rad"] for row in cases.values()
            ),
            "twice the Nyquist rate of ω_h gives 20 dB, four times 55 dB": all(
                row["bound_snr_db_2x"] > 20 and row["bound_snr_db_4x"] > 55 for row in cases.values()
            ),
            "less than 1 % of the energy is beyond twice ω_h": all(
                row["energy_beyond_twice"] < 0.01 for row in cases.values()
            ),
            "a millionth of the energy at most is four Airy lengths beyond the edge": all(
                edge["energy_beyond_edge_plus_4_airy_lengths"] < 1e-6 for edge in edges.values()
            ),
        },
    }  # fmt: skip


def _print(cases: dict[str, dict[str, float]], edges: dict[str, dict[str, float]]) -> None:
    head = f"{'f and g':32}{'ω_h':>8}{'product':>9}{'ratio':>7}{'beyond ω_h':>12}{'beyond 2ω_h':>13}"
    print(head + f"{'dB at 1×':>10}{'2×':>6}{'4×':>6}")
    for name, row in cases.items():
        ratio = row["product_bound_rad"] / row["bound_rad"]
        line = f"{name:32}{row['bound_rad']:8.2f}{row['product_bound_rad']:9.2f}{ratio:7.2f}"
        line += f"{row['energy_beyond_bound']:12.2%}{row['energy_beyond_twice']:13.2e}"
        print(line + "".join(f"{row[f'bound_snr_db_{o}x']:{w}.0f}" for o, w in ((1, 10), (2, 6), (4, 6))))
    for name, edge in edges.items():
        beyond = ", ".join(f"{edge[f'energy_beyond_edge_plus_{n}_airy_lengths']:.1e}" for n in (0, 2, 4))
        print(
            f"kernel of {name} Gaussian(s): slopes {edge['slope_low']:.2f} to {edge['slope_high']:.2f}, Airy within "
            f"{edge['airy_relative_error']:.1%} at the edge, energy beyond it by 0, 2, 4 Airy lengths: {beyond}"
        )
    assert all(math.isfinite(value) for row in cases.values() for value in row.values())
