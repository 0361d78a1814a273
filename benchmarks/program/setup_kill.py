# SPDX-License-Identifier: GPL-3.0-or-later
"""Set-up of a fresh clone killed with -9 at random moments: the next set-up makes a whole environment.

After the kills, ``make test`` passes in the clone; with ``--quick`` the commands and one test of each room stand in
for the whole suite. ``--kills N``: 10, or 3 with ``--quick``. ``--seed N`` draws the moments.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

from benchmarks import ROOT, Options

SEED = 20261122
OPTIONS = ("--kills N", "--seed N")
FEW_TESTS = ("tests/package/test_setup.py", "tests/test_commands.py", "tests/lattice", "tests/test_import_rules.py")


def run(options: Options) -> dict[str, Any]:
    """Interrupt set-up, then set up and test."""
    kills = options.whole("--kills", 3 if options.quick else 10)
    seed = options.whole("--seed", SEED)
    clone = options.out.resolve() / "clone"
    shutil.rmtree(clone, ignore_errors=True)
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    began = time.monotonic()
    _set_up(clone)
    whole_s = time.monotonic() - began
    chance, moments = random.Random(seed), []
    # The environment of the first set-up is taken away, so that the first kill meets a set-up from nothing.
    shutil.rmtree(clone / ".venv")
    for _ in range(kills):
        moments.append(_killed_after(clone, chance.uniform(0.0, whole_s)))
    _set_up(clone)
    differing = _differing_packages(clone)
    tests = [".venv/bin/python", "-m", "pytest", "-q", *FEW_TESTS] if options.quick else ["make", "test"]
    done = subprocess.run(tests, cwd=clone, capture_output=True, text=True, env=_environment())
    last_line = (done.stdout.strip().splitlines() or [""])[-1]
    figures: dict[str, Any] = {
        "kills": len(moments), "moments_s": [round(moment, 1) for moment in moments], "seed": seed,
        "whole_set_up_s": round(whole_s, 1), "broken_packages": differing,
        "tests": last_line, "test_status": done.returncode,
    }  # fmt: skip
    figures["holds"] = {"interrupted set-ups leave nothing broken": done.returncode == 0 and not differing}
    for name, value in figures.items():
        print(f"{name:20} {value}")
    return figures


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in {"MAKEFLAGS", "MAKELEVEL", "VIRTUAL_ENV"}}


def _set_up(clone: Path) -> None:
    subprocess.run(["make", "setup"], cwd=clone, check=True, capture_output=True, env=_environment())


def _killed_after(clone: Path, seconds: float) -> float:
    """Start set-up in a group of its own and kill the whole group; return the moment."""
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(
        ["make", "setup"], cwd=clone, stdout=quiet, stderr=quiet, start_new_session=True, env=_environment()
    )
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    return seconds


def _differing_packages(clone: Path) -> list[str]:
    """Names of files that a package's own record lists and that are missing: written by pip, read without it."""
    missing = []
    site = next((clone / ".venv/lib").glob("python*/site-packages"))
    for record in site.glob("*.dist-info/RECORD"):
        for line in record.read_text("utf-8").splitlines():
            name = line.rsplit(",", 2)[0].strip('"')
            if not name.endswith(".pyc") and not (site / name).exists():
                missing.append(name)
    return missing[:10]
