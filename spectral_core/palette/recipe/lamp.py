# SPDX-License-Identifier: GPL-3.0-or-later
"""Drive levels of LED channels for a wanted white, with few channels and good color rendering."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog, minimize

from spectral_core.checks import frozen_array, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.palette.given import require_each, sequence_of
from spectral_core.palette.recipe.channels import combinations_of
from spectral_core.palette.recipe.fidelity import FidelityReference
from spectral_core.palette.recipe.library import DOSAGE_ERROR, amount_text
from spectral_core.palette.recipe.white import (
    LAMP_GRID,
    RANGE_K,
    RenderingReference,
    cct_and_duv,
    color_rendering_index,
    luminous_efficacy,
    mixed_lamp,
    power_per_nm,
    uv_from_xyz,
    white_xyz,
    xyz_from_spd,
)
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]

MARGIN = 0.05
"""Shortfall of an index that still counts as met: less than its printed digit."""
SOFTNESS = 0.5
"""Indices within this distance of the worst one are raised together with it."""


@dataclass(frozen=True, slots=True, eq=False)
class LampRecipe:
    """Drive levels (k,) in [0, 1] of the channels in ``names``, the brightest at 1, and the resulting lamp.

    ``cct_k``, ``duv``, ``rendering_index`` (Ra), ``fidelity`` and ``gamut`` (Rf and Rg of TM-30-18) and
    ``efficacy_lm_per_w`` (of the radiation) belong to the mixed spectrum; ``dosage_delta_uv``: rms shift of the white
    in CIE 1960 uv for ``DOSAGE_ERROR`` of each drive; ``met``: True if white, Ra, Rf and Rg meet the request.
    """

    names: tuple[str, ...]
    drives: Array
    lamp: Illuminant
    cct_k: float
    duv: float
    rendering_index: float
    fidelity: float
    gamut: float
    efficacy_lm_per_w: float
    dosage_delta_uv: float
    met: bool
    seconds: float

    def text(self) -> str:
        """The recipe as text lines: channel and drive level in percent."""
        lines = [
            f"{name:24} {amount_text(100 * drive, 2):>6} %"
            for name, drive in zip(self.names, self.drives, strict=True)
            if drive > 0
        ]
        return "\n".join(
            [
                *lines,
                f"{self.cct_k:.0f} K, Duv {self.duv:+.5f}, Ra {self.rendering_index:.1f}, Rf {self.fidelity:.1f}, "
                f"Rg {self.gamut:.1f}, {self.efficacy_lm_per_w:.0f} lm per watt of radiation",
                f"{100 * DOSAGE_ERROR:.0f} % errors of the drives move the white by Δuv {self.dosage_delta_uv:.4f}",
            ]
        )


@dataclass(frozen=True, slots=True)
class LampQuality:
    """Requests for a lamp beside its white. None: no request.

    ``rendering_index``: least Ra; ``fidelity``: least Rf; ``gamut``: least and greatest Rg; ``cct_tolerance_k`` and
    ``duv_tolerance``: allowed distances of the white if they help.
    """

    rendering_index: float | None = 80.0
    fidelity: float | None = None
    gamut: tuple[float, float] | None = None
    cct_tolerance_k: float = 0.0
    duv_tolerance: float = 0.0

    def __post_init__(self) -> None:
        require_range("cct_tolerance_k", self.cct_tolerance_k, 0.0, 2_000.0, " K")
        require_range("duv_tolerance", self.duv_tolerance, 0.0, 0.02)
        for name, least in (("rendering_index (Ra)", self.rendering_index), ("fidelity (Rf)", self.fidelity)):
            if least is not None:
                require_range(name, least, 0.0, 100.0)
        if self.gamut is not None:
            ends = [require_range("gamut (Rg)", end, 0.0, 1e3) for end in sequence_of("gamut", self.gamut)]
            if len(ends) != 2 or ends[0] > ends[1]:
                raise InvalidInputError(f"gamut (Rg) is {ends}; expected two numbers, the least Rg first")

    def margins(self, spd: Array, kelvin: float) -> list[float]:
        """Margin of each requested index; negative if it falls short."""
        found = []
        if self.rendering_index is not None:
            found.append(_rendering(kelvin).index(spd) - self.rendering_index)
        if self.fidelity is not None or self.gamut is not None:
            fidelity, gamut = _fidelity(kelvin).indices(spd)
            if self.fidelity is not None:
                found.append(fidelity - self.fidelity)
            if self.gamut is not None:
                found += [gamut - self.gamut[0], self.gamut[1] - gamut]
        return found or [0.0]


@cache
def _rendering(kelvin: float) -> RenderingReference:
    return RenderingReference(kelvin)


@cache
def _fidelity(kelvin: float) -> FidelityReference:
    return FidelityReference(kelvin)


def lamp_recipe(
    channels: Sequence[Illuminant],
    cct_k: float,
    *,
    duv: float = 0.0,
    quality: LampQuality | None = None,
    most_channels: int | None = None,
    wanted_xyz: Array | None = None,
) -> LampRecipe:
    """Find drive levels that reach a white with the requested color rendering, with few channels.

    Parameters
    ----------
    channels : spectra of the channels at full drive, 3 to 16.
    cct_k : wanted color temperature, 1,500 to 20,000 kelvin.
    duv : wanted distance from Planck's locus, -0.02 to 0.02.
    quality : requests beside the white, Ra 80 by default; if they cannot be met, the nearest mixture is given and
        ``met`` is False.
    most_channels : channels that may be used, at least 3; None: all.
    wanted_xyz : (3,), a white that replaces temperature and Duv.

    Raises
    ------
    InvalidInputError : too few channels, or no mix of them has the wanted white.
    """
    started = time.perf_counter()
    quality = LampQuality() if quality is None else quality
    channels = sequence_of("channels", channels)
    require_each("channels", channels, Illuminant, "an Illuminant")
    require_kind("quality", quality, LampQuality)
    if not 3 <= len(channels) <= 16:
        raise InvalidInputError(f"a lamp recipe takes 3 to 16 channels; got {len(channels)}")
    most = len(channels) if most_channels is None else require_whole("most_channels", most_channels, 3, len(channels))
    spds = np.stack([power_per_nm(channel) for channel in channels])
    power = spds.sum(axis=1)
    if not power.all():
        dark, first_nm, last_nm = channels[int(np.argmin(power))].name, *LAMP_GRID.wavelengths_nm[[0, -1]]
        raise InvalidInputError(f"channel {dark!r} emits no light from {first_nm:g} to {last_nm:g} nm; remove it")
    equal = spds / power[:, None]  # so that the scale of a channel does not change the mix
    best: tuple[float, Array] | None = None
    for white in _whites(cct_k, duv, quality) if wanted_xyz is None else [frozen_array("wanted_xyz", wanted_xyz, (3,))]:
        found = _best_mix(equal, white, quality, most)
        if found is not None and (best is None or found[0] > best[0]):
            best = found
        if best is not None and best[0] >= 0:
            break
    if best is None:
        wanted = white_xyz(cct_k, duv) if wanted_xyz is None else wanted_xyz
        raise InvalidInputError(
            f"no mix of the {counted(len(channels), 'channel')} has the white XYZ {np.round(wanted, 3).tolist()}; "
            "add a channel on the other side of the wanted color"
        )
    drives = best[1] / power
    return _described(channels, spds, drives / drives.max(), (best[0] >= -MARGIN, started))


def _whites(cct_k: float, duv: float, quality: LampQuality) -> list[Array]:
    """The wanted white, then whites slightly inside the ends of its tolerance, where these have a color temperature."""
    require_range("color temperature", cct_k, 1_500, 20_000, " K")
    require_range("Duv", duv, -0.02, 0.02)
    around = {(0.0, 0.0)}
    if quality.cct_tolerance_k or quality.duv_tolerance:
        around |= {(-0.95, 0.0), (0.95, 0.0), (0.0, -0.95), (0.0, 0.95)}
    ordered = sorted(around, key=lambda step: abs(step[0]) + abs(step[1]))
    whites = [(cct_k + t * quality.cct_tolerance_k, duv + d * quality.duv_tolerance) for t, d in ordered]
    return [white_xyz(kelvin, tint) for kelvin, tint in whites if kelvin > RANGE_K[0]]


def _best_mix(spds: Array, white: Array, quality: LampQuality, most: int) -> tuple[float, Array] | None:
    """Least margin and drives (k,) of the first set of channels that meets all requests, or of the best."""
    kelvin = round(cct_and_duv(white)[0], 1)
    best: tuple[float, Array] | None = None
    for chosen in combinations_of(spds, white, most, lambda drives: min(quality.margins(drives @ spds, kelvin))):
        drives = _optimized(spds[list(chosen)], white, quality, kelvin)
        if drives is None:
            continue
        margin = min(quality.margins(drives @ spds[list(chosen)], kelvin))
        if best is None or margin > best[0]:
            full = np.zeros(len(spds))
            full[list(chosen)] = drives
            best = margin, full
        if margin >= 0:
            break
    return best


def _optimized(spds: Array, wanted: Array, quality: LampQuality, kelvin: float) -> Array | None:
    """Drives (k,) with the largest least margin on the wanted white, up to a common factor."""
    matrix = spds @ xyz_from_spd().T
    first = linprog(np.zeros(len(spds)), A_eq=matrix.T, b_eq=wanted, bounds=(0, None), method="highs-ds")
    if first.status != 0:
        return None
    if len(spds) == 3:
        return np.asarray(first.x)
    # The free directions keep the white; the index is optimized along them from the center of the feasible set.
    _, _, rows = np.linalg.svd(matrix.T)
    free = rows[3:].T
    center = _center(first.x, free)

    def short(z: Array) -> float:
        # A smooth least: the worst of the margins counts most.
        margins = np.array(quality.margins(np.maximum(center + free @ z, 0) @ spds, kelvin))
        return float(SOFTNESS * np.logaddexp.reduce(-margins / SOFTNESS))

    answer = minimize(
        short,
        np.zeros(free.shape[1]),
        constraints=[{"type": "ineq", "fun": lambda z: center + free @ z, "jac": lambda _: free}],
        method="SLSQP",
        options={"maxiter": 40, "ftol": 1e-3, "eps": 1e-4 * float(center.max())},
    )
    drives = np.maximum(center + free @ answer.x, 0)
    drives[drives < 1e-4 * drives.max()] = 0
    return np.asarray(drives)


def _center(start: Array, free: Array) -> Array:
    """The drives with the largest least drive on the wanted white."""
    count, directions = free.shape
    answer = linprog(
        np.append(np.zeros(directions), -1.0), A_ub=np.hstack([-free, np.ones((count, 1))]), b_ub=start,
        bounds=[(None, None)] * directions + [(0, None)], method="highs",
    )  # fmt: skip
    return np.asarray(start + free @ answer.x[:-1]) if answer.status == 0 else start


def _described(channels: Sequence[Illuminant], spds: Array, drives: Array, outcome: tuple[bool, float]) -> LampRecipe:
    met, started = outcome
    spd = drives @ spds
    xyz = xyz_from_spd() @ spd
    cct, duv = cct_and_duv(xyz)
    fidelity, gamut = _fidelity(round(cct, 1)).indices(spd)
    # First-order change of uv with the logarithm of each drive, by central differences.
    step, moved = 1e-4, drives[:, None] * (spds @ xyz_from_spd().T)
    shifts = (uv_from_xyz(xyz + step * moved) - uv_from_xyz(xyz - step * moved)) / (2 * step)
    lamp, names = mixed_lamp(channels, drives), tuple(channel.name for channel in channels)
    return LampRecipe(
        names, frozen_array("drives", drives), lamp, cct, duv, color_rendering_index(spd), fidelity, gamut,
        luminous_efficacy(spd), DOSAGE_ERROR * float(np.sqrt(np.sum(np.square(shifts)))), met,
        time.perf_counter() - started,
    )  # fmt: skip
