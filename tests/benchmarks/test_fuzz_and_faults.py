# SPDX-License-Identifier: GPL-3.0-or-later
"""A short run of ``fuzz`` with a fixed seed, and a short one of ``fault-kill``."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks import Options
from benchmarks.program import fault_kill, fuzz


def test_damaged_files_of_every_type_are_read_or_refused(tmp_path: Path) -> None:
    figures = fuzz.run(Options(out=tmp_path, extra=["--seed", "20111", "--inputs", "400"]))
    assert figures["inputs"] == 400
    assert figures["faults"] == []
    assert figures["no_faults"]


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kill -9")
def test_killed_and_full_disk_writers_lose_nothing(tmp_path: Path) -> None:
    figures = fault_kill.run(Options(out=tmp_path, extra=["--kills", "20", "--seed", "7"]))
    assert figures["kills_failed"] == 0
    assert figures["full_disks_failed"] == 0
    assert figures["command"] == ""
