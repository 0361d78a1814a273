# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of several moments of a moving scene as those of one picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene.passes import CRYPTOMATTES, LOBES

Pixels = NDArray[np.float32]

OF_FIRST_SAMPLE = ("Depth", "Position", "Object Index", "Material Index")
"""Passes of one camera ray of each pixel."""
FIRST_MOMENT = "depth, position, indices and cryptomattes of a moving scene are those of one moment"


def joined_passes(
    before: dict[str, Pixels], samples: float, more: dict[str, Pixels], others: float
) -> dict[str, Pixels]:
    """Means weighted by samples or other weights; passes that have no mean come from the first moment."""
    total = samples + others or 1.0
    first, second = samples / total, others / total
    found = {}
    for name, picture in before.items():
        lobe, _, order = name.partition(" ")
        color = f"{lobe} Color"
        if name in OF_FIRST_SAMPLE or name.startswith(CRYPTOMATTES):
            found[name] = picture
        elif name == "Debug Sample Count":
            found[name] = picture + more[name]
        elif lobe in LOBES and order in ("Direct", "Indirect") and color in before:
            light = picture * before[color] * first + more[name] * more[color] * second
            mean = before[color] * first + more[color] * second
            found[name] = np.divide(light, mean, out=np.zeros_like(light), where=mean > 0)
        else:
            found[name] = picture * first + more[name] * second
    return {name: np.asarray(picture, np.float32) for name, picture in found.items()}
