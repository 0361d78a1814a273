# SPDX-License-Identifier: GPL-3.0-or-later
"""Logs of child processes: read while the process writes, they lose nothing; and the end of a process is named."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from spectral_core.child.ending import LAST_BYTES, Log, ended, output_of
from spectral_core.explore.sweep.pool import executor as pool

LINES = 20_000
WRITER = f"""
import sys
for number in range({LINES}):
    sys.stdout.write(f"{{number}}\\n")
    sys.stdout.flush()
"""


def test_a_log_that_is_read_while_it_is_written_keeps_every_line() -> None:
    log = Log()
    process = subprocess.Popen([sys.executable, "-c", WRITER], stdout=log.file)
    while process.poll() is None:
        output_of(log.file)
    assert output_of(log.file).decode().split() == [str(number) for number in range(LINES)]
    assert log.last_words().endswith(f"{LINES - 1}")
    assert len(log.last_words()) < LAST_BYTES + 30
    log.close()


def test_a_log_that_another_thread_closes_has_no_last_words() -> None:
    """Its number was read after it was closed, or when another file had it: an ended worker raised OSError."""
    for _ in range(200):
        log = Log()
        log.file.write(b"word")
        log.file.flush()
        closing = threading.Thread(target=log.close)
        closing.start()
        while log.last_words() == "\nIts last words:\nword":
            pass
        closing.join()
        assert log.last_words() == ""


@pytest.mark.parametrize(
    ("code", "status", "words"),
    [
        ("raise SystemExit(3)", 3, "ended with status 3"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", -9, "was killed by signal 9"),
    ],
)
def test_the_end_of_a_process_is_named(code: str, status: int, words: str) -> None:
    assert ended(subprocess.Popen([sys.executable, "-c", code])) == (status, words)


def test_a_worker_that_never_gets_ready_is_started_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was taken for one that somebody else had killed, and started ten times, for twenty minutes."""
    monkeypatch.setattr(pool, "START_LIMIT_S", 0.5)
    started = time.monotonic()
    with pool.WorkerPool(
        1, prelude="import time; print('waits for a license', flush=True); time.sleep(600)"
    ) as workers:
        with pytest.raises(pool.WorkerDied, match=r"not ready within 0\.5 s") as told:
            workers.submit(abs, -1).result(timeout=60)
        assert not workers.process_ids()
    assert told.value.signal == 0
    assert time.monotonic() - started < 30


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="Windows has no groups of processes")
def test_a_program_of_a_point_ends_with_its_worker(tmp_path: Path) -> None:
    """A stopped sweep left the program of each point running, for up to an hour."""
    mark = tmp_path / "number"
    program = f"import os, pathlib, time; pathlib.Path({str(mark)!r}).write_text(str(os.getpid())); time.sleep(600)"
    with pool.WorkerPool(1) as workers:
        workers.submit(subprocess.run, [sys.executable, "-c", program])
        while not (mark.exists() and mark.read_text()):
            time.sleep(0.05)
        os.kill(int(mark.read_text()), 0)
        workers.shutdown(wait=False)
    limit = time.monotonic() + 20
    while _runs(int(mark.read_text())):
        assert time.monotonic() < limit
        time.sleep(0.05)


@pytest.mark.parametrize("starting", [True, False])
def test_workers_that_are_ended_at_once_compute_no_further_point(starting: bool) -> None:
    """A worker that was still starting when the run was stopped computed its point to the end."""
    prelude = "import time; time.sleep(2)" if starting else ""
    workers = pool.WorkerPool(2, prelude=prelude)
    points = [workers.submit(time.sleep, 40.0) for _ in range(5)]
    while not points[1].running() or not (starting or len(workers.process_ids()) == 2):
        time.sleep(0.01)
    began = time.monotonic()
    workers.shutdown(wait=False)
    assert time.monotonic() - began < 35  # a point takes 40 s
    assert not workers.process_ids()
    assert all(point.done() for point in points)
    assert all(point.cancelled() or isinstance(point.exception(), pool.WorkerDied) for point in points)


def test_a_worker_that_is_ended_before_its_task_has_died() -> None:
    """Where its pipes were closed already, the point had a ``ValueError``: I/O on a closed file."""
    with pool.WorkerPool(1) as workers:
        assert workers.submit(int, 3).result() == 3
        process = workers._processes[0]
        assert process is not None
        process.end()
        with pytest.raises(pool.WorkerDied, match="during a point"):
            process.call((int, (), {}))
        assert workers.submit(int, 4).result() == 4


def test_a_value_error_of_a_point_keeps_its_words() -> None:
    with pool.WorkerPool(1) as workers, pytest.raises(ValueError, match="invalid literal"):
        workers.submit(int, "x").result()


def _runs(number: int) -> bool:
    """True for a process that has not ended, also if its parent has not collected it."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
