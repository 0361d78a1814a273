# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory of recording 8 lights: the stated memory, and the measured peaks of the processes; also at 4K."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from typing import Any

from benchmarks import Options
from benchmarks.relight.cases.scenes import scenes
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render.relight.band_storage import BandStorage
from spectral_core.render.relight.exact_storage import ExactStorage
from spectral_core.render.relight.memory import available_bytes, peak_bytes, require_memory, stated_peak
from spectral_core.render.relight.storage import MixtureStorage, Storage
from spectral_core.scene import Scene
from spectral_core.spectra.spectrum import SpectralGrid

WORDS = "STORAGE WIDTH HEIGHT"
LIGHTS = 8
FOUR_K = (3840, 2160)


def storages() -> dict[str, Storage]:
    """By the names that the command line uses."""
    bands = {f"bands{count}": BandStorage(count) for count in (31, 61, 121)}
    return {"dial": MixtureStorage(), **bands, "exact": ExactStorage(SpectralGrid.uniform(380, 780, 10))}


def run(options: Options) -> dict[str, Any]:
    """Each storage is recorded in a fresh process at a size that fits; the statement for 4K is printed beside."""
    if options.extra:
        return _record(options.extra)
    width, height = (240, 136) if options.quick else (640, 360)
    figures: dict[str, Any] = {"lights": LIGHTS, "width": width, "height": height}
    for name, storage in storages().items():
        command = [sys.executable, "-m", "benchmarks", "relight-memory", "--json", name, str(width), str(height)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=900, check=True)
        row = json.loads(done.stdout.splitlines()[-1])
        row["stated_peak_mb"] = peak_bytes(storage, width, height, LIGHTS) / 1e6
        row["kept"] = row["peak_mb"] <= row["stated_peak_mb"]
        row["four_k"] = _four_k(storage)
        figures[name] = row
        print(f"{name:9} stored {row['stored_mb']:7.0f} MB, peak {row['peak_mb']:7.0f} of stated "
              f"{row['stated_peak_mb']:7.0f} MB; 4K: {row['four_k']}")  # fmt: skip
    free = available_bytes()
    figures["available_mb"] = None if free is None else free / 1e6
    figures["holds"] = {f"{name}: no peak above the stated one": figures[name]["kept"] for name in storages()}
    return figures


def _four_k(storage: Storage) -> str:
    try:
        require_memory(storage, FOUR_K, LIGHTS)
    except InvalidInputError as refusal:
        return f"refused: {refusal}"
    return stated_peak(storage, *FOUR_K, LIGHTS)


def _record(arguments: list[str]) -> dict[str, Any]:
    """Record one storage here, rendering in a process of its own; peaks of both, each by the system's own count."""
    import resource

    from spectral_core.render import RenderProcess
    from spectral_core.render.relight.transport import record_transport

    name, *size = arguments
    if name not in storages() or len(size) != 2 or not all(word.isdecimal() for word in size):
        raise UnknownNameError(
            f"{' '.join(arguments)!r}: expected one of {', '.join(storages())}, then width and height in pixels"
        )
    width, height = map(int, size)
    with RenderProcess() as renderer:
        transport = record_transport(_eight_lights(width, height), storages()[name], render=renderer.render)
    kilobyte = 1 if sys.platform == "darwin" else 1024
    peaks = [resource.getrusage(who).ru_maxrss * kilobyte for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return {
        "stored_mb": (transport.channels.nbytes + transport.coverage.nbytes) / 1e6,
        "session_mb": peaks[0] / 1e6, "renderer_mb": peaks[1] / 1e6, "peak_mb": sum(peaks) / 1e6,
    }  # fmt: skip


def _eight_lights(width: int, height: int) -> Scene:
    scene = scenes(width, height, 1)["corner"]
    key = scene.lights[0]
    lights = tuple(replace(key, name=f"light {k}", group=f"light {k}", power_w=50.0 + k) for k in range(LIGHTS))
    return replace(scene, lights=lights, world=replace(scene.world, strength=0.0))
