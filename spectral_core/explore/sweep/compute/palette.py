# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette problem as a compute node: a sweep sets its numbers and collects its colors and errors."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.explore.sweep.compute.paths import place_of, require_set_once, set_path
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.outcome import Outcome
from spectral_core.explore.sweep.parameters import Space, Value

TILE = 24


@dataclass(frozen=True)
class PaletteNode:
    """Solves a palette with numbers of its problem set, such as ``smoothness`` or ``cells[0][1].weight``."""

    document: str
    folder: str
    paths: tuple[tuple[str, str], ...]
    fingerprint: str = ""

    @classmethod
    def of(cls, palette: Path, space: Space) -> PaletteNode:
        """The node of a palette file; checks every path on its document."""
        from spectral_core.palette.files import read_palette
        from spectral_core.palette.files.document import document_of

        problem = read_palette(palette)
        text = json_text(document_of(problem))
        paths = tuple((parameter.name, parameter.target) for parameter in space.parameters)
        for parameter in space.parameters:
            set_path(problem, parameter.target, parameter.value(0.5))
        require_set_once((f"the parameter {name}", place_of(problem, path)) for name, path in paths)
        print_ = hashlib.sha256((text + repr(paths)).encode()).hexdigest()
        return cls(text, str(palette.parent.resolve()), paths, print_)

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        from spectral_core.palette import solve_palette
        from spectral_core.palette.files.document import problem_of

        problem: Any = problem_of(json.loads(self.document), Path(self.folder))
        for name, path in self.paths:
            problem = set_path(problem, path, parameters[name])
        solution = solve_palette(problem)
        errors = np.asarray(solution.delta_e_2000, float)
        asked = errors[~np.isnan(errors)]
        values: dict[str, float | int | str] = {
            "delta_e_max": float(asked.max()) if asked.size else 0.0,
            "delta_e_mean": float(asked.mean()) if asked.size else 0.0,
            "kkt_residual": float(solution.kkt_residual),
            "rounds": int(solution.rounds),
            "status": solution.status.value,
        }
        rgb = np.clip(np.asarray(solution.actual_linear_rgb, float), 0.0, None)
        tiles = np.repeat(np.repeat(rgb, TILE, axis=0), TILE, axis=1)
        return Outcome(values, {"": tiles.astype(np.float32)})

    def describe(self) -> list[str]:
        """Sentences for the plan of a run."""
        return ["solves the palette once per point; each worker keeps the solvers loaded"]
