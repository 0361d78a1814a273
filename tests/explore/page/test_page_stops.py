# SPDX-License-Identifier: GPL-3.0-or-later
"""A page that is no longer served while it computes: its run stops, and the table has every finished row."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest

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


def test_points_that_the_page_renders_are_compared_with_the_reference(tmp_path: Path) -> None:
    """They had no rmse until the sweep was run again."""
    (tmp_path / "f.py").write_text(
        "import numpy as np\ndef f(a):\n    return {'picture': np.full((3, 4, 3), a)}\n", "utf-8"
    )
    (tmp_path / "s.toml").write_text(
        '[compute]\nkind = "function"\nfunction = "f.py:f"\n[design]\nbudget = 3\n[reference]\na = 0.25\n'
        '[columns]\ntwice = "2 * rmse"\n[[parameters]]\nname = "a"\nlow = 0.0\nhigh = 1.0\n',
        "utf-8",
    )
    with closing(Sweep(read_sweep(tmp_path / "s.toml"), tmp_path / "out")) as sweep:
        sweep.run(sweep.plan(), executor=ThreadPoolExecutor(1))
        live = LiveSweep(sweep.store, tmp_path)
        live.refine({})
        live.render({})
        end = time.monotonic() + 60
        while "computed" not in live.status({})["message"] and time.monotonic() < end:
            time.sleep(0.05)
        live.close()
        table = sweep.store.columns()
        assert live.status({})["message"] == "3 computed, 0 set aside; reload to see them"
    assert len(table["a"]) == 6
    for a, rmse, twice in zip(table["a"], table["rmse"], table["twice"], strict=True):
        assert rmse == pytest.approx(abs(a - 0.25), abs=1e-6) and twice == 2 * rmse
