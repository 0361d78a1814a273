# SPDX-License-Identifier: GPL-3.0-or-later
"""Design the spectra of a palette file, or of a preset, and write spectra, swatches and errors.

Writes into the output folder: solution.json (everything), lights.csv and reflectances.csv (spectra), swatches.gpl and
swatches.ase, and palette.png (a row per reflectance, a column per light; the wanted color inside the actual one).
A texture document (pictures instead of a table; see examples/two_pictures.toml) is designed as `texture` does it.
Exits with 1 if the answer is not reliable: exact cells that conflict, a light that no observer sees, or no solver
that passed its check. Files are written all the same.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.cli.shared.outputs import files_of_document, require_outputs
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError, SpectralError, UnknownNameError, counted, first_of
from spectral_core.files.whole_set import whole_files
from spectral_core.palette import PaletteProblem, PaletteSolution, solve_palette
from spectral_core.spectra.pictures import write_picture

NAMED = {"rounds": "--rounds"}
WRITTEN = ("solution.json", "lights.csv", "reflectances.csv", "swatches.gpl", "swatches.ase", "palette.png")
"""Files in the folder of a solution."""
TILE, INSET = 96, 32
"""Pixels of a cell's color, and of the wanted color inside it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument(
        "palette", nargs="?", type=Path, metavar="PALETTE.toml",
        help="a palette or a texture in TOML or JSON; see examples/",
    )  # fmt: skip
    parser.add_argument("--preset", help="instead of a file: one of the presets by name, such as 'Hidden mark'")
    parser.add_argument("--out", type=Path, help="folder to write to (default: out/ and the palette's name)")
    parser.add_argument("--rounds", type=int, help="at most this many rounds, instead of the palette's own number")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    is_texture = arguments.palette is not None and _is_texture(arguments.palette)
    return dict.fromkeys(("rounds", "preset"), "a texture is designed") if is_texture else {}


def run(arguments: argparse.Namespace) -> int:
    """Solve, print the table of errors, write the files."""
    if arguments.palette is not None and _is_texture(arguments.palette):
        from spectral_core.cli.shared.texture import make_texture
        from spectral_core.palette.texture.project import read_project

        folder = arguments.out or Path("out") / arguments.palette.stem
        read = files_of_document(arguments.palette)
        return make_texture(read_project(arguments.palette), folder, read=read, as_json=arguments.json, tell=False)
    problem, name = _problem(arguments)
    if arguments.rounds is not None:
        problem = replace(problem, rounds=arguments.rounds)
    folder = arguments.out or Path("out") / name
    read = [] if arguments.palette is None else files_of_document(arguments.palette)
    require_outputs([folder / each for each in WRITTEN], read)
    solution = solve_palette(problem)
    with whole_files(folder) as unfinished:  # before printing, because the reader of the table may close the pipe
        clipped = _write(unfinished, solution)
    if clipped:
        named = first_of(clipped, len(clipped))
        print(f"note: the channels of swatches outside the display's gamut were clipped, as screens show them: {named}")
    _print(solution)
    print(f"written to {folder}: {', '.join(WRITTEN)}")
    if arguments.json:
        print_json(_summary(solution, folder, list(WRITTEN)))
    return 0 if solution.status.usable else 1


def _is_texture(path: Path) -> bool:
    """True if a document states that it is a texture; the reader of palettes reports unreadable files."""
    from spectral_core.documents import read_document
    from spectral_core.palette.texture.project import FORMAT

    try:
        stated = read_document(path, lambda document, _folder: document, "a palette or a texture")
    except SpectralError:
        return False
    return isinstance(stated, dict) and stated.get("format") == FORMAT


def _problem(arguments: argparse.Namespace) -> tuple[PaletteProblem, str]:
    """The named problem, and a name for its folder."""
    if (arguments.palette is None) == (arguments.preset is None):
        raise InvalidInputError("give either a palette file or --preset NAME")
    if arguments.preset is None:
        from spectral_core.palette.files import read_palette

        return read_palette(arguments.palette), arguments.palette.stem
    from spectral_core.palette.presets import PRESETS

    by_name = {name.lower(): make for name, make in PRESETS.items()}
    wanted = arguments.preset.lower().replace("_", " ").replace("-", " ")
    by_word = {name.replace("-", " "): make for name, make in by_name.items()}
    if wanted not in by_word:
        raise UnknownNameError.among("preset", arguments.preset, PRESETS)
    return by_word[wanted](), wanted.replace(" ", "_")


def _print(solution: PaletteSolution) -> None:
    """ΔE2000 of each cell, then the status and its remedy."""
    lights = [light.name for light in solution.illuminants]
    width = max(12, *(len(surface.name) + 1 for surface in solution.reflectances))
    print(f"{'ΔE2000':{width}}" + "".join(f"{name[:15]:>16}" for name in lights))
    for surface, row in zip(solution.reflectances, solution.delta_e_2000, strict=True):
        errors = ["—" if np.isnan(error) else f"{error:.3f}" for error in row]
        print(f"{surface.name:{width}}" + "".join(f"{text:>16}" for text in errors))
    rounds = counted(solution.rounds, "round")
    print(
        f"{solution.status.value} after {rounds} by {', '.join(solution.engines) or 'no solver'}; "
        f"KKT residual {solution.kkt_residual:.1e}, {1e3 * solution.timings['total']:.0f} ms"
    )
    if solution.remedy:
        print(solution.remedy)
    for note in solution.notes:
        print(f"note: {note}")


def _write(folder: Path, solution: PaletteSolution) -> tuple[str, ...]:
    """Write all files; returns the names of the swatches that are outside the display's gamut."""
    from spectral_core.palette.files import swatches_of, write_solution, write_swatches
    from spectral_core.spectra.files import write_spectra

    write_solution(folder / "solution.json", solution)
    write_spectra(folder / "lights.csv", solution.illuminants)
    write_spectra(folder / "reflectances.csv", solution.reflectances)
    for ending in ("gpl", "ase"):
        clipped = write_swatches(folder / f"swatches.{ending}", swatches_of(solution), clip=True)
    write_picture(folder / "palette.png", table_picture(solution))
    return clipped


def table_picture(solution: PaletteSolution) -> NDArray[Any]:
    """Linear RGB picture of the table: actual colors, the wanted ones as squares within, on a dark ground."""
    rows, columns, _ = solution.actual_linear_rgb.shape
    gap = 8
    step = TILE + gap
    picture = np.full((rows * step + gap, columns * step + gap, 3), 0.02, dtype=np.float32)
    start = (TILE - INSET) // 2
    for i in range(rows):
        for j in range(columns):
            top, left = gap + i * step, gap + j * step
            picture[top : top + TILE, left : left + TILE] = solution.actual_linear_rgb[i, j]
            if np.isfinite(solution.delta_e_2000[i, j]):
                inside = (slice(top + start, top + start + INSET), slice(left + start, left + start + INSET))
                picture[inside] = solution.target_linear_rgb[i, j]
    return picture


def _summary(solution: PaletteSolution, folder: Path, written: list[str]) -> dict[str, Any]:
    """The object that ``--json`` prints."""
    return {
        "status": solution.status.value,
        "remedy": solution.remedy,
        "delta_e_2000": [[None if np.isnan(e) else float(e) for e in row] for row in solution.delta_e_2000],
        "max_delta_e_2000": solution.max_delta_e_2000,
        "lights": [light.name for light in solution.illuminants],
        "reflectances": [surface.name for surface in solution.reflectances],
        "kkt_residual": solution.kkt_residual,
        "rounds": solution.rounds,
        "engines": list(solution.engines),
        "conflicts": [conflict.text for conflict in solution.conflicts],
        "notes": list(solution.notes),
        "seconds": solution.timings["total"],
        "out": str(folder),
        "files": written,
    }
