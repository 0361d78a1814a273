# SPDX-License-Identifier: GPL-3.0-or-later
"""Mix measured colors: as paint (Kubelka and Munk), or as patches too small to see (additively).

`mix cyan:3 blue:1 --law paint --light D65 --light A` prints the color of the mixture under each light. Names are of
the catalogue, FILE or FILE@NAME. Two designed metamers match additively under their light, and differ as paint.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError

HALF_STEP = 0.5 / 255
"""Distance outside a display's range that rounding to its 256 steps hides."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("parts", nargs="+", metavar="NAME:PARTS", help="a color and how many parts of it")
    parser.add_argument("--law", choices=["paint", "additive"], default="paint", help="how they mix (paint)")
    parser.add_argument(
        "--light",
        action="append",
        default=[],
        metavar="NAME",
        help="light to show it under; repeat it for more (D65 and A)",
    )
    parser.add_argument("--out", type=Path, help="write the mixture's reflectance to this spectrum file")


def run(arguments: argparse.Namespace) -> int:
    """Mix, print the colors, write the spectrum where asked."""
    from spectral_core.cli.shared.outputs import require_outputs
    from spectral_core.cli.shared.spectra import files_in, illuminant_named, reflectance_named
    from spectral_core.palette.paint.mixtures import additive_mixture, paint_mixture
    from spectral_core.palette.texture.reach import stimulus_matrix
    from spectral_core.spectra.color import display_hex_from_linear, display_rgb_from_linear
    from spectral_core.spectra.files import format_of_ending, write_spectra
    from spectral_core.spectra.spectrum import Reflectance, common_grid, told_apart

    named = [_part(word) for word in arguments.parts]
    lights = told_apart([illuminant_named(name) for name in arguments.light or ("D65", "A")])
    shares = np.array([parts for _, parts in named])
    shares = shares / shares.sum()
    measured = [reflectance_named(name) for name, _ in named]
    if arguments.out is not None:
        format_of_ending(arguments.out)
        read = [name for name, _ in named] + arguments.light
        require_outputs([arguments.out], [file for name in read for file in files_in(name)])
    grid, note = common_grid(measured, "the mixture")
    if note:
        print(f"note: {note}")
    spectra = np.stack([surface.at(grid.wavelengths_nm) for surface in measured])
    mixed = (paint_mixture if arguments.law == "paint" else additive_mixture)(shares, spectra)
    if arguments.out is not None:  # before printing, because the reader of the colors may close the pipe
        write_spectra(arguments.out, [Reflectance("mixture", grid, mixed)])
    colors = {}
    for light in lights:
        rgb = stimulus_matrix([light], grid) @ mixed
        display = display_rgb_from_linear(rgb)
        off = float(np.abs(display - np.clip(display, 0, 1)).max())
        beyond = " (no display shows it: this is the nearest value of each channel)" if off > HALF_STEP else ""
        colors[light.name] = display_hex_from_linear(rgb)
        print(f"under {light.name}: {colors[light.name]}{beyond}, linear sRGB {np.round(rgb, 4).tolist()}")
    if arguments.out is not None:
        print(f"written to {arguments.out}")
    if arguments.json:
        print_json({"colors": colors, "reflectance": mixed.tolist(), "wavelengths_nm": grid.wavelengths_nm.tolist()})
    return 0


def _part(word: str) -> tuple[str, float]:
    name, colon, parts = word.rpartition(":")
    try:
        count = float(parts)
    except ValueError:
        count = -1.0
    if not colon or not 0 < count < 1e9:
        raise InvalidInputError(f"{word!r} is no color with its parts; expected NAME:PARTS, such as blue:2")
    return name, count
