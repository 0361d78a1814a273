# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory available in a container: its limit minus the used memory, with file caches counted as free."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from spectral_core.render.relight import memory
from spectral_core.render.relight.storage import MixtureStorage


def test_file_caches_of_a_container_count_as_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "memory.max").write_text("1000\n")
    (tmp_path / "memory.current").write_text("700\n")
    (tmp_path / "memory.stat").write_text("anon 500\ninactive_file 120\nactive_file 30\nslab 7\n")
    monkeypatch.setattr(memory, "Path", lambda *_: tmp_path)
    assert memory._of_container() == 1000 - 700 + 150


@pytest.mark.parametrize("limit", ["max\n", None])
def test_a_container_without_a_limit_gives_no_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str | None
) -> None:
    if limit is not None:
        (tmp_path / "memory.max").write_text(limit)
    monkeypatch.setattr(memory, "Path", lambda *_: tmp_path)
    assert memory._of_container() is None


def test_the_memory_of_a_machine_is_the_available_memory_of_linux(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tmp_path / "meminfo"
    table.write_text("MemTotal:       8000 kB\nMemFree:         100 kB\nMemAvailable:    3000 kB\n")
    monkeypatch.setattr(memory, "Path", lambda *_: table)
    assert memory._of_machine() == 3000 * 1024  # kB of /proc are 1024 bytes


def test_the_stated_peak_is_in_megabytes() -> None:
    """Includes the copy in the session, and is at least the number of stored bytes."""
    storage = MixtureStorage()
    stored = storage.bytes_needed(3840, 2160, 8)
    found = re.search(r"up to ([\d,]+) MB", memory.stated_peak(storage, 3840, 2160, 8))
    assert found
    stated = 1e6 * float(found[1].replace(",", ""))
    assert abs(stated - memory.peak_bytes(storage, 3840, 2160, 8)) < 1e6
    assert stated > stored
