# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory that a container leaves: its limit less what is used, caches of files counted as free."""

from __future__ import annotations

from pathlib import Path

import pytest

from spectral_core.render.relight import memory


def test_file_caches_of_a_container_count_as_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "memory.max").write_text("1000\n")
    (tmp_path / "memory.current").write_text("700\n")
    (tmp_path / "memory.stat").write_text("anon 500\ninactive_file 120\nactive_file 30\nslab 7\n")
    monkeypatch.setattr(memory, "Path", lambda *_: tmp_path)
    assert memory._of_container() == 1000 - 700 + 150


@pytest.mark.parametrize("limit", ["max\n", None])
def test_a_container_without_a_limit_leaves_no_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str | None
) -> None:
    if limit is not None:
        (tmp_path / "memory.max").write_text(limit)
    monkeypatch.setattr(memory, "Path", lambda *_: tmp_path)
    assert memory._of_container() is None
