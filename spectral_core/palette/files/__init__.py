# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes in files: problems as TOML or JSON, solutions as JSON, colors as swatches for painting programs.

>>> problem = read_palette("examples/split_light.toml")  # doctest: +SKIP
>>> write_solution("split_light.json", solve_palette(problem))  # doctest: +SKIP
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.palette.files.document import document_of, problem_of
from spectral_core.palette.files.schema import palette_schema
from spectral_core.palette.files.solution import solution_document, solution_of
from spectral_core.palette.files.swatches import Swatch, read_swatches, swatches_of, write_swatches
from spectral_core.palette.files.toml import toml_text
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.files.columns import read_text

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


def read_palette(path: str | Path) -> PaletteProblem:
    """The problem in a TOML or JSON file. Raises FileFormatError (file, and line or place in the document)."""
    file = Path(path)
    return _decoded(file, problem_of)


def write_palette(path: str | Path, problem: PaletteProblem, *, comment: str = "") -> None:
    """Write a problem as ``.toml`` or ``.json``; read_palette returns it with the same numbers.

    ``comment``: lines for people on top of a TOML file.
    """
    document = document_of(problem)
    file = Path(path)
    if _suffix(file) == ".toml":
        remark = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
        file.write_text((remark + "\n" if remark else "") + toml_text(document), encoding="utf-8")
    else:
        file.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_solution(path: str | Path) -> PaletteSolution:
    """A solution written by write_solution, without its warm state. Raises FileFormatError."""
    return _decoded(Path(path), solution_of)


def write_solution(path: str | Path, solution: PaletteSolution) -> None:
    """Write a solution, its problem included, as JSON."""
    file = Path(path)
    if file.suffix.lower() != ".json":
        raise InvalidInputError(f"solutions are written as .json, got {file.name!r}; change the file name's ending")
    file.write_text(json.dumps(solution_document(solution), allow_nan=False) + "\n", encoding="utf-8")


def _suffix(file: Path) -> str:
    suffix = file.suffix.lower()
    if suffix not in (".toml", ".json"):
        raise InvalidInputError(f"cannot tell the format of {file.name!r}; name palettes .toml or .json")
    return suffix


def _decoded(file: Path, decode: Any) -> Any:
    text = read_text(file)
    suffix = file.suffix.lower()
    as_json = suffix == ".json" or (suffix != ".toml" and text.lstrip().startswith("{"))
    try:
        document = json.loads(text) if as_json else tomllib.loads(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        kind = "JSON" if as_json else "TOML"
        raise FileFormatError(f"{file}: {error}; expected a palette in {kind}") from error
    try:
        return decode(document, file.parent)
    except FileFormatError:
        raise
    except (InvalidInputError, KeyError, TypeError, ValueError) as error:  # of a solution, no schema is kept
        raise FileFormatError(f"{file}: {error}") from error
