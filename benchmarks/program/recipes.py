# SPDX-License-Identifier: GPL-3.0-or-later
"""Recipes of lamps against colour-science, of paints against an independent Kubelka-Munk, and dosage noise."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from benchmarks import Options
from spectral_core.palette.recipe.lamp import LampQuality, LampRecipe, lamp_recipe
from spectral_core.palette.recipe.material import Colorants, material_recipe
from spectral_core.palette.recipe.white import LAMP_GRID
from spectral_core.palette.texture.lights import led
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.spectra.catalogue import illuminant, reflectance
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import SpectralGrid

CHANNELS = ((445, 20), (470, 22), (500, 25), (525, 32), (560, 90), (595, 16), (630, 18), (660, 20))
FIDELITY = ((3000, 0.0, 90, (95, 108)), (4000, 0.001, 92, None), (5000, 0.0, 85, (103, 112)))
"""Temperature, Duv, least Rf, and Rg between."""
ASKED = ((2700, 0.0, 90), (3000, 0.0, 95), (4000, 0.0, 90), (5000, 0.0, 95), (6500, 0.003, 80), (6500, -0.004, 90))
PAINTS = ("blue", "green", "red", "yellow", "magenta", "white 9.5 (.05 D)", "black 2 (1.5 D)")


def run(options: Options) -> dict[str, Any]:
    """Every figure of acceptance line 6 of the recipes."""
    lamps = [_lamp(*asked) for asked in (ASKED[:2] if options.quick else ASKED)]
    fidelity = [_fidelity(*asked) for asked in (FIDELITY[:1] if options.quick else FIDELITY)]
    paints = _paints(200 if options.quick else 3000)
    holds = {
        "LED mixes within Duv 0.001 and the CRI as asked": all(
            row["duv_error"] < 0.001 and row["rendering_short"] < 0.3 for row in lamps
        ),
        "TM-30 as asked, against colour-science": all(
            row["duv_error"] < 0.001 and row["short"] < 0.1 and row["disagreement"] < 0.1 for row in fidelity
        ),
        "paint recipes reproduced by an independent Kubelka-Munk": paints["largest_disagreement"] < 1e-4,
        "dosage noise of 2 % predicted within 20 %": paints["largest_dosage_error"] < 0.2,
    }
    return {"lamps": lamps, "fidelity": fidelity, "paints": paints, "holds": holds}


def _lamp(cct_k: float, duv: float, rendering_index: float) -> dict[str, float]:
    recipe = lamp_recipe([led(*channel) for channel in CHANNELS], cct_k, duv=duv, quality=LampQuality(rendering_index))
    kelvin, found_duv, index = _measured(recipe)
    print(
        f"{cct_k:.0f} K, Duv {duv:+.3f}, Ra {rendering_index:.0f}: {np.count_nonzero(recipe.drives)} channels; "
        f"colour-science says {kelvin:.0f} K, Duv {found_duv:+.5f}, Ra {index:.1f} ({recipe.seconds:.2f} s)"
    )
    return {
        "cct_k": cct_k, "duv_error": abs(found_duv - duv), "rendering_index": index,
        "rendering_short": max(0.0, rendering_index - index), "seconds": recipe.seconds,
    }  # fmt: skip


def _fidelity(cct_k: float, duv: float, least: float, gamut: tuple[float, float] | None) -> dict[str, float]:
    """A lamp by TM-30, and the distance of colour-science's numbers from the request and from ours."""
    quality = LampQuality(None, least, gamut)
    recipe = lamp_recipe([led(*channel) for channel in CHANNELS], cct_k, duv=duv, quality=quality)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour

        spd = colour.SpectralDistribution(dict(zip(LAMP_GRID.wavelengths_nm, recipe.lamp.values, strict=True)))
        found: Any = colour.colour_fidelity_index(spd, additional_data=True, method="ANSI/IES TM-30-18")
    low, high = gamut or (-np.inf, np.inf)
    short = max(0.0, least - found.R_f, low - found.R_g, found.R_g - high)
    print(
        f"{cct_k:.0f} K, Duv {duv:+.3f}, Rf {least:.0f}, Rg {gamut}: {np.count_nonzero(recipe.drives)} channels; "
        f"colour-science says Rf {found.R_f:.1f}, Rg {found.R_g:.1f}, Duv {found.D_uv:+.5f} ({recipe.seconds:.2f} s)"
    )
    return {
        "cct_k": cct_k, "fidelity": found.R_f, "gamut": found.R_g, "short": short, "duv_error": abs(found.D_uv - duv),
        "disagreement": max(abs(found.R_f - recipe.fidelity), abs(found.R_g - recipe.gamut)),
        "seconds": recipe.seconds,
    }  # fmt: skip


def _measured(recipe: LampRecipe) -> tuple[float, float, float]:
    """Temperature, Duv and Ra as colour-science evaluates the spectrum."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour

        spd = colour.SpectralDistribution(dict(zip(LAMP_GRID.wavelengths_nm, recipe.lamp.values, strict=True)))
        uv = colour.UCS_to_uv(colour.XYZ_to_UCS(colour.sd_to_XYZ(spd)))
        kelvin, duv = colour.temperature.uv_to_CCT_Ohno2013(uv)
        return float(kelvin), float(duv), float(colour.colour_rendering_index(spd))


def _paints(trials: int) -> dict[str, Any]:
    measured = SpectralGrid.uniform(400, 700, 10)
    given = np.stack([reflectance(name).at(measured.wavelengths_nm) for name in PAINTS])
    lights = [illuminant("D65"), illuminant("A")]
    # Paints are measured at every second knot of the targets: between these the color of a recipe would be another one.
    grid = SpectralGrid.uniform(400, 700, 5)
    spectra = np.stack([np.interp(grid.wavelengths_nm, measured.wavelengths_nm, each) for each in given])
    matrix = stimulus_matrix(lights, grid)
    mixed = Colorants("paints", PAINTS, grid, spectra)
    rng = np.random.default_rng(8)
    rows, disagreement, dosage = {}, 0.0, 0.0

    def lab(values: Any) -> Any:
        return lab_from_linear_rgb((matrix @ values).reshape(2, 3))

    for name in ("dark skin", "foliage", "purple", "orange"):
        recipe = material_recipe(Colorants("paints", PAINTS, measured, given), reflectance(name), lights)
        ratio = sum(a * (1 - s) ** 2 / (2 * s) for a, s in zip(recipe.amounts, spectra, strict=True))
        made = 1 + ratio - np.sqrt(ratio**2 + 2 * ratio)
        errors = delta_e_2000(lab(made), lab(reflectance(name).at(grid.wavelengths_nm)))
        disagreement = max(disagreement, float(np.abs(errors - recipe.delta_e).max()))
        dosed = recipe.amounts * (1 + 0.02 * rng.normal(size=(trials, len(PAINTS))))
        noise = np.mean([delta_e_2000(lab(mixed.reflectance(row)), lab(made)) for row in dosed], axis=0)
        dosage = max(dosage, float(np.abs(recipe.dosage_delta_e / noise - 1).max()))
        rows[name] = {"delta_e": recipe.delta_e, "dosage": recipe.dosage_delta_e, "dosage_measured": noise}
        print(
            f"{name}: ΔE2000 {recipe.delta_e.round(2)}, dosage {recipe.dosage_delta_e.round(3)}, "
            f"measured {noise.round(3)}"
        )
    return {"recipes": rows, "largest_disagreement": disagreement, "largest_dosage_error": dosage}
