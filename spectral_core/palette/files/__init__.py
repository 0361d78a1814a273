# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes in files: problems as TOML or JSON, solutions as JSON, colors as swatches for painting programs.

>>> problem = read_palette("examples/split_light.toml")  # doctest: +SKIP
>>> write_solution("split_light.json", solve_palette(problem))  # doctest: +SKIP
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from spectral_core.checks import path_of, require_kind
from spectral_core.documents import read_document, write_document
from spectral_core.errors import InvalidInputError
from spectral_core.palette.files.document import PALETTE_SCHEMA, document_of, problem_of
from spectral_core.palette.files.solution import solution_document, solution_of
from spectral_core.palette.files.swatches import Swatch, read_swatches, swatches_of, write_swatches
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.solution import PaletteSolution

__all__ = [
    "Swatch",
    "palette_schema",
    "read_palette",
    "read_solution",
    "read_swatches",
    "swatches_of",
    "write_palette",
    "write_solution",
    "write_swatches",
]


def palette_schema() -> dict[str, Any]:
    """The JSON Schema of palette documents."""
    return PALETTE_SCHEMA.content


def read_palette(path: str | Path) -> PaletteProblem:
    """The problem in a TOML or JSON file. Raises FileFormatError (file, and line or place in the document)."""
    return read_document(path, problem_of, "a palette")


def write_palette(path: str | Path, problem: PaletteProblem, *, comment: str = "") -> None:
    """Write a problem as ``.toml`` or ``.json``; read_palette returns it with the same numbers.

    ``comment``: lines for people on top of a TOML file.
    """
    require_kind("the palette", problem, PaletteProblem)
    write_document(path, document_of(problem), comment=comment, what="palettes")


def read_solution(path: str | Path) -> PaletteSolution:
    """A solution written by write_solution, without its warm state. Raises FileFormatError."""
    return read_document(path, solution_of, "a palette solution")


def write_solution(path: str | Path, solution: PaletteSolution) -> None:
    """Write a solution, its problem included, as JSON."""
    require_kind("the solution", solution, PaletteSolution, "from solve_palette")
    file = path_of(path)
    if file.suffix.lower() != ".json":
        raise InvalidInputError(f"solutions are written as .json, got {file.name!r}; change the file name's ending")
    write_document(file, solution_document(solution), indent=None)
