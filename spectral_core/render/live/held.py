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

_DATA = ("spectral_core.scene", "spectral_core.spectra", "spectral_core.render.plugins.surfaces.sources")
"""Modules whose objects hold no arrays of Dr.Jit except in Mitsuba's textures; those of many materials are long to
search.
"""

_ARRAY, _LEAF, _DICT, _SEQUENCE, _OBJECT = range(5)


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
    known: dict[type, tuple[int, list[str]]] = {}
    waiting = [root for root in roots if not dr.is_array_v(root)]
    while waiting:
        item = waiting.pop()
        of = type(item)
        if of not in known:
            known[of] = _kind_of(of, mitsuba, dr)
        kind, slots = known[of]
        if kind == _LEAF or id(item) in seen:
            continue
        seen.add(id(item))
        if kind == _ARRAY:
            found.append(item)
        elif kind == _DICT:
            waiting += item.values()
        elif kind == _SEQUENCE:
            if not _PLAIN.issuperset(map(type, item)):  # tables of numbers are long
                waiting += item
        else:
            waiting += getattr(item, "__dict__", {}).values()
            waiting += [getattr(item, name) for name in slots if hasattr(item, name)]
    return found


def _kind_of(of: type, mitsuba: Any, dr: Any) -> tuple[int, list[str]]:
    """How an object of a type is searched, and the names of its slots."""
    if issubclass(of, _LEAVES) or issubclass(of, mitsuba.Object):
        return _LEAF, []
    if dr.is_array_v(of) or of.__module__.startswith(("drjit", "mitsuba")):
        return _ARRAY, []
    if issubclass(of, dict):
        return _DICT, []
    if issubclass(of, (list, tuple)):
        return _SEQUENCE, []
    if not of.__module__.startswith("spectral_core") or of.__module__.startswith(_DATA):
        return _LEAF, []
    # the descriptor of weak references that a dataclass with slots inherits raises a TypeError in Python 3.11.2
    slots = (name for base in of.__mro__ for name in getattr(base, "__slots__", ()))
    return _OBJECT, [name for name in slots if name != "__weakref__"]
