# SPDX-License-Identifier: GPL-3.0-or-later
"""Single-feature scenes against Cycles: agree, agree with a note, wrong with a note, or silently wrong.

``--only PATTERN`` renders the scenes whose name matches (``lamps/*``, ``*sky*``; several may follow), ``--list``
names them. A scene agrees when its error on the ball, on the rest and on the whole is at most 3 %; the error is the
mean absolute difference of 4×4 blocks over the region's mean, with Cycles' own noise taken out. A scene that disagrees
is rendered again with more samples, because its own noise is not known. ``--bad`` prints the scenes that disagree only.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections import Counter
from collections.abc import Iterator
from fnmatch import fnmatch
from typing import Any

from benchmarks import Options
from spectral_core.errors import UnknownNameError

OPTIONS = ("--only PATTERN…", "--list", "--bad")
WORDS = "PATTERN…"
TOLERANCE = 0.03
SAMPLES = 32
MORE = 6
"""Factor on the samples of a scene that disagrees at first."""
AGREES, NOTED, WRONG, SILENT, FAILED = "agrees", "agrees, with a note", "wrong, with a note", "SILENTLY WRONG", "FAILED"


def run(options: Options) -> dict[str, Any]:
    """Print one line per scene and the counts, and return them."""
    import blender_addon
    from benchmarks.render.features import all_features

    blender_addon.register_once()
    features = all_features()
    patterns = [word for word in options.extra if not word.startswith("-")]
    names = [n for n in features if not patterns or any(fnmatch(n, p) or fnmatch(n, f"*/{p}") for p in patterns)]
    if not names:
        raise UnknownNameError(f"no scene is named {' '.join(patterns)}; --list prints all names")
    if "--list" in options.extra:
        print("\n".join(names))
        return {"scenes": len(names)}
    if options.quick and not patterns:
        names = names[:: max(1, len(names) // 6)]
    rows: dict[str, Any] = {}
    for name in names:
        row = rows[name] = _one(features[name], SAMPLES // 4 if options.quick else SAMPLES)
        if row["verdict"] in (WRONG, SILENT) and not options.quick:
            row = rows[name] = _one(features[name], SAMPLES * MORE)
        if "--bad" not in options.extra or row["verdict"] not in (AGREES, NOTED):
            print(
                f"{row['verdict']:20} {name:44} error {row['error']:7.2%}  noise {row['noise']:6.2%}  "
                f"ours/Cycles {row['ratio']:6.3f}  {row['worst']:5} {'; '.join(row['notes'])[:160]}",
                flush=True,
            )
    counts = Counter(row["verdict"] for row in rows.values())
    good = counts[AGREES] + counts[NOTED]
    print(f"\n{len(rows)} scenes: " + ", ".join(f"{counts[k]} {k}" for k in (AGREES, NOTED, WRONG, SILENT, FAILED)))
    share = good / max(1, len(rows))
    return {
        "scenes": rows,
        "counts": dict(counts),
        "share_that_agrees": share,
        "holds": {
            "none silently wrong": counts[SILENT] == 0 and counts[FAILED] == 0,
            "at least 95 % agree": share >= 0.95,
        },
    }


def _one(feature: Any, samples: int) -> dict[str, Any]:
    from benchmarks.render.features.compare import ball_mask, compare, render
    from benchmarks.render.features.stage import Stage
    from blender_addon import jobs

    row: dict[str, Any] = {"error": 1.0, "noise": 0.0, "ratio": 0.0, "worst": "", "notes": []}
    try:
        with quiet():
            stage = Stage(samples * feature.samples)
            feature.build(stage)
            ball = ball_mask(stage)
            jobs.records.clear()
            ours = render("SPECTRAL", 1)
            row["notes"] = [f"{note.subject}: {note.message}" for record in jobs.records for note in record.notes]
            found = compare(ours, [render("CYCLES", seed) for seed in (1, 2)], ball)
    except Exception as error:  # one scene that fails is a finding, not the end of the run
        return {**row, "verdict": FAILED, "notes": [f"{type(error).__name__}: {error}"[:300]]}
    agrees = found.error <= TOLERANCE
    verdict = (NOTED if agrees else WRONG) if row["notes"] else (AGREES if agrees else SILENT)
    worst = max(found.by_region, key=lambda name: found.by_region[name])
    return {**row, "verdict": verdict, "error": found.error, "noise": found.noise, "ratio": found.ratio, "worst": worst}


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Blender's own words on the console go nowhere meanwhile."""
    sys.stdout.flush()
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)
