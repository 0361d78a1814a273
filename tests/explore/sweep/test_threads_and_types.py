# SPDX-License-Identifier: GPL-3.0-or-later
"""Points computed by threads of one process, and results of functions that no table holds."""

from __future__ import annotations

import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.compute.function import load_function
from spectral_core.explore.sweep.outcome import Outcome, as_outcome
from spectral_core.explore.sweep.task import compute_point

THREADS = 16


class Loading:
    """A node that counts in which threads it has loaded its data."""

    fingerprint = "loading"
    loads: Counter[int] = Counter()

    def __init__(self) -> None:
        self.data: float | None = None

    def __call__(self, parameters: Any, seed: int) -> Outcome:
        if self.data is None:
            self.loads[threading.get_ident()] += 1
            self.data = 1.0
        return Outcome({"a": self.data})


def test_each_of_many_threads_loads_a_node_once() -> None:
    """Nine threads or more dropped the nodes of each other, so that almost every point loaded its data again."""
    Loading.loads.clear()
    together = threading.Barrier(THREADS)

    def points(thread: int) -> None:
        for number in range(20):
            together.wait(30)
            compute_point(Loading(), {"x": 1.0}, 0, f"k{thread}_{number}", None)

    with ThreadPoolExecutor(THREADS) as executor:
        list(executor.map(points, range(THREADS)))
    assert len(Loading.loads) == THREADS and set(Loading.loads.values()) == {1}


def test_threads_wait_for_a_file_that_another_one_loads(tmp_path: Path) -> None:
    """The second thread found the module without its functions."""
    (tmp_path / "slow.py").write_text("import time\ntime.sleep(0.3)\n\ndef f(x):\n    return x\n", "utf-8")
    together = threading.Barrier(4)

    def load(_: int) -> Any:
        together.wait(30)
        return load_function(f"{tmp_path / 'slow.py'}:f")

    with ThreadPoolExecutor(4) as executor:
        found = list(executor.map(load, range(4)))
    assert len(set(found)) == 1 and found[0](3) == 3


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (np.complex128(1 + 2j), "complex"),
        (np.datetime64(1, "D"), "datetime64"),
        (np.timedelta64(1, "s"), "timedelta64"),
        (np.full((4, 4, 3), 1j), "complex"),
        ([[1.0, 2.0], [3.0]], "differ in length"),
        ([np.zeros((2, 3)), np.zeros((2, 4))], "differ in length"),
        ([["x", "y"], ["z", "u"]], "picture of numbers"),
        (np.zeros((4, 4, 7)), "3 or 4"),
    ],
)
def test_results_that_no_table_holds_are_refused_by_name(value: Any, said: str) -> None:
    """Imaginary parts and the fourth to seventh channel were lost, others ended in an error of NumPy or of JSON."""
    with pytest.raises(InvalidInputError, match=said):
        as_outcome({"a": value}, "f")


def test_single_values_of_any_numpy_type_are_kept() -> None:
    given = {"a": np.array(3), "b": np.array("x"), "c": np.float16(0.5), "d": np.bool_(True), "e": np.str_("y")}
    assert dict(as_outcome(given, "f").values) == {"a": 3, "b": "x", "c": 0.5, "d": True, "e": "y"}
