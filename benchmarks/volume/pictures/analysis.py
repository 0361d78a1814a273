# SPDX-License-Identifier: GPL-3.0-or-later
"""Figs. 4.1 to 4.4 of the thesis, drawn from ``spectral_core.volume.analysis``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.volume.analysis import (
    SampledFunction,
    composite_bandlimit,
    cone_edges,
    frequency_transfer_kernel,
    sample_composition,
)

Function = Callable[[np.ndarray], np.ndarray]
CURVE, SAMPLED, FAINT = "#1f4e79", "#d1495b", "#9aa5b1"
INTERVAL = (-3.0, 3.0)


def write(
    folder: Path, two_tones: Function, slow_tone: Function, g: Function, gaussians: dict[str, Function], dpi: int = 130
) -> list[Path]:
    """Draw the four figures into ``folder``; their paths."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    style = {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 10}
    figures = {
        "analysis_4_1_two_bounds.png": lambda: _two_bounds(plt, two_tones, g),
        "analysis_4_2_kernel.png": lambda: _kernel(plt, gaussians),
        "analysis_4_3_airy.png": lambda: _airy(plt, gaussians["one"]),
        "analysis_4_4_one_tone.png": lambda: _one_tone(plt, slow_tone, g),
    }
    with plt.rc_context(style):
        for name, draw in figures.items():
            figure = draw()
            figure.savefig(folder / name, dpi=dpi)
            plt.close(figure)
    return [folder / name for name in figures]


def _limits(f: Function, g: Function) -> Any:
    return composite_bandlimit(
        SampledFunction.of(f, 0, 4, 4096, periodic=True), SampledFunction.of(g, 0, 1, 1024, periodic=True)
    )


def _sampling_panel(axis: Any, f: Function, g: Function, frequency: float, title: str) -> None:
    """g(f(x)), its samples at twice the Nyquist rate of ``frequency``, and the sinc interpolant through them."""
    x = np.linspace(*INTERVAL, 2000)
    samples = sample_composition(f, g, INTERVAL, frequency, oversampling=2.0)
    axis.plot(x, g(f(x)), color=FAINT, linewidth=3, label="g(f(x))")
    axis.plot(x, samples(x), color=CURVE, linewidth=1.2, label="rebuilt from the samples")
    shown = (samples.positions >= INTERVAL[0]) & (samples.positions <= INTERVAL[1])
    axis.plot(samples.positions[shown], samples.samples[shown], "o", color=SAMPLED, markersize=3.5, label="samples")
    axis.set(title=f"{title}: {samples.count_inside} samples", xlabel="x", ylim=(-0.12, 1.12))


def _two_bounds(plt: Any, f: Function, g: Function) -> Any:
    figure, axes = plt.subplots(2, 2, figsize=(10, 6), layout="constrained")
    x, y = np.linspace(*INTERVAL, 2000), np.linspace(0, 1, 500)
    axes[0, 0].plot(x, f(x), color=CURVE)
    axes[0, 0].set(title="data f(x)", xlabel="x", ylim=(-0.02, 1.02))
    axes[0, 1].plot(y, g(y), color=CURVE)
    axes[0, 1].set(title="transfer function g(y)", xlabel="data value y", ylim=(-0.02, 1.02))
    limit = _limits(f, g)
    _sampling_panel(axes[1, 0], f, g, limit.product_frequency, "product of band limits, ×4")
    _sampling_panel(axes[1, 1], f, g, limit.frequency, "ν_g · max|f′|, ×4")
    handles, labels = axes[1, 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _one_tone(plt: Any, f: Function, g: Function) -> Any:
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.4), layout="constrained", sharey=True)
    limit = _limits(f, g)
    _sampling_panel(axes[0], f, g, limit.product_frequency, "product of band limits, ×4")
    _sampling_panel(axes[1], f, g, limit.frequency, "ν_g · max|f′|, ×4")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _kernel(plt: Any, gaussians: dict[str, Function]) -> Any:
    """f and log|K(ω, ν)| for one and two Gaussians; frequencies in units of π per sample, as the thesis draws them."""
    figure, axes = plt.subplots(2, 2, figsize=(10, 8), layout="constrained", width_ratios=(1, 1.25))
    count = 256
    nu_scale = np.pi * count / 12 / 2  # the slope 12·exp(-1/2) of φ(·, 1/12, ·) then runs through the picture
    for (curve, map_axis), (name, f) in zip(axes, gaussians.items(), strict=True):
        signal = SampledFunction.of(f, 0, 1, count)
        x = np.linspace(0, 1, 1000)
        curve.plot(x, f(x), color=CURVE)
        curve.set(title=f"f: {name} Gaussian{'s' if name != 'one' else ''}", xlabel="x", ylim=(-0.02, 1.1))
        nu = np.linspace(-1, 1, 513) * nu_scale
        kernel = frequency_transfer_kernel(signal, nu)
        magnitude = np.abs(kernel.values)
        shade = np.log(np.maximum(magnitude / magnitude.max(), np.exp(-7)))
        highest = np.pi / signal.spacing[0]
        extent = (-1, 1, -1, 1)
        image = map_axis.imshow(
            shade, origin="lower", extent=extent, aspect="auto", cmap="magma", interpolation="bilinear"
        )
        for edge, colour in zip(cone_edges(signal), ("#7fd1ff", "#9dff8a"), strict=True):
            map_axis.plot(edge.slope * nu / highest, nu / nu_scale, color=colour, linewidth=1, linestyle="--")
        map_axis.set(title="log |K(ω, ν)|, dashed: the extreme slopes of f", xlim=(-1, 1), ylim=(-1, 1))
        map_axis.set(xlabel="ω / (π samples per unit)", ylabel=f"ν / {nu_scale:.0f}")
        figure.colorbar(image, ax=map_axis, shrink=0.9)
    return figure


def _airy(plt: Any, f: Function) -> Any:
    """The Airy function, and a real kernel row laid over it: the band edge is where its argument is zero."""
    from scipy.special import airy

    figure, axis = plt.subplots(figsize=(7.5, 3.8), layout="constrained")
    t = np.linspace(-10, 5, 1500)
    axis.plot(t, airy(t)[0], color=CURVE, label="Ai(t)")
    signal, nu = SampledFunction.of(f, -1, 2, 1 << 15), 2000.0
    upper = cone_edges(signal)[1]
    kernel = frequency_transfer_kernel(signal, [nu])
    argument = (kernel.omega - nu * upper.slope) / upper.decay_length(nu)
    near = (argument > -10) & (argument < 5)
    phase = np.exp(-1j * (nu * upper.data_values[0] - kernel.omega[near] * upper.positions[0]))
    measured = (kernel.values[0][near] * phase).real * upper.decay_length(nu)
    axis.plot(
        argument[near][::3], measured[::3], ".", color=SAMPLED, markersize=4, label="K(ω, 2000) of one Gaussian, scaled"
    )
    axis.axvline(0, color=FAINT, linewidth=1)
    axis.annotate("band edge: ω = ν · max f′", (0, -0.33), xytext=(6, 0), textcoords="offset points", color="#555555")
    axis.set(xlabel="t = Airy lengths beyond the edge", ylim=(-0.47, 0.62), xlim=(-10, 5))
    axis.legend(frameon=False, loc="upper left")
    return figure
