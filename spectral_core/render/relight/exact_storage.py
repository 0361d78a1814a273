# SPDX-License-Identifier: GPL-3.0-or-later
"""Hat function times color matching function, under flat light: exact for every spectrum of a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spectral_core.checks import require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.render.images.spectral_exr import spectral_channel
from spectral_core.render.relight.storage import Array, Storage
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import STANDARD, integration_points, observer
from spectral_core.spectra.spectrum import FIRST_NM, LAST_NM, WAVELENGTHS_NM, SpectralGrid, Spectrum

EXACT_GRID = SpectralGrid.uniform(380.0, 780.0, 10.0)
"""Default grid of an exact recording: that of the palette's designs."""
_LEAST_WEIGHT = 1e-3
"""Added to the observer's sensitivity, relative to its largest: the projection stays well-conditioned at the ends."""


@dataclass(frozen=True, eq=False)
class ExactStorage(Storage):
    """Every spectrum of ``knots``; these must be whole nm from 360 to 830, the range of the observer's table."""

    knots: SpectralGrid

    kind: ClassVar[str] = "exact"

    def __post_init__(self) -> None:
        require_kind("knots of an exact transport", self.knots, SpectralGrid)
        nm = self.knots.wavelengths_nm
        if np.any(nm != np.round(nm)) or nm[0] < FIRST_NM or nm[-1] > LAST_NM:
            raise InvalidInputError(
                f"an exact transport needs knots at whole nm within {FIRST_NM} to {LAST_NM}; got {self.knots}"
            )

    @classmethod
    def choices(cls) -> dict[str, Storage]:
        """The storage of the palette's grid."""
        return {cls.kind: cls(EXACT_GRID)}

    @classmethod
    def of_grid(cls, grid: SpectralGrid | None) -> Storage | None:
        """The storage of any grid of whole nm."""
        return None if grid is None else cls(grid)

    @property
    def grid(self) -> SpectralGrid:
        """Knots of the spectra that are exact."""
        return self.knots

    def channel_names(self) -> tuple[str, ...]:
        """X, Y and Z of each hat."""
        labels = (spectral_channel(knot) for knot in self.knots.wavelengths_nm)
        return tuple(label.replace("S0", axis) for label in labels for axis in "XYZ")

    def measured(self) -> Bands:
        """Products of two functions that are linear within each 1 nm cell; the outermost hats end with the grid."""
        cmfs, nm = observer(STANDARD).cmfs, self.knots.wavelengths_nm
        hats = self.knots.values_from_knots(WAVELENGTHS_NM).T
        inside = (nm[0] <= WAVELENGTHS_NM[:-1]) & (WAVELENGTHS_NM[1:] <= nm[-1])
        ends = (slice(None, -1), slice(1, None))
        at_ends = [hats[:, None, end] * cmfs[:, end] for end in ends]
        half_way = (hats[:, None, :-1] + hats[:, None, 1:]) * (cmfs[:, :-1] + cmfs[:, 1:]) / 4
        pieces = np.stack([at_ends[0], half_way, at_ends[1]]) * inside
        names = tuple(f"{axis}.{knot:.6f}" for knot in nm for axis in "xyz")
        responses = (hats[:, None] * cmfs).reshape(len(names), -1)
        return Bands(names, responses, pieces.reshape(3, len(names), -1))

    def rgb_from_channels(self, light: Spectrum) -> Array:
        """Linear sRGB from the light's amount of each hat: exact for a light on the grid."""
        amounts = self._amounts(light)
        return (amounts[None, :, None] * RGB_FROM_XYZ[:, None, :]).reshape(3, -1)

    def _amounts(self, light: Spectrum) -> Array:
        """Values at the knots that approximate a light best, weighted by the observer; its own values if it is on the
        grid.

        Sampling a light at the knots would lose a line between two of them. The least-squares projection preserves its
        weighted integral against every hat. Among the spectra whose color on a white surface is exactly the light's,
        the one nearest to it is taken: without that condition a line between two knots was up to 3 % too bright.
        """
        grid = self.knots
        if light.grid.same_as(grid):
            return light.values
        viewer = observer(STANDARD)

        def weighed(*knots_nm: Array) -> tuple[Array, Array]:
            points, weights = integration_points(viewer.wavelengths_nm, *knots_nm)
            sensitivity = np.interp(points, viewer.wavelengths_nm, viewer.cmfs.sum(axis=0))
            return points, weights * (sensitivity + _LEAST_WEIGHT * viewer.cmfs.max())

        points, weights = weighed(grid.wavelengths_nm)
        gram = grid.against_hats(points, grid.values_from_knots(points).T * weights)
        points, weights = weighed(grid.wavelengths_nm, light.grid.wavelengths_nm)
        amounts: Array = np.linalg.solve(gram, grid.against_hats(points, light.at(points) * weights)[0])
        cmfs = np.stack([np.interp(points, viewer.wavelengths_nm, cmf) for cmf in viewer.cmfs])
        within = integration_points(viewer.wavelengths_nm, grid.wavelengths_nm, light.grid.wavelengths_nm)[1]
        wanted = cmfs @ (light.at(points) * within)
        xyz_from_amounts = self._xyz_of_hats()
        step = np.linalg.solve(gram, xyz_from_amounts.T)
        missing = wanted - xyz_from_amounts @ amounts
        return amounts + step @ np.linalg.lstsq(xyz_from_amounts @ step, missing, rcond=None)[0]

    def _xyz_of_hats(self) -> Array:
        """XYZ (3, n) of each hat, as recorded on a white surface."""
        viewer = observer(STANDARD)
        points, weights = integration_points(viewer.wavelengths_nm, self.knots.wavelengths_nm)
        cmfs = np.stack([np.interp(points, viewer.wavelengths_nm, cmf) for cmf in viewer.cmfs])
        return self.knots.against_hats(points, cmfs * weights)

    def stated_error(self) -> str:
        """Text on the difference of a relit picture from a render."""
        return f"Every spectrum that is linear between values at {self.knots} is exact, up to rounding"
