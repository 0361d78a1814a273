# SPDX-License-Identifier: GPL-3.0-or-later
"""Closures of hair, about a strand's tangent."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.strands import chiang, huang, single_lobe
from spectral_core.render.plugins.closures.strands.fiber import FIBER

__all__ = ["FIBER", "register"]


def register(mi: Any, dr: Any) -> None:
    """Define and register the closures for the active variant."""
    for module in (chiang, huang, single_lobe):
        module.register(mi, dr)
