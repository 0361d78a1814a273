# SPDX-License-Identifier: GPL-3.0-or-later
"""Times: 512² at 60 dB, a transfer function edit to a new picture, and a 1024³ uint8 field within 4 GB.

Wall times are the least of several; on a busy machine processor seconds over two cores tell more, so both stand.
Arguments: ``large`` adds the 1024³ field (some minutes and 4 GB); a volume name replaces embryo (256³).
"""

from __future__ import annotations

import resource
import time
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.volume.cases.volumes import all_volumes, shared_data
from spectral_core.errors import UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.plan import plan
from spectral_core.volume.presets import preset
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.samples import sample_volume
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

WORDS = "VOLUME large"


def run(options: Options) -> dict[str, Any]:
    names = [word for word in options.extra if word != "large"] or ["embryo"]
    if len(names) > 1:
        raise UnknownNameError(f"{' '.join(names)!r}: expected one volume, and large for the largest one, too")
    known = next(all_volumes(names=names)) if shared_data() and not options.quick else None
    volume = known or sample_volume("shells", 48 if options.quick else 256)
    size = 64 if options.quick else 512
    start = time.perf_counter()
    renderer = VolumeRenderer(volume)
    renderer.statistics("error")
    figures: dict[str, Any] = {"volume": volume.name, "voxels": volume.data.size}
    figures["prepare_ms"] = 1e3 * (time.perf_counter() - start)
    for function in ("wide", "narrow", "opaque"):
        transfer = preset(function, volume)
        view = View.around(volume, 33.0, 21.0, width=size, height=size)
        made = plan(renderer, view, transfer, 60.0)
        wall, processor = least(lambda t=transfer, v=view, m=made: renderer.render(v, t, m.stepping))
        edit, edit_processor = least(lambda t=transfer, v=view, m=made: edited(renderer, t, v, m.stepping))
        figures |= {f"{function}_60_db_ms": wall, f"{function}_processor_ms": processor, f"{function}_edit_ms": edit}
        how = f"{volume.name} {function:7} {made.stepping.rule}/{made.stepping.quadrature} {made.estimate_db:.1f} dB"
        planned, plan_processor = least(lambda t=transfer, v=view: edited(renderer, t, v))
        figures[f"{function}_edit_and_plan_ms"] = planned
        print(f"{how}: {wall:.1f} ms ({processor:.1f} of processor), edit {edit:.1f} ms ({edit_processor:.1f}), "
              f"edit with a new plan {planned:.1f} ms ({plan_processor:.1f})")  # fmt: skip
    figures |= large() if "large" in options.extra else {}
    figures["holds"] = {
        "from an edit of the transfer function to its picture in 250 ms": all(
            figures[f"{function}_edit_ms"] < 250 for function in ("wide", "narrow", "opaque")
        )
    }
    if "large" in options.extra:
        figures["holds"]["a field of 1024³ voxels is rendered with 4 GB"] = figures["large_peak_gb"] < 4
    return figures


def edited(renderer: VolumeRenderer, before: TransferFunction, view: View, stepping: Any = None) -> None:
    """Time after a moved knot: a new function, its tables and step grid, and the picture; without steps, a plan too."""
    transfer = before.scaled(1.0 + 0.01 * np.random.default_rng().random())
    renderer.render(view, transfer, stepping or plan(renderer, view, transfer, 60.0).stepping)


def least(work: Any, rounds: int = 7) -> tuple[float, float]:
    """Least wall and processor milliseconds of ``work``; the first call compiles and does not count."""
    work()
    wall, processor = np.inf, np.inf
    for _ in range(rounds):
        start, busy = time.perf_counter(), time.process_time()
        work()
        wall, processor = min(wall, time.perf_counter() - start), min(processor, time.process_time() - busy)
    return 1e3 * wall, 1e3 * processor


def large() -> dict[str, float]:
    """A 1024³ uint8 field of shells, made in place, through to a picture; peak memory of the whole process."""
    n = 1024
    data = np.empty((n, n, n), np.uint8, order="F")
    line = (np.linspace(-1, 1, n, dtype=np.float32)) ** 2
    for z in range(n):
        radius = np.sqrt(line[:, None] + line[None, :] + line[z])
        data[:, :, z] = np.where(radius < 0.95, 127 + 120 * np.cos(25 * radius), 0).astype(np.uint8)
    data.setflags(write=False)
    volume = ScalarVolume("shells 1024", data)
    start = time.perf_counter()
    renderer = VolumeRenderer(volume)
    renderer.statistics("error")
    ready = time.perf_counter() - start
    transfer = preset("wide", volume, 0.1)
    view = View.around(volume, 33.0, 21.0, width=512, height=512)
    made = plan(renderer, view, transfer, 50.0)
    wall, processor = least(lambda: renderer.render(view, transfer, made.stepping), 3)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"1024³ uint8: ready in {ready:.1f} s, {wall:.0f} ms at 50 dB ({processor:.0f} ms of processor), "
          f"peak memory {peak:.2f} GB")  # fmt: skip
    return {"large_ready_s": ready, "large_ms": wall, "large_peak_gb": peak}
