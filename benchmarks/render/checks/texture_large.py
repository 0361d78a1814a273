# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole command ``spectral-scene texture`` on two pictures of 8192 × 8192 texels: memory of all its processes."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.pictures import write_png_rows


def large_picture(path: Path, small: NDArray[Any], size: int, seed: int) -> Path:
    """A photograph (display bytes) enlarged to ``size``², with a grain at every texel so that no two rows are alike."""
    height, width = small.shape[:2]
    columns = np.arange(size) * width // size

    def rows(first: int, last: int) -> NDArray[Any]:
        rng = np.random.default_rng([seed, first])
        display = small[np.arange(first, last) * height // size][:, columns].astype(np.float32) / 255
        display += rng.normal(scale=0.02, size=display.shape[:2]).astype(np.float32)[..., None]
        return np.asarray(np.clip(display, 0, 1) ** 2.2)

    write_png_rows(path, (size, size), rows)
    return path


def tree_memory(root: int) -> int:
    """Bytes of memory of a process and all that it started (proportional set size where the system tells)."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, IndexError, ValueError):
                continue
            children.setdefault(parent, []).append(int(entry.name))
    waiting, total = [root], 0
    while waiting:
        process = waiting.pop()
        waiting += children.get(process, [])
        try:
            lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
            total += 1024 * next(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
        except (OSError, StopIteration):
            continue
    return total


def measured(pictures: list[Path], out: Path, arguments: tuple[str, ...] = ()) -> dict[str, Any]:
    """Run the command; seconds, peak memory in GB, the lines of progress, and its figures."""
    command = [sys.executable, "-m", "spectral_core.cli", "texture", *map(str, pictures), "--out", str(out)]
    started = time.perf_counter()
    peak = 0
    log = (out.parent / "large.log").open("w+b")
    process = subprocess.Popen([*command, "--progress", "--json", *arguments], stdout=log, stderr=subprocess.STDOUT)
    while process.poll() is None:
        peak = max(peak, tree_memory(process.pid))
        time.sleep(0.05)
    seconds = time.perf_counter() - started
    log.seek(0)
    words = log.read().decode()
    log.close()
    if process.returncode:
        raise RuntimeError(words[-2000:])
    steps = [line.split(maxsplit=2)[1:] for line in words.splitlines() if line.startswith("progress ")]
    shares = [float(share) for share, _ in steps]
    return {
        "seconds": seconds, "peak_gb": peak / 1e9, "steps": len(steps), "rising": shares == sorted(shares),
        "figures": json.loads(words.splitlines()[-1]),
    }  # fmt: skip
