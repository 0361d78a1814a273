# SPDX-License-Identifier: GPL-3.0-or-later
"""Swept locations, rotations and scales that leave their object in one place, as constraints and limits do."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.parameters import Parameter

from .settings import setting_at

SHARES = (1.0, 0.97, 0.37, 0.03, 0.0)
"""Places in a range where an object is looked at: between the ends, which whole turns repeat, and near them, where a
constraint may stop it. It ends at the start.
"""
ROUNDING = 1e-6
"""Of a matrix in single precision, which a constraint computes anew for each value."""


def where_it_stays(parameter: Parameter) -> str:
    """A note if some values of a location, rotation or scale leave its object in one place, as limits do.

    Raises InvalidInputError if no value moves it: a constraint or another rotation mode leaves the value as it was
    set, and places the object elsewhere.
    """
    setting = setting_at(parameter.target)
    places: dict[Any, Any] = {}
    for share in SHARES:
        setting.write(value := parameter.value(share))
        bpy.context.view_layer.update()
        places[value] = setting.matrix(bpy.context.evaluated_depsgraph_get())
    if None in places.values() or any(isinstance(value, str) for value in places):
        return ""
    values, found = list(map(float, places)), np.array(list(places.values()))
    rounding = ROUNDING * np.abs(found).max()
    if np.ptp(values) <= 8 * rounding:  # so far from the origin that single precision does not tell
        return ""
    if np.ptp(found, axis=0).max() <= rounding:
        raise InvalidInputError(
            f"{parameter.target} moves nothing: a constraint decides where its object is, or the rotation mode "
            "is another one; remove that, or sweep what decides"
        )
    steps = zip(values, values[1:], found, found[1:], strict=False)
    stays = [f"{b:g} and {a:g}" for a, b, one, other in steps
             if abs(a - b) > 8 * rounding and np.abs(one - other).max() <= rounding]  # fmt: skip
    if not stays:
        return ""
    return (f"note: {parameter.target} has its object in one place at {', and in one at '.join(sorted(stays))}: a "
            "constraint limits it, and pictures of such values are the same")  # fmt: skip
