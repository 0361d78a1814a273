# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples, error against a reference and seconds of a volume picture, beside uniform steps of the same wanted error."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping, VolumeImage, combine
from spectral_core.volume.plan import Plan, plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

REFERENCE_GAIN_DB = 25.0
"""dB by which the reference exceeds the judged picture; its own error then changes the figure by 0.01 dB."""
RUNS = 3


def report(
    renderer: VolumeRenderer, view: View, transfer: TransferFunction, chosen: Plan, wanted_db: float
) -> dict[str, Any]:
    """Print and return one row per way of stepping: the chosen one, and uniform steps where that is another."""
    aim = min(wanted_db + REFERENCE_GAIN_DB, 85.0)
    # A two-dimensional function has no pre-integration table.
    quadrature: Literal["midpoint", "preintegrated"] = "midpoint" if transfer.uses_gradient else "preintegrated"
    finest = plan(renderer, view, transfer, aim, rule="uniform", quadrature=quadrature).stepping
    reference = _judged(renderer.render(view, transfer, finest))
    # Halve the step again: the change is the error of the reference itself, stated with the figures.
    finer = _judged(renderer.render(view, transfer, replace(finest, scale=finest.scale / 2)))
    own_db = _snr(finer, reference)
    ways = {"chosen": chosen.stepping}
    if chosen.stepping.rule != "uniform":
        even = plan(renderer, view, transfer, wanted_db, rule="uniform", quadrature="midpoint")
        ways["uniform"] = even.stepping
    own = f"itself good to {own_db:.1f} dB" if math.isfinite(own_db) else "which half its step leaves as it is"
    print(f"reference: uniform {finest.scale:.3g} voxel, {quadrature}, {own}")
    rows = {name: _row(renderer, view, transfer, way, finer) for name, way in ways.items()}
    for name, row in rows.items():
        print(
            f"  {name:8} {row['rule']:8} {row['quadrature']:14} {_stated(row['snr_db'])} {row['samples']:12,} samples "
            f"{row['seconds'] * 1000:8.1f} ms"
        )
    return {"reference_db": own_db if math.isfinite(own_db) else None, **rows}


def why_empty(volume: ScalarVolume, transfer: TransferFunction) -> str:
    """Why a picture without samples has none."""
    low, high = float(volume.data.min()), float(volume.data.max())
    if transfer.shows(low, high):
        return (
            "no ray through the middle of a pixel meets what the transfer function shows: change --size or the camera"
        )
    return f"the transfer function shows nothing of values from {low:g} to {high:g}"


def _row(
    renderer: VolumeRenderer, view: View, transfer: TransferFunction, way: Stepping, reference: Any
) -> dict[str, Any]:
    image = renderer.render(view, transfer, way, counts=True)
    # Counting takes time, and the first render of a type compiles: the time is the shortest of plain renders.
    seconds = min(renderer.render(view, transfer, way).seconds for _ in range(RUNS))
    snr = _snr(reference, _judged(image))
    return {
        "rule": way.rule,
        "quadrature": way.quadrature,
        "scale": way.scale,
        "snr_db": snr if math.isfinite(snr) else None,
        "samples": image.samples,
        "steps": image.steps,
        "seconds": seconds,
    }


def _stated(snr_db: float | None) -> str:
    """A figure as text; without one the pictures are equal, at the shortest possible step."""
    return "equal to it" if snr_db is None or not math.isfinite(snr_db) else f"{snr_db:6.1f} dB"


def _judged(image: VolumeImage) -> list[Any]:
    """What has the stated quality: the picture and, if dark materials show by what they hide, the opacity."""
    from spectral_core.volume.mitsuba_integrator.illumination import display_matrix

    picture = combine(image.amounts, display_matrix(image.transfer)).astype(np.float64)
    return [picture, 1.0 - image.transmittance.astype(np.float64)] if image.transfer.has_dark else [picture]


def _snr(signals: list[Any], others: list[Any]) -> float:
    """The lowest of the parts, as a plan states it."""
    found = []
    for signal, other in zip(signals, others, strict=True):
        noise, energy = float(np.sum((signal - other) ** 2)), float(np.sum(signal**2))
        found.append(math.inf if noise == 0 else -math.inf if energy == 0 else 10 * math.log10(energy / noise))
    return min(found)
