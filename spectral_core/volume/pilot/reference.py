# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference of pilot rays: their colors by ever finer steps, until two marches agree or rounding sets the limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import REFERENCE, Quadrature

Array = NDArray[np.float64]
March = Callable[[Stepping], Array]

_SINGLE = 90.0  # dB: the picture and its reference have the same rounding of single precision
_ROUNDING_DB = 50.0  # dB: two marches that agree less than this differ by more than rounding
_DISTANCE_DB = 10.0  # dB by which the agreement of uniform steps exceeds that of the error rule
_COARSEST, _EVEN = 0.5, 1.0 / 16.0  # scale of the first march by the error rule; voxels of the first by uniform steps
_FINEST = 0.02  # scale of the error rule below which uniform steps follow
_ORDERS_DB = (6.0, 12.0)  # dB that a halving adds at first and at second order


@dataclass(frozen=True)
class Reference:
    """Colors of the pilot rays, their own SNR in dB, and the scale of the march that they are from.

    ``first``: the colors by uniform steps of a sixteenth of a voxel. ``is_rounded``: single precision limits the SNR.
    """

    colors: Array
    snr_db: float
    scale: float
    first: Array
    is_rounded: bool = False


@dataclass(frozen=True)
class _Halved:
    """A march, and its agreement in dB with the march of twice its steps."""

    colors: Array
    scale: float
    agreed_db: float
    gain_db: float = 0.0
    """What the last halving added to the agreement; 0 if it is not known."""
    first: Array | None = None
    """Colors of the first march."""

    @property
    def own_db(self) -> float:
        """Its expected SNR.

        If each halving divides the error by r, it divides the differences of marches by r as well, and the error that
        is left is 1/(r - 1) of the last difference: a third of it at second order, all of it at first order.
        """
        ratio = 10.0 ** (float(np.clip(self.gain_db, *_ORDERS_DB)) / 20.0)
        return self.agreed_db + 20.0 * math.log10(ratio - 1.0)


def refined_reference(march: March, quadrature: Quadrature, agreement_db: float, parts: int = 1) -> Reference:
    """March until the steps are fine enough for an error clearly below ``agreement_db``.

    Steps of the error rule are halved until two marches agree, and uniform steps of a sixteenth of a voxel have to
    agree too: two marches of one rule may both miss a feature that its estimate of roughness does not see. If these do
    not agree, uniform steps are halved until they do.

    Parameters
    ----------
    march
        Marches the pilot rays with a stepping: their colors (rays, 3). All of its steps end at the faces of cells,
        where the tips of objects are that a ray grazes.
    quadrature
        The quadrature of all marches.
    agreement_db
        SNR of one march against the next at which they agree.
    parts
        Number of pictures in the colors, each of which has to agree.
    """
    adaptive = _halved(march, Stepping("error", quadrature, _COARSEST), _FINEST, agreement_db, parts)
    first = Stepping("uniform", quadrature, _EVEN)
    # The errors of two marches by uniform steps have the same sign, so that their difference looks smaller than either
    # error: these marches must agree better.
    even = _halved(march, first, REFERENCE.shortest_step, agreement_db + _DISTANCE_DB, parts, adaptive)
    own = even.own_db
    own = min(own, _SINGLE) if math.isfinite(own) else own
    assert even.first is not None
    return Reference(even.colors, own, min(adaptive.scale, even.scale), even.first)


def limited_by_rounding(
    made: Reference, beside: March, quadrature: Quadrature, smaller_db: float, parts: int = 1
) -> Reference:
    """The reference with its SNR at most that of single precision for its rays.

    Parameters
    ----------
    made
        A reference.
    beside
        Marches rays beside those of the reference, as ``refined_reference`` does.
    quadrature
        That of the reference.
    smaller_db
        dB by which rounding changes the colors less than the way to the rays beside.
    parts
        Number of pictures in the colors.
    """
    rounded = snr_db(made.first, beside(Stepping("uniform", quadrature, _EVEN)) - made.first, parts) + smaller_db
    return made if rounded >= made.snr_db else replace(made, snr_db=rounded, is_rounded=True)


def _halved(
    march: March, way: Stepping, last: float, wanted_db: float, parts: int, before: _Halved | None = None
) -> _Halved:
    """The march whose steps are halved, from ``way`` down to ``last``, until it agrees with the one before.

    Each halving doubles the number of roundings. So if the agreement of fine steps falls from one halving to the next,
    the march before the fall is the better one.
    """
    marches: list[_Halved] = []
    first: Array | None = None
    while True:
        colors = march(way)
        first = colors if first is None else first
        agreed = -math.inf if before is None else snr_db(colors, before.colors - colors, parts)
        before = _Halved(colors, way.scale, agreed)
        marches.append(before)
        fallen = [_ROUNDING_DB < b.agreed_db < a.agreed_db for a, b in pairwise(marches)]
        if agreed > wanted_db or way.scale <= last or fallen[-2:] == [True, True]:
            break
        way = replace(way, scale=0.5 * way.scale)
    while fallen and fallen.pop():
        marches.pop()
    # The first march is compared with one of another rule, whose error may be the smaller one.
    gain = marches[-1].agreed_db - marches[-2].agreed_db if len(marches) > 2 and marches[-1] is before else 0.0
    return replace(marches[-1], gain_db=gain, first=first)


def snr_db(signal: Array, error: Array, parts: int = 1) -> float:
    """10·log10 of signal over error energy; infinite without error. Of several ``parts``, the least, see ``worst``."""
    signal, error = worst(signal, error, parts)
    noise, energy = float(np.sum(error**2)), float(np.sum(signal**2))
    return math.inf if noise == 0 else -math.inf if energy == 0 else 10.0 * math.log10(energy / noise)


def worst(signal: Array, error: Array, parts: int) -> tuple[Array, Array]:
    """The columns of the part of greatest error energy relative to its signal; dark parts do not count.

    ``signal`` and ``error`` are (rays, columns), and each part has as many columns.
    """
    if parts == 1:
        return signal, error
    halves = zip(np.split(signal, parts, axis=-1), np.split(error, parts, axis=-1), strict=True)
    lit = [(one, other) for one, other in halves if one.any()]
    return max(lit, key=lambda part: np.sum(part[1] ** 2) / np.sum(part[0] ** 2), default=(signal, error))
