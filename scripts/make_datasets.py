# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes spectral_core/spectra/data/*.csv from colour-science, so that the program does not import it at its start."""

from __future__ import annotations

import sys
from pathlib import Path

import colour
import numpy as np

from spectral_core.cli.shared.terminal import completed

DATA = Path(__file__).parents[1] / "spectral_core" / "spectra" / "data"
OBSERVERS = {
    "cie_1931_2deg": "CIE 1931 2 Degree Standard Observer",
    "cie_1964_10deg": "CIE 1964 10 Degree Standard Observer",
    "cie_2015_2deg": "CIE 2015 2 Degree Standard Observer",
    "cie_2015_10deg": "CIE 2015 10 Degree Standard Observer",
}


def write(name: str, columns: dict[str, dict[float, float]], source: str) -> None:
    """One CSV: a comment, a header, a row per wavelength; cells outside a spectrum's range stay empty."""
    wavelengths = sorted({w for column in columns.values() for w in column})
    lines = [f"# {source}", ",".join(["wavelength_nm", *columns])]
    for w in wavelengths:
        cells = [repr(float(np.float64(c[w]))) if w in c else "" for c in columns.values()]
        lines.append(",".join([f"{w:g}", *cells]))
    (DATA / name).write_text("\n".join(lines) + "\n", "utf-8")


def as_column(sd: colour.SpectralDistribution) -> dict[float, float]:
    return dict(zip(sd.wavelengths.tolist(), sd.values.tolist(), strict=True))


def main() -> None:
    observers = {}
    for name, title in OBSERVERS.items():
        cmfs = colour.MSDS_CMFS[title]
        for axis, values in zip("xyz", cmfs.values.T, strict=True):
            observers[f"{name} {axis}"] = dict(zip(cmfs.wavelengths.tolist(), values.tolist(), strict=True))
    write("observers.csv", observers, "CIE color matching functions, 1 nm, as colour-science holds them (BSD-3-Clause)")
    lights = {**colour.SDS_ILLUMINANTS, **colour.SDS_LIGHT_SOURCES}
    kept = {name.replace(",", " "): as_column(sd) for name, sd in lights.items() if "ISO 7589" not in name}
    write("illuminants.csv", kept, "CIE illuminants and measured lamps, as colour-science holds them (BSD-3-Clause)")
    patches = {name: as_column(sd) for name, sd in colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"].items()}
    write("reflectances.csv", patches, "Color checker, N. Ohta 1997, as colour-science holds it (BSD-3-Clause)")
    write_natural_components()


def write_natural_components(count: int = 24) -> None:
    """Principal components of the CIE 224:2017 materials (not centered), scaled to carry their second moments."""
    from colour.quality.cfi2017 import load_TCS_CIE2017

    materials = load_TCS_CIE2017(colour.SpectralShape(380, 780, 5))
    _, lengths, directions = np.linalg.svd(materials.values.T, full_matrices=False)
    components = np.round(directions[:count].T * lengths[:count] / np.sqrt(materials.values.shape[1]), 8)
    columns = {
        f"component {index + 1}": dict(zip(materials.wavelengths.tolist(), column.tolist(), strict=True))
        for index, column in enumerate(components.T)
    }
    write("natural_components.csv", columns, "second moments of the 99 materials of CIE 224:2017 (colour-science, BSD)")


if __name__ == "__main__":
    sys.exit(completed(main))
