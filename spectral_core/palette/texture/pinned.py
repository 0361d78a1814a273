# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture with wanted colors: exact under one light, with some colors that look different under another.

The wanted colors become a texture of K channels like any other: the lattice of ``uplift`` in the weights of K spectra.
A search over hats with moved peaks finds the K spectra that come nearest to the wanted colors.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_whole
from spectral_core.palette.texture.basis import MOST_SPECTRA, TextureBasis, design_basis
from spectral_core.palette.texture.loss import picture_losses, texel_delta_e
from spectral_core.palette.texture.nearest_color import nearest_weights
from spectral_core.palette.texture.reach import TEXTURE_GRID, corner_colors, stimulus_matrix
from spectral_core.palette.texture.texture import Picture, SpectralTexture, TextureDesign
from spectral_core.palette.texture.uplift import Pin, Uplift, design_uplift
from spectral_core.spectra.color import lab_from_linear_rgb
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]
TRIALS, RESTARTS = 250, 3
"""Moves of peaks in one search for a basis, and searches from each of two starts."""
SETTLED = 1e-2
"""Sum of squared CIELAB distances to the wanted colors below which the search ends."""
LEAST_GAP = 2.5
"""Between the peaks of two spectra, in knots of 5 nm."""
BAND_TEXELS = 1 << 20
"""Texels whose equal colors are looked up once."""
FEWEST_SPECTRA = 4
"""Basis spectra of one picture with wanted colors at least."""
CHUNK = 1 << 18
"""Different colors that are looked up at a time."""


@dataclass(frozen=True, slots=True, eq=False)
class PinnedDesign:
    """A texture of one picture, and the lattice with the outcome of each wanted color (``uplift.pins``)."""

    design: TextureDesign
    uplift: Uplift


def design_pinned_texture(
    picture: Picture,
    first: Illuminant,
    second: Illuminant,
    pins: Sequence[Pin] = (),
    *,
    count: int = MOST_SPECTRA,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> PinnedDesign:
    """Find the texture that shows ``picture`` under ``first``, and wanted colors under ``second``.

    Parameters
    ----------
    picture : the picture of the surface under the first light.
    first : light under which every texel is exact.
    second : light of the wanted colors.
    pins : the wanted colors, in linear sRGB relative to each light's white.
    count : basis spectra K, 4 to 8; more come nearer to the wanted colors.
    seed : of the search for the basis.
    progress : called with the share done, from 0 to 1.

    Raises
    ------
    InvalidInputError : contradicting wanted colors, or a light that leaves the picture no contrast.
    """
    started = time.perf_counter()
    matrix = stimulus_matrix([first])
    basis = _basis_for_pins(
        matrix,
        stimulus_matrix([second]),
        pins,
        require_whole("the number of basis spectra", count, FEWEST_SPECTRA, MOST_SPECTRA),
        seed,
    )
    uplift = design_uplift(first, second, pins, basis.spectra, slope=max(basis.slope, 1e-3))
    weights, delta_e = _looked_up(picture, uplift, basis.slope, progress)
    texture = SpectralTexture(weights, uplift.basis, (first, second))
    losses = picture_losses([picture], SpectralTexture(weights, uplift.basis, (first,)), delta_e, (0.0, basis.slope))
    design = TextureDesign(
        texture, basis, 0.0, basis.slope, basis.slope, 0.0, losses, time.perf_counter() - started
    )  # fmt: skip
    return PinnedDesign(design, uplift)


def _looked_up(
    picture: Picture, uplift: Uplift, slope: float, progress: Callable[[float], None] | None
) -> tuple[NDArray[np.float16], NDArray[np.float16]]:
    """Weights (K, H, W) and color differences (1, H, W) of all texels; equal colors are looked up once per band."""
    height, width = picture.pixels.shape[:2]
    count = uplift.lattice.shape[-1]
    color_from_weights = stimulus_matrix(uplift.lights[:1]) @ uplift.basis.T
    weights = np.empty((count, height, width), dtype=np.float16)
    delta_e = np.zeros((1, height, width), dtype=np.float16)
    rows = max(1, BAND_TEXELS // width)
    for first in range(0, height, rows):
        last = min(first + rows, height)
        wanted = picture.linear_rows(first, last)
        colors, places = np.unique(np.ascontiguousarray(wanted.T).view([("", np.float32)] * 3), return_inverse=True)
        flat = colors.view(np.float32).reshape(-1, 3)
        found = np.concatenate([uplift.weights(flat[start : start + CHUNK]) for start in range(0, len(flat), CHUNK)])
        stored = np.abs(found).astype(np.float16)
        errors = texel_delta_e(np.float32(slope) * flat.T, stored.T.astype(np.float32), color_from_weights)[0]
        weights[:, first:last] = stored[places.ravel()].T.reshape(count, last - first, width)
        delta_e[0, first:last] = errors[places.ravel()].reshape(last - first, width)
        if progress is not None:
            progress(last / height)
    return weights, delta_e


def _basis_for_pins(first: Array, second: Array, pins: Sequence[Pin], count: int, seed: int) -> TextureBasis:
    """Spectra of all display colors under the first light that come nearest to the wanted colors under the second."""
    started = time.perf_counter()
    plain = design_basis(first, count, floor=0.0)
    if not pins:
        return plain
    search = _BasisSearch(first, second, pins, min(plain.slope, 1.0) - 1e-9)
    best, least = plain.spectra, _missed(plain.spectra, first, second, pins)
    rng = np.random.default_rng(seed)
    for start in (_peaks(first, count), _peaks(np.concatenate([first, second]), count)):
        for _ in range(RESTARTS):
            spectra, missed = search.climbed(start, rng)
            if missed < least:
                best, least = spectra, missed
            if least < SETTLED:
                break
    return TextureBasis(best, 0.0, plain.slope, plain.iterations + search.tried, time.perf_counter() - started)


@dataclass(slots=True)
class _BasisSearch:
    """Hill climbing over the peaks of hats. ``needed``: least slope for all display colors under the first light."""

    first: Array
    second: Array
    pins: Sequence[Pin]
    needed: float
    tried: int = 0

    def climbed(self, start: Array, rng: np.random.Generator) -> tuple[Array, float]:
        """Spectra near ``start`` and their error; infinity if no allowed ones were found."""
        knots, corners = TEXTURE_GRID.size, corner_colors(1)
        peaks, least = start, np.inf
        for _ in range(TRIALS):
            self.tried += 1
            trial = _moved(peaks, rng, knots)
            spectra = _hats(trial, knots)
            missed = _missed(spectra, self.first, self.second, self.pins)
            if missed >= least or not self._shows_all(spectra, corners):
                continue
            peaks, least = trial, missed
            if least < SETTLED:
                break
        return _hats(peaks, knots), least

    def _shows_all(self, spectra: Array, corners: Array) -> bool:
        """True if the mixtures of ``spectra`` show every display color under the first light."""
        one = self.first @ spectra.T
        return all(
            nearest_weights(one, one, self.needed * corner, self.needed * corner) is not None for corner in corners
        )


def _missed(spectra: Array, first: Array, second: Array, pins: Sequence[Pin]) -> float:
    """Least sum of squared CIELAB distances that remain to the wanted colors."""
    one, two = np.ascontiguousarray(first @ spectra.T), second @ spectra.T
    total = 0.0
    for pin in pins:
        found = nearest_weights(one, two, pin.color, pin.wanted)
        if found is None:
            return np.inf
        total += float(np.sum((lab_from_linear_rgb(two @ found) - lab_from_linear_rgb(pin.wanted)) ** 2))
    return total


def _peaks(stimuli: Array, count: int) -> Array:
    """Peaks, in knots, that divide the stimulus into equal parts."""
    weight = np.cumsum(np.abs(stimuli).sum(axis=0))
    return np.interp((np.arange(count) + 0.5) / count, weight / weight[-1], np.arange(stimuli.shape[1]))


def _moved(peaks: Array, rng: np.random.Generator, knots: int) -> Array:
    """One or two peaks moved at random, all at least LEAST_GAP apart."""
    moved = peaks.copy()
    chosen = rng.integers(0, len(peaks), rng.integers(1, 3))
    moved[chosen] += rng.normal(scale=rng.choice([0.5, 2.0, 6.0]), size=len(chosen))
    moved = np.sort(np.clip(moved, 1.0, knots - 2.0))
    return moved if np.diff(moved).min() >= LEAST_GAP else peaks


def _hats(peaks: Array, knots: int) -> Array:
    """Linear interpolation between peaks: (K, knots), at least 0, with sum 1."""
    return np.stack([np.interp(np.arange(knots), peaks, row) for row in np.eye(len(peaks))])
