# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields and functions that were not used for tuning, against an independent exact marcher: error and time of `auto`.

Twelve fields with seven functions each (steps, one-value peaks, sawtooth, log-scaled, hard-edged opaque, emission).
`auto` is compared at equal measured SNR with uniform midpoint steps, and with the better of the two ways of fixed
steps (midpoint and pre-integrated), in samples and in processor time on one core. A sensor's plan is kept, so the
time of a frame after its first has no pilot in it; that of the first is printed beside. Times are of a picture of 512²
with the same steps: the exact marcher is for small ones, whose launch takes longer than their march. Arguments: names
of fields. ``--draw SEED`` takes twelve other fields with functions drawn by the seed, each at one of the three targets;
``--odd SEED`` twelve odd ones (``cases/odd_fields.py``), with a camera inside them, along an axis, near, or
orthographic.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import Options
from benchmarks.volume.cases import drawn_fields as drawn
from benchmarks.volume.cases import odd_fields as odd
from benchmarks.volume.cases.strange_fields import fields, functions
from benchmarks.volume.cases.volumes import Curve, colors_of
from benchmarks.volume.checks.exact import exact_amounts
from benchmarks.volume.volume_auto import interleaved
from spectral_core.errors import UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.rays import snr_db
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

UNIFORM = (Stepping("uniform", "midpoint", 0.3), Stepping("uniform", "preintegrated", 0.3))
TARGETS = (40.0, 50.0, 60.0)  # dB
TIMED = 512  # pixels
FINEST = 0.01  # voxels, the shortest step
NOISE = 1.03  # of a ratio of processor times
FEWEST_PIECES, MOST_PIECES = 64, 512  # into which the exact march divides a ray's way through a cell
CLEAR_DB = 16.0  # dB by which the exact march is better than the picture, if so many pieces suffice


OPTIONS = ("--draw SEED", "--odd SEED")
WORDS = "FIELD…"


def run(options: Options) -> dict[str, Any]:
    rows = []
    size, pixels = (24, 64) if options.quick else (48, 160)
    rng, suite, names = None, None, list(options.extra)
    for option, fields_and_functions in (("--draw", drawn), ("--odd", odd)):
        if option in names:
            rng, suite = np.random.default_rng(options.whole(option, 0)), fields_and_functions
            at = names.index(option)
            del names[at : at + 2]
    volumes = list(suite.fields(size, rng) if suite and rng else fields(size))
    for name in names:
        if name not in (known := [volume.name for volume in volumes]):
            raise UnknownNameError.among("field", name, known)
    for number, volume in enumerate(volumes):
        asked = list(suite.functions(volume, rng) if suite and rng else functions(volume))
        cameras = list(odd.views(volume, pixels, rng)) if suite is odd and rng else []
        if names and volume.name not in names:
            continue
        renderer = VolumeRenderer(volume)
        fov = None if number % 2 else 30.0
        view = View.around(volume, 23.0 * number + 7, 11.0 + 7 * number, width=pixels, height=pixels, fov_deg=fov)
        for place, (function, transfer) in enumerate(asked):
            view = cameras[place % len(cameras)] if cameras else view
            targets = (TARGETS[(number + place) % 3],) if rng else TARGETS[1:2] if options.quick else TARGETS
            for target in targets:
                rows.append(judge(renderer, view, function, transfer, target))
    return report(rows)


def judge(
    renderer: VolumeRenderer, view: View, function: str, transfer: TransferFunction, target: float
) -> dict[str, Any]:
    """Stated and measured error of one case, and what `auto` takes of fixed steps at equal measured SNR."""
    volume = renderer.volume
    made = plan(renderer, view, transfer, target)
    image = renderer.render(view, transfer, made.stepping)
    exact, own = compared(volume, transfer, view, colors_of(image, transfer))
    measured = snr_db(exact, colors_of(image, transfer) - exact)
    row: dict[str, Any] = {
        "volume": volume.name, "function": function, "db": target, "rule": made.stepping.rule,
        "quadrature": made.stepping.quadrature, "reference_db": own, "stated_db": made.estimate_db,
        "is_bound": made.is_bound, "measured_db": measured, "reached": made.is_reached,
        "plan_frames": made.seconds / max(image.seconds, 1e-9),
    }  # fmt: skip
    row |= costs(Curve(renderer, view, transfer, exact), made.stepping, measured)
    stated = f"{'at least' if made.is_bound else 'stated'} {made.estimate_db:5.1f}"
    print(
        f"{volume.name:11}{function:9}{target:.0f} dB  {made.stepping.rule:8} {made.stepping.quadrature:14}"
        f" {stated}, measured {measured:5.1f} (reference {own:.0f})"
        + "".join(f"  {key} {row[key]:.2f}" for key in ("samples", "time", "time_fixed")),
        flush=True,
    )
    return row


def compared(
    volume: ScalarVolume, transfer: TransferFunction, view: View, colors: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """(exact colors, their own SNR): pieces are halved until they are clearly better than ``colors``."""
    pieces = FEWEST_PIECES
    coarse, fine = (exact_amounts(volume, transfer, view, n) @ transfer.colors for n in (pieces // 2, pieces))
    while (own := snr_db(fine, fine - coarse) + 6.0) < snr_db(fine, colors - fine) + CLEAR_DB and pieces < MOST_PIECES:
        pieces *= 2
        coarse, fine = fine, exact_amounts(volume, transfer, view, pieces) @ transfer.colors
    return fine, own


def costs(curve: Curve, chosen: Stepping, reached: float) -> dict[str, float]:
    """Samples and time of ``chosen`` over fixed steps of the same SNR; the finest where these never reach it."""
    if chosen == replace(UNIFORM[0], scale=chosen.scale):
        return {"samples": 1.0, "time": 1.0, "time_fixed": 1.0, "uniform_reaches": 1.0}
    found = [curve.at(way, reached) for way in UNIFORM]
    able = [at["reached"] >= reached - 0.5 for at in found]
    # For a stepping that never reaches it, the cost of its finest march is used.
    ways = [
        replace(way, scale=at["scale"] if can else FINEST) for way, at, can in zip(UNIFORM, found, able, strict=True)
    ]
    samples, times = curve.point(chosen)[1], _times(curve, [chosen, *ways])
    best = min((t for t, can in zip(times[1:], able, strict=True) if can), default=min(times[1:]))
    return {
        # Uniform steps that miss everything take no samples, and nothing can be divided by their number.
        "samples": samples / max(found[0]["samples"], 1.0) if able[0] else 0.0,
        "time": times[0] / times[1],
        "time_fixed": 1.0 if chosen.rule == "uniform" and any(able) else times[0] / best,
        "uniform_reaches": float(able[0]),
    }


def _times(curve: Curve, ways: list[Stepping]) -> list[float]:
    """Processor seconds of each way on the same view in a large picture."""
    view = curve.view
    scale = TIMED / view.width
    large = replace(view, width=TIMED, height=round(scale * view.height))
    return interleaved(curve.renderer, large, curve.transfer, ways, rounds=3)


def report(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares and medians, and True if they meet the acceptance."""
    # A reference must be better than the picture that it is compared with.
    judged = [row for row in rows if row["reference_db"] > row["measured_db"] + 6.0]
    off = np.array([row["stated_db"] - row["measured_db"] for row in judged])
    bounds = np.array([row["is_bound"] for row in judged])
    # A lower bound is wrong only where the measured value is below it.
    right = np.abs(np.where(bounds, np.maximum(off, 0.0), off)) <= 3
    over = {key: np.array([row[key] for row in judged]) for key in ("time", "time_fixed")}
    # If uniform steps never reach it, there is no reference, and no share of samples.
    matched = [row for row in judged if row["uniform_reaches"]]
    over["samples"] = np.array([row["samples"] for row in matched])
    worst_time = max(row["time"] for row in matched)
    figures: dict[str, Any] = {
        "cases": len(rows),
        "judged": len(judged),
        "stated_within_3_db_percent": float(100 * np.mean(right)),
        "stated_as_a_lower_bound": int(bounds.sum()),
        "stated_within_3_db_percent_without_bounds": float(100 * np.mean(right[~bounds]))
        if not bounds.all()
        else 100.0,
        "most_optimistic_db": float(off.max()),
        "not_reached_and_not_said": sum(row["reached"] and row["measured_db"] < row["db"] - 6 for row in judged),
        "uniform_never_reaches_it": sum(not row["uniform_reaches"] for row in judged),
        "plan_in_frames_median": float(np.median([row["plan_frames"] for row in rows])),
    }
    for key, values in over.items():
        figures |= {f"{key}_median": float(np.median(values)), f"{key}_worst": float(values.max())}
    figures["time_worst_where_uniform_reaches"] = worst_time
    figures["holds"] = {
        "stated within 3 dB in 95 %, never optimistic by more than 6": bool(
            figures["stated_within_3_db_percent"] >= 95 and off.max() <= 6
        ),
        "no case over uniform in samples or time": bool(over["samples"].max() <= 1.0 and worst_time <= NOISE),
        "time median at most 0.6 of uniform": bool(np.median(over["time"]) <= 0.6),
        "time median at most 0.8 of the best fixed way": bool(np.median(over["time_fixed"]) <= 0.8),
    }
    for name, value in figures.items():
        print(f"{name:30} {value if isinstance(value, dict) else round(value, 2)}")
    return figures | {"rows": rows}
