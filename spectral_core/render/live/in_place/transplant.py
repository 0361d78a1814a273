# SPDX-License-Identifier: GPL-3.0-or-later
"""Copy the numbers of a new Mitsuba object into the existing one, so that nothing is compiled again.

Two compatible objects (equal classes, equal structure, arrays of equal size) differ only in numbers that kernels read.
These are copied; if anything else differs, nothing is changed. A helper with tables implements ``can_take(other)`` and
``take(other)`` to copy them itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from spectral_core.render.same import equal

Step = Callable[[], None]

PASSED_OVER = ("held_numbers",)
"""Attributes that a live view adds to plugins."""


def transplant(old: Any, new: Any, mitsuba: Any) -> bool:
    """Copy the numbers of ``new`` into ``old``; False, without any change, if they are not compatible."""
    steps: list[Step] = []
    if not _plan(old, new, mitsuba, steps, {}):
        return False
    for step in steps:
        step()
    return True


def _plan(old: Any, new: Any, mi: Any, steps: list[Step], seen: dict[int, Any]) -> bool:
    """Collect the copies; False if the two are not compatible."""
    if old is new or id(old) in seen:
        return True
    if type(old) is not type(new):
        return False
    if isinstance(old, (str, bytes, bool, int, float, complex, type(None), np.generic, np.ndarray)):
        return equal(old, new)
    seen[id(old)] = old  # kept: another wrapper of a child of Mitsuba could otherwise get the number of a freed one
    if isinstance(old, (list, tuple)):
        return len(old) == len(new) and all(_plan_item(old, k, new[k], mi, steps, seen) for k in range(len(old)))
    if isinstance(old, dict):
        return old.keys() == new.keys() and all(_plan_item(old, k, new[k], mi, steps, seen) for k in old)
    return (_plan_object if isinstance(old, mi.Object) else _plan_helper)(old, new, mi, steps, seen)


def _plan_helper(old: Any, new: Any, mi: Any, steps: list[Step], seen: dict[int, Any]) -> bool:
    """A plain object that a plugin uses."""
    if hasattr(old, "can_take"):
        if old.can_take(new):
            steps.append(lambda: old.take(new))
            return True
        return False
    if type(old).__module__.startswith("drjit"):
        return False  # reading its contents would change its type for a recorded launch
    return hasattr(old, "__code__") or _plan_attributes(old, new, mi, steps, seen)


def _plan_attributes(old: Any, new: Any, mi: Any, steps: list[Step], seen: dict[int, Any]) -> bool:
    """Attributes of one of our objects."""
    if not hasattr(old, "__dict__"):
        return old == new if type(old).__eq__ is not object.__eq__ else False
    mine = {name: value for name, value in vars(old).items() if name not in PASSED_OVER}
    if mine.keys() != {name for name in vars(new) if name not in PASSED_OVER}:
        return False
    free = getattr(type(old), "NOT_IN_KERNELS", ())
    for name in free:
        steps.append(lambda name=name: setattr(old, name, getattr(new, name)))  # type: ignore[misc]
    return all(_plan_item(old, name, vars(new)[name], mi, steps, seen) for name in mine if name not in free)


def _plan_item(owner: Any, key: Any, new: Any, mi: Any, steps: list[Step], seen: dict[int, Any]) -> bool:
    """One attribute, entry or item of ``owner``; arrays of the just-in-time compiler are copied in place."""
    import drjit as dr

    old = vars(owner)[key] if hasattr(owner, "__dict__") and isinstance(key, str) else owner[key]
    if not dr.is_array_v(old):
        return _plan(old, new, mi, steps, seen)
    if type(old) is not type(new) or dr.shape(old) != dr.shape(new):
        return False
    if _holds_the_same(old, new):  # a recorded launch may treat a new array as another type, so the old one stays
        return True
    if isinstance(owner, tuple):  # its items can be overwritten, but not replaced
        steps.append(lambda: _fill(old, new))
    elif hasattr(owner, "__dict__"):
        steps.append(lambda: setattr(owner, key, new))
    else:
        steps.append(lambda: owner.__setitem__(key, new))
    return True


def _holds_the_same(old: Any, new: Any) -> bool:
    return bool(np.array_equal(np.array(old), np.array(new)))


def _fill(old: Any, new: Any) -> None:
    """Copy the contents of ``new`` into the array ``old``."""
    if hasattr(old, "assign"):
        old.assign(new)
    else:
        old[:] = new


def _plan_object(old: Any, new: Any, mi: Any, steps: list[Step], seen: dict[int, Any]) -> bool:
    """A Mitsuba object: its parameters if Mitsuba implements it, its attributes if it is our plugin."""
    import drjit as dr

    if old.class_name() != new.class_name():
        return False
    if _is_ours(old):
        return _plan_attributes(old, new, mi, steps, seen)
    mine, other = _children(old, mi), _children(new, mi)
    if mine.keys() != other.keys() or not _same_kind(old, new):
        return False
    for name, child in mine.items():
        if not _plan(child, other[name], mi, steps, seen):
            return False
    own, given = mi.traverse(old), mi.traverse(new)
    names = [name for name in own.keys() if "." not in name and name not in mine]  # noqa: SIM118 - not a dict
    if set(names) != {name for name in given.keys() if "." not in name and name not in other}:  # noqa: SIM118
        return False
    for name in names:
        if type(own[name]) is not type(given[name]):
            return False
        if dr.is_array_v(own[name]) and dr.shape(own[name]) != dr.shape(given[name]):
            return False
    names = [name for name in names if not _holds_the_same(own[name], given[name])]
    if names:
        steps.append(lambda: _write(own, given, names))
    return not any(_is_constant(own, given, name) for name in names)


def _is_constant(own: Any, given: Any, name: str) -> bool:
    """True if recorded launches have a parameter, or what Mitsuba computes from it, as a constant: replayed, they would
    keep the old one. So it is with the ends of a spectrum's range.
    """
    import drjit as dr

    if name == "wavelengths":
        return not np.array_equal(np.array(own[name])[[0, -1]], np.array(given[name])[[0, -1]])
    return not dr.is_jit_v(own[name])


def _write(own: Any, given: Any, names: list[str]) -> None:
    for name in names:
        own[name] = given[name]
    own.update()


def _same_kind(old: Any, new: Any) -> bool:
    """True if two Mitsuba objects have equal flags, which are not among their parameters."""
    if hasattr(old, "flags"):
        return bool(old.flags() == new.flags())
    return True


def _is_ours(item: Any) -> bool:
    """True if a Mitsuba object is one of our plugins, written in Python."""
    return type(item).__module__.startswith("spectral_core")


def _children(item: Any, mi: Any) -> dict[str, Any]:
    """Direct children of a Mitsuba object."""
    found: dict[str, Any] = {}

    class Reader(mi.TraversalCallback):
        def put(self, name: str, value: Any, flags: int, kind: Any = None) -> None:
            if isinstance(value, mi.Object):
                found[name] = value

        def put_value(self, name: str, value: Any, flags: int, kind: Any = None) -> None:
            pass

        def put_object(self, name: str, value: Any, flags: int) -> None:
            found[name] = value

    item.traverse(Reader())
    return found
