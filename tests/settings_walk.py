# SPDX-License-Identifier: GPL-3.0-or-later
"""A test of translations, for panels, documents and Blender's types: each setting must change the result.

``ignored_settings`` lists the settings that change nothing, for example after their removal from a translation.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np


def fingerprint(item: Any) -> str:
    """SHA-256 over every number, text and array of a translation's result: equal data, equal fingerprint.

    Numbers count in single precision: the last digits of a product of matrices may differ from call to call.
    """
    digest = hashlib.sha256()
    _feed(digest, item)
    return digest.hexdigest()


PLAIN = (str, bytes, bool, int, type(None), np.generic, Path, Enum)


def _feed(digest: Any, item: Any) -> None:
    """Add an item to a digest; most are numbers, texts and dataclasses, of which a scene has ten thousands."""
    kind = type(item)
    digest.update(f"<{kind.__name__}".encode())
    if kind is float or kind is np.float64:
        digest.update(f"{item:.8g}".encode())
    elif isinstance(item, PLAIN):
        digest.update(repr(item).encode())
    elif (names := _fields_of(kind)) is not None:
        for name in names:
            digest.update(f".{name}".encode())
            _feed(digest, getattr(item, name))
    elif isinstance(item, (tuple, list)):
        for each in item:
            _feed(digest, each)
    elif isinstance(item, np.ndarray):
        kept = item.astype(np.float32) if item.dtype == np.float64 else item
        digest.update(f"{item.shape}".encode() + np.ascontiguousarray(kept).tobytes())
    elif isinstance(item, Mapping):
        for key in sorted(item, key=repr):
            _feed(digest, key)
            _feed(digest, item[key])
    elif isinstance(item, frozenset):
        digest.update(repr(sorted(item, key=repr)).encode())
    else:
        raise TypeError(f"{kind.__name__} has no fingerprint; state it as data")
    digest.update(b">")


@cache
def _fields_of(kind: type) -> tuple[str, ...] | None:
    """Names of the fields of a dataclass, None for any other type."""
    return tuple(field.name for field in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else None


def ignored_settings(
    names: Iterable[str], read: Callable[[str], Any], write: Callable[[str, Any], None],
    other: Callable[[str], Any], translated: Callable[[], Any],
) -> dict[str, str]:  # fmt: skip
    """Settings that the translation ignores, each with the observation.

    Parameters
    ----------
    names : settings to change, one after another.
    read, write : get and set the value of one.
    other : a value that differs from the present one.
    translated : the translation of all settings.
    """
    plain = fingerprint(translated())
    assert plain == fingerprint(translated()), "the translation differs from one call to the next"
    found = {}
    for name in sorted(names):
        kept = read(name)
        write(name, other(name))
        if fingerprint(translated()) == plain:
            found[name] = "changes nothing"
        write(name, kept)
        if fingerprint(translated()) != plain:
            found[name] = "is not undone"
    return found


def settings_of(owner: Any, base: Any = None) -> list[str]:
    """Names of the properties of a Blender struct that can be set, without those of a base type."""
    common = {"rna_type"} | ({each.identifier for each in base.bl_rna.properties} if base is not None else set())
    return [
        each.identifier
        for each in owner.bl_rna.properties
        if each.identifier not in common and not (each.is_readonly and each.type != "POINTER")
    ]


def read_rna(owner: Any, name: str) -> Any:
    """The value of a Blender property, as a copy."""
    value = getattr(owner, name)
    is_numbers = owner.bl_rna.properties[name].type in ("FLOAT", "INT", "BOOLEAN")
    return np.array(value).tolist() if is_numbers and np.ndim(value) else value


def other_rna(owner: Any, name: str) -> Any:
    """A value of a Blender property that differs from the present one, within its range."""
    declared, value = owner.bl_rna.properties[name], getattr(owner, name)
    if getattr(declared, "is_array", False) and declared.type != "FLOAT":
        return [not each if declared.type == "BOOLEAN" else each + 1 for each in value]
    if declared.type == "BOOLEAN":
        return not value
    if declared.type == "ENUM":
        return next(item.identifier for item in declared.enum_items if item.identifier != value)
    if declared.type == "STRING":
        return value + "other"
    if declared.type in ("INT", "FLOAT"):
        low, high = max(declared.soft_min, declared.hard_min), min(declared.soft_max, declared.hard_max)
        if declared.type == "INT":
            return value + 1 if value < high else value - 1
        if getattr(declared, "is_array", False):
            return tuple(_between(each, low, high) for each in value)
        return _between(value, low, high)
    raise TypeError(f"{name} is a {declared.type}; give another value for it by hand")


def _between(value: float, low: float, high: float) -> float:
    """A value near the present one, toward the farther end of its range."""
    end = high if value < high and high - value >= value - low else low
    return value + np.sign(end - value) * min(abs(end - value) / 2, max(abs(value) / 10, 0.02))


def because(reason: str, names: str) -> dict[str, str]:
    """One reason for each of the names, which spaces separate."""
    return dict.fromkeys(names.split(), reason)
