# SPDX-License-Identifier: GPL-3.0-or-later
"""Parameters of a sweep: names with ranges, units, scales, and their mapping to the unit cube."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_choices, require_declared, require_kind
from spectral_core.errors import InvalidInputError, UnknownNameError

Value = float | int | str
"""Value of a parameter."""
Kind = Literal["real", "integer", "choice"]
NAME_PATTERN = re.compile(r"[^\W\d]\w*", re.UNICODE)
MAX_PARAMETERS = 64
RESERVED_COLUMNS = ("key", "seconds", "nan", "inf", "infinity")
"""Columns of every table, and words that readers of tables interpret as numbers."""


def is_column_name(name: Any) -> bool:
    """True if a text may name a column: an identifier that is not reserved and does not announce files."""
    return (
        isinstance(name, str)
        and NAME_PATTERN.fullmatch(name) is not None
        and name.lower() not in RESERVED_COLUMNS
        and not name.upper().startswith("FILE")
    )


def require_column_name(name: str) -> str:
    """An identifier that is no FILE column."""
    if is_column_name(name) and len(name) <= 64:
        return name
    raise InvalidInputError(
        f"{str(name)[:80]!r} cannot name a column; expected letters, digits and underscores, not key, seconds or FILE…"
    )


def is_finite(number: float) -> bool:
    """True if this is a number that is finite as a float. A whole number of 400 digits is too large for that."""
    try:
        return math.isfinite(number)
    except (OverflowError, TypeError):
        return False


@dataclass(frozen=True, slots=True)
class Parameter:
    """One swept quantity.

    ``name``: an identifier, the column of the table. ``path``: what it sets (a property path, an argument); the name
    where empty. ``low``, ``high``: ends of the range in ``unit``, both included. ``scale``: "log"
    spreads points evenly over the logarithm. ``choices``: the values of a parameter of kind "choice". ``group``: the
    dimension group in which views show it.
    """

    name: str
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    kind: Kind = "real"
    choices: tuple[Value, ...] = ()
    path: str = ""
    group: str = "parameters"

    def __post_init__(self) -> None:
        if not is_column_name(self.name):
            raise InvalidInputError(
                f"a parameter is named {self.name!r}; expected letters, digits and underscores, such as key_energy_w, "
                f"and none of {', '.join(RESERVED_COLUMNS)}, FILE…, which mean something else in a table"
            )
        require_choices(self)
        if self.kind == "choice":
            self._check_choices()
            return
        if self.choices:
            raise InvalidInputError(f"parameter {self.name!r} has choices; say kind = 'choice' or leave them out")
        low, high = self.low, self.high
        if not (is_finite(low) and is_finite(high) and low < high and is_finite(high - low)):
            raise InvalidInputError(
                f"parameter {self.name!r} runs from {low} to {high}; expected finite numbers, low < high, "
                "less than 1.8e308 apart. Leave out a parameter that should not vary"
            )
        if self.scale == "log" and low <= 0:
            raise InvalidInputError(f"parameter {self.name!r} runs from {low} on a log scale; expected low above 0")
        if self.kind == "integer" and (low != int(low) or high != int(high)):
            raise InvalidInputError(
                f"parameter {self.name!r} counts whole numbers from {low} to {high}; expected whole ends"
            )

    def _check_choices(self) -> None:
        for choice in self.choices:
            if isinstance(choice, bool) or not isinstance(choice, float | int | str):
                raise InvalidInputError(f"parameter {self.name!r} has the choice {choice!r}; expected numbers or texts")
            if not isinstance(choice, str) and not is_finite(choice):
                raise InvalidInputError(f"parameter {self.name!r} has the choice {choice}; expected finite numbers")
        if len(self.choices) < 2 or len(set(self.choices)) < len(self.choices):
            raise InvalidInputError(
                f"parameter {self.name!r} has choices {list(self.choices)}; expected at least two, each once"
            )
        if self.scale == "log":
            raise InvalidInputError(f"parameter {self.name!r} chooses among values, which have no log scale")

    @property
    def target(self) -> str:
        """The path that is set; the name if there is none."""
        return self.path or self.name

    @property
    def count(self) -> int | None:
        """Number of different values; None for a real parameter."""
        if self.kind == "choice":
            return len(self.choices)
        return int(self.high) - int(self.low) + 1 if self.kind == "integer" else None

    def value(self, unit: float) -> Value:
        """Value at a coordinate of the unit cube; those outside [0, 1] extrapolate a range of numbers."""
        if self.kind == "choice":
            return self.choices[min(max(math.floor(unit * len(self.choices)), 0), len(self.choices) - 1)]
        if self.kind == "real":
            return float(self._from_unit(self.low, self.high, unit))
        if self.scale == "log":  # the interval of each whole number extends half a step to both sides
            number = round(self._from_unit(self.low - 0.5, self.high + 0.5, unit))
        else:
            number = math.floor(self.low + unit * (self.high - self.low + 1))
        # the end of the interval of the last number belongs to it
        return int(min(max(number, int(self.low)), int(self.high))) if 0.0 <= unit <= 1.0 else int(number)

    def coordinate(self, value: Value) -> float:
        """Coordinate of a value in the unit cube: the middle of its interval for a whole number or a choice."""
        if self.kind == "choice":
            if value not in self.choices or isinstance(value, bool):
                raise InvalidInputError(f"{self.name} is {value!r}; the choices are {list(self.choices)}")
            return (self.choices.index(value) + 0.5) / len(self.choices)
        return self.place(self._number(value))

    def counted(self, value: Value) -> Value:
        """A value of this parameter as points of a design have it: an integer, or the choice itself."""
        if self.kind == "choice":
            return self.choices[self.choices.index(value)]
        return int(value) if self.kind == "integer" else value

    def place(self, number: float) -> float:
        """Coordinate of a number, which need not be whole for a parameter that counts: it has half a step around it."""
        half = 0.5 if self.kind == "integer" else 0.0
        return self._to_unit(self.low - half, self.high + half, number)

    @property
    def width(self) -> float:
        """Length of the unit interval in values, in decades on a log scale."""
        half = 0.5 if self.kind == "integer" else 0.0
        low, high = self.low - half, self.high + half
        return math.log10(high) - math.log10(low) if self.scale == "log" else high - low

    def _number(self, value: Value) -> float:
        if isinstance(value, bool | str) or not is_finite(value):
            raise InvalidInputError(f"{self.name} is {value!r}; expected a finite number")
        if self.scale == "log" and value <= 0:
            raise InvalidInputError(f"{self.name} is {value} on a log scale; expected a number above 0")
        if self.kind == "integer" and value != int(value):
            raise InvalidInputError(f"{self.name} is {value}; expected a whole number")
        return float(value)

    def _from_unit(self, low: float, high: float, unit: float) -> float:
        if self.scale == "log":
            value = math.exp(math.log(low) + unit * (math.log(high) - math.log(low)))
        else:
            value = low + unit * (high - low)
        # the exponential may round beyond the end of the range that contains its argument
        return min(max(value, low), high) if 0.0 <= unit <= 1.0 else value

    def _to_unit(self, low: float, high: float, value: float) -> float:
        if self.scale == "log":
            return (math.log(value) - math.log(low)) / (math.log(high) - math.log(low))
        return (value - low) / (high - low)

    def to_dict(self) -> dict[str, Any]:
        """Plain entries for a document; defaults are left out."""
        plain: dict[str, Any] = {"name": self.name}
        if self.kind == "choice":
            plain |= {"choices": list(self.choices)}
        else:
            plain |= {"low": self.low, "high": self.high}
        rest = {"kind": (self.kind, "real"), "unit": (self.unit, ""), "scale": (self.scale, "linear"),
                "path": (self.path, ""), "group": (self.group, "parameters")}  # fmt: skip
        return plain | {name: value for name, (value, default) in rest.items() if value != default}

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Parameter:
        """The parameter of a document's table; InvalidInputError names the entry that is wrong."""
        given = dict(plain)
        known = {"name", "low", "high", "unit", "scale", "kind", "choices", "path", "group"}
        strange = sorted(set(given) - known)
        if strange or "name" not in given:
            what = f"has the entry {strange[0]!r}" if strange else "has no name"
            raise InvalidInputError(f"a parameter {what}; expected name and {', '.join(sorted(known - {'name'}))}")
        if "choices" in given:
            given.setdefault("kind", "choice")
            given["choices"] = tuple(given["choices"]) if isinstance(given["choices"], list | tuple) else ()
        elif not {"low", "high"} <= set(given):
            raise InvalidInputError(f"parameter {given['name']!r} has no range; give low and high, or choices")
        for end in ("low", "high"):
            if end in given and (isinstance(given[end], bool) or not isinstance(given[end], int | float)):
                raise InvalidInputError(f"parameter {given['name']!r} has {end} = {given[end]!r}; expected a number")
        for text in ("name", "unit", "path", "group"):
            if not isinstance(given.get(text, ""), str):
                raise InvalidInputError(f"a parameter has {text} = {given[text]!r}; expected a text")
        return cls(**given)


@dataclass(frozen=True, slots=True)
class Space:
    """The parameters of a sweep in order, and the unit cube over their ranges."""

    parameters: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        require_declared(self)
        for number, parameter in enumerate(self.parameters):
            require_kind(f"parameter {number} of the sweep", parameter, Parameter)
        object.__setattr__(self, "parameters", tuple(self.parameters))
        names = self.names
        if not 1 <= len(names) <= MAX_PARAMETERS:
            raise InvalidInputError(f"the sweep has {len(names)} parameters; expected 1 to {MAX_PARAMETERS}")
        doubled = [name for name in names if names.count(name) > 1]
        if doubled:
            raise InvalidInputError(f"two parameters are named {doubled[0]!r}; give each its own name")

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(parameter.name for parameter in self.parameters)

    def __getitem__(self, name: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise UnknownNameError.among("parameter", name, self.names)

    def values(self, unit_point: Sequence[float] | NDArray[np.float64]) -> dict[str, Value]:
        """Value of each parameter at a point (n,) of the unit cube."""
        return {p.name: p.value(float(u)) for p, u in zip(self.parameters, unit_point, strict=True)}

    def coordinates(self, values: Mapping[str, Value]) -> NDArray[np.float64]:
        """Point (n,) of the unit cube with these values."""
        missing = [name for name in self.names if name not in values]
        if missing:
            raise InvalidInputError(f"the point has no value for {missing[0]!r}; it needs {', '.join(self.names)}")
        return np.array([p.coordinate(values[p.name]) for p in self.parameters])
