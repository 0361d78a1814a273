# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths into frozen scenes and plain documents, such as ``lights[Key].power_w`` or ``cells[3].weight``.

A path is read by a small grammar, never evaluated: field names after dots, and in brackets the name of an item, its
number, or the numbers of an array's entry. Setting a value returns a changed copy.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError, UnknownNameError

Step = str | int | tuple[int, ...] | tuple[str]
_FIELD = re.compile(r"\.?([^\W\d]\w*)")
_BRACKET = re.compile(r"""\[\s*(?:"([^"]*)"|'([^']*)'|(-?\d+(?:\s*,\s*-?\d+)*)|([^\[\]"']+?))\s*\]""")
MAX_PATH = 400


def parse_path(path: str) -> list[Any]:
    """Steps of a path: ("field", name), ("item", name) or ("index", numbers). InvalidInputError if it is none."""
    if not isinstance(path, str) or not path or len(path) > MAX_PATH:
        raise InvalidInputError(f"a path is a text of 1 to {MAX_PATH} characters; got {str(path)[:60]!r}")
    steps: list[Any] = []
    at = 0
    while at < len(path):
        if match := _BRACKET.match(path, at):
            double, single, numbers, bare = match.groups()
            if numbers is not None:
                steps.append(("index", tuple(int(each) for each in numbers.split(","))))
            else:
                steps.append(("item", next(each for each in (double, single, bare) if each is not None)))
        elif (match := _FIELD.match(path, at)) and (at == 0) != path[at:].startswith("."):
            steps.append(("field", match.group(1)))
        else:
            raise InvalidInputError(
                f"the path {path!r} cannot be read at {path[at:][:30]!r}; expected for example lights[Key].power_w"
            )
        at = match.end()
    return steps


def set_path(whole: Any, path: str, value: Any) -> Any:
    """A copy of ``whole`` with the number or text at ``path`` replaced.

    Raises UnknownNameError for a name that is not there, InvalidInputError if the place holds no number or text,
    or one of another type.
    """
    return _set(whole, parse_path(path), value, path)


def place_of(whole: Any, path: str) -> tuple[Any, ...]:
    """The place to which a path leads in ``whole``, equal for each way to write it. Raises as ``set_path`` does."""
    place: list[Any] = []
    for kind, name in parse_path(path):
        part = _part(whole, (kind, name), path)
        if isinstance(whole, list | tuple):
            place.append(_position(whole, name, path) if kind == "item" else name[0] % len(whole))
        elif isinstance(whole, np.ndarray):
            place.append(tuple(each % size for each, size in zip(name, whole.shape, strict=True)))
        else:
            place.append(name)
        whole = part
    return tuple(place)


def require_set_once(places: Iterable[tuple[str, Any]]) -> None:
    """Raise InvalidInputError if two of the (words, place) pairs set the same place: one value would be lost."""
    found: dict[Any, str] = {}
    for words, place in places:
        if place in found:
            raise InvalidInputError(f"{found[place]} and {words} set the same value; leave out one of them")
        found[place] = words


def _set(whole: Any, steps: list[Any], value: Any, path: str, declared: str = "") -> Any:
    if not steps:
        return _fitting(whole, value, path, declared)
    first, *rest = steps
    part = _set(_part(whole, first, path), rest, value, path, _declared(whole, first[1]))
    kind, name = first
    if isinstance(whole, np.ndarray):
        changed = np.array(whole)
        changed[name] = part
        return changed
    if dataclasses.is_dataclass(whole) and not isinstance(whole, type):
        return dataclasses.replace(whole, **{name: part})
    if isinstance(whole, dict):
        return {**whole, name: part}
    position = name[0] if kind == "index" else _position(whole, name, path)
    items = list(whole)
    items[position] = part
    return tuple(items) if isinstance(whole, tuple) else items


def _part(whole: Any, step: tuple[str, Any], path: str) -> Any:
    kind, name = step
    if kind == "field" and dataclasses.is_dataclass(whole) and not isinstance(whole, type):
        known = [field.name for field in dataclasses.fields(whole) if not field.name.startswith("_")]
        if name not in known:
            raise UnknownNameError.among(f"property of {type(whole).__name__} (in the path {path!r})", name, known)
        return getattr(whole, name)
    if kind in ("field", "item") and isinstance(whole, dict):
        if name not in whole:
            raise UnknownNameError.among(f"entry (in the path {path!r})", name, [str(key) for key in whole])
        return whole[name]
    if kind == "index" and isinstance(whole, np.ndarray):
        try:
            entry = whole[name]
        except IndexError as error:
            raise InvalidInputError(f"the path {path!r} leads out of an array of shape {whole.shape}") from error
        if np.ndim(entry):
            raise InvalidInputError(
                f"the path {path!r} leads to part of an array of shape {whole.shape}; name one entry"
            )
        return entry.item()
    if kind == "index" and isinstance(whole, list | tuple):
        if len(name) != 1 or not -len(whole) <= name[0] < len(whole):
            raise InvalidInputError(f"the path {path!r} asks for item {name} of {len(whole)}")
        return whole[name[0]]
    if kind == "item" and isinstance(whole, list | tuple):
        return whole[_position(whole, name, path)]
    raise InvalidInputError(f"the path {path!r} does not lead on from a {type(whole).__name__}")


def _position(items: Any, name: str, path: str) -> int:
    names = [item.get("name") if isinstance(item, dict) else getattr(item, "name", None) for item in items]
    if name not in names:
        raise UnknownNameError.among(f"item (in the path {path!r})", name, [str(each) for each in names])
    return names.index(name)


def _declared(whole: Any, name: Any) -> str:
    """Declared type of a dataclass's field; "" for anything else."""
    if not dataclasses.is_dataclass(whole):
        return ""
    return next((str(field.type) for field in dataclasses.fields(whole) if field.name == name), "")


def _fitting(old: Any, new: Any, path: str, declared: str) -> Any:
    """The new value if it has the type of the old one, or the type that its field declares."""
    if isinstance(old, bool):
        if new in (0, 1, "true", "false"):
            return new in (1, "true")
        raise InvalidInputError(f"{path} is a switch; expected 0 or 1, got {new!r}")
    if declared.startswith("int") and not isinstance(new, str):
        if new != int(new):
            raise InvalidInputError(f"{path} is a whole number; got {new}. Sweep it with kind = 'integer'")
        return int(new)
    if isinstance(old, int | float) and not isinstance(new, str):
        return float(new)
    if isinstance(old, str) and isinstance(new, str):
        return new
    if old is None:  # a setting of None, which leaves a decision to the plan, accepts any value
        return new
    raise InvalidInputError(f"{path} holds a {type(old).__name__}, which cannot be set to {new!r}")
