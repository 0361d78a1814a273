# SPDX-License-Identifier: GPL-3.0-or-later
"""Two white lights under which one surface can show two unrelated pictures.

Both lights are mixes of the same primaries (LEDs) and have the same white. The contrast of every pair of display colors
under them is a minimum over 64 linear programs, whose multipliers are its derivatives by each primary. A sequence of
linear programs with a trust region climbs it; the climb is local, hence several starts.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.palette.texture.reach import (
    TEXTURE_GRID,
    ScaledReach,
    corner_colors,
    reachable_contrast,
    reachable_scales,
)
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, delta_e_2000, lab_from_xyz
from spectral_core.spectra.observer import normalized, xyz_from_product, xyz_from_spectrum
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

Array = NDArray[np.float64]

LIGHT_GRID = SpectralGrid.uniform(380, 780, 1)
STARTING_PEAKS_NM = (
    ((430.0, 515.0, 660.0), (470.0, 552.0, 610.0)),
    ((445.0, 525.0, 640.0), (475.0, 550.0, 600.0)),
    ((465.0, 545.0, 605.0), (435.0, 510.0, 650.0)),
)
"""Interleaved peaks of the two lights: both triangles of primaries surround most of the display's colors."""
MOST_ITERATIONS = 40
"""Most iterations of each start. A climb ends by itself after 10 to 25. Iterations are counted, not seconds, so that a
busy machine finds the same result.
"""
SMALLEST_STEP = 2e-3
"""Trust radius, as a share of the strongest primary, below which the climb has ended."""


@dataclass(frozen=True, slots=True, eq=False)
class LightDesign:
    """Two lights and the contrast of unrelated pictures under them.

    ``white_delta_e``: (2,), ΔE2000 of each white to the wanted white; ``slope`` and ``floor`` as in
    ``ReachableContrast``; ``iterations`` and ``seconds`` of the whole design, ``starts`` the slope of each start.
    """

    lights: tuple[Illuminant, Illuminant]
    floor: float
    slope: float
    white_delta_e: tuple[float, float]
    starts: tuple[float, ...]
    iterations: int
    seconds: float


def led(peak_nm: float, width_nm: float, grid: SpectralGrid = LIGHT_GRID) -> Illuminant:
    """Gaussian LED of unit peak: ``peak_nm`` its wavelength, ``width_nm`` its full width at half maximum."""
    peak_nm = require_range("the peak of an LED", peak_nm, 100.0, 10_000.0, " nm")
    distance = (grid.wavelengths_nm - peak_nm) / require_range("LED width", width_nm, 2.0, 200.0, " nm")
    return Illuminant(f"LED {peak_nm:g} nm", grid, np.exp(-4 * np.log(2) * distance**2))


def led_range(
    width_nm: float = 20.0, first_nm: float = 430.0, last_nm: float = 670.0, step_nm: float = 5.0
) -> list[Illuminant]:
    """LEDs of one width with peaks at equal steps: the primaries of a design with free peaks."""
    for name, value in (("first_nm", first_nm), ("last_nm", last_nm)):
        require_range(name, value, 100.0, 10_000.0, " nm")
    require_range("step_nm", step_nm, 0.1, 1000.0, " nm")
    return [led(peak, width_nm) for peak in np.arange(first_nm, last_nm + 0.5 * step_nm, step_nm)]


def design_lights(
    primaries: Sequence[Illuminant] | None = None,
    *,
    floor: float = 0.05,
    daylight_share: float = 0.0,
    daylight: Illuminant | None = None,
    iterations: int = MOST_ITERATIONS,
) -> LightDesign:
    """Design two lights of one white under which a surface shows two unrelated pictures with the most contrast.

    Parameters
    ----------
    primaries : the LEDs that both lights are mixed from, at least 6; by default Gaussians of 20 nm, 430 to 670 nm.
    floor : linear gray of the darkest color, 0.005 to 0.5.
    daylight_share : share 0 to 0.9 of the luminance that comes from ``daylight``: the more, the more natural other
        surfaces look and the less contrast is left.
    daylight : the light mixed in, and the white of both; the white of the display (D65) where None.
    iterations : linear programs that each start may use at most; the best lights so far are returned.

    Raises
    ------
    InvalidInputError : fewer than 6 primaries. SolveError : no mix of the primaries has the wanted white.
    """
    started = time.perf_counter()
    leds = list(led_range() if primaries is None else primaries)
    if len(leds) < 6:
        raise InvalidInputError(f"two lights of three primaries each need at least 6 primaries; got {len(leds)}")
    require_range("floor", floor, 0.005, 0.5)
    share = require_range("daylight_share", daylight_share, 0.0, 0.9)
    climb = _Climb(leds, floor, share, daylight)
    best: tuple[float, Array] | None = None
    reached, total = [], 0
    for peaks in STARTING_PEAKS_NM:
        slope, amounts, used = climb.run(climb.start(peaks), iterations)
        reached.append(slope)
        total += used
        if best is None or slope > best[0]:
            best = slope, amounts
    assert best is not None
    lights = climb.lights(best[1])
    exact = reachable_contrast(lights, floor)
    return LightDesign(
        lights, floor, exact.slope, (climb.white_error(lights[0]), climb.white_error(lights[1])), tuple(reached),
        total, time.perf_counter() - started,
    )  # fmt: skip


class _Climb:
    """The sequence of linear programs. ``kernels``: (m, 3, n), linear RGB rows of each primary."""

    def __init__(self, leds: list[Illuminant], floor: float, share: float, daylight: Illuminant | None) -> None:
        self.leds, self.floor, self.share = leds, floor, share
        self.kernels = np.stack([RGB_FROM_XYZ @ xyz_from_product(light, TEXTURE_GRID) for light in leds])
        self.whites = self.kernels.sum(axis=2).T  # (3, m)
        self.daylight = None if daylight is None else normalized(daylight)
        if share > 0 and self.daylight is None:
            from spectral_core.spectra.catalogue import illuminant

            self.daylight = normalized(illuminant("D65"))
        self.white_xyz = (
            WHITE_XYZ
            if daylight is None
            else xyz_from_spectrum(normalized(daylight).grid) @ normalized(daylight).values
        )
        self.mixed_in = np.zeros((3, TEXTURE_GRID.size))
        if share > 0 and self.daylight is not None:
            self.mixed_in = share * RGB_FROM_XYZ @ xyz_from_product(self.daylight, TEXTURE_GRID)
        self.white_rgb = RGB_FROM_XYZ @ self.white_xyz
        # The contribution that the primaries need so that the whole has exactly the wanted white.
        self.wanted_rgb = self.white_rgb - self.mixed_in.sum(axis=1)
        self.corners = corner_colors(2)

    def start(self, peaks_nm: tuple[tuple[float, ...], ...]) -> Array:
        """Amounts (2, m) near the given peaks that have the wanted white, by non-negative least change."""
        centers = np.array([light.grid.wavelengths_nm[light.values.argmax()] for light in self.leds])
        rows = []
        for triple in peaks_nm:
            far = np.min(np.abs(centers[:, None] - np.array(triple)), axis=1)
            answer = linprog(
                1.0 + (far / 10.0) ** 2, A_eq=self.whites, b_eq=self.wanted_rgb, bounds=(0, None), method="highs-ds"
            )
            if answer.status != 0:
                raise SolveError(
                    f"no mix of the {len(self.leds)} primaries has the wanted white; add primaries at the blue, green "
                    "or red end"
                )
            rows.append(answer.x)
        return np.array(rows)

    def matrix(self, amounts: Array) -> Array:
        """(6, n): linear RGB under both lights, each relative to the wanted white."""
        rows = np.einsum("lm,mcn->lcn", amounts, self.kernels) + self.mixed_in
        return np.asarray((rows / self.white_rgb[:, None]).reshape(6, -1))

    def run(self, amounts: Array, most: int) -> tuple[float, Array, int]:
        """Climb from ``amounts`` until no step helps, at most ``most`` iterations: slope, amounts, iterations."""
        reach = reachable_scales(self.matrix(amounts), self.corners, self.floor)
        slope, radius, used = float(reach.scales.min()), 0.3, 0
        while radius > SMALLEST_STEP and used < most:
            used += 1
            trial = amounts + self._step(amounts, reach.scales, self._gradients(reach), radius)
            trial_reach = reachable_scales(self.matrix(trial), self.corners, self.floor)
            gained = float(trial_reach.scales.min()) - slope
            if gained > 1e-7:
                amounts, reach, slope = trial, trial_reach, slope + gained
                radius = min(0.5, radius * 1.5)
            else:
                radius /= 3
        return slope, amounts, used

    def _gradients(self, reach: ScaledReach) -> Array:
        """(64, 2, m): change of each corner's scale with each amount, ds/dM = outer(y, r - floor)."""
        # r - floor rather than r: the gray that is added to every color also changes with the light.
        shifts = reach.reflectances - self.floor
        per_light = reach.multipliers.reshape(len(shifts), 2, 3) / self.white_rgb
        return np.asarray(np.einsum("vlc,mcn,vn->vlm", per_light, self.kernels, shifts, optimize=True))

    def _step(self, amounts: Array, scales: Array, gradients: Array, radius: float) -> Array:
        """Change (2, m) of the amounts that raises the linearized least scale most, inside the trust region."""
        count = amounts.size
        costs = np.zeros(count + 1)
        costs[-1] = -1.0  # maximize t, the least scale
        above = np.hstack([-gradients.reshape(len(scales), count), np.ones((len(scales), 1))])
        whites = np.zeros((6, count + 1))
        half = count // 2
        whites[:3, :half], whites[3:, half:count] = self.whites, self.whites
        limit = radius * amounts.max(axis=1, keepdims=True) * np.ones_like(amounts)
        low = np.maximum(-amounts, -limit).ravel()
        bounds = [*zip(low, limit.ravel(), strict=True), (None, None)]
        answer = linprog(
            costs, A_ub=above, b_ub=scales, A_eq=whites, b_eq=np.zeros(6), bounds=bounds, method="highs-ds"
        )
        if answer.status != 0:
            return np.zeros_like(amounts)
        return np.asarray(answer.x[:-1].reshape(amounts.shape))

    def lights(self, amounts: Array) -> tuple[Illuminant, Illuminant]:
        """Both lights as spectra of luminance 1."""
        knots = np.unique(
            np.concatenate([LIGHT_GRID.wavelengths_nm, *(light.grid.wavelengths_nm for light in self.leds)])
        )
        grid = SpectralGrid(knots)
        made = []
        for number, row in enumerate(np.maximum(amounts, 0.0), 1):
            values = sum(amount * light.at(knots) for amount, light in zip(row, self.leds, strict=True))
            if self.share > 0 and self.daylight is not None:
                values = values + self.share * self.daylight.at(knots)
            made.append(normalized(Illuminant(f"designed white {number}", grid, np.asarray(values))))
        return made[0], made[1]

    def white_error(self, light: Illuminant) -> float:
        """ΔE2000 of the light's white to the wanted white."""
        white = xyz_from_spectrum(light.grid) @ light.values
        return float(delta_e_2000(lab_from_xyz(white / white[1]), lab_from_xyz(self.white_xyz / self.white_xyz[1])))
