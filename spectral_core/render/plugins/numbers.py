# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers that kernels read instead of knowing."""

from __future__ import annotations

from typing import Any


def opaque_number(mi: Any, dr: Any, value: float) -> Any:
    """A number that kernels read instead of knowing, so that another value needs no new kernel."""
    return dr.opaque(mi.Float, float(value))
