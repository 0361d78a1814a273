# SPDX-License-Identifier: GPL-3.0-or-later
"""A sweep on a dask LocalCluster of four workers, two of which are killed: complete, with the same rows."""

from __future__ import annotations

import os
import shutil
import signal
import threading
import time
from typing import Any

from benchmarks import Options
from benchmarks.explore.sweep_kill import command_of, command_run, rows_of
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.sweep import Sweep


def run(options: Options) -> dict[str, Any]:
    """Sweep with dask while two workers die, then with threads of this machine, and compare the tables."""
    from distributed import Client, LocalCluster

    points, pause = (40, 0.05) if options.quick else (500, 0.05)
    folder = options.out.resolve()
    for name in ("dask", "whole"):
        shutil.rmtree(folder / f"{name}.cdb", ignore_errors=True)
        (folder / f"{name}.log").unlink(missing_ok=True)
    command_of(folder, "dask", points, pause)
    sweep = Sweep(read_sweep(folder / "dask.toml"), folder / "dask")
    killed: list[int] = []
    start = time.perf_counter()
    with (
        LocalCluster(n_workers=4, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        victims = list(client.run(os.getpid).values())[:2]
        stop = threading.Event()

        def kill() -> None:
            while sweep.store.ledger.states() and not stop.is_set() and len(killed) < 2:
                done = sum(state == "done" for state in sweep.store.ledger.states().values())
                if done > (1 + len(killed)) * points // 4:
                    os.kill(victims[len(killed)], signal.SIGKILL)
                    killed.append(victims[len(killed)])
                time.sleep(0.05)

        plan = sweep.plan()
        watcher = threading.Thread(target=kill, daemon=True)
        watcher.start()
        report = sweep.run(plan, executor=client.get_executor(pure=False), in_flight=8)
        stop.set()
        watcher.join()
    seconds = time.perf_counter() - start
    command_run(folder, "whole", points, 0.0)
    first, second = rows_of(folder / "dask.cdb"), rows_of(folder / "whole.cdb")
    figures: dict[str, Any] = {
        "points": points, "killed_workers": len(killed), "rows": len(first), "rows_equal": first == second,
        "failed": len(report.failures), "seconds": round(seconds, 1),
    }  # fmt: skip
    figures["holds"] = {
        "complete with the same rows after two workers died": bool(first == second and len(killed) == 2)
    }
    for name, value in figures.items():
        print(f"{name:18} {value}")
    return figures
