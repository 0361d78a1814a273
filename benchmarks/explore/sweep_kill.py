# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers and workers of a sweep killed with -9 at random moments: no loss, few points computed twice.

The driver holds the ledger, so that its death is the ledger's. ``starts`` counts how often a point was begun: each
kill of a worker costs the point at hand, which must be begun again. ``completed`` counts how often it was computed to
the end.
"""

from __future__ import annotations

import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks import Options
from spectral_core.explore.sweep.cinema import check_folder
from spectral_core.explore.sweep.store import TIMING_COLUMN, Store

WORKERS = 2


def run(options: Options) -> dict[str, Any]:
    """Sweep twice, with and without kills, and compare."""
    kills, points, pause = (6, 40, 0.1) if options.quick else (50, 300, 0.25)
    folder = options.out.resolve()
    for name in ("killed", "whole"):
        shutil.rmtree(folder / f"{name}.cdb", ignore_errors=True)
        (folder / f"{name}.log").unlink(missing_ok=True)
    killed = _Killed(folder, points, pause)
    tally = killed.until(kills)
    command_run(folder, "whole", points, 0.0)
    first, second = (rows_of(folder / f"{name}.cdb") for name in ("killed", "whole"))
    counts = Counter((folder / "killed.log").read_text().splitlines())
    starts = [count for line, count in counts.items() if line.startswith("start ")]
    ends = [count for line, count in counts.items() if line.startswith("end ")]
    torn = [str(p.name) for p in (folder / "killed.cdb").rglob(".spectral-unfinished-*")] + check_folder(
        folder / "killed.cdb"
    )
    torn += _unreadable(folder / "killed.cdb")
    with Store.open(folder / "killed.cdb") as store:
        aside = len(store.ledger.rows("failed"))
    figures: dict[str, Any] = {
        "kills": sum(tally.values()), "killed_drivers": tally["driver"], "killed_workers": tally["worker"],
        "points": points, "rows": len(first), "rows_equal": first == second, "half_written": torn[:5],
        "most_completed": max(ends), "most_starts": max(starts), "begun_twice_or_more": sum(c > 1 for c in starts),
        "completed_twice": sum(c > 1 for c in ends), "set_aside": aside,
    }  # fmt: skip
    figures["holds"] = {
        "the table equals the uninterrupted one": bool(first == second and len(first) == points),
        "no file half-written": not torn,
        "no point rendered more than twice": max(ends) <= 2,
    }
    for name, value in figures.items():
        print(f"{name:24} {value}")
    return figures


class _Killed:
    """A sweep whose processes are killed at random."""

    def __init__(self, folder: Path, points: int, pause: float) -> None:
        self.folder, self.points, self.pause = folder, points, pause
        self.random = random.Random(7)

    def until(self, kills: int) -> Counter[str]:
        tally: Counter[str] = Counter()
        while sum(tally.values()) < kills:
            driver = _start(self.folder, "killed", self.points, self.pause)
            while driver.poll() is None and sum(tally.values()) < kills:
                time.sleep(self.random.uniform(0.05, 2.0))
                workers = _children(driver.pid)
                if not workers and self.random.random() < 0.7:  # mostly wait until there is something to lose
                    continue
                choice = self.random.choice(["driver", *["worker"] * len(workers)])
                victim = driver.pid if choice == "driver" else self.random.choice(workers)
                try:
                    os.kill(victim, signal.SIGKILL)
                except ProcessLookupError:
                    continue
                tally[choice] += 1
            if driver.poll() == 0:
                break
            if sum(tally.values()) < kills:
                driver.wait()
        if driver.poll() is None:
            driver.wait()
        command_run(self.folder, "killed", self.points, self.pause)
        return tally


def _children(pid: int) -> list[int]:
    try:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
        for task in Path(f"/proc/{pid}/task").iterdir():
            text += " " + (task / "children").read_text()
    except OSError:
        return []
    return sorted({int(word) for word in text.split()})


def command_of(folder: Path, name: str, points: int, pause: float) -> list[str]:
    document = folder / f"{name}.toml"
    place = Path(__file__).parent / "cases" / "kill.py"
    log = json.dumps(str(folder / f"{name}.log"))
    document.write_text(
        f"""[compute]
kind = "function"
function = {json.dumps(f"{place}:work")}
fixed = {{log = {log}, pause = {pause}}}
[design]
budget = {points}
[[parameters]]
name = "a"
low = 0.0
high = 1.0
[[parameters]]
name = "b"
low = 1.0
high = 50.0
scale = "log"
"""
    )
    return [sys.executable, "-m", "spectral_core.cli", "sweep", str(document), "--out", str(folder / name), "--workers",
            str(WORKERS)]  # fmt: skip


def _start(folder: Path, name: str, points: int, pause: float) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        command_of(folder, name, points, pause), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def command_run(folder: Path, name: str, points: int, pause: float) -> None:
    subprocess.run(command_of(folder, name, points, pause), check=True, capture_output=True)


def rows_of(folder: Path) -> list[dict[str, str]]:
    """Rows without their times, keys and file names, which hold what differs between the two: the log's name."""
    with (folder / "data.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    left_out = {TIMING_COLUMN, "key", "FILE", "FILE_linear"}
    return [{name: value for name, value in row.items() if name not in left_out} for row in rows]


def _unreadable(folder: Path) -> list[str]:
    from spectral_core.explore.features.picture_files import read_linear

    bad = []
    for path in (folder / "image").iterdir():
        try:
            read_linear(path)
        except Exception as error:
            bad.append(f"{path.name}: {error}")
    return bad
