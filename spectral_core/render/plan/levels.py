# SPDX-License-Identifier: GPL-3.0-or-later
"""The effects that are omitted at a tolerance: error and saving of each level of an effect, and the order of omission.

All steps of all effects are sorted: by magnitude of error (below 0.1, to 1, to 10, above), within a magnitude by error
per time saved. Steps are taken in this order until the sum of their errors would exceed the tolerance. An effect that
is omitted at one tolerance is therefore omitted at every larger one, and the total error stays below the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from spectral_core.render.plan.decision import How, error_together

KEEP = float("inf")
"""Error of a step that is not taken at any tolerance."""
_LEAST_SAVING = 1e-3
"""Least share of the time that a step counts as saving: less noise, fewer kernels."""


@dataclass(frozen=True, slots=True)
class Level:
    """A level of an effect: its ``error`` (ΔE2000) relative to the full effect, and the share of the time that it
    ``saves``. One that does not ``pay`` is stated, and not chosen at any tolerance.
    """

    value: str
    error: float = 0.0
    saves: float = 0.0
    pays: bool = True


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect and its levels, from complete to none; errors and savings increase.

    ``reason``: why it is present, or why not. ``loses``: the visible loss without it. ``how``: origin of the errors.
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
        """Error of omitting it completely; None if unknown."""
        return None if self.how == "not known" else self.levels[-1].error

    @property
    def share(self) -> float:
        """Its share of the time."""
        return self.levels[-1].saves


def indirect_error(effects: Iterable[Effect]) -> float | None:
    """ΔE2000 of omitting all light after a first bounce, None if it is not known."""
    last = next((effect.levels[-1] for effect in effects if effect.name == "bounces"), None)
    return last.error if last is not None and last.value == "0" and last.error < KEEP else None


def chosen(effects: Iterable[Effect], tolerance: float) -> Mapping[str, int]:
    """Index of the level of each effect at a tolerance in ΔE2000."""
    effects = list(effects)
    indirect = indirect_error(effects)
    steps = []
    for order, effect in enumerate(effects):
        key = (0, 0.0)
        for number in range(1, len(effect.levels)):
            before, after = effect.levels[number - 1], effect.levels[number]
            more = max(after.error - before.error, 0.0)
            error = max(after.error, before.error)
            if after.error == KEEP or not after.pays:
                break
            magnitude = int(np.searchsorted([0.1, 1.0, 10.0], after.error, side="right"))
            ratio = more / max(after.saves - before.saves, _LEAST_SAVING)
            key = max(key, (magnitude, ratio))  # levels of one effect are taken from the smallest loss on
            steps.append((*key, order, number, error))
    level = {effect.name: 0 for effect in effects}
    spent: dict[str, float] = {}
    for _, _, order, number, error in sorted(steps):
        spent[effects[order].name] = error
        if error_together(spent, indirect) > tolerance + 1e-12:
            break
        level[effects[order].name] = number
    return level
