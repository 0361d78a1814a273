# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files of palette solutions are refused, with the name of the entry."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import FileFormatError
from spectral_core.palette import presets, solve_palette
from spectral_core.palette.files import read_solution, write_solution

SOLUTION = solve_palette(presets.metamer_pair())


@pytest.mark.parametrize(
    ("entry", "value", "said"),
    [
        ("kkt_residual", "x", "kkt_residual is 'x'; expected a number"),
        ("light_scale", None, "light_scale is None; expected a number"),
        ("rounds", "many", "rounds is many, a text"),
        ("remedy", 3, "remedy is 3; expected text"),
        ("residuals", [1], r"residuals is \[1\]; expected a table of numbers"),
        ("residuals", {"color": "x"}, "residuals.color is 'x'; expected a number"),
        ("notes", "x", "notes: got 'x'; expected a tuple"),
        ("engines", [1], "an entry of engines is 1; expected text"),
        ("delta_e_2000", [[1.0]], r"delta_e_2000 has shape \(1, 1\); expected finite numbers of shape \(2, 2\)"),
        ("actual_linear_rgb", True, r"actual_linear_rgb has shape \(\)"),
        ("illuminants", [], "2 reflectances and 0 illuminants; expected 2 and 2"),
        ("amounts", [None], "amounts have 1 entry; expected 2"),
        ("status", "fine", "fine"),
    ],
)
def test_an_entry_of_a_wrong_kind_or_count_is_refused(tmp_path, entry, value, said) -> None:
    """Such entries were kept, and ended later in errors of inner lines."""
    file = tmp_path / "solution.json"
    write_solution(file, SOLUTION)
    document = json.loads(file.read_text("utf-8"))
    file.write_text(json.dumps({**document, entry: value}), "utf-8")
    with pytest.raises(FileFormatError, match=said) as raised:
        read_solution(file)
    assert str(file) in str(raised.value)


def test_a_whole_file_is_read_as_it_was_written(tmp_path) -> None:
    write_solution(tmp_path / "solution.json", SOLUTION)
    again = read_solution(tmp_path / "solution.json")
    assert (again.status, again.rounds, again.remedy) == (SOLUTION.status, SOLUTION.rounds, SOLUTION.remedy)
    assert (again.notes, again.engines, again.residuals) == (SOLUTION.notes, SOLUTION.engines, SOLUTION.residuals)
    np.testing.assert_array_equal(again.actual_linear_rgb, SOLUTION.actual_linear_rgb)
    np.testing.assert_array_equal(again.delta_e_2000, SOLUTION.delta_e_2000)


def test_a_solution_that_failed_its_check_is_written(tmp_path) -> None:
    """Its KKT residual is infinite, which ended the writer in an error of JSON."""
    file = tmp_path / "solution.json"
    failed = replace(SOLUTION, kkt_residual=np.inf)
    write_solution(file, failed)
    json.loads(file.read_text("utf-8"), parse_constant=pytest.fail)  # plain JSON has no word for infinity
    assert read_solution(file).kkt_residual == np.inf
    file.write_text(file.read_text("utf-8").replace('"kkt_residual": "inf"', '"kkt_residual": "endless"'), "utf-8")
    with pytest.raises(FileFormatError, match="kkt_residual is 'endless'; expected a number"):
        read_solution(file)
