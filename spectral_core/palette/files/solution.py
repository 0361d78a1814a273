# SPDX-License-Identifier: GPL-3.0-or-later
"""``PaletteSolution`` as a plain document and back: spectra, colors, errors, status. Without the solver's warm
state.
"""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, require_text, require_whole
from spectral_core.documents.codecs import SpectrumFiles, decoded_spectrum, encoded_spectrum
from spectral_core.errors import InvalidInputError, counted
from spectral_core.palette.files.document import document_of, problem_of
from spectral_core.palette.given import number_of, sequence_of, shown
from spectral_core.palette.solution import Conflict, PaletteSolution, PaletteStatus
from spectral_core.spectra.files import kind_of
from spectral_core.spectra.spectrum import Spectrum

FORMAT = "spectral-scene palette solution"
VERSION = 1
ARRAYS = ("target_linear_rgb", "actual_linear_rgb", "delta_e_2000")
SPECTRA = ("illuminants", "reflectances")
NOT_STORED = ("problem", "state")
PLAIN = tuple(
    each.name
    for each in fields(PaletteSolution)
    if each.name not in (*ARRAYS, *SPECTRA, *NOT_STORED, "conflicts", "amounts", "status")
)
"""Numbers, texts and tables of them, stored unchanged."""


def solution_document(solution: PaletteSolution) -> dict[str, Any]:
    """The solution as strings, numbers, lists and tables; NaN (no request) as None, infinity as text."""
    grid = solution.problem.grid
    document: dict[str, Any] = {"format": FORMAT, "version": VERSION, "status": str(solution.status)}
    document |= {name: _plain(getattr(solution, name)) for name in PLAIN}
    for name in ARRAYS:
        document[name] = _with_none(getattr(solution, name))
    for name in SPECTRA:
        document[name] = [{"kind": kind_of(each), **encoded_spectrum(each, grid)} for each in getattr(solution, name)]
    document["amounts"] = [None if each is None else each.tolist() for each in solution.amounts]
    document["conflicts"] = [_plain(asdict(each)) for each in solution.conflicts]
    document["problem"] = document_of(solution.problem)
    return document


def solution_of(document: dict[str, Any], folder: Path) -> PaletteSolution:
    """Inverse of solution_document, without the warm state. Raises InvalidInputError."""
    if not isinstance(document, dict):
        raise InvalidInputError(f"a {type(document).__name__}; expected the table of a palette solution")
    missing = {"problem", "status", *PLAIN, *ARRAYS, *SPECTRA} - set(document)
    if document.get("format") != FORMAT or document.get("version") != VERSION or missing:
        raise InvalidInputError(
            f"a document of format {document.get('format')!r}, version {document.get('version')!r}, without "
            f"{sorted(missing) or 'nothing'}; expected {FORMAT!r}, version {VERSION}"
        )
    problem, files = problem_of(document["problem"], folder), SpectrumFiles(folder)

    def spectra(name: str) -> tuple[Spectrum, ...]:
        tables = [dict(table) for table in document[name]]
        return tuple(decoded_spectrum(table, table.pop("kind"), problem.grid, files) for table in tables)

    stored: dict[str, Any] = {name: _plain_entry(name, document[name]) for name in PLAIN}
    shape = (len(problem.reflectances), len(problem.lights))
    stored |= {name: _colors(name, document[name], shape) for name in ARRAYS}
    illuminants, reflectances = spectra("illuminants"), spectra("reflectances")
    if (len(reflectances), len(illuminants)) != shape:
        raise InvalidInputError(
            f"{counted(len(reflectances), 'reflectance')} and {counted(len(illuminants), 'illuminant')}; expected "
            f"{shape[0]} and {shape[1]}, as the problem has"
        )
    return PaletteSolution(
        problem=problem,
        illuminants=illuminants,
        reflectances=reflectances,
        status=PaletteStatus(document["status"]),
        amounts=_amounts(document.get("amounts", []), shape[1]),
        conflicts=tuple(_conflict(each) for each in document.get("conflicts", ())),
        **stored,
    )


def _plain_entry(name: str, value: Any) -> Any:
    """An entry of PLAIN, if it is of its kind."""
    if name in ("residuals", "timings"):
        if not isinstance(value, dict):
            raise InvalidInputError(f"{name} is {shown(value)}; expected a table of numbers")
        return {key: number_of(f"{name}.{key}", each) for key, each in value.items()}
    if name in ("engines", "notes"):
        return tuple(require_text(f"an entry of {name}", each) for each in sequence_of(name, value))
    if name == "remedy":
        return require_text(name, value)
    if name == "rounds":
        return require_whole(name, value, 0, 1 << 53)
    return number_of(name, float(value) if value in ("inf", "-inf") else value)


def _colors(name: str, table: Any, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Numbers of all cells, (R, L) or (R, L, 3), with NaN for None."""
    expected = shape if name == "delta_e_2000" else (*shape, 3)
    found = np.array(table, dtype=np.float64)
    if found.shape != expected or np.isinf(found).any():
        raise InvalidInputError(f"{name} has shape {found.shape}; expected finite numbers of shape {expected}")
    return found


def _amounts(table: Any, lights: int) -> tuple[NDArray[np.float64] | None, ...]:
    """Amounts of primaries for each light, None without primaries; empty in files that state none."""
    entries = sequence_of("amounts", table)
    if len(entries) not in (0, lights):
        raise InvalidInputError(
            f"amounts have {counted(len(entries), 'entry', 'entries')}; expected {lights}, one for each light"
        )
    return tuple(None if each is None else frozen_array("amounts of a light", each, (None,)) for each in entries)


def _conflict(table: dict[str, Any]) -> Conflict:
    pairs = {"cell": tuple(table["cell"]), "relieved_by": tuple(tuple(cell) for cell in table["relieved_by"])}
    return Conflict(**{**table, **pairs})


def _with_none(values: Any) -> Any:
    """Nested lists with None for NaN: JSON has no NaN."""
    if isinstance(values, np.ndarray):
        return [_with_none(each) for each in values]
    return None if np.isnan(values) else float(values)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    value = value.item() if isinstance(value, np.generic) else value
    # A solve that failed its check has an infinite KKT residual, for which JSON has no number.
    return str(value) if isinstance(value, float) and np.isinf(value) else value
