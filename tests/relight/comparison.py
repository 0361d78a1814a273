# SPDX-License-Identifier: GPL-3.0-or-later
"""Difference of two pictures."""

from __future__ import annotations

import numpy as np


def relative_error(picture: np.ndarray, reference: np.ndarray) -> float:
    return float(np.abs(picture - reference)[..., :3].max() / np.abs(reference[..., :3]).max())
