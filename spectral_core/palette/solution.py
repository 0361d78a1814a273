# SPDX-License-Identifier: GPL-3.0-or-later
"""The answer to a palette: spectra, colors, errors, and the results of its checks."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import counted
from spectral_core.palette.problem import CellIndex, PaletteProblem
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

VISIBLE_DELTA_E = 3.0
"""ΔE2000 from which a cell counts as missed and gets a warning."""


class PaletteStatus(StrEnum):
    """Status of a solve. The first two are checked optima: neither reflectances nor lights alone can be improved."""

    SOLVED = "solved"
    COMPROMISE = "compromise"
    EXACT_CONFLICT = "exact_conflict"
    INVISIBLE = "invisible"
    INACCURATE = "inaccurate"
    IMPROVING = "still_improving"

    @property
    def trusted(self) -> bool:
        """True if the answer passed the checks of optimality and bounds, and every exact cell holds."""
        return self in (PaletteStatus.SOLVED, PaletteStatus.COMPROMISE)

    @property
    def usable(self) -> bool:
        """True if bounds and exact cells hold, and the colors belong to the spectra; the answer may not be optimal."""
        return self.trusted or self is PaletteStatus.IMPROVING


UNRELIABLE = "No solver's solution passed the check; the best one is shown, but it is not reliable."
ROUGH = (
    "All exact cells hold, but the spectra may be rougher than they must be: beside these cells the smoothness is lost "
    "in rounding. Raise the smoothness, or make one of the cells not exact."
)
NOT_FOUND = (
    "No lights and materials were found with which all exact cells hold; the closest compromise is shown. Make one of "
    "the cells not exact, choose another spectrum from which a light begins, or give more time or rounds."
)
"""Remedy of conflicting exact cells if lights and materials are both designed: no search proves that none exist."""
REMEDIES = {
    PaletteStatus.SOLVED: "",
    PaletteStatus.COMPROMISE: (
        "Some colors cannot be reached together. Raise the weight of those that matter, free or ignore a conflicting "
        "cell, let a light be designed too, brighten the lights, lower the smoothness, or use a finer grid."
    ),
    PaletteStatus.EXACT_CONFLICT: (
        "Not all exact cells can hold at once; the closest compromise is shown. Make one of the conflicting cells not "
        "exact, free a light or reflectance that they share, or remove the white of a light."
    ),
    PaletteStatus.INVISIBLE: (
        "A target is under a light that is invisible on this grid, or on a material that must be black under every "
        "light. Give the light power between 380 and 780 nm, widen the grid, or make the black cells of the material "
        "not exact."
    ),
    PaletteStatus.INACCURATE: (
        f"{UNRELIABLE} Bring weights and light intensities nearer to each other, or add a little smoothness."
    ),
    PaletteStatus.IMPROVING: (
        "The time or the rounds ended while the spectra were still improving. Solve again to continue from here."
    ),
}
"""Remedy for each status."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """A cell that misses its target, and the cell whose release would reduce its error most."""

    cell: CellIndex
    delta_e_2000: float
    relieved_by: tuple[CellIndex, ...]
    """Cells, best release first; after the first release the error falls to ``delta_e_without``."""
    delta_e_without: float
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class PaletteSolution:
    """Designed and given spectra, and the color of each cell. Arrays of cells are (reflectances, lights, ...)."""

    problem: PaletteProblem
    illuminants: tuple[Spectrum, ...]
    """Each an ``Illuminant``, unless negative values were requested; measured ones on their own grid, scaled."""
    reflectances: tuple[Spectrum, ...]
    """Each a ``Reflectance``, unless values outside [0, 1] were requested."""
    target_linear_rgb: Array
    """(R, L, 3): the target; for same and constant cells the color of the cell referred to; NaN without one."""
    actual_linear_rgb: Array
    """(R, L, 3), for the first observer."""
    delta_e_2000: Array
    """(R, L): error of each cell, the largest over all observers and variants; NaN without a request."""
    residuals: dict[str, float]
    """Root mean square by criterion: "color" (linear RGB), "smoothness", "subspace", "robust"."""
    kkt_residual: float
    """Largest scaled violation of the optimality conditions of either side, at these spectra."""
    bound_violation: float
    """Largest distance of a spectrum outside its bounds."""
    status: PaletteStatus
    remedy: str
    rounds: int
    engines: tuple[str, ...]
    """Engines whose answers are in this solution, most used first."""
    notes: tuple[str, ...] = ()
    """Text on deviations from the request: capped weights, fallbacks, scaled lights."""
    conflicts: tuple[Conflict, ...] = ()
    light_scale: float = 1.0
    """Factor by which all lights were brightened (section 5.5)."""
    timings: dict[str, float] = field(default_factory=dict)
    """Seconds by stage."""
    amounts: tuple[Array | None, ...] = ()
    """Per light the amounts of its primaries; None without primaries."""
    state: Any = field(default=None, repr=False)
    """Warm start of the next solve; not part of the answer."""

    def __repr__(self) -> str:
        rows, columns = self.delta_e_2000.shape
        size = f"{counted(rows, 'reflectance')}, {counted(columns, 'light')}"
        return f"PaletteSolution({self.status}, {size}, ΔE2000 {self.max_delta_e_2000:.3g} at most)"

    @property
    def max_delta_e_2000(self) -> float:
        """Largest error of any cell, and of any pair of cells with equal requested colors; 0 without requests."""
        known = self.delta_e_2000[np.isfinite(self.delta_e_2000)]
        return max(float(known.max(initial=0.0)), self.residuals.get("worst_pair_delta_e_2000", 0.0))
