# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the numbers that plugins keep in helper objects visible to Dr.Jit.

A recorded kernel launch reads the current members of a plugin. Dr.Jit follows lists, but not plain Python objects, so
each plugin gets a list of the arrays in its helpers.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

_LEAVES = (str, bytes, bool, int, float, complex, type(None), type, np.ndarray, np.generic)

_PLAIN = frozenset({str, bytes, bool, int, float, type(None)})


def lay_open(plugins: Iterable[Any], mitsuba: Any) -> None:
    """Give each of our plugins the list ``held_numbers``; call it again after helpers got new arrays."""
    for plugin in plugins:
        if type(plugin).__module__.startswith("spectral_core") and hasattr(plugin, "__dict__"):
            plugin.held_numbers = held(
                [value for name, value in vars(plugin).items() if name != "held_numbers"], mitsuba
            )


def held(roots: list[Any], mitsuba: Any) -> list[Any]:
    """Arrays and textures of Dr.Jit that are reachable through plain objects; Mitsuba's objects are not followed."""
    import drjit as dr

    found: list[Any] = []
    seen: set[int] = set()
    waiting = [root for root in roots if not dr.is_array_v(root)]
    while waiting:
        item = waiting.pop()
        if isinstance(item, _LEAVES) or id(item) in seen:
            continue
        seen.add(id(item))
        if isinstance(item, mitsuba.Object):
            continue
        if dr.is_array_v(item) or type(item).__module__.startswith(("drjit", "mitsuba")):
            found.append(item)
        elif isinstance(item, dict):
            waiting += list(item.values())
        elif isinstance(item, (list, tuple)):
            if not _PLAIN.issuperset(map(type, item)):  # tables of numbers are long
                waiting += list(item)
        elif type(item).__module__.startswith("spectral_core"):
            waiting += list(getattr(item, "__dict__", {}).values())
            slots = [name for kind in type(item).__mro__ for name in getattr(kind, "__slots__", ())]
            waiting += [getattr(item, name) for name in slots if hasattr(item, name)]
    return found
