# SPDX-License-Identifier: GPL-3.0-or-later
"""A scripted session of work in a Blender with a window: how long does the extension hold up the interface?

A scene of 80,000 triangles in Rendered mode, a palette, all panels open; a script orbits, edits numbers, lamps, objects
and meshes, drags wanted colors, applies, undoes, plays frames, renders, records and turns the dial, opens files, in
random order (``--seed``), for ``--minutes`` (60; 2 with ``--quick``). Every call of the extension on Blender's main
thread is timed to its return; those are listed by their longest, in processor time, which other programs on the machine
do not change, and on the clock. ``queued``: time of the longest call in which no processor was free (Linux);
``apart``: longest without that, which other programs change little. Calls of more than 60 ms are listed with the time
since the last tick in which a virtual machine's host gave a processor to others. Of a call of more than 0.12 s, the
places of all threads in its course are printed. SPECTRAL_REAL_BLENDER as in ``launch``.
"""

from __future__ import annotations

import sys
from typing import Any

from benchmarks import Options
from benchmarks.viewport.window import launch
from spectral_core.errors import MissingDependencyError

OPTIONS = ("--minutes N", "--seed N")
LIMIT_MS = 100.0
SHOWN = 25


def run(options: Options) -> dict[str, Any]:
    """Print the trace and return it."""
    if not launch.has_window():
        raise MissingDependencyError(f"nothing is measured: {launch.MISSING}")
    minutes, seed = options.number("--minutes", 2 if options.quick else 60)[0], options.whole("--seed", 1)
    told = launch.told_by("stalls.py", {"minutes": minutes, "seed": seed}, options, (1500, 900))
    for text in told["errors"]:
        print(text, file=sys.stderr)
    functions, ticks = told.get("functions", {}), told.get("ticks", {})
    print(f"Blender {told['version']}, {told.get('minutes', 0):.1f} minutes, {told.get('steps')} steps, seed {seed}")
    head = f"{'work ms':>8} {'clock ms':>8} {'queued':>7} {'apart':>7} {'median':>7} {'calls':>6}"
    print(f"{head}  function, step with the most work, step that took longest")
    for name, found in sorted(functions.items(), key=lambda item: -item[1]["work_ms"])[:SHOWN]:
        print(f"{found['work_ms']:8.1f} {found['clock_ms']:8.1f} {found['queued_ms']:7.1f} {found['apart_ms']:7.1f} "
              f"{found['median_ms']:7.2f} {found['calls']:6}  {name} ({found['at']}, {found['slow_at']})")  # fmt: skip
    if ticks:
        print(f"a timer every 10 ms: {ticks['number']} gaps, median {ticks['median_ms']:.0f} ms, 99th "
              f"{ticks['p99_ms']:.0f} ms; from so many ms on: {ticks['histogram']}")  # fmt: skip
        for gap, own, step, _ in ticks["longest"]:
            print(f"  gap of {gap:.0f} ms at {step!r}, {own:.0f} ms of it within the extension")
        for gap, own, step, calls in ticks["own"]:
            parts = ", ".join(f"{name} {took:.0f} ms" for took, name in calls)
            print(f"  {own:.0f} ms within the extension at {step!r}, in a gap of {gap:.0f} ms: {parts}")
    for call in told.get("slow", ()):
        spent = (
            f"{call['work_ms']:.0f} of work, {call['queued_ms']:.0f} queued, {call['host_took_ms']:.0f} at most taken"
        )
        print(f"  {call['clock_ms']:.0f} ms: {spent} by the host: {call['name']} at {call['step']!r}")
    for call in told.get("stood", ()):
        print(f"{call['clock_ms']:.0f} ms in {call['name']} at {call['step']!r}, {call['pages_read']} pages read from "
              f"disk; the threads in its course:\n{call['threads']}")  # fmt: skip
    for text, count in told["refused"].items():
        print(f"refused {count} times: {text}")
    work = max((found["work_ms"] for found in functions.values()), default=float("nan"))
    clock = max((found["clock_ms"] for found in functions.values()), default=float("nan"))
    apart = max((found["apart_ms"] for found in functions.values()), default=float("nan"))
    together = max((own for _, own, *_ in ticks.get("own", ())), default=float("nan"))
    holds = {
        f"no call of the extension takes more than {LIMIT_MS:g} ms of processor time": work <= LIMIT_MS,
        f"no call takes more than {LIMIT_MS:g} ms apart from waiting for a free processor": apart <= LIMIT_MS,
        f"no call of the extension takes more than {LIMIT_MS:g} ms on the clock": clock <= LIMIT_MS,
        f"all calls between two ticks together take at most {LIMIT_MS:g} ms on the clock": together <= LIMIT_MS,
        "no errors": not told["errors"],
    }
    return told | {"most_work_ms": work, "most_clock_ms": clock, "holds": holds}
