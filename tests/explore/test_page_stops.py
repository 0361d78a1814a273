# SPDX-License-Identifier: GPL-3.0-or-later
"""A page that is no longer served while it computes: its run stops, and the table has every finished row."""

from __future__ import annotations

import time
from pathlib import Path

from spectral_core.explore.page.live import LiveSweep
from spectral_core.explore.sweep.document import read_sweep
from spectral_core.explore.sweep.sweep import Sweep


def test_a_stopped_page_writes_its_table(tmp_path: Path) -> None:
    """The store was closed under the run: the table lacked the latest rows, and an attempt stayed open."""
    log = tmp_path / "log"
    (tmp_path / "s.toml").write_text(
        '[compute]\nkind = "function"\nfunction = "tests.explore.functions:counted"\n'
        f'fixed = {{log = "{log.as_posix()}", pause = 0.2}}\n[design]\nbudget = 60\n'
        + "".join(f'[[parameters]]\nname = "{name}"\nlow = 0.0\nhigh = 1.0\n' for name in "ab"),
        "utf-8",
    )
    sweep = Sweep(read_sweep(tmp_path / "s.toml"), tmp_path / "out")
    sweep.plan()
    live, ledger = LiveSweep(sweep.store, tmp_path), sweep.store.ledger
    live.render({})
    end = time.monotonic() + 60
    while len(ledger.rows("done")) < 3 and time.monotonic() < end:
        time.sleep(0.05)
    live.close()
    done = {row.key for row in ledger.rows("done")}
    lines = (sweep.store.folder / "data.csv").read_text("utf-8").splitlines()
    column = lines[0].split(",").index("key")
    assert 3 <= len(done) < 60 and {line.split(",")[column] for line in lines[1:]} == done
    assert ledger.interrupt_open() == 0
    sweep.close()
