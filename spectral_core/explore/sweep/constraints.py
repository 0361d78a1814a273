# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear constraints as text: ``2 * a + b <= 3``, ``log10(energy_w) >= 1``."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.explore.features.expression import as_read, require_readable
from spectral_core.explore.sweep.parameters import Parameter, Space

MAX_LENGTH = 500
LARGEST = 1e300


@dataclass(frozen=True, slots=True)
class LinearConstraint:
    """``coefficients · x <= bound`` over named parameters: values, or log10 of the values on a log scale.

    ``strict``: below the bound, which whole numbers and listed points may meet.
    """

    coefficients: tuple[tuple[str, float], ...]
    bound: float
    text: str
    strict: bool = False

    def row(self, space: Space, lowest: Mapping[str, float] | None = None) -> tuple[NDArray[np.float64], float]:
        """The half-space in coordinates of the unit cube, with its border: row (n,) and bound.

        It has the whole interval of each whole number that it allows, so that all of them have equal shares; those
        beyond the border that it has with them are left out by ``holds``. ``lowest``: of whole numbers, where the
        region has smaller ones than the sweep.
        """
        row = np.zeros(len(space.parameters))
        bound = self.bound
        for name, coefficient in self.coefficients:
            index, parameter = space.names.index(name), space[name]
            half = 0.5 if parameter.kind == "integer" else 0.0
            low, high = parameter.low - half, parameter.high + half
            if parameter.scale == "log":
                low, high = math.log10(low), math.log10(high)
            row[index] += coefficient * (high - low)
            bound -= coefficient * low
            if half:
                least = max(min(parameter.low, (lowest or {}).get(name, math.inf)), 1.0)
                bound += self._half_interval(parameter, coefficient, least)
        return row, bound

    def _half_interval(self, parameter: Parameter, coefficient: float, least: float) -> float:
        """By how much the border moves, so that the interval of each allowed whole number is within it."""
        if len(self.coefficients) > 1:
            if parameter.scale == "linear":
                return 0.5 * abs(coefficient)
            steps = (least + 0.5) / least if coefficient > 0 else least / (least - 0.5)
            return abs(coefficient) * math.log10(steps)  # the widest of all
        # one number alone: the border moves exactly to the end of an interval
        border = self.bound / coefficient
        if parameter.scale == "log":
            border = 10.0 ** min(max(border, -300.0), 300.0)
        last = float(math.floor(border) if coefficient > 0 else math.ceil(border))
        beyond = last + math.copysign(1.0, coefficient)
        last = next((k for k in (beyond, last) if self._allows(parameter, k)), last - math.copysign(1.0, coefficient))
        end = last + math.copysign(0.5, coefficient)
        if parameter.scale == "log":
            end = math.log10(max(end, 1e-300))
        return coefficient * end - self.bound

    def _allows(self, parameter: Parameter, number: float) -> bool:
        return (parameter.scale == "linear" or number > 0) and self.holds(Space((parameter,)), {parameter.name: number})

    def holds(self, space: Space, values: dict[str, float]) -> bool:
        """True if values satisfy it."""
        terms = [c * (math.log10(values[n]) if space[n].scale == "log" else values[n]) for n, c in self.coefficients]
        total = sum(terms)
        rounding = 1e-12 * max(map(abs, (*terms, self.bound)))  # relative: values may be meters of light's wavelength
        return total < self.bound - rounding if self.strict else total <= self.bound + rounding


def parse_constraint(text: str, space: Space) -> list[LinearConstraint]:
    """Constraints of a comparison such as ``0.1 <= a + 2*b <= 3``; one per comparison sign.

    Raises InvalidInputError if it is not linear, for names that the sweep lacks and for a parameter on a log scale
    that stands without log10.
    """
    if not isinstance(text, str) or len(text) > MAX_LENGTH:
        raise InvalidInputError(f"a constraint is a text of at most {MAX_LENGTH} characters; got {str(text)[:80]!r}")
    require_readable(text, space.names)
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InvalidInputError(f"the constraint {text!r} cannot be read: {getattr(error, 'msg', error)}") from error
    if not isinstance(tree, ast.Compare):
        raise InvalidInputError(f"the constraint {text!r} is no comparison; expected for example 2*a + b <= 3")
    found = []
    sides = [tree.left, *tree.comparators]
    for left, operator, right in zip(sides, tree.ops, sides[1:], strict=False):
        if isinstance(operator, ast.GtE | ast.Gt):
            left, right = right, left
        elif not isinstance(operator, ast.LtE | ast.Lt):
            raise InvalidInputError(f"the constraint {text!r} compares with a sign other than <=, <, >= and >")
        first, second = _linear(left, space, text), _linear(right, space, text)
        names = [name for name in space.names if first.get(name, 0.0) != second.get(name, 0.0)]
        if not names:
            raise InvalidInputError(f"the constraint {text!r} names no parameter, or they cancel")
        coefficients = tuple((name, first.get(name, 0.0) - second.get(name, 0.0)) for name in names)
        bound = second.get("", 0.0) - first.get("", 0.0)
        found.append(LinearConstraint(coefficients, bound, text, isinstance(operator, ast.Lt | ast.Gt)))
    return found


def _linear(node: ast.expr, space: Space, text: str) -> dict[str, float]:
    """Coefficients by name; "" is the constant."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and abs(number) <= LARGEST:
            return {"": float(number)}
        case ast.Name(id=name):
            name = as_read(space.names).get(name, name)
            _known(name, space, text)
            if space[name].scale == "log":
                raise InvalidInputError(f"{name} is on a log scale; write log10({name}) in the constraint {text!r}")
            return {name: 1.0}
        case ast.Call(func=ast.Name(id="log10"), args=[ast.Name(id=name)], keywords=[]):
            name = as_read(space.names).get(name, name)
            _known(name, space, text)
            if space[name].scale != "log":
                raise InvalidInputError(f"{name} is on a linear scale; write {name} itself in the constraint {text!r}")
            return {name: 1.0}
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return {name: -value for name, value in _linear(operand, space, text).items()}
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as operator, right=right):
            first, second = _linear(left, space, text), _linear(right, space, text)
            sign = 1.0 if isinstance(operator, ast.Add) else -1.0
            return {name: first.get(name, 0.0) + sign * second.get(name, 0.0) for name in {**first, **second}}
        case ast.BinOp(left=left, op=ast.Mult() | ast.Div() as operator, right=right):
            first, second = _linear(left, space, text), _linear(right, space, text)
            if isinstance(operator, ast.Mult) and set(first) == {""}:
                first, second = second, first
            factor = second.get("", 0.0)
            if set(second) == {""} and not (isinstance(operator, ast.Div) and factor == 0):
                factor = factor if isinstance(operator, ast.Mult) else 1.0 / factor
                return {name: factor * value for name, value in first.items()}
    raise InvalidInputError(
        f"the constraint {text!r} is not linear; expected sums of numbers times parameters, such as 2*a - b/3 <= 1"
    )


def _known(name: str, space: Space, text: str) -> None:
    if name not in space.names:
        raise InvalidInputError(f"the constraint {text!r} names {name!r}; the parameters are {', '.join(space.names)}")
    if space[name].kind == "choice" and any(isinstance(choice, str) for choice in space[name].choices):
        raise InvalidInputError(f"{name} chooses among texts, so it cannot be in the constraint {text!r}")
    if space[name].kind == "choice":
        raise InvalidInputError(f"{name} chooses among values; make it an integer or real to constrain it")
