# SPDX-License-Identifier: GPL-3.0-or-later
"""The examples of the docs work: their files are read, their code runs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from spectral_core.palette import solve_palette
from spectral_core.palette.files import read_palette
from spectral_core.spectra.files import write_spectra
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

DOCS = Path(__file__).parents[2] / "docs"


def blocks(name: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / name).read_text("utf-8"), re.DOTALL)


def test_the_palette_of_the_docs_is_read_and_solved(tmp_path: Path) -> None:
    (text,) = blocks("spectra_files.md", "toml")
    (tmp_path / "palette.toml").write_text(text, encoding="utf-8")
    grid = SpectralGrid.uniform(380, 780, 5)
    lamp = Illuminant("street lamp", grid, np.exp(-(((grid.wavelengths_nm - 590) / 30) ** 2)))
    write_spectra(tmp_path / "lamps.csv", [lamp])
    assert solve_palette(read_palette(tmp_path / "palette.toml")).status.trusted


def test_the_code_of_the_page_on_light_models_runs() -> None:
    (code,) = blocks("light_models.md", "python")
    names: dict[str, object] = {}
    exec(code, names)
    assert names["twice"].shape == (1, 8)  # type: ignore[attr-defined]


def test_the_least_difference_equals_that_in_the_docs() -> None:
    code = blocks("distinct_paint_fluorescence.md", "python")[0]
    names: dict[str, object] = {}
    exec(code, names)
    assert names["solution"].residuals["least_delta_e_2000"] >= 30  # type: ignore[attr-defined]
