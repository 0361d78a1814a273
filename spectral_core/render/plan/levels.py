# SPDX-License-Identifier: GPL-3.0-or-later
"""Which effects leave at a tolerance: what each amount of an effect gives away and saves, and the order of leaving.

All steps of all effects stand in one row: by magnitude of error (below 0.1, to 1, to 10, above), within a magnitude by
error per time saved. A tolerance pays for the steps from the front, until their errors together would exceed it. So an
effect that has left at one tolerance has left at every larger one, and all that is given away stays below the
tolerance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from spectral_core.render.plan.decision import How

KEEP = float("inf")
"""Error of a step that is not taken at any tolerance."""
_LEAST_SAVING = 1e-3
"""Share of the time that every step counts to save: less noise, fewer kernels."""


@dataclass(frozen=True, slots=True)
class Level:
    """An amount of an effect: its ``error`` (ΔE2000) against all of it, and the share of the time it ``saves``."""

    value: str
    error: float = 0.0
    saves: float = 0.0


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect and its amounts, from all of it to none; errors and savings increase.

    ``reason``: why it is there, or why not. ``loses``: what is seen without it. ``how``: where the errors come from.
    """

    name: str
    levels: tuple[Level, ...]
    reason: str
    loses: str = ""
    how: How = "exact"
    choices: tuple[str, ...] = ()
    overridable: bool = True

    @property
    def known(self) -> float | None:
        """Error of leaving it out altogether; None where that is not known."""
        return None if self.how == "not known" else self.levels[-1].error

    @property
    def share(self) -> float:
        """Its share of the time."""
        return self.levels[-1].saves


def chosen(effects: Iterable[Effect], tolerance: float) -> Mapping[str, int]:
    """Number of the level of each effect at a tolerance in ΔE2000."""
    effects = list(effects)
    steps = []
    for order, effect in enumerate(effects):
        key = (0, 0.0)
        for number in range(1, len(effect.levels)):
            before, after = effect.levels[number - 1], effect.levels[number]
            more = max(after.error - before.error, 0.0)
            if after.error == KEEP:
                break
            magnitude = int(np.searchsorted([0.1, 1.0, 10.0], after.error, side="right"))
            ratio = more / max(after.saves - before.saves, _LEAST_SAVING)
            key = max(key, (magnitude, ratio))  # a chain leaves from its far end
            steps.append((*key, order, number, more))
    level = {effect.name: 0 for effect in effects}
    spent = 0.0
    for _, _, order, number, more in sorted(steps):
        spent += more
        if spent > tolerance + 1e-12:
            break
        level[effects[order].name] = number
    return level
