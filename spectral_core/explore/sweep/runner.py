# SPDX-License-Identifier: GPL-3.0-or-later
"""Running a sweep: pending points to an executor, outcomes to the ledger, failures retried once, then set aside.

Any ``concurrent.futures`` executor can be used, because the store owns the data, not the executor. Running again
computes only missing points, however the last run ended.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Any

from spectral_core.child import cores
from spectral_core.errors import InvalidInputError, MissingDependencyError, RenderError, SpectralError
from spectral_core.explore.sweep.files import DRIVER_LOCK, only_holder
from spectral_core.explore.sweep.ledger import Pace
from spectral_core.explore.sweep.outcome import ComputeNode, worker_command, worker_prelude
from spectral_core.explore.sweep.pool.executor import KILLED_FROM_OUTSIDE, WorkerDied, WorkerPool
from spectral_core.explore.sweep.store import Store
from spectral_core.explore.sweep.task import OutcomeNotStored, Receipt, compute_point, spooled_record

MAX_FAILURES = 2
"""Attempts that end with an error or a crash before a point is set aside: the first, and one elsewhere."""
MAX_KILLS = 5
"""Attempts that were killed from outside before a point is set aside; the next run takes it up again."""
TABLE_EVERY_S = 15.0


@dataclass(frozen=True, slots=True)
class SweepProgress:
    """Progress of a run. ``seconds_left`` is None until a point is done."""

    done: int
    failed: int
    total: int
    running: int
    seconds: float
    seconds_left: float | None


@dataclass(slots=True)
class SweepReport:
    """Result of a run. ``computed`` counts points of this run, ``reused`` those that were done before."""

    total: int = 0
    computed: int = 0
    reused: int = 0
    recovered: int = 0
    seconds: float = 0.0
    computing_seconds: float = 0.0
    cancelled: bool = False
    failures: dict[str, str] = field(default_factory=dict)
    """Reason of each point that is set aside, by key."""
    not_compared: str = ""
    """Why the pictures were not compared with the reference of the document; "" if they were, or it names none."""
    not_computed: dict[str, str] = field(default_factory=dict)
    """Why columns of the document's expressions are empty or absent, by name."""
    not_finite: dict[str, int] = field(default_factory=dict)
    """At how many points a column has no finite value, so that the table has no number there, by column."""

    def reasons(self) -> list[tuple[str, int]]:
        """Reasons of failures and how many points each has, most first."""
        return Counter(reason.splitlines()[0][:200] for reason in self.failures.values()).most_common()


def run_sweep(
    store: Store,
    node: ComputeNode,
    *,
    keys: Iterable[str] | None = None,
    executor: Executor | None = None,
    workers: int = 1,
    in_flight: int | None = None,
    linear: bool = True,
    on_progress: Callable[[SweepProgress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SweepReport:
    """Compute the points of a store that are not done.

    Parameters
    ----------
    store : the store; its points are entered already.
    node : computes a point; it has the fingerprint of the store's project.
    keys : only these rows; all by default.
    executor : computes the points; ``workers`` processes that keep loaded data by default.
    workers : number of processes where no executor is given.
    in_flight : points handed out at once; by default twice the workers of the executor, if it reports them.
    linear : also store linear pictures (EXR).
    on_progress : called after each point.
    should_stop : called a few times a second; if true, the points in progress are abandoned.

    Raises
    ------
    InvalidInputError : another process runs this sweep, or the node is not the one that the store was made with.
    """
    if node.fingerprint != store.project.fingerprint:
        raise InvalidInputError(
            "the swept scene or program has changed since this folder was made, so its rows would not fit together; "
            "name another folder for the new sweep"
        )
    with only_holder(store.folder / DRIVER_LOCK, f"the sweep in {store.folder}"):
        own = None
        if executor is None:
            command, prelude = worker_command(node), worker_prelude(node)
            executor = own = WorkerPool(workers, command=command, threads=_threads_each(workers), prelude=prelude)
        run = _Run(store, node, executor, in_flight or _capacity(executor, workers), linear)
        try:
            return run.all(keys, on_progress, should_stop)
        finally:
            if own is not None:
                own.shutdown(wait=False)


def _threads_each(workers: int) -> int | None:
    return max(1, cores() // max(1, workers)) if workers > 1 else None


def _capacity(executor: Executor, workers: int) -> int:
    if isinstance(executor, WorkerPool):
        return executor.workers
    return 2 * int(getattr(executor, "_max_workers", max(workers, 8)))


def text_of(error: Exception) -> str:
    """Text of the error of a point, whose code may be a user's: the ledger holds no half of a surrogate pair."""
    text = str(error) if isinstance(error, SpectralError) else f"{type(error).__name__}: {error}"
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


class _Run:
    """The state of one run."""

    def __init__(self, store: Store, node: ComputeNode, executor: Executor, capacity: int, linear: bool) -> None:
        self.store, self.node, self.executor, self.capacity = store, node, executor, capacity
        self.address = store.address(linear=linear)
        self.report = SweepReport()
        self.flying: dict[Future[Any], str] = {}
        self.queue: deque[tuple[str, int | None]] = deque()
        self.aside = 0
        self.pace = Pace(capacity)

    def all(
        self,
        keys: Iterable[str] | None,
        on_progress: Callable[[SweepProgress], None] | None,
        should_stop: Callable[[], bool] | None,
    ) -> SweepReport:
        start = written = time.monotonic()
        report, store = self.report, self.store
        report.recovered = store.recover()
        store.ledger.interrupt_open()
        store.ledger.retry_killed()
        chosen = None if keys is None else set(keys)
        rows = [row for row in store.ledger.rows() if chosen is None or row.key in chosen]
        self.parameters = {row.key: row.parameters for row in rows}
        report.total = len(rows)
        report.reused = sum(row.state == "done" for row in rows)
        report.failures = {row.key: row.reason or "" for row in rows if row.state == "failed"}
        self.aside = len(report.failures)
        self.queue.extend((row.key, None) for row in rows if row.state == "pending")
        try:
            while self.queue or self.flying:
                self._submit()
                done, _ = wait(self.flying, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    self._settle(future)
                if done and on_progress is not None:
                    on_progress(self._progress(time.monotonic() - start))
                if should_stop is not None and should_stop():
                    report.cancelled = True
                    break
                if done and time.monotonic() - written > TABLE_EVERY_S:
                    store.write_table()
                    written = time.monotonic()
        finally:
            self._give_up()
            report.seconds = time.monotonic() - start
            if report.computed + report.reused or report.failures:
                store.write_table()
        return report

    def _submit(self) -> None:
        while self.queue and len(self.flying) < self.capacity:
            key, avoid = self.queue.popleft()
            self.store.ledger.begin(key, type(self.executor).__name__)
            arguments = (self.node, self.parameters[key], self.store.project.seed, key, self.address)
            options: dict[str, Any] = {"avoid": avoid} if isinstance(self.executor, WorkerPool) else {}
            self.flying[self.executor.submit(compute_point, *arguments, **options)] = key

    def _settle(self, future: Future[Any]) -> None:
        key = self.flying.pop(future)
        try:
            receipt: Receipt = future.result()
        except (BrokenProcessPool, CancelledError) as error:
            self.store.ledger.end_attempt(key, "interrupted", repr(error))
            raise RenderError(
                f"the executor broke down ({error!r}); computed points are safe, run the sweep again to continue"
            ) from error
        except Exception as error:
            self._failed(key, error, getattr(future, "worker", None))
            return
        self.store.take_in(receipt)
        self.report.computed += 1
        self.report.computing_seconds += receipt.record["seconds"]

    def _failed(self, key: str, error: Exception, worker: int | None) -> None:
        """Record a failure; try again on another worker, or set the point aside."""
        spooled = spooled_record(self.store.folder / "outcome" / f"{key}.json")
        if spooled is not None:  # it crashed after its commit: nothing is lost
            self.store.recover()
            self.report.computed += 1
            return
        killed = isinstance(error, WorkerDied) and error.signal in KILLED_FROM_OUTSIDE
        text = text_of(error)
        ledger = self.store.ledger
        lacking = isinstance(error, MissingDependencyError) and not self.report.computed + self.report.reused
        if lacking or isinstance(error, OutcomeNotStored):  # the same would happen to every other point
            ledger.end_attempt(key, "interrupted", text)
            raise error
        how = "killed" if killed else "failed"
        ledger.end_attempt(key, how, text)
        if ledger.attempts(key, how) >= (MAX_KILLS if killed else MAX_FAILURES):
            ledger.set_aside(key, text)
            self.report.failures[key] = text
        else:
            self.queue.append((key, worker))

    def _progress(self, seconds: float) -> SweepProgress:
        report = self.report
        done, failed = report.reused + report.computed, len(report.failures)
        left = report.total - done - failed
        ended = report.computed + failed - self.aside
        return SweepProgress(
            done, failed, report.total, len(self.flying), seconds, self.pace.seconds_left(seconds, ended, left)
        )

    def _give_up(self) -> None:
        """Close open attempts, so that a cancelled run leaves none."""
        for future, key in self.flying.items():
            if not future.cancel() and future.done() and future.exception() is None:
                self.store.take_in(future.result())
                self.report.computed += 1
            else:
                self.store.ledger.end_attempt(key, "interrupted", "the run was stopped")
        self.flying.clear()
