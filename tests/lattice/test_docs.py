# SPDX-License-Identifier: GPL-3.0-or-later
"""The page docs/lattice.md has the figures that the benchmarks print."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.lattice.cases.designs import DESIGNS
from benchmarks.lattice.lattice_acceptance import shipped
from benchmarks.lattice.lattice_comparison import table_row

PAGE = Path(__file__).parents[2] / "docs" / "lattice.md"


def _without_seconds(row: str) -> str:
    return row.rsplit("|", 2)[0]


@pytest.mark.parametrize("name", ["Sobol, scrambled", "ours, rate 2, packing", "ours, rate 2, second moment"])
def test_comparison_rows_of_the_page_equal_those_of_the_benchmark(name: str) -> None:
    section = PAGE.read_text("utf-8").split("### n = 3, m = 256\n")[1].split("###")[0]
    row = table_row(name, DESIGNS[name], 3, 256, seeds=2)
    assert row is not None
    assert _without_seconds(row[0]) in section


def test_shipped_lattices_of_the_page_equal_those_of_the_package() -> None:
    page = PAGE.read_text("utf-8")
    assert "\n".join(shipped()) in page
