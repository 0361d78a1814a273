# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a volume: settings of the march, its records, and their conversion to a picture by colors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind, require_range
from spectral_core.errors import UnknownNameError
from spectral_core.volume.march.march_input import QUADRATURES, Quadrature
from spectral_core.volume.march.rules import RULES, Rule
from spectral_core.volume.transfer import TransferFunction

MOST_SCALE = 1e6
"""Largest factor on the steps of a rule, which the longest step limits long before."""


@dataclass(frozen=True)
class Stepping:
    """Settings of a march: rule, quadrature and the factor on the rule's steps (voxels, for `uniform`); 0 takes the
    shortest step that a march has.

    Raises UnknownNameError for another rule or quadrature, InvalidInputError for a scale out of range.
    """

    rule: Rule = "error"
    quadrature: Quadrature = "midpoint"
    scale: float = 1.0

    def __post_init__(self) -> None:
        for what, name, known in (("step rule", self.rule, RULES), ("quadrature", self.quadrature, QUADRATURES)):
            if not isinstance(name, str) or name not in known:
                raise UnknownNameError.among(what, str(name), known)
        object.__setattr__(self, "scale", require_range("the scale of the steps", self.scale, 0.0, MOST_SCALE))


@dataclass(frozen=True, eq=False)
class VolumeImage:
    """The record of a march: sufficient for the picture under any light and with any palette.

    ``amounts`` (height, width, K) float32, one channel per material; ``transmittance`` (height, width). ``samples``
    counts steps with visible material, ``steps`` all iterations of the loop (None if not requested); ``seconds`` is the
    time of the march with the copy back.
    """

    transfer: TransferFunction
    stepping: Stepping
    amounts: NDArray[np.float32]
    transmittance: NDArray[np.float32]
    seconds: float
    samples: int | None = None
    steps: int | None = None

    def picture(self, light: ArrayLike | None = None, colors: ArrayLike | None = None) -> NDArray[np.float32]:
        """Σ_k A_k·color_k: linear RGB or spectral radiance (height, width, 3 or wavelengths), without tracing a ray.

        ``light`` (same length as a color) multiplies the lit materials' colors, ``colors`` (K, …) replaces them.
        """
        return combine(self.amounts, palette_matrix(self.transfer, light, colors))


def palette_matrix(
    transfer: TransferFunction, light: ArrayLike | None = None, colors: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Color of each material under ``light``, (K, channels); new lights and palettes change only these."""
    require_kind("the transfer function", transfer, TransferFunction, "preset(NAME, volume)")
    base = transfer.colors
    matrix = base.copy() if colors is None else np.array(frozen_array("colors", colors, base.shape))
    if light is not None:
        spectrum = frozen_array("light", light, (base.shape[1],))
        lit = [k for k, material in enumerate(transfer.materials) if material.lit]
        matrix[lit] *= spectrum
    return matrix


def combine(amounts: NDArray[np.float32], matrix: NDArray[np.float64]) -> NDArray[np.float32]:
    """(height, width, K) amounts times (K, channels), as one float32 matrix product."""
    flat = amounts.reshape(-1, amounts.shape[-1]) @ matrix.astype(np.float32)
    return flat.reshape(*amounts.shape[:-1], matrix.shape[1])
