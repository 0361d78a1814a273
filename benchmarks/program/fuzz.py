# SPDX-License-Identifier: GPL-3.0-or-later
"""Random damage to every file that is read: no foreign exception, no call over 5 s, no memory beyond a budget.

``--seconds N`` or ``--inputs N`` (2000), ``--seed N`` to repeat a run, ``--source TEXT`` for sources whose name holds
it. Input ``i`` follows from the seed and ``i`` alone; ``--only i`` reads that one and shows what happens.
"""

from __future__ import annotations

import math
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.program.cases.fuzz_inputs import Source, damaged, sources

OPTIONS = ("--seconds N", "--inputs N", "--seed N", "--source NAME", "--only INPUT", "--child FIRST:LAST")
MOST_SECONDS = 5.0
"""In processor time, which does not depend on the load of the machine."""
MOST_BYTES = 1 << 30
"""Bytes of memory that a call may use in addition to those of the program before."""
_HANG_SECONDS = 90.0
_START_SECONDS = 600.0
"""Time limit for a child to make its undamaged files, also on a busy machine."""
READY = "READY"


def run(options: Options) -> dict[str, Any]:
    """Feed, watch, count."""
    seed = options.whole("--seed", int.from_bytes(os.urandom(4), "little"))
    inputs = options.whole("--inputs", 300 if options.quick else 2000)
    seconds = options.number("--seconds", math.inf)[0]
    if "--seconds" in options.extra and "--inputs" not in options.extra:
        inputs = 10**9
    wanted = options.word("--source", "")
    if "--only" in options.extra:
        return _show(seed, options.whole("--only", 0), wanted)
    if "--child" in options.extra:
        first, last = map(int, options.word("--child", "0:0").split(":"))
        _child(seed, first, last, wanted)
        return {}
    print(f"seed {seed}", flush=True)
    outcomes = _watched(seed, inputs, time.monotonic() + seconds, wanted)
    kinds = Counter(outcome.partition(":")[0] for _, outcome in outcomes)
    faults = [(index, outcome) for index, outcome in outcomes if outcome not in ("read", "refused")]
    print(f"{len(outcomes)} inputs: " + ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())))
    for index, outcome in faults[:40]:
        print(f"  input {index}: {outcome}")
    # The test is void if no reader refuses the damage, or if all refuse it at once.
    meaningful = kinds["read"] > 0 and kinds["refused"] > kinds["read"]
    return {
        "seed": seed, "inputs": len(outcomes), "outcomes": dict(kinds), "faults": [list(each) for each in faults[:40]],
        "most_seconds": MOST_SECONDS, "most_bytes": MOST_BYTES,
        "holds": {
            f"none of {len(outcomes):,} damaged inputs gave a foreign exception, took {MOST_SECONDS:g} s or 1 GiB": (
                not faults
            ),
            "some inputs are read, and more are refused": meaningful,
        },
        "no_faults": not faults and meaningful,
    }  # fmt: skip


def _chosen(folder: Path, wanted: str) -> tuple[Source, ...]:
    return tuple(source for source in sources(folder) if wanted in source.name)


def _watched(seed: int, inputs: int, deadline: float, wanted: str) -> list[tuple[int, str]]:
    """Outcome of each input. A child reads; one that hangs or crashes is reported and replaced."""
    outcomes: list[tuple[int, str]] = []
    at = 0
    while at < inputs and time.monotonic() < deadline:
        line = [sys.executable, "-m", "benchmarks", "fuzz", "--seed", str(seed), "--child", f"{at}:{inputs}"]
        line += ["--source", wanted] if wanted else []
        child = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        reader = threading.Thread(target=_collect, args=(child, lines), daemon=True)
        reader.start()
        begun, patience = at, _START_SECONDS
        while at < inputs:
            try:
                said = lines.get(timeout=min(patience, max(deadline - time.monotonic(), 0.01) + 1))
            except queue.Empty:
                if time.monotonic() < deadline:
                    outcomes.append((at, f"hang: over {patience:g} s"))
                    at += 1
                break
            if said is None:
                if at < inputs:
                    outcomes.append((at, f"crash: the reading process ended with {child.wait()}"))
                    at += 1
                break
            if said.strip() == READY:
                patience = _HANG_SECONDS
            if said.startswith("OUTCOME "):
                at = int(said.split()[1]) + 1
                outcomes.append((at - 1, said.split(maxsplit=2)[2].strip()))
            if time.monotonic() > deadline:
                break
        child.kill()
        child.wait()
        reader.join()  # the pipe ended with the child; the reader closes it
        if at == begun and outcomes and outcomes[-1][1].startswith("crash") and at == 0:
            break
    return outcomes


def _collect(child: subprocess.Popen[str], lines: queue.SimpleQueue[str | None]) -> None:
    assert child.stdout is not None
    with child.stdout as stream:
        for line in stream:
            lines.put(line)
    lines.put(None)


def _child(seed: int, first: int, last: int, wanted: str) -> None:
    import warnings

    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        chosen = _chosen(Path(folder), wanted)
        print(READY, flush=True)
        for index in range(first, last):
            print(f"OUTCOME {index} {_outcome(chosen, seed, index, Path(folder))}", flush=True)


def _outcome(chosen: tuple[Source, ...], seed: int, index: int, folder: Path) -> str:
    """``read``, ``refused``, or the failure of input ``index``."""
    from spectral_core.errors import SpectralError

    source, path = _prepared(chosen, seed, index, folder)
    before, start, outcome = _peak_bytes(reset=True), time.process_time(), "read"
    try:
        source.read(path)
    except SpectralError:
        outcome = "refused"
    except BaseException as error:
        where = error.__traceback__
        while where is not None and where.tb_next is not None:
            where = where.tb_next
        line = f"{Path(where.tb_frame.f_code.co_filename).name}:{where.tb_lineno}" if where is not None else ""
        outcome = f"foreign: {source.name}: {type(error).__name__} at {line}: {' '.join(str(error).split())[:120]}"
    seconds, taken = time.process_time() - start, _peak_bytes() - before
    if seconds > MOST_SECONDS:
        return f"slow: {source.name}: {seconds:.1f} s"
    if taken > MOST_BYTES:
        return f"memory: {source.name}: {taken / 2**30:.1f} GiB"
    return outcome


def _prepared(chosen: tuple[Source, ...], seed: int, index: int, folder: Path) -> tuple[Source, Path]:
    rng = np.random.default_rng([seed, index])
    source = chosen[int(rng.integers(len(chosen)))]
    place = folder / "input"
    place.mkdir(exist_ok=True)
    for entry in place.iterdir():
        entry.unlink()
    for name, data in source.beside:
        (place / name).write_bytes(data)
    path = place / source.file_name
    path.write_bytes(damaged(source, chosen, rng))
    return source, path


def _peak_bytes(*, reset: bool = False) -> int:
    """Most memory that this process held since the last reset; 0 if the system does not report it."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        text = Path("/proc/self/status").read_text()
    except OSError:
        return 0
    return 1024 * int(text.split("VmHWM:")[1].split()[0])


def _show(seed: int, index: int, wanted: str) -> dict[str, Any]:
    """Read one input; an error is printed with its traceback."""
    with tempfile.TemporaryDirectory() as folder:
        source, path = _prepared(_chosen(Path(folder), wanted), seed, index, Path(folder))
        data = path.read_bytes()
        print(f"{source.name}, {len(data)} bytes: {data[:1500]!r}")
        print(f"read: {source.read(path)}")
    return {}
