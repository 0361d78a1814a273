# SPDX-License-Identifier: GPL-3.0-or-later
"""Every benchmark states claims under ``holds``, each of a figure of the run; ``python -m benchmarks`` prints them."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from benchmarks import __main__ as program


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
