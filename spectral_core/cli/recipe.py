# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes for spectra that can be made: drive levels of an LED lamp, amounts of paints, inks or filters.

`recipe lamp CHANNELS.csv --cct 4000` prints the drive level of each channel for a white of that temperature.
`recipe paints PAINTS.csv --target dark_skin.csv` prints the grams of each paint for a wanted reflectance; `inks` and
`filters` likewise. A target is a reflectance of the catalogue, FILE or FILE@NAME.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spectral_core.checks import require_range
from spectral_core.cli.shared.report import print_json
from spectral_core.errors import InvalidInputError
from spectral_core.files.guarded import no_file

if TYPE_CHECKING:
    from spectral_core.spectra.files.columns import SpectrumKind
    from spectral_core.spectra.spectrum import Illuminant, Spectrum


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    kinds = ["lamp", "paints", "inks", "filters"]
    parser.add_argument("kind", choices=kinds, metavar="|".join(kinds), help="what is mixed")
    parser.add_argument(
        "spectra", type=Path, metavar="SPECTRA.csv", help="file with one spectrum per channel, paint, ink or filter"
    )
    parser.add_argument("--most", type=int, metavar="N", help="channels or colorants in the recipe at most")
    parser.add_argument("--cct", type=float, metavar="K", help="lamp: color temperature in kelvin")
    parser.add_argument("--duv", type=float, default=0.0, help="lamp: distance from Planck's locus (0)")
    parser.add_argument("--cri", type=float, default=80.0, help="lamp: least color rendering index Ra (80)")
    parser.add_argument("--rf", type=float, help="lamp: least fidelity Rf of TM-30")
    parser.add_argument(
        "--rg", type=float, nargs=2, metavar=("LOW", "HIGH"), help="lamp: least and largest gamut Rg of TM-30"
    )
    parser.add_argument(
        "--cct-tolerance", type=float, default=0.0, metavar="K", help="lamp: kelvin that the white may be off"
    )
    parser.add_argument("--duv-tolerance", type=float, default=0.0, metavar="D", help="lamp: Duv that it may be off")
    parser.add_argument("--target", metavar="NAME", help="material: the wanted reflectance")
    parser.add_argument(
        "--light", action="append", default=[], metavar="NAME", help="material: light; repeat it for more (D65 and A)"
    )
    parser.add_argument("--paper", metavar="NAME", help="inks and filters: reflectance underneath (perfect white)")
    parser.add_argument("--dot-gain", type=float, default=2.0, metavar="N", help="inks: n of Yule and Nielsen (2)")
    parser.add_argument("--grams", type=float, default=100.0, help="paints: grams of the mixture (100)")


NAMED = {
    "most_channels": "--most", "most_colorants": "--most", "color temperature": "--cct", "Duv": "--duv",
    "rendering_index (Ra)": "--cri", "fidelity (Rf)": "--rf", "gamut (Rg)": "--rg",
    "cct_tolerance_k": "--cct-tolerance", "duv_tolerance": "--duv-tolerance", "dot_gain_n": "--dot-gain",
}  # fmt: skip
OF_LAMPS = ("cct", "duv", "cri", "rf", "rg", "cct_tolerance", "duv_tolerance")
OF_MATERIALS = {
    "target": ("paints", "inks", "filters"), "light": ("paints", "inks", "filters"), "paper": ("inks", "filters"),
    "dot_gain": ("inks",), "grams": ("paints",),
}  # fmt: skip


def unused(arguments: argparse.Namespace) -> dict[str, str]:
    """Options that this call would ignore, with the reason of each."""
    ignored = {name: f"it is for {' and '.join(kinds)}" for name, kinds in OF_MATERIALS.items()
               if arguments.kind not in kinds}  # fmt: skip
    return ignored if arguments.kind == "lamp" else ignored | dict.fromkeys(OF_LAMPS, "it is for lamps")


def run(arguments: argparse.Namespace) -> int:
    """Find and print the recipe. Exits with 1 if the lamp misses its requirements."""
    return _lamp(arguments) if arguments.kind == "lamp" else _material(arguments)


def _lamp(arguments: argparse.Namespace) -> int:
    from spectral_core.palette.recipe.lamp import LampQuality, lamp_recipe
    from spectral_core.palette.recipe.missed import missed_requests

    if arguments.cct is None:
        raise InvalidInputError("a lamp needs --cct, the color temperature in kelvin")
    quality = LampQuality(
        arguments.cri, arguments.rf, None if arguments.rg is None else (arguments.rg[0], arguments.rg[1]),
        arguments.cct_tolerance, arguments.duv_tolerance,
    )  # fmt: skip
    recipe = lamp_recipe(
        [_illuminant(spectrum) for spectrum in _channels(arguments.spectra, "illuminant")], arguments.cct,
        duv=arguments.duv, quality=quality, most_channels=arguments.most,
    )  # fmt: skip
    print(recipe.text())
    missed = missed_requests(recipe, quality)
    if not recipe.met:
        print(
            f"not all requirements can be reached with these channels: {', '.join(missed)}; this is the nearest "
            "recipe. Add channels, allow more of them with --most, or require less."
        )
    if arguments.json:
        figures = {
            "drives": dict(zip(recipe.names, recipe.drives.tolist(), strict=True)), "cct_k": recipe.cct_k,
            "duv": recipe.duv, "rendering_index": recipe.rendering_index, "fidelity": recipe.fidelity,
            "gamut": recipe.gamut, "met": recipe.met, "missed": missed,
            "efficacy_lm_per_w": recipe.efficacy_lm_per_w, "dosage_delta_uv": recipe.dosage_delta_uv,
        }  # fmt: skip
        print_json(figures)
    return 0 if recipe.met else 1


def _material(arguments: argparse.Namespace) -> int:
    from spectral_core.cli.shared.spectra import illuminant_named, reflectance_named
    from spectral_core.palette.recipe.material import Colorants, material_recipe
    from spectral_core.spectra.spectrum import common_grid, told_apart

    if arguments.target is None:
        raise InvalidInputError("a recipe of a material needs --target, the wanted reflectance")
    spectra = _channels(arguments.spectra, "reflectance")
    target = reflectance_named(arguments.target)
    paper = None if arguments.paper is None else reflectance_named(arguments.paper)
    grid, note = common_grid([*spectra, target, *([] if paper is None else [paper])], "the recipe")
    if any(np.ptp(grid.wavelengths_nm) < np.ptp(each.grid.wavelengths_nm) for each in spectra):
        print(f"note: {note}")
    values = np.stack([spectrum.at(grid.wavelengths_nm) for spectrum in spectra])
    colorants = Colorants(
        arguments.kind, tuple(spectrum.name for spectrum in spectra), grid, values,
        paper=None if paper is None else paper.at(grid.wavelengths_nm),
        dot_gain_n=arguments.dot_gain,
    )  # fmt: skip
    lights = told_apart([illuminant_named(name) for name in arguments.light or ("D65", "A")])
    grams = require_range("--grams", arguments.grams, 1e-6, 1e12)
    most = {} if arguments.most is None else {"most_colorants": arguments.most}
    recipe = material_recipe(colorants, target, lights, **most)
    print(recipe.text(grams))
    if arguments.json:
        figures: dict[str, Any] = {
            "amounts": dict(zip(colorants.names, recipe.amounts.tolist(), strict=True)), "unit": recipe.unit,
            "delta_e": dict(zip(recipe.lights, recipe.delta_e.tolist(), strict=True)),
            "observer_delta_e": recipe.observer_delta_e.tolist(), "metamerism_index": recipe.metamerism_index,
            "dosage_delta_e": recipe.dosage_delta_e.tolist(),
        }  # fmt: skip
        print_json(figures)
    return 0


def _read(path: Path, kind: SpectrumKind) -> list[Spectrum]:
    from spectral_core.spectra.files import read_spectra

    if not path.is_file():
        example = "leds.csv" if kind == "illuminant" else "paints.csv"
        raise InvalidInputError(no_file(path, f"give a file of spectra such as examples/{example}"))
    return list(read_spectra(path, kind=kind))


def _channels(path: Path, kind: SpectrumKind) -> list[Spectrum]:
    from spectral_core.spectra.spectrum import told_apart

    return told_apart(_read(path, kind))


def _illuminant(spectrum: Spectrum) -> Illuminant:
    from spectral_core.spectra.spectrum import Illuminant

    return Illuminant(spectrum.name, spectrum.grid, spectrum.values)
