# SPDX-License-Identifier: GPL-3.0-or-later
"""An option that is given twice with different values is refused: the parser took the last one in silence."""

from __future__ import annotations

import pytest

from spectral_core.cli import main


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("lattice --points 4 --points 5", "argument --points: given twice, as 4 and 5; give it once"),
        ("lattice --low 0 --low -1 --high 1", "argument --low: given twice, as 0.0 and -1.0"),
        ("recipe lamp x.csv --rg 90 100 --rg 95 110", "--rg: given twice, as 90.0 100.0 and 95.0 110.0"),
        ("explore x --region a 1 --region b 2", "--region: given twice, as a 1 and b 2"),
    ],
)
def test_two_values_of_one_option_are_refused(line: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    said = capsys.readouterr().err
    assert ended.value.code == 2 and message in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    "line", ["lattice --points 4 --points 4", "mix blue:1 --light D65 --light A", "lattice --points 4 --json --json"]
)
def test_the_same_value_and_lists_may_be_repeated(line: str) -> None:
    assert main(line.split()) == 0
    assert main(line.split()) == 0  # and a second call begins anew


def test_a_value_of_minus_infinity_is_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    """It counted as an option: the message said that --low needs a value."""
    assert main(["lattice", "--low", "-inf", "0"]) == 1
    assert "--low holds 1 value(s) that are not finite" in capsys.readouterr().err
