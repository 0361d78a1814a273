# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit against re-rendered with the same seed and samples: dial and exact storage, three multi-bounce scenes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.relight.cases.scenes import scenes, under_lights
from spectral_core.render import render_scene
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storage import MixtureStorage
from spectral_core.render.relight.transport import record_transport
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid

GRID = SpectralGrid.uniform(380, 780, 10)
LAMPS = {"Key": "HP1", "Fill": "FL11", "Sky": "LED-B3"}


def run(options: Options) -> dict[str, Any]:
    """Largest difference of any pixel over the largest value of the re-render."""
    figures: dict[str, Any] = {}
    for name, scene in scenes(*((24, 18) if options.quick else (96, 72)), 16).items():
        dial = relight(record_transport(scene, MixtureStorage()), mix={"Key": 0.3, "Sky": 2.0})
        key, fill = scene.lights
        dimmed = replace(
            scene,
            lights=(replace(key, power_w=0.3 * key.power_w), fill),
            world=replace(scene.world, strength=2 * scene.world.strength),
        )
        spectra = {group: catalogue.illuminant(lamp).resampled(GRID) for group, lamp in LAMPS.items()}
        exact = relight(record_transport(scene, ExactStorage(GRID)), lights=spectra)
        spectral = replace(scene, settings=replace(scene.settings, transport="spectral"))
        rendered = render_scene(under_lights(spectral, spectra), sampling_lights=SAMPLING_LIGHTS).pixels
        figures[name] = {
            "dial": _error(dial, render_scene(dimmed, sampling_lights=SAMPLING_LIGHTS).pixels),
            "exact": _error(exact, rendered),
        }
        print(f"{name:20} dial {figures[name]['dial']:.1e}   exact {figures[name]['exact']:.1e}")
    figures["holds"] = {
        "dial equals a new render to float rounding": all(row["dial"] < 1e-5 for row in figures.values()),
        "exact storage equals a new render to float rounding": all(row["exact"] < 1e-5 for row in figures.values()),
    }
    return figures


def _error(picture: Any, reference: Any) -> float:
    return float(np.abs(picture - reference)[..., :3].max() / np.abs(reference[..., :3]).max())
