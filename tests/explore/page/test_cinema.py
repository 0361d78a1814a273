# SPDX-License-Identifier: GPL-3.0-or-later
"""data.csv compared with Cinema Specification D by a checker that shares no code with the writer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from benchmarks.explore.checks.cinema import kind_of, parse, problems
from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.cinema import csv_text, read_csv
from spectral_core.explore.sweep.parameters import Parameter

TABLES: dict[str, dict[str, list[Any]]] = {
    "whole numbers with one missing": {"n": [1, None, 3], "x": [0.0, 1.0, 2.0]},
    "whole numbers among floats": {"x": [1, 2.5, None], "y": [1e16, -1e-7, 0.0]},
    "nothing is known": {"x": [None, None], "y": [1.0, 2.0]},
    "texts that look like numbers": {"t": ["1", "nan", "abc"], "u": ["", "inf", None]},
    "numbers among texts": {"t": [1, "two", 3.5]},
    "commas, quotes and line ends": {"t": ['a,"b"', "c\rd", "e\nf", "g\r\nh", '"', "  padded "]},
    "formulas": {"t": ["=1+1", "+1", "-2", "@x", "\t=1", "'=x", "'5", "'"]},
    "other scripts": {"größe": ["рука", "手", "🎨", "\u2028"], "x": [1.5, 2.5, 3.5, 4.5]},
    "one row": {"x": [1.25]},
    "texts where a number is missing": {"t": [None, "a"], "x": [None, 2.0]},
}


@pytest.mark.parametrize("name", TABLES)
def test_a_written_table_conforms_and_is_read_back(tmp_path: Path, name: str) -> None:
    columns = TABLES[name]
    folder = tmp_path / "t.cdb"
    folder.mkdir()
    count = len(next(iter(columns.values())))
    rows = [{column: values[row] for column, values in columns.items()} for row in range(count)]
    (folder / "data.csv").write_text(csv_text(list(columns), rows), encoding="utf-8", newline="")
    assert problems(folder) == []
    header, back = read_csv(folder / "data.csv")
    assert header == list(columns)
    for column, values in columns.items():
        texts = any(isinstance(value, str) for value in values)
        expected = [(str(value) if texts else value) if value not in (None, "") else None for value in values]
        assert [row[column] for row in back] == expected, column


def test_the_checker_reports_each_violation(tmp_path: Path) -> None:
    folder = tmp_path / "t.cdb"
    folder.mkdir()
    wrong = {
        "a,b\n1,2\n3,x\n": "mixes", "a\n1\nNaN\n": "mixes", "a,a\n1,2\n": "one name", "FILE,a\nx,1\n": "follows",
        "a,b\n1\n": "fields", "a\n": "no data row", 'a\n"x\n': "no end", 'a\n"x"y\n': "after a field",
        "1\n2\n": "no string", "a,FILE\n1,gone.png\n": "missing",
    }  # fmt: skip
    for text, said in wrong.items():
        (folder / "data.csv").write_text(text)
        assert any(said in problem for problem in problems(folder)), text
    assert parse('a,"b ""c""",\r\n,2,x\n') == [["a", 'b "c"', None], [None, "2", "x"]]
    assert [kind_of(text) for text in ("1", "1.0", "nan", "x")] == ["integer", "float", "float", "string"]


@pytest.mark.parametrize("name", ["key", "seconds", "FILE", "filename", "nan", "Inf", "1a", "a b", "", "a-b"])
def test_a_name_with_another_meaning_in_a_table_is_refused(name: str) -> None:
    with pytest.raises(InvalidInputError, match="a parameter is named"):
        Parameter(name)
