# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters that change nothing are found with few calls."""

from __future__ import annotations

from typing import Any

from spectral_core.explore.sweep.effects import without_effect
from spectral_core.explore.sweep.parameters import Parameter, Space

SPACE = Space((
    Parameter("power", 0, 10), Parameter("shown", kind="choice", choices=("off", "on")),
    Parameter("turn", 0, 360), Parameter("dummy", 0, 5, kind="integer"),
))  # fmt: skip


def test_only_parameters_without_any_effect_are_named() -> None:
    calls = []

    def state(values: dict[str, Any]) -> Any:
        calls.append(values)
        return values["power"] if values["shown"] == "on" else 0.0, values["turn"] % 360

    assert [parameter.name for parameter in without_effect(SPACE, state)] == ["dummy"]
    assert len(calls) == len({tuple(each.values()) for each in calls}) <= 20


def test_parameters_with_an_effect_cost_one_call_each() -> None:
    calls = []
    assert not without_effect(SPACE, lambda values: (calls.append(values), *values.values()))
    assert len(calls) == 1 + len(SPACE.parameters)
