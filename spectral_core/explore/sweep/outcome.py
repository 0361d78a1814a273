# SPDX-License-Identifier: GPL-3.0-or-later
"""The outcome of a point, and the node that computes it: any callable with a fingerprint."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.files import json_text
from spectral_core.explore.sweep.parameters import RESERVED_COLUMNS, Value, is_column_name, is_finite

Picture = NDArray[np.float32]
REAL = "fiub"
"""NumPy's kinds of numbers that a table and a picture hold: not complex ones, times or texts."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """Values and pictures of one point.

    ``values``: numbers and texts by column name. ``pictures``: linear sRGB (height, width, 3 or 4), row 0 on top, by
    name; "" is the main one. ``files``: ready file contents by ending, such as {".png": bytes}, where the picture is
    not known as numbers. ``shown``: a PNG for display in place of the plain sRGB one, by the name of its picture, where
    the scene has a view transform.
    """

    values: Mapping[str, float | int | str] = field(default_factory=dict)
    pictures: Mapping[str, Picture] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    shown: Mapping[str, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in self.values.items():
            if not is_column_name(name):
                raise InvalidInputError(
                    f"a value is named {name!r}; expected an identifier other than {', '.join(RESERVED_COLUMNS)}, FILE…"
                )
            is_plain = isinstance(value, np.generic) and value.dtype.kind in f"{REAL}U"
            if not (is_plain or isinstance(value, float | int | str)):
                raise InvalidInputError(f"the value {name!r} is a {type(value).__name__}; expected a number or a text")
            if isinstance(value, int) and not is_finite(value):
                raise InvalidInputError(f"the value {name!r} is a whole number beyond 1e308, which no table holds")
            if isinstance(value, str) and value != value.encode("utf-8", "ignore").decode("utf-8"):
                raise InvalidInputError(
                    f"the value {name!r} is {ascii(value)[:80]}, a text that UTF-8 cannot store; replace what stands "
                    "for half a character, as in file names of other encodings"
                )

    def beside(self, parameters: Mapping[str, Value]) -> Outcome:
        """This outcome, if none of its values has the column name of a parameter with another value."""
        for name in parameters:
            if name in self.values and self.values[name] != parameters[name]:
                raise InvalidInputError(
                    f"the outcome has a value {name!r}, which is a parameter's column; rename one of the two"
                )
        return self


@runtime_checkable
class ComputeNode(Protocol):
    """The swept function. It is pickled for workers, and may keep data in them between points."""

    @property
    def fingerprint(self) -> str:
        """Hash that changes if the same parameters give another outcome."""

    def __call__(self, parameters: Mapping[str, Value], seed: int) -> Outcome:
        """Compute one point."""


def worker_command(node: ComputeNode) -> list[str] | None:
    """Command of the process that can compute a node, the bootstrap code to be appended; None for plain Python."""
    command = getattr(node, "worker_command", None)
    return None if command is None else list(command())


def worker_prelude(node: ComputeNode) -> str:
    """Code that a worker runs before anything else, on its own module path; "" for most nodes."""
    return str(getattr(node, "worker_prelude", ""))


def describe(node: ComputeNode) -> list[str]:
    """Text of the plan on a node: data that stay between points, points that are re-lit or rendered."""
    lines = getattr(node, "describe", None)
    return list(lines()) if lines is not None else [type(node).__name__]


def point_key(fingerprint: str, parameters: Mapping[str, Value], seed: int) -> str:
    """Name of a row: SHA-256 (32 hex digits) of the node, its parameters and the seed."""
    plain = {"of": fingerprint, "parameters": dict(parameters), "seed": seed}
    return hashlib.sha256(json_text(plain).encode()).hexdigest()[:32]


def plain_values(values: Mapping[str, Any]) -> dict[str, float | int | str | None]:
    """Values for JSON: NumPy scalars become Python's; NaN and infinities become None, an empty cell."""
    plain: dict[str, float | int | str | None] = {}
    for name, value in values.items():
        item = value.item() if isinstance(value, np.generic) else value
        if isinstance(item, bool):
            item = int(item)
        plain[name] = None if isinstance(item, float) and not math.isfinite(item) else item
    return plain


def join_values(values: dict[str, Any], further: Mapping[str, Any]) -> None:
    """Add values to others. Raises InvalidInputError for a name that occurs twice: one value would be lost."""
    twice = next((name for name in further if name in values), None)
    if twice is not None:
        raise InvalidInputError(
            f"the outcome has two values named {twice!r}; entry {twice.rpartition('_')[2]} of a list "
            f"{twice.rpartition('_')[0]!r} has this name, too. Rename one of the two"
        )
    values.update(further)


def as_outcome(result: Any, name: str) -> Outcome:
    """Make an outcome from a user's result: an outcome, a number, or a mapping of numbers and pictures."""
    if isinstance(result, Outcome):
        return result
    if isinstance(result, int | float | np.generic):
        return Outcome({"result": result if not isinstance(result, np.generic) else result.item()})
    if not isinstance(result, Mapping):
        raise InvalidInputError(
            f"{name} returned a {type(result).__name__}; expected a number, or a dict of numbers, texts and pictures"
        )
    values: dict[str, Any] = {}
    pictures: dict[str, Picture] = {}
    for key, value in result.items():
        array = _array_of(name, key, value)
        if array is None or array.ndim == 0:
            join_values(values, {str(key): value if array is None else array[()]})
        elif (array.ndim == 2 or array.shape[2:] in ((3,), (4,))) and array.dtype.kind in REAL:
            pictures[str(key)] = np.asarray(array, np.float32)
        elif array.ndim == 1 and array.size <= 256 and array.dtype.kind in REAL:
            join_values(values, {f"{key}_{index}": item for index, item in enumerate(array.tolist())})
        else:
            raise InvalidInputError(
                f"{name} returned {key!r} of shape {array.shape} and type {array.dtype}; expected a number, a text, at "
                "most 256 numbers, or a picture of numbers: (height, width) or (height, width, 3 or 4)"
            )
    if pictures and "" not in pictures:
        first = next(iter(pictures))
        pictures = {"" if key == first else key: picture for key, picture in pictures.items()}
    return Outcome(values, pictures)


def _array_of(name: str, key: Any, value: Any) -> NDArray[Any] | None:
    """A list or an array as an array; None for another value."""
    if not isinstance(value, np.ndarray | Sequence) or isinstance(value, str | bytes):
        return None
    try:
        return np.asarray(value)
    except ValueError as error:
        raise InvalidInputError(
            f"{name} returned {key!r}, a list whose parts differ in length; expected numbers, or rows of equal length"
        ) from error
