# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare light models: a surface as a few numbers, a light as a small matrix, and the color error that this costs.

`light-model --light D65 --light HP1` prints the error of each model under these lights, on the surfaces of the color
checker or on those that --surface names, after one reflection and after two. `--out model.json` writes the numbers of
the surfaces and the matrices of the lights for one model (`--keep`), for a renderer of your own. Names are of the
catalogue, FILE or FILE@NAME.
"""

from __future__ import annotations

import argparse
import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from spectral_core.cli.shared.parser import without_companion
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError, UnknownNameError, counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from spectral_core.light_models import LightModel
    from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid

SAME_KNOT = 1e-6
"""Distance of two wavelengths, in nm, that are one."""
SIZES = (3, 5, 8)
"""Numbers per surface of the models that learn a basis."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument(
        "--light", action="append", default=[], metavar="NAME", help="light; repeat it for more (D65, A and FL11)"
    )
    parser.add_argument(
        "--surface", action="append", default=[], metavar="NAME", help="surface; repeat it for more (the color checker)"
    )
    parser.add_argument(
        "--keep", default="8 nodes", metavar="MODEL", help="model to write, as the table names it (8 nodes)"
    )
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the kept model's numbers and matrices")


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    return without_companion(arguments, {"keep": "out"})


def run(arguments: argparse.Namespace) -> int:
    """Print a line per model, and write one model where asked."""
    from spectral_core.cli.shared.outputs import require_apart, require_format, require_outputs
    from spectral_core.cli.shared.spectra import files_in, illuminant_named, reflectance_named
    from spectral_core.files.whole import write_text
    from spectral_core.spectra import catalogue, observer
    from spectral_core.spectra.spectrum import told_apart

    names = arguments.surface or catalogue.reflectance_names()
    if arguments.out is not None:
        require_apart([arguments.out], [file for name in (*arguments.light, *names) for file in files_in(name)])
        require_format("--out", arguments.out, "JSON", ".json")
    named = [illuminant_named(name) for name in arguments.light or ("D65", "A", "FL11")]
    lights = [observer.normalized(light) for light in told_apart(named)]
    for light in lights:
        _require_white(light)
    surfaces = told_apart([reflectance_named(name) for name in names])
    grid = _grid(surfaces)
    models = _models(lights, surfaces, grid)
    if arguments.keep not in models:
        raise UnknownNameError.among("light model", arguments.keep, models)
    if arguments.out is not None:
        require_outputs([arguments.out])
    figures = {name: _figures(model, lights, surfaces) for name, model in models.items()}
    kept = models[arguments.keep]
    if arguments.out is not None:  # before printing, because the reader of the table may close the pipe
        write_text(arguments.out, json.dumps(_document(arguments.keep, kept, lights, surfaces), indent=1) + "\n")
    count = counted(len(surfaces), "surface")
    print(f"{count} under {', '.join(light.name for light in lights)}; ΔE2000 to the full spectra")
    print(f"{'model':<22}{'mean':>8}{'largest':>9}{'mean, twice':>13}{'products':>10}")
    for name, row in figures.items():
        print(
            f"{name:<22}{row['mean']:>8.2f}{row['largest']:>9.2f}{row['mean_twice']:>13.2f}{row['multiplications']:>10}"
        )
    if arguments.out is not None:
        print(f"{arguments.out}: {kept.size} numbers per surface, a 3×{kept.size} matrix per light")
    if arguments.json:
        print_json({"models": figures})
    return 0


def _grid(surfaces: Sequence[Reflectance]) -> SpectralGrid:
    """Steps of 5 nm, and the knots of the surfaces: a peak between two steps would count in no error."""
    import numpy as np

    from spectral_core.spectra.spectrum import SpectralGrid

    low, high, step = 380.0, 780.0, 5.0
    grid = SpectralGrid.uniform(low, high, step)
    knots = np.concatenate([surface.grid.wavelengths_nm for surface in surfaces])
    further = knots[(knots > low) & (knots < high) & (np.abs(knots / step - np.round(knots / step)) > SAME_KNOT)]
    further = np.unique(np.round(further / SAME_KNOT)) * SAME_KNOT  # files write decimals of one knot differently
    return SpectralGrid(np.union1d(grid.wavelengths_nm, further)) if further.size else grid


def _require_white(light: Illuminant) -> None:
    """Raise InvalidInputError for a light whose white has no color difference, such as a red laser."""
    from spectral_core.spectra.observer import xyz_of

    white = xyz_of(light)
    if min(white) <= 0:
        raise InvalidInputError(
            f"light {light.name!r} has the white XYZ {white.round(6).tolist()}, in which no color difference is "
            "defined; expected power in the whole visible range"
        )


def _models(lights: Sequence[Illuminant], surfaces: Sequence[Reflectance], grid: SpectralGrid) -> dict[str, LightModel]:
    """The models by name; those on a basis learn it from these lights and surfaces, where they suffice."""
    from spectral_core.light_models import (
        NATURAL_NODES_NM,
        BasisModel,
        FactorModel,
        NodeModel,
        RgbModel,
        principal_components,
        representative_spectra,
    )
    from spectral_core.spectra.catalogue import illuminant

    spectra = representative_spectra(lights, surfaces, grid)
    models: dict[str, LightModel] = {"RGB under D65": RgbModel(grid, illuminant("D65"))}
    for size in (size for size in SIZES if size <= min(spectra.shape)):
        basis = principal_components(spectra, size)
        models[f"{size} components"] = BasisModel(grid, basis)
        with contextlib.suppress(InvalidInputError):  # lights that leave parts of the spectrum dark have no factors
            models[f"{size} factors"] = FactorModel(grid, basis)
    models |= {f"{size} nodes": NodeModel.natural(size, grid) for size in NATURAL_NODES_NM}
    models["nodes of the surfaces"] = NodeModel.scene(surfaces, grid)
    return models


def _figures(model: LightModel, lights: Sequence[Illuminant], surfaces: Sequence[Reflectance]) -> dict[str, Any]:
    import numpy as np

    from spectral_core.spectra.color import delta_e_2000, lab_from_xyz
    from spectral_core.spectra.observer import xyz_from_product

    values = np.array([surface.at(model.grid.wavelengths_nm) for surface in surfaces])
    numbers = model.surface_coefficients(values)

    def errors(spectra: NDArray[np.float64], coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        found = []
        for light in lights:
            exact = xyz_from_product(light, model.grid)
            white = exact.sum(axis=1)
            shown = coefficients @ model.xyz_from_coefficients(light).T
            found.append(delta_e_2000(lab_from_xyz(spectra @ exact.T, white), lab_from_xyz(shown, white)))
        return np.array(found)

    once, twice = errors(values, numbers), errors(np.square(values), model.reflect(numbers, numbers))
    return {
        "mean": float(once.mean()), "largest": float(once.max()), "mean_twice": float(twice.mean()),
        "size": model.size, "multiplications": model.multiplications_per_reflection + 3 * model.size,
    }  # fmt: skip


def _document(
    name: str, model: LightModel, lights: Sequence[Illuminant], surfaces: Sequence[Reflectance]
) -> dict[str, Any]:
    return {
        "model": name,
        "wavelengths_nm": model.grid.wavelengths_nm.tolist(),
        "coefficients_from_values": model.coefficients_from_values.tolist(),
        "surfaces": {surface.name: model.surface_coefficients([surface])[0].tolist() for surface in surfaces},
        "linear_rgb_from_coefficients": {
            light.name: model.linear_rgb_from_coefficients(light).tolist() for light in lights
        },
    }
