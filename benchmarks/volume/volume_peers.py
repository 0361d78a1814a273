# SPDX-License-Identifier: GPL-3.0-or-later
"""Same picture, same machine: time of VTK, yt and Mitsuba's volpath over ours at the SNR that each reaches.

Each peer renders the same field, transfer function and camera; its SNR is against our fine reference, our time is at
that SNR. Fields have an empty rim, since VTK and yt end at the outermost voxel centers. A peer that is not installed
is said to be missing. Argument: volume names.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, reference
from benchmarks.volume.checks.peers import PEERS, Peer
from spectral_core.errors import MissingDependencyError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

WORDS = "VOLUME…"


def run(options: Options) -> dict[str, Any]:
    size = 64 if options.quick else 512
    figures: dict[str, Any] = {}
    for volume in all_volumes(options.quick, options.extra or (["hipip"] if options.quick else ["neghip", "engine"])):
        field = rimmed(volume)
        renderer, transfer = VolumeRenderer(field), one_colour_each(field)
        view = View.around(field, 33.0, 21.0, width=size, height=size)
        exact = reference(renderer, view, transfer, 60.0)
        for peer in PEERS:
            rows = against(peer, renderer, transfer, view, exact, options.quick)
            figures |= {f"{volume.name}_{peer.name}_{key}": value for key, value in rows.items()}
    faster = [value for key, value in figures.items() if key.endswith("_times_faster")]
    if not faster:
        raise MissingDependencyError(
            f"nothing is measured: none of {', '.join(peer.name for peer in PEERS)} is installed; install one with pip"
        )
    return figures | {"holds": {"every installed peer is slower at the SNR that it reaches": min(faster) > 1}}


def rimmed(volume: ScalarVolume) -> ScalarVolume:
    """The field with a rim of one voxel of its least value, at unit spacing."""
    return ScalarVolume(volume.name, np.asfortranarray(np.pad(volume.data, 1, constant_values=volume.data.min())))


def one_colour_each(volume: ScalarVolume) -> TransferFunction:
    """Two tents of pure colors that do not overlap: what every peer can hold."""
    low, high = volume.value_range
    at = [low + (high - low) * part for part in (0.1, 0.3, 0.5, 0.7, 1.0)]
    return TransferFunction(
        (
            Material("warm", at[:3], [0, 0.06, 0], [0.9, 0.4, 0.1]),
            Material("cool", at[2:], [0, 0.2, 0.3], [0.1, 0.4, 0.9]),
        )
    )


def against(
    peer: Peer, renderer: VolumeRenderer, transfer: TransferFunction, view: View, exact: np.ndarray, quick: bool
) -> dict[str, Any]:
    """Times faster than ``peer`` at each of its settings, and the SNR reached there."""
    rows: dict[str, Any] = {}
    try:
        results = list(peer.render(renderer.volume, transfer, view, quick))
    except ImportError as error:
        print(f"{peer.name}: not installed ({error.name})")
        return {"installed": False}
    for label, picture, seconds in results:
        truth = peer.truth(exact, renderer, transfer, view)
        reached = snr_db(truth, picture - truth)
        made = plan(renderer, view, transfer, float(np.clip(reached, 15.0, 85.0)))
        ours = min(_timed(renderer, view, transfer, made.stepping) for _ in range(6))
        image = renderer.render(view, transfer, made.stepping)
        own = snr_db(truth, peer.shows(image) - truth)
        theirs = f"{renderer.volume.name} {peer.name} {label}: {reached:.1f} dB in {1e3 * seconds:.0f} ms"
        print(f"{theirs}; ours {own:.1f} dB in {1e3 * ours:.1f} ms: {seconds / ours:.0f} times faster", flush=True)
        rows |= {f"{label}_db": reached, f"{label}_times_faster": seconds / ours}
    return rows


def _timed(renderer: VolumeRenderer, view: View, transfer: TransferFunction, stepping: Any) -> float:
    start = time.perf_counter()
    renderer.render(view, transfer, stepping)
    return time.perf_counter() - start
