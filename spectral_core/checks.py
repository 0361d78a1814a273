# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of input: arrays become finite, read-only and of the stated shape, or an error gives the reason."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from os import PathLike
from pathlib import Path
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from spectral_core.errors import InvalidInputError, UnknownNameError, counted


def frozen_array(
    name: str, values: ArrayLike, shape: Sequence[int | None] | None = None, *, dtype: DTypeLike = np.float64
) -> NDArray[Any]:
    """Copy of ``values`` as a finite, C-contiguous, read-only array.

    ``shape`` holds one entry per axis, None if any length fits. Raises InvalidInputError naming ``name``, also for
    masked values and for complex numbers, of which NumPy would drop the mask and the imaginary part.
    """
    require_unmasked(name, values)
    if np.dtype(dtype).kind != "c" and getattr(getattr(values, "dtype", None), "kind", "") == "c":
        raise InvalidInputError(f"{name} holds complex numbers; expected real ones, such as their real part")
    try:
        array = np.array(values, dtype=dtype, order="C", copy=True)
    except (TypeError, ValueError, OverflowError) as error:  # OverflowError: an integer outside the range of a float
        raise InvalidInputError(f"{name} must be numbers of type {np.dtype(dtype)}; {error}") from error
    if shape is not None and not _fits(array.shape, shape):
        raise InvalidInputError(f"{name} has shape {array.shape}; expected {_shape_in_words(shape)}")
    require_finite(name, array)
    array.setflags(write=False)
    return array


def real_numbers(name: str, values: ArrayLike, last: int | None = None) -> NDArray[np.float64]:
    """``values`` in double precision, not copied where they have it; NaN and infinity are kept.

    ``last``: length of the last axis. Raises InvalidInputError naming ``name`` for anything but real numbers of that
    shape, also for masked values.
    """
    given: Any = values
    is_plain = type(given) is np.ndarray and given.dtype == np.float64
    array: NDArray[np.float64] = given if is_plain else _converted(name, values)
    if last is not None and array.shape[-1:] != (last,):
        raise InvalidInputError(f"{name} has shape {array.shape}; expected {last} numbers along the last axis")
    return array


def as_array(what: str, values: object, dtype: DTypeLike) -> NDArray[Any]:
    """``values`` as a C-contiguous array, not copied where they are one; ``what`` begins the message of the error."""
    try:
        return np.ascontiguousarray(values, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{what} type {type(values).__name__}; expected numbers ({error})") from error


def _converted(name: str, values: ArrayLike) -> NDArray[np.float64]:
    require_unmasked(name, values)
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise TypeError(f"they are of type {array.dtype}")
        return array.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} must be real numbers; {error}") from error


AnyArray = TypeVar("AnyArray", bound=NDArray[Any])


def read_only(array: AnyArray) -> AnyArray:
    """The same array, read-only: one that is kept for later calls would change for all of them."""
    array.setflags(write=False)
    return array


Frozen = TypeVar("Frozen")


def read_only_when_copied(kind: type[Frozen]) -> type[Frozen]:
    """Decorator of frozen dataclasses: arrays that are read-only stay so in deep copies and in other processes.

    NumPy restores an array as one that can be written.
    """

    def state(item: Any) -> tuple[dict[str, Any], list[str]]:
        values = (
            vars(item) if hasattr(item, "__dict__") else {each.name: getattr(item, each.name) for each in fields(item)}
        )
        arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
        return dict(values), [name for name, array in arrays.items() if not array.flags.writeable]

    def restore(item: Any, stored: tuple[dict[str, Any], list[str]]) -> None:
        for name, value in stored[0].items():
            object.__setattr__(item, name, value)
        for name in stored[1]:
            stored[0][name].setflags(write=False)

    for name, function in (("__getstate__", state), ("__setstate__", restore)):
        setattr(kind, name, function)
    return kind


def require_unmasked(name: str, values: ArrayLike) -> None:
    """Raise InvalidInputError if values of a masked array are masked: numbers that nobody knows."""
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise InvalidInputError(
            f"{name} holds {np.ma.count_masked(values)} masked value(s); fill them or leave them out before "
            "passing the data on"
        )


def require_finite(name: str, array: NDArray[Any]) -> None:
    """Raise InvalidInputError that names the first NaN or Inf of ``array`` by index."""
    if array.dtype.kind not in "fc":
        return
    bad = ~np.isfinite(array)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        value = array[index]
        raise InvalidInputError(
            f"{name} holds {int(bad.sum())} value(s) that are not finite, the first is {value} at index {index}; "
            "replace them before passing the data on"
        )


def require_range(name: str, value: float, low: float, high: float, unit: str = "") -> float:
    """``value`` as float when low <= value <= high; else InvalidInputError, also for text that reads as a number."""
    if isinstance(value, str | bytes):
        raise InvalidInputError(f"{name} is {str(value)[:40]}, a text; expected a number, without quotes")
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(f"{name} is {str(value)[:40]}{unit}; expected a number ({error})") from error
    if not low <= number <= high:  # also catches NaN
        limits = "a number" if (low, high) == (-math.inf, math.inf) else f"a value from {low}{unit} to {high}{unit}"
        raise InvalidInputError(f"{name} is {value}{unit}; expected {limits}")
    return number


def require_whole(name: str, value: float, low: int, high: int, unit: str = "") -> int:
    """``value`` as int when it is a whole number from ``low`` to ``high``; else InvalidInputError."""
    number = require_range(name, value, low, high, unit)
    if number != int(number) or isinstance(value, bool):
        raise InvalidInputError(f"{name} is {value}{unit}; expected a whole number")
    return int(number)


def path_of(path: str | PathLike[str], what: str = "the file") -> Path:
    """The path. Raises InvalidInputError for None, a number, bytes or an open file in place of a path."""
    if not isinstance(path, str | PathLike):
        raise InvalidInputError(
            f"{what} is {str(path)[:40]!r}, of type {type(path).__name__}; expected a path, as text or Path"
        )
    return Path(path)


def require_kind(name: str, value: object, kind: type, hint: str = "") -> None:
    """Raise InvalidInputError if ``value`` is not an instance of ``kind``; ``hint`` says where one comes from."""
    if not isinstance(value, kind):
        given = str(value)
        shown = repr(given[:40] + ("…" if len(given) > 40 else ""))
        raise InvalidInputError(
            f"{name} is {shown}, of type {type(value).__name__}; expected a {kind.__name__}{hint and f' ({hint})'}"
        )


def require_choices(item: Any) -> None:
    """Raise UnknownNameError if a field whose type is a ``Literal``, or one or None, has none of its values."""
    kind: Any = type(item)
    for name, (choices, is_optional) in _choices(kind).items():
        value = getattr(item, name)
        if value is None and is_optional:
            continue
        if not isinstance(value, str) or value not in choices:  # an array is compared with each by its elements
            raise UnknownNameError.among(f"{name.replace('_', ' ')} of {kind.__name__}", str(value), choices)


@cache
def _choices(kind: type) -> dict[str, tuple[tuple[Any, ...], bool]]:
    """Values of each field that takes only such values, and whether it may be None."""
    found = {}
    for name, hint in get_type_hints(kind).items():
        parts = get_args(hint) if _is_union(hint) else (hint,)
        rest = [part for part in parts if part is not type(None)]
        if len(rest) == 1 and get_origin(rest[0]) is Literal:
            found[name] = (get_args(rest[0]), len(parts) > 1)
    return found


def require_declared(item: Any) -> None:
    """Raise an error if a field of a dataclass has none of its declared choices, or another type than declared.

    UnknownNameError for choices, InvalidInputError for types. Numbers of NumPy count as numbers, and lists as tuples.
    Arrays are not checked: whoever stores one checks its shape and values, too.
    """
    require_choices(item)
    declared: Any = type(item)
    for name, kinds, is_open, is_whole, expected in _types(declared):
        value = getattr(item, name)
        if is_open and is_dataclass(value):
            continue
        if not isinstance(value, kinds) or (is_whole and isinstance(value, _FRACTIONAL) and value % 1 != 0):
            given = str(value)[:40] + ("…" if len(str(value)) > 40 else "")
            raise InvalidInputError(
                f"{name} of {type(item).__name__} is {given!r}, of type {type(value).__name__}; expected {expected}"
            )


FEW = 4
"""Most types of a field that a message lists."""
_FRACTIONAL = (float, np.floating)
_PLAIN: dict[Any, tuple[tuple[type, ...], str]] = {
    float: ((int, float, np.number), "a number"),
    int: ((int, float, np.number), "a whole number"),
    bool: ((bool, int, np.bool_), "True or False"),
    tuple: ((tuple, list), "a tuple"),
    str: ((str,), "a text"),
    type(None): ((type(None),), "None"),
}
"""What may stand for a plain type, and its words."""


@cache
def _types(kind: type) -> list[tuple[str, tuple[type, ...], bool, bool, str]]:
    """Name, permitted types, whether other dataclasses may stand there, whether a number must be whole, and words, of
    each field whose type can be checked.

    A union of more than ``FEW`` dataclasses, such as the closures of a surface, is open: a plugin may add others.
    """
    found = []
    hints = get_type_hints(kind)
    for each in fields(kind):
        hint = hints[each.name]
        parts = [get_origin(part) or part for part in (get_args(hint) if _is_union(hint) else (hint,))]
        if all(isinstance(part, type) and part is not np.ndarray for part in parts):
            known = [_PLAIN.get(part, ((part,), f"{'an' if part.__name__[0] in 'AEIOU' else 'a'} {part.__name__}"))
                     for part in parts]  # fmt: skip
            kinds = tuple(one for permitted, _ in known for one in permitted)
            is_whole = int in parts and float not in parts
            is_open = len(parts) > FEW and any(map(is_dataclass, parts))
            found.append((each.name, kinds, is_open, is_whole, _any_of([words for _, words in known])))
    return found


def _any_of(words: list[str]) -> str:
    """One of the words, or an example where there are many."""
    if len(words) > FEW:
        return f"one of {len(words)} types, such as {words[0]}"
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _is_union(hint: Any) -> bool:
    return get_origin(hint) in (Union, UnionType)


def require_text(name: str, text: str) -> str:
    """``text`` if every file can store it; raises InvalidInputError for NUL and for unpaired surrogates.

    Blender represents a name that is not UTF-8 with unpaired surrogates.
    """
    if not isinstance(text, str):
        raise InvalidInputError(f"{name} is {str(text)[:40]}; expected text")
    if "\0" in text or any("\ud800" <= each <= "\udfff" for each in text):
        raise InvalidInputError(f"{name} is {text[:40]!r}, which no file can store; rename it")
    return text


def _shape_in_words(shape: Sequence[int | None]) -> str:
    if not shape:
        return "a single number"
    if len(shape) == 1:
        return "a list of numbers" if shape[0] is None else f"a list of {counted(shape[0], 'number')}"
    return "×".join("any" if length is None else str(length) for length in shape)


def _fits(actual: tuple[int, ...], expected: Sequence[int | None]) -> bool:
    return len(actual) == len(expected) and all(e is None or a == e for a, e in zip(actual, expected, strict=True))
