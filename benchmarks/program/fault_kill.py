# SPDX-License-Identifier: GPL-3.0-or-later
"""Kill -9 at random moments over every writer, and a full disk for each: the earlier file is whole, or the new one.

``--kills N`` (200), ``--seed N``; the seed is printed. A disk is full where a small memory disk can be mounted (root),
and everywhere by a limit on the size of a file, which the system answers in the same calls.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import Options
from benchmarks.program.cases.file_writers import Writer, writers
from spectral_core.errors import SpectralError

OPTIONS = ("--kills N", "--seed N")
FULL_AT = (0.0, 0.3, 0.7, 0.97)
"""Shares of the finished file at which the disk is full."""


def run(options: Options) -> dict[str, Any]:
    """Kill, fill, count."""
    kills = options.whole("--kills", 30 if options.quick else 200)
    seed = options.whole("--seed", int.from_bytes(os.urandom(4), "little"))
    print(f"seed {seed}, {kills} kills")
    rng, known = np.random.default_rng(seed), writers()
    with tempfile.TemporaryDirectory() as folder:
        references = {each.name: _references(each, Path(folder)) for each in known}
        kill_outcomes = [_kill(known[index % len(known)], references, Path(folder), rng) for index in range(kills)]
        killed, midway = [each for each, _ in kill_outcomes], sum(was_midway for _, was_midway in kill_outcomes)
        full = [_fill(each, references, Path(folder), share) for each in known for share in FULL_AT]
        full += _memory_disk(known, references)
        command = _full_command()
    for name, outcomes in (("kill -9", killed), ("full disk", full)):
        print(f"{name:10} {len(outcomes)} tried, {sum(each == '' for each in outcomes)} as they should be")
        for each in sorted(set(outcomes) - {""}):
            print(f"           {outcomes.count(each)} × {each}")
    print(f"{midway} of the kills interrupted a write")
    print(f"command    {command or 'one line of error, exit status 1'}")
    return {
        "seed": seed,
        "writers": [each.name for each in known],
        "kills": len(killed),
        "kills_midway": midway,
        "kills_failed": sum(each != "" for each in killed),
        "full_disks": len(full),
        "full_disks_failed": sum(each != "" for each in full),
        "command": command,
        "holds": {
            f"after {len(killed)} kills each file is the earlier one or the new one": not any(killed),
            f"{len(full)} full disks are reported, and the earlier file is kept": not any(full),
            "a command on a full disk ends with one line of error": not command,
        },
    }


def _references(writer: Writer, folder: Path) -> list[bytes]:
    """The bytes of both versions."""
    found = []
    for version in range(2):
        path = folder / f"reference{version}" / writer.file_name
        path.parent.mkdir(exist_ok=True)
        writer.write(path, version)
        found.append(path.read_bytes())
    return found


def _state(writer: Writer, references: dict[str, list[bytes]], path: Path) -> int | None:
    """Version of a file; None if it is neither."""
    if writer.read is None:
        data = path.read_bytes()
        return references[writer.name].index(data) if data in references[writer.name] else None
    try:
        return int(writer.read(path))
    except (SpectralError, ValueError, StopIteration):
        return None


def _kill(
    writer: Writer, references: dict[str, list[bytes]], folder: Path, rng: np.random.Generator
) -> tuple[str, bool]:
    """Kill a process that alternates both versions; "" if the files are whole, True if a write was interrupted."""
    place = Path(tempfile.mkdtemp(dir=folder))
    path = place / writer.file_name
    writer.write(path, 0)
    process = os.fork()
    if process == 0:
        for number in range(1_000_000):
            writer.write(path, number % 2)
        os._exit(0)
    time.sleep(rng.uniform(0.0, 0.06))
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    if _state(writer, references, path) is None:
        return f"{writer.name}: neither the earlier file nor the new one", True
    midway = len(list(place.iterdir())) > 1
    _forget(place)
    writer.write(path, 1)
    left = sorted(entry.name for entry in place.iterdir())
    fault = "" if left == [writer.file_name] else f"{writer.name}: the next run leaves {len(left) - 1} file(s) behind"
    return fault, midway


def _forget(place: Path) -> None:
    """Another process would look for leftovers afresh."""
    from spectral_core.files import whole

    whole._looked_through.pop(str(place), None)


def _fill(writer: Writer, references: dict[str, list[bytes]], folder: Path, share: float) -> str:
    """Write with a file size limit below the needed size; "" if it is refused and the earlier file is whole."""
    place = Path(tempfile.mkdtemp(dir=folder))
    path = place / writer.file_name
    writer.write(path, 0)
    limit = int(share * len(references[writer.name][1]))
    process = os.fork()
    if process == 0:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        os._exit(_attempt(writer, path))
    return _judged(writer, references, path, os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]))


def _attempt(writer: Writer, path: Path) -> int:
    """0 if the write was refused with the right error, 1 if it was not noticed, 2 for another error."""
    try:
        writer.write(path, 1)
    except SpectralError as error:
        return 0 if "\n" not in str(error) else 3
    except BaseException:
        return 2
    return 1


def _judged(writer: Writer, references: dict[str, list[bytes]], path: Path, status: int) -> str:
    if status:
        reasons = {1: "a full disk is not noticed", 2: "a foreign exception", 3: "an error of several lines"}
        return f"{writer.name}: {reasons.get(status, f'ended with status {status}')}"
    if _state(writer, references, path) != 0:
        return f"{writer.name}: the earlier file is lost"
    left = [entry.name for entry in path.parent.iterdir()]
    return "" if left == [writer.file_name] else f"{writer.name}: leaves {len(left) - 1} file(s) behind"


def _memory_disk(known: list[Writer], references: dict[str, list[bytes]]) -> list[str]:
    """The same on a real full disk; skipped if this user cannot mount one."""
    outcomes = []
    for writer in known:
        # Room for the earlier file and half of another, in pages of 4 KiB and with one for the folder itself.
        pages = -(-len(references[writer.name][0]) // 4096) + max(-(-len(references[writer.name][1]) // 8192) - 1, 0)
        with tempfile.TemporaryDirectory() as mounted:
            size = f"size={max(pages, 1) * 4096}"
            if subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", mounted], capture_output=True).returncode:
                return outcomes
            try:
                path = Path(mounted) / writer.file_name
                writer.write(path, 0)
                process = os.fork()
                if process == 0:
                    os._exit(_attempt(writer, path))
                status = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
                outcomes.append(_judged(writer, references, path, status))
            finally:
                subprocess.run(["umount", mounted], capture_output=True)
    return outcomes


def _full_command() -> str:
    """A command whose files do not fit: one line of error, exit status 1, no traceback; "" if it passes."""
    with tempfile.TemporaryDirectory() as folder:
        line = [
            sys.executable,
            "-m",
            "spectral_core.cli",
            "design",
            "--preset",
            "hidden_mark",
            "--out",
            f"{folder}/out",
        ]
        # Python 3.11 would keep a module's bytecode truncated at the limit, and then always fail to import it.
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(line, capture_output=True, text=True, env=environment, preexec_fn=_small_files)
    lines = done.stderr.strip().splitlines()
    return "" if done.returncode == 1 and len(lines) == 1 else f"status {done.returncode}: {lines[-3:]}"


def _small_files() -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
