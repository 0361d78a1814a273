# SPDX-License-Identifier: GPL-3.0-or-later
"""Time from a change of a scene to its first picture in a live view, by kind of change, RGB and spectral.

Ten balls of 10,000 triangles (2,000 with ``--quick``) on a floor, ten materials, an area lamp and a world, seen at
960×540. Four parts: ``session``, from the change to the picture in the session, without Blender; ``counts``, launches
recorded and kernels compiled by kind, which other work on the machine does not change; ``window``, from the change of a
property to the end of the ``view_draw`` that shows it, in a Blender with a window (SPECTRAL_REAL_BLENDER, see
``launch``); ``drag``, from a wanted color that is dragged over a recording to the picture, without a window
(``palette-live``), in the camera view of a 3D view in Solid and Rendered mode, and in an image editor. Each kind is
tried in turn, so that a busy machine slows all alike. Names of parts as arguments run those alone; ``--count N`` tries
each kind N times (200); ``--only KIND,KIND`` measures these in the window alone, ``--transport rgb`` or ``spectral``
one transport.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.palette import palette_live
from benchmarks.viewport.cases.latency_counts import counted
from benchmarks.viewport.cases.latency_scene import CHANGES, HEIGHT, RARE, VIEWPOINTS, WIDTH, balls
from benchmarks.viewport.window import launch
from spectral_core.errors import UnknownNameError
from spectral_core.render.live.link import LiveLink
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import Scene

NUMBERS = ("roughness", "color", "coat", "lamp", "world", "palette cell")
LIMITS_MS = dict.fromkeys((*VIEWPOINTS, *NUMBERS), 120.0) | {"moved": 150.0, "mesh": 150.0}
"""First picture after each kind of change, 99th percentile, of the acceptance."""
RARE_MS = {"object added": 2000.0, "node added": 2000.0}
SPECTRAL_RATIO = 1.5
"""Most of a median in spectral transport over that in RGB."""
DRAG_MS = 50.0
TRANSPORTS = ("rgb", "spectral")
PARTS = ("session", "counts", "window", "drag")
OPTIONS = ("--count N", "--only NAMES", "--transport NAMES")
WORDS = "PART…"


def run(options: Options) -> dict[str, Any]:
    """Print medians and 99th percentiles and return them."""
    figures: dict[str, Any] = {"holds": {}}
    parts = options.lone(OPTIONS)
    for word in parts:
        if word not in PARTS:
            raise UnknownNameError.among("part", word, PARTS)
    for part in parts or PARTS:
        {"session": _session, "counts": _counts, "window": _in_window, "drag": _drag}[part](options, figures)
    return figures


def _count(options: Options) -> int:
    """How often each kind is tried."""
    return options.whole("--count", 3 if options.quick else 200)


def _chosen(options: Options, option: str, names: Sequence[str]) -> list[str]:
    """The names that follow an option, separated by commas; none without it."""
    found = options.word(option, "").split(",") if option in options.extra else []
    if unknown := sorted(set(found) - set(names)):
        raise UnknownNameError(f"{option} {', '.join(unknown)}: expected some of {', '.join(names)}")
    return found


def _session(options: Options, figures: dict[str, Any]) -> None:
    count = _count(options)
    for transport in TRANSPORTS:
        link = LiveLink()
        try:
            found = _measure(link, balls(options.quick, transport), count, max(1, count // 10))
        finally:
            link.close()
        _tell(figures, "session", transport, found)


def _tell(figures: dict[str, Any], where: str, transport: str, found: dict[str, list[dict[str, Any]]]) -> None:
    """Print and keep the times of one transport, and whether each kind keeps its limit."""
    limits = LIMITS_MS | RARE_MS
    for kind, records in found.items():
        times = [record["ms"] for record in records]
        median, high = float(np.median(times)), float(np.percentile(times, 99))
        loads = sum(record["how"] == "loaded" for record in records)
        name = f"{where}, {transport}, {kind}"
        figures[name] = {"median_ms": median, "p99_ms": high, "most_ms": max(times), "loads": loads}
        print(
            f"{where:8} {transport:9} {kind:15} median {median:7.1f} ms  99th {high:7.1f} ms  "
            f"loaded {loads}/{len(records)}{_parts(records)}"
        )
        for record in records:
            if record["ms"] > limits[kind]:
                print(f"{'':8} late: " + ", ".join(f"{key} {_short(value)}" for key, value in record.items()))
        figures["holds"][f"{name}: within {limits[kind]:g} ms"] = high <= limits[kind]
        if transport == "spectral" and kind in LIMITS_MS and f"{where}, rgb, {kind}" in figures:
            ratio = median / figures[f"{where}, rgb, {kind}"]["median_ms"]
            figures[name]["over_rgb"] = ratio
            figures["holds"][f"{name}: within {SPECTRAL_RATIO:g} times of RGB"] = ratio <= SPECTRAL_RATIO


def _short(value: Any) -> str:
    return f"{value:.0f}" if isinstance(value, float) else str(value)


def _parts(records: list[dict[str, Any]]) -> str:
    """Medians of what the time consists of, where it was measured; in words."""
    if not records or "update_ms" not in records[0]:
        return ""
    update, arrived, waited, draws = (
        float(np.median([record[name] for record in records]))
        for name in ("update_ms", "arrived_ms", "waited_ms", "draws")
    )
    return f"; translated {update:.0f} ms, picture after {arrived:.0f} ms, waited {waited:.0f} ms, {draws:.0f} draws"


def _counts(options: Options, figures: dict[str, Any]) -> None:
    rounds = 3 if options.quick else 6
    for transport in TRANSPORTS:
        found = counted(balls(options.quick, transport), CHANGES | RARE, VIEWPOINTS, rounds)
        for kind, counts in found.items():
            name, hows = f"counts, {transport}, {kind}", sorted(set(counts.how))
            figures[name] = {"first": counts.first, "later": counts.later, "how": hows}
            print(
                f"counts   {transport:9} {kind:15} first: {counts.first[0]} recorded, {counts.first[1]} kernels; "
                f"{rounds - 1} later: {counts.later[0]} recorded, {counts.later[1]} kernels; {', '.join(hows)}"
            )
            if kind in LIMITS_MS:
                is_bare = counts.first == counts.later == (0, 0) and "loaded" not in hows
                figures["holds"][f"{name}: nothing is recorded, compiled or loaded"] = is_bare
            if kind == "object added":
                figures["holds"][f"{name}: no kernel is compiled"] = counts.later[1] == 0


def _in_window(options: Options, figures: dict[str, Any]) -> None:
    """A Blender with a window."""
    if not launch.has_window():
        print(f"no window is measured: {launch.MISSING}", file=sys.stderr)
        return
    count = _count(options)
    only = _chosen(options, "--only", [*LIMITS_MS, *RARE_MS])
    transports = _chosen(options, "--transport", TRANSPORTS) or TRANSPORTS
    settings = {"quick": options.quick, "count": count, "rare": max(1, count // 10), "only": only,
                "transports": list(transports)}  # fmt: skip
    told = launch.told_by("latency.py", settings, options, (WIDTH, HEIGHT))
    where = f"Blender {told['version'].split()[0]}"
    print(f"{where}, a view of {told['size'][0]} × {told['size'][1]} pixels")
    for transport, found in told["times"].items():
        _tell(figures, where, transport, found)
        rare = [record for kind in RARE_MS for record in found.get(kind, [])]
        if rare:
            figures["holds"][
                f"{where}, {transport}: the old picture stays, with a word, until a new object or node shows"
            ] = all(record["old"] == record["worded"] for record in rare)
    figures["troubles"] = told["errors"]
    figures["holds"][f"{where}: no errors"] = not told["errors"]
    for text in told["errors"]:
        print(text, file=sys.stderr)


def _drag(options: Options, figures: dict[str, Any]) -> None:
    """Wanted colors that are dragged, without a window and with one."""
    dragged = palette_live.run(options)
    figures["palette-live"] = dragged
    figures["holds"] |= dragged["holds"]
    if not launch.has_window():
        print(f"no window is measured: {launch.MISSING}", file=sys.stderr)
        return
    settings = {"quick": options.quick, "count": _count(options)}
    told = launch.told_by("drag.py", settings, options, (WIDTH, HEIGHT))
    figures["holds"]["no errors while a color is dragged"] = not told["errors"]
    for text in told["errors"]:
        print(text, file=sys.stderr)
    for editor, drags in told["drags"].items():
        if drags:
            _tell_drags(figures, f"Blender {told['version'].split()[0]}, {editor}", drags)


def _tell_drags(figures: dict[str, Any], where: str, drags: list[dict[str, Any]]) -> None:
    names = ("ms", "work_ms", "shown_ms", "idle_ms", "ignored_ms")
    medians = {name: float(np.median([drag[name] for drag in drags])) for name in names}
    relit = sum(drag["relit"] for drag in drags)
    coarse = sum(drag["coarse"] for drag in drags)
    figures[f"{where}, dragged"] = medians | {"relit": relit, "at half the size": coarse, "drags": len(drags)}
    print(
        f"{where}: a wanted color is dragged {len(drags)} times, {relit} re-lit, {coarse} at half the size: "
        f"median {medians['ms']:.1f} ms to the picture ({medians['work_ms']:.1f} ms of it work of the main thread), "
        f"{medians['shown_ms']:.1f} ms to the end of the redraw; a redraw alone {medians['idle_ms']:.1f} ms, "
        f"{medians['ignored_ms']:.1f} ms after a change of the scene that the extension ignores"
    )
    is_kept = medians["shown_ms"] <= DRAG_MS and relit == len(drags)
    figures["holds"][f"{where}: a dragged color is solved, re-lit and drawn in {DRAG_MS:g} ms"] = is_kept


def _measure(link: LiveLink, scene: Scene, count: int, rare: int) -> dict[str, list[dict[str, Any]]]:
    rng = np.random.default_rng(7)
    viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
    show(link, scene, viewpoint)
    kinds = {**VIEWPOINTS, **CHANGES}
    found: dict[str, list[dict[str, Any]]] = {kind: [] for kind in (*kinds, *RARE)}
    for number in range(count + 1):  # the first of each kind may record
        for kind in [*kinds, *(RARE if 0 < number <= rare else ())]:
            start = time.perf_counter()
            if kind in VIEWPOINTS:
                viewpoint = VIEWPOINTS[kind](rng)
            else:
                scene = (CHANGES | RARE)[kind](scene, rng)
            how = show(link, scene, viewpoint)
            if number:
                found[kind].append(
                    {"ms": 1e3 * (time.perf_counter() - start), "how": "" if kind in VIEWPOINTS else how}
                )
    return found


def show(link: LiveLink, scene: Scene, viewpoint: Viewpoint) -> str:
    """Show a change and wait for its first picture; how the change was made."""
    link.show("stage", scene)
    generation = link.look("view", ViewRequest("stage", viewpoint, WIDTH, HEIGHT, 64, 0), lambda: None)
    if not link.wait("view", generation, 300.0):
        raise TimeoutError(f"no picture within 300 s: {link.trouble('view')}")
    shown = link.latest("view")
    assert shown is not None
    return shown.frame.how
