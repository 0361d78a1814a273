# SPDX-License-Identifier: GPL-3.0-or-later
"""Every benchmark states claims under ``holds``, each of a figure of the run; ``python -m benchmarks`` prints them."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from benchmarks import __main__ as program
from benchmarks.program import recipes


def claims_of(file: Path) -> list[ast.expr]:
    """Values beside the key ``holds`` in a module: those of dicts, and those that are assigned to an entry."""
    found: list[ast.expr] = []
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Dict):
            found += [value for key, value in zip(node.keys, node.values, strict=True)
                      if isinstance(key, ast.Constant) and key.value == "holds"]  # fmt: skip
        if isinstance(node, ast.Assign):
            found += [node.value for target in node.targets if ast.unparse(target).endswith("['holds']")]
    return found


@pytest.mark.parametrize("name", sorted(program.known()))
def test_every_benchmark_states_claims_and_none_without_a_check(name: str) -> None:
    claims = claims_of(program.known()[name])
    assert claims, f"{name} has no claims under 'holds'"
    for claim in claims:
        values = claim.values if isinstance(claim, ast.Dict) else []
        assert not [value for value in values if isinstance(value, ast.Constant)], f"{name} claims without a check"


def test_claims_are_printed_and_the_last_line_holds_them(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert program.main(["palette-mixtures", "--quick", "--json", "--out", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    holds = json.loads(lines[-1])["holds"]
    assert len(holds) >= 4
    assert all(holds.values())
    assert [f"holds  {claim}" for claim in holds] == lines[-1 - len(holds) : -1]


def test_help_after_a_name_lists_the_words_that_it_reads(capsys: pytest.CaptureFixture[str]) -> None:
    """It listed only the options that all benchmarks have."""
    assert program.main(["fuzz", "--help"]) == 0
    assert "words of fuzz: --seconds N, --inputs N, --seed N" in capsys.readouterr().out
    assert program.main(["relight-memory", "-h"]) == 0
    assert "words of relight-memory: STORAGE WIDTH HEIGHT" in capsys.readouterr().out


def test_without_a_name_json_is_an_object_and_wrong_words_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert program.main(["--json"]) == 0
    assert json.loads(capsys.readouterr().out).keys() == program.known().keys()
    assert program.main(["--qick"]) == 2
    assert "--qick" in capsys.readouterr().err


def test_recipes_of_paints_are_those_of_an_independent_formula() -> None:
    """The benchmark compared at the knots of the paints alone, so its claim failed once recipes used those between."""
    assert recipes._paints(20)["largest_disagreement"] < 1e-6
