# SPDX-License-Identifier: GPL-3.0-or-later
"""Run, resume or extend a sweep: many settings of a scene, a palette, a volume, a function or a program.

A second run computes only the missing points. A larger --budget adds points, a smaller region reuses those inside.
``spectral-scene explore FOLDER`` opens the result.
"""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path
from typing import Any

from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError, MissingDependencyError, counted

MOST_SHARES = 100_000
"""Commands of an array job: schedulers take fewer."""
NAMED = {"the budget": "--budget"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of ``spectral-scene sweep``."""
    parser.add_argument("sweep", type=Path, metavar="SWEEP.toml", help="document of the sweep; see examples/sweeps")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="the store; default: the file's name and .cdb, here")
    parser.add_argument(
        "--budget",
        type=int,
        metavar="M",
        help="this many points, instead of the file's number; points that the folder already has stay",
    )
    parser.add_argument("--plan", action="store_true", help="print the plan, write nothing, and stop")
    parser.add_argument(
        "--pending",
        action="store_true",
        help="compute the listed but missing points of the folder, such as points added by its page",
    )
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes that compute points (default 1)")
    parser.add_argument("--retry", action="store_true", help="try points again that were set aside")
    elsewhere = parser.add_mutually_exclusive_group()
    elsewhere.add_argument("--dask", metavar="tcp://HOST:PORT", help="compute on a running dask cluster")
    elsewhere.add_argument(
        "--shell", type=int, metavar="K", help="print K commands, for an array job, that share the points"
    )
    elsewhere.add_argument("--share", metavar="I/K", help="compute share I of K, as --shell prints it")
    elsewhere.add_argument("--collect", action="store_true", help="only collect the points that shares computed")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    ignored = {"budget": "--pending takes the points that the folder lists"} if arguments.pending else {}
    if arguments.plan:
        names = ("retry", "workers", "dask", "shell", "share", "collect")
        ignored |= dict.fromkeys(names, "--plan computes nothing")
    elif arguments.share is not None:
        ignored |= dict.fromkeys(("budget", "pending", "retry", "workers"), "a share computes what --shell has listed")
    elif arguments.shell is not None or arguments.collect or arguments.dask:
        ignored["workers"] = "no process of this machine computes"
    if arguments.collect and not arguments.plan:
        ignored |= dict.fromkeys(("budget", "pending"), "--collect takes the points that shares computed")
    return ignored


def run(arguments: argparse.Namespace) -> int:
    """Open or make the store, plan, run, report."""
    from spectral_core.explore.sweep.document import read_sweep
    from spectral_core.explore.sweep.sweep import Sweep, planned_apart

    if arguments.workers < 1:
        raise InvalidInputError(f"--workers is {arguments.workers}; expected 1 or more")
    if arguments.shell is not None and not 1 <= arguments.shell <= MOST_SHARES:
        raise InvalidInputError(f"--shell is {arguments.shell}; expected 1 to {MOST_SHARES} commands")
    folder = arguments.out or Path(arguments.sweep.stem + ".cdb")
    document = read_sweep(arguments.sweep)
    _require_listed(arguments, folder)
    if arguments.plan:
        with planned_apart(document, folder) as apart:
            plan = apart.pending() if arguments.pending else apart.plan(arguments.budget)
        return _say(arguments, folder, plan)
    with closing(Sweep(document, folder)) as sweep:
        return _work(arguments, sweep, folder)


def _require_listed(arguments: argparse.Namespace, folder: Path) -> None:
    """Raise InvalidInputError if listed points are to be computed or collected in a folder that lists none."""
    from spectral_core.explore.sweep.store import cdb_folder

    wanted = [name for name in ("pending", "share", "collect") if getattr(arguments, name) not in (None, False)]
    if wanted and not (cdb_folder(folder) / "project.json").is_file():
        raise InvalidInputError(
            f"--{wanted[0]} takes points that a folder lists, and {cdb_folder(folder)} holds no sweep; check the "
            "folder's name, or list the points first, with --shell or by a run without this option"
        )


def _work(arguments: argparse.Namespace, sweep: Any, folder: Path) -> int:
    if arguments.share is not None:
        return _share(arguments, sweep)
    sweep.store.recover()
    if arguments.retry:
        again = sweep.store.ledger.retry_failed()
        print(counted(again, "point that was set aside is tried", "points that were set aside are tried"), "again")
    if arguments.collect:
        return _collect(arguments, sweep, folder)
    plan = sweep.pending() if arguments.pending else sweep.plan(arguments.budget)
    if arguments.shell is not None:
        return _say(arguments, folder, plan, lambda: _print_shell(arguments, folder))
    return _say(arguments, folder, plan, lambda: _run(arguments, sweep, plan))


def _collect(arguments: argparse.Namespace, sweep: Any, folder: Path) -> int:
    """Write the table. Once no point is missing, compare them with the reference and name what failed, as after a run.

    No point is added to the list: shares that start later compute what is missing of it.
    """
    plan = sweep.listed()
    if plan.new:
        return _say(arguments, folder, plan, sweep.store.write_table)
    return _say(arguments, folder, plan, lambda: _run(arguments, sweep, plan))


def _say(arguments: argparse.Namespace, folder: Path, plan: Any, work: Callable[[], Any] | None = None) -> int:
    """Print the plan, do the work, print the figures; the status of the command."""
    from spectral_core.explore.sweep.store import cdb_folder

    for line in plan.lines:
        print(line)
    done = work() if work is not None else None
    result = {"folder": str(cdb_folder(folder)), "points": len(plan.keys), "new": plan.new, "reused": plan.reused}
    if isinstance(done, dict):
        result |= done
    if arguments.json:
        print_json(result)
    return 1 if any(result.get(name) for name in ("failed", "cancelled", "not_compared", "not_computed")) else 0


def _run(arguments: argparse.Namespace, sweep: Any, plan: Any) -> dict[str, Any]:
    from spectral_core.explore.sweep.store import not_finite_note

    executor, flying = _dask(arguments.dask) if arguments.dask else (None, None)
    last = 0.0

    def show(progress: Any) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last > 1.0 or progress.done + progress.failed == progress.total:
            last = now
            left = "" if progress.seconds_left is None else f", about {progress.seconds_left:.0f} s left"
            failed = f", {progress.failed} set aside" if progress.failed else ""
            print(f"{progress.done} of {progress.total}{failed}{left}", file=sys.stderr)

    report = sweep.run(plan, executor=executor, workers=arguments.workers, in_flight=flying, on_progress=show)
    print(f"{report.computed} computed in {report.seconds:.1f} s, {report.reused} reused, {report.recovered} recovered")
    for reason, count in report.reasons():
        print(f"{count} set aside: {reason}")
    print(f"table: {sweep.store.folder / 'data.csv'}")
    for name, count in report.not_finite.items():
        print(f"note: {not_finite_note(name, count, len(plan.keys) - len(report.failures))}", file=sys.stderr)
    if report.not_compared:
        print(f"the points are not compared with the reference: {report.not_compared}", file=sys.stderr)
    for name, reason in report.not_computed.items():
        print(f"the column {name!r} is not computed: {reason}", file=sys.stderr)
    return {
        "computed": report.computed, "recovered": report.recovered, "seconds": round(report.seconds, 3),
        "computing_seconds": round(report.computing_seconds, 3), "failed": len(report.failures),
        "failures": report.failures, "cancelled": report.cancelled, "not_compared": report.not_compared,
        "not_computed": report.not_computed, "not_finite": report.not_finite,
    }  # fmt: skip


def _dask(address: str) -> tuple[Executor, int]:
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingDependencyError.package("distributed", "computing on a dask cluster", "dask") from error
    try:
        client = Client(address, timeout=20)
    except (OSError, ValueError, TimeoutError) as error:
        raise InvalidInputError(f"no dask scheduler answers at {address}: {error}") from error
    threads = sum(client.nthreads().values()) or 1
    return client.get_executor(pure=False), 2 * threads


def _print_shell(arguments: argparse.Namespace, folder: Path) -> None:
    """Commands for any scheduler: each computes its share, then one collects."""
    own = [*arguments.program, "sweep", str(arguments.sweep.absolute()), "--out", str(folder.absolute())]
    for number in range(1, arguments.shell + 1):
        print(shlex.join([*own, "--share", f"{number}/{arguments.shell}"]))
    print(shlex.join([*own, "--collect"]))


def _share(arguments: argparse.Namespace, sweep: Any) -> int:
    """Compute a share of the pending points in this process; a point that fails is left for the driver's list."""
    from spectral_core.explore.sweep.task import compute_point

    try:
        number, count = (int(word) for word in arguments.share.split("/"))
    except ValueError:
        number, count = 0, 0
    if not 1 <= number <= count:
        raise InvalidInputError(f"--share is {arguments.share!r}; expected I/K with I from 1 to K")
    store, failed = sweep.store, 0
    # by place in the design: shares start at different times, and a point that was collected must not move the others
    pending = [row for row in store.ledger.rows("pending") if row.ordinal % count == number - 1]
    for row in pending:
        try:
            compute_point(sweep.node, row.parameters, store.project.seed, row.key, store.address())
        except Exception as error:
            failed += 1
            print(f"{row.key}: {type(error).__name__}: {error}", file=sys.stderr)
    print(f"{counted(len(pending) - failed, 'point')} computed, {failed} failed")
    if arguments.json:
        print_json({"computed": len(pending) - failed, "failed": failed})
    return 1 if failed else 0
