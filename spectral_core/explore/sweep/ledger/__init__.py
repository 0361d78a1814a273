# SPDX-License-Identifier: GPL-3.0-or-later
"""The ledger of a sweep: its tables, a private copy of one that is read-only, finished points, and the time left."""

from spectral_core.explore.sweep.ledger.count import DoneCount
from spectral_core.explore.sweep.ledger.ledger import VERSION, Ledger
from spectral_core.explore.sweep.ledger.lost import require_ledger, require_points
from spectral_core.explore.sweep.ledger.pace import Pace
from spectral_core.explore.sweep.ledger.rows import Row, State

__all__ = ["VERSION", "DoneCount", "Ledger", "Pace", "Row", "State", "require_ledger", "require_points"]
