# SPDX-License-Identifier: GPL-3.0-or-later
"""BSDFs that Mitsuba lacks."""

from __future__ import annotations

from typing import Any


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDFs for the active variant."""
