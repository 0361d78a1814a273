# SPDX-License-Identifier: GPL-3.0-or-later
"""Amounts of paints, inks or filters for a wanted material: a recipe in grams, coverages or thicknesses.

The unknowns are amounts of real colorants. Paints mix by Kubelka and Munk's theory of opaque layers (absorption and
scattering add), inks by Yule and Nielsen's halftones over Demichel's overprints, filters by Bouguer and Beer's law.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.palette.given import sequence_of
from spectral_core.palette.paint.mixtures import halftone_shares, paint_mixture
from spectral_core.palette.recipe.amounts import best_amounts, lab_of
from spectral_core.palette.recipe.library import DOSAGE_ERROR, amount_text
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.spectra.color import delta_e_2000
from spectral_core.spectra.observer import OBSERVER_NAMES, observer
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum, common_grid

Array = NDArray[np.float64]
Kind = Literal["paints", "inks", "filters"]
LEAST_REFLECTANCE = 1e-4
"""Least reflectance of a paint, below any measured one; a perfect black would have infinite absorption."""
MOST_COLORANTS = 8
"""Most colorants in one recipe."""
STEP = 1e-4
"""Share of an amount by which it is changed to find the slopes of colors."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Colorants:
    """Measured colorants on one grid. ``spectra``: (k, n).

    ``"paints"``: reflectances of the opaque paints, ``scattering`` (k,) relative to each other; amounts are shares of
    the mixture. ``"inks"``: reflectances of full coverage on ``paper`` (n,), ``dot_gain_n`` of Yule and Nielsen;
    amounts are coverages in [0, 1]. ``"filters"``: internal transmittances of unit thickness; amounts are
    thicknesses up to 4, in front of ``paper``. Values below ``LEAST_REFLECTANCE`` are raised to it.
    """

    kind: Kind
    names: tuple[str, ...]
    grid: SpectralGrid
    spectra: Array
    scattering: Array | None = None
    paper: Array | None = None
    dot_gain_n: float = 2.0

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or self.kind not in ("paints", "inks", "filters"):
            raise InvalidInputError(f"colorants are {self.kind!r}; expected 'paints', 'inks' or 'filters'")
        object.__setattr__(self, "names", sequence_of(f"names of the {self.kind}", self.names))
        require_kind(f"the grid of the {self.kind}", self.grid, SpectralGrid, "such as design_grid()")
        count = len(self.names)
        if not 1 <= count <= (8 if self.kind == "inks" else 24):
            raise InvalidInputError(
                f"{count} {self.kind}; expected 1 to {8 if self.kind == 'inks' else 24}: leave out some of them"
            )
        spectra = frozen_array(f"spectra of the {self.kind}", self.spectra, (count, self.grid.size))
        if spectra.min() < 0 or spectra.max() > 1:
            raise InvalidInputError(
                f"spectra of the {self.kind} span {spectra.min():g} to {spectra.max():g}, not 0 to 1"
            )
        object.__setattr__(self, "spectra", np.maximum(spectra, LEAST_REFLECTANCE))
        if self.scattering is not None:
            object.__setattr__(self, "scattering", frozen_array("scattering", self.scattering, (count,)))
            if np.min(np.asarray(self.scattering)) <= 0:
                raise InvalidInputError(f"scattering is {np.min(self.scattering):g} at least; expected it above 0")
        paper = np.ones(self.grid.size) if self.paper is None else self.paper
        object.__setattr__(self, "paper", frozen_array("paper", paper, (self.grid.size,)))
        self._check_paper()
        require_range("dot_gain_n", self.dot_gain_n, 1.0, 100.0)

    def _check_paper(self) -> None:
        """Raise InvalidInputError for a paper, or an overprint of inks on it, that reflects more light than it gets."""
        paper = np.asarray(self.paper)
        if paper.min() < 0 or paper.max() > 1:
            raise InvalidInputError(f"the paper spans {paper.min():g} to {paper.max():g}; expected 0 to 1")
        if self.kind != "inks":
            return
        brightest = paper * np.prod(np.maximum(self._on_paper(), 1.0), axis=0)
        worst = int(np.argmax(brightest))
        if brightest[worst] > 1 + Reflectance.TOLERANCE:
            raise InvalidInputError(
                f"overprints of the inks reflect {brightest[worst]:.3g} of the light at "
                f"{self.grid.wavelengths_nm[worst]:g} nm, because inks reflect more than their paper there; expected "
                "at most 1: give the paper that they were printed on, or leave out an ink"
            )

    def _on_paper(self) -> Array:
        """Transmittance of each ink, (k, n): its reflectance relative to that of the paper."""
        return np.asarray(self.spectra / np.maximum(np.asarray(self.paper), LEAST_REFLECTANCE))

    @property
    def most(self) -> float:
        """Largest amount of one colorant."""
        return 4.0 if self.kind == "filters" else 1.0

    def reflectance(self, amounts: ArrayLike) -> Array:
        """Reflectance (n,) of amounts (k,); amounts of paints are divided by their sum."""
        given = frozen_array("amounts", amounts, (len(self.names),))
        if given.min() < 0 or (self.kind == "paints" and not given.any()):
            raise InvalidInputError(f"amounts are {given.tolist()}; expected at least 0, and some above")
        if self.kind == "paints":
            return paint_mixture(given / given.sum(), self.spectra, self.scattering)
        assert self.paper is not None
        if self.kind == "filters":
            # Light passes a filter on the way to the paper and back.
            return np.asarray(self.paper * np.prod(self.spectra ** (2 * given[:, None]), axis=0))
        shares = halftone_shares(given)
        bits = (np.arange(len(shares))[:, None] >> np.arange(len(given))) & 1
        # An overprint has the absorption of its inks, relative to the paper that each was measured on.
        relative = np.where(bits[:, :, None] == 1, self._on_paper(), 1.0)
        overprints = self.paper * np.prod(relative, axis=1)
        return np.asarray((shares @ overprints ** (1 / self.dot_gain_n)) ** self.dot_gain_n)


@dataclass(frozen=True, slots=True, eq=False)
class MaterialRecipe:
    """``amounts`` (k,): shares of the mixture, coverages or thicknesses; ``reflectance``: of the result.

    ``delta_e``: (L,) ΔE2000 to the target under each light. ``observer_delta_e``: (O, L), the same for every standard
    observer; ``metamerism_index``: the largest of it minus that of the first observer. ``dosage_delta_e``: (L,), mean
    ΔE2000 that ``DOSAGE_ERROR`` of each amount causes.
    """

    colorants: Colorants
    amounts: Array
    reflectance: Reflectance
    lights: tuple[str, ...]
    delta_e: Array
    observer_delta_e: Array
    metamerism_index: float
    dosage_delta_e: Array
    seconds: float

    def grams(self, total: float) -> dict[str, float]:
        """Grams of each paint for ``total`` grams of mixture. Raises InvalidInputError for inks and filters."""
        if self.colorants.kind != "paints":
            raise InvalidInputError(
                f"grams are of paints; these are {self.colorants.kind}, whose amounts are {self.unit}"
            )
        total = require_range("grams of the mixture", total, 0.0, 1e12)
        pairs = zip(self.colorants.names, self.amounts, strict=True)
        return {name: total * float(amount) for name, amount in pairs if amount > 0}

    @property
    def unit(self) -> str:
        """Unit of an amount."""
        return {"paints": "shares", "inks": "coverages", "filters": "thicknesses"}[self.colorants.kind]

    def text(self, total_g: float = 100.0) -> str:
        """The recipe as text lines."""
        total_g = require_range("grams of the mixture", total_g, 0.0, 1e12)
        factor, unit = {"paints": (total_g, "g"), "inks": (100.0, "%"), "filters": (1.0, "x")}[self.colorants.kind]
        pairs = zip(self.colorants.names, self.amounts, strict=True)
        lines = [f"{name:24} {amount_text(factor * amount, 3):>8} {unit}" for name, amount in pairs if amount > 0]
        for name, error, dosage in zip(self.lights, self.delta_e, self.dosage_delta_e, strict=True):
            lines.append(f"under {name}: ΔE2000 {error:.2f}; {100 * DOSAGE_ERROR:.0f} % dosage errors add {dosage:.2f}")
        return "\n".join([*lines, f"metamerism index over observers {self.metamerism_index:.2f}"])


def material_recipe(
    colorants: Colorants,
    target: Reflectance,
    lights: Sequence[Illuminant],
    *,
    most_colorants: int = 4,
    seed: int = 0,
) -> MaterialRecipe:
    """Find amounts whose color is nearest to that of a target reflectance under all lights.

    Parameters
    ----------
    colorants : the available colorants.
    target : the wanted reflectance, on any grid, such as a designed one; compared where the colorants are known, too.
    lights : illuminants under which the colors shall agree.
    most_colorants : colorants in the recipe, at least 1.
    seed : start of the random numbers of the dosage errors.

    Raises
    ------
    InvalidInputError : no light, a number out of range, or no wavelength that the target and the colorants have.
    """
    started = time.perf_counter()
    lights = sequence_of("lights", lights)
    if not lights:
        raise InvalidInputError("a recipe needs at least one light under which the colors shall agree; got none")
    require_kind("the colorants", colorants, Colorants)
    for word, each in (("the wanted reflectance", target), *(("a light", light) for light in lights)):
        require_kind(word, each, Spectrum)
    seed = require_whole("seed", seed, 0, 1 << 62)
    most = min(len(colorants.names), require_whole("most_colorants", most_colorants, 1, MOST_COLORANTS))
    colorants = _on_common_knots(colorants, target)
    matrix = stimulus_matrix(lights, colorants.grid)
    aim = target.at(colorants.grid.wavelengths_nm)
    wanted = lab_of(matrix, aim)
    amounts = best_amounts(colorants, matrix, wanted, most)
    made = colorants.reflectance(amounts)
    seen = [stimulus_matrix(lights, colorants.grid, observer(name)) for name in OBSERVER_NAMES]
    by_observer = np.stack([delta_e_2000(lab_of(each, made), lab_of(each, aim)) for each in seen])
    return MaterialRecipe(
        colorants, frozen_array("amounts", amounts), Reflectance(f"recipe of {target.name}", colorants.grid, made),
        tuple(light.name for light in lights), delta_e_2000(lab_of(matrix, made), wanted), by_observer,
        float(by_observer.max() - by_observer[0].max()), _dosage(colorants, matrix, amounts, seed),
        time.perf_counter() - started,
    )  # fmt: skip


def _on_common_knots(colorants: Colorants, target: Reflectance) -> Colorants:
    """The colorants on their knots and those of the target, between which its color would be another one."""
    first = Reflectance(colorants.names[0], colorants.grid, colorants.spectra[0])
    grid, _ = common_grid([target, first], "the recipe")
    if grid.same_as(colorants.grid):
        return colorants
    knots, own = grid.wavelengths_nm, colorants.grid.wavelengths_nm
    spectra = np.stack([np.interp(knots, own, each) for each in colorants.spectra])
    return replace(colorants, grid=grid, spectra=spectra, paper=np.interp(knots, own, np.asarray(colorants.paper)))


def _dosage(colorants: Colorants, matrix: Array, amounts: Array, seed: int) -> Array:
    """Mean ΔE2000 (L,) of normal errors of ``DOSAGE_ERROR`` of each amount, by first-order propagation in CIELAB."""
    used = np.flatnonzero(amounts)
    center = lab_of(matrix, colorants.reflectance(amounts))
    noise = np.random.default_rng(seed).normal(scale=DOSAGE_ERROR, size=(2000, len(used)))
    # No ink covers more than all of the paper, however much of it is printed.
    room = np.full(len(used), np.inf) if colorants.kind != "inks" else colorants.most / amounts[used] - 1
    slopes = []
    for index, above in zip(used, np.minimum(room, STEP), strict=True):
        up, down = amounts.copy(), amounts.copy()
        up[index] = up[index] * (1 + above) if above == STEP else colorants.most
        down[index] *= 1 - STEP
        difference = lab_of(matrix, colorants.reflectance(up)) - lab_of(matrix, colorants.reflectance(down))
        slopes.append(difference / (above + STEP))
    shifted = center + np.einsum("sk,klc->slc", np.minimum(noise, room), np.array(slopes))
    return np.asarray(delta_e_2000(shifted, np.broadcast_to(center, shifted.shape)).mean(axis=0))
