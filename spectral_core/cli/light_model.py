# SPDX-License-Identifier: GPL-3.0-or-later
"""A few numbers for each surface, a small matrix for each light: print both, and how far the colors are off.

`light_model --size 8 --light HP1` prints the wavelengths at which a surface is kept, the 3 x 8 matrix of the lamp, and
the color differences on the 24 patches of the color checker, against whole spectra (docs/light_models.md).
"""

from __future__ import annotations

import argparse
import json

import numpy as np


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--size", type=int, default=8, help="numbers for each surface, 6 to 9 (8)")
    parser.add_argument("--light", action="append", default=[], metavar="NAME", help="lights (D65, A, HP1)")


def run(arguments: argparse.Namespace) -> int:
    """Print matrices and errors."""
    from spectral_core.errors import InvalidInputError
    from spectral_core.light_models import NATURAL_NODES_NM, NodeModel
    from spectral_core.palette.recipe.library import paint_chips
    from spectral_core.spectra.catalogue import illuminant
    from spectral_core.spectra.color import delta_e_2000, lab_from_xyz
    from spectral_core.spectra.observer import normalized, xyz_of

    if arguments.size not in NATURAL_NODES_NM:
        known = ", ".join(map(str, sorted(NATURAL_NODES_NM)))
        raise InvalidInputError(f"--size is {arguments.size}; expected one of {known}")
    model = NodeModel.natural(arguments.size)
    patches = paint_chips()
    kept = model.surface_coefficients(patches)
    print(f"a surface is {model.size} numbers: {', '.join(f'{nm:g}' for nm in NATURAL_NODES_NM[arguments.size])} nm")
    figures = {}
    for name in arguments.light or ("D65", "A", "HP1"):
        light = normalized(illuminant(name))
        matrix = model.linear_rgb_from_coefficients(light)
        white = xyz_of(light)
        truth = np.array([xyz_of(light, patch) for patch in patches])
        shown = kept @ model.xyz_from_coefficients(light).T
        errors = delta_e_2000(lab_from_xyz(truth / white), lab_from_xyz(shown / white))
        figures[name] = {
            "matrix": matrix.tolist(),
            "mean_delta_e": float(errors.mean()),
            "largest": float(errors.max()),
        }
        print(f"{name}: ΔE2000 mean {errors.mean():.2f}, largest {errors.max():.2f}")
        print("\n".join("  " + " ".join(f"{value:8.4f}" for value in row) for row in matrix))
    if arguments.json:
        print(json.dumps(figures))
    return 0
