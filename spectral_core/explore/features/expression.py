# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions over columns, such as ``10 * log10(mse)`` or ``where(delta_e < 1, "good", "visible")``.

Text is parsed to a syntax tree of which only arithmetic, comparisons and a list of functions is admitted, and that
tree is walked over NumPy columns. Python never evaluates the text: there are no attributes, subscripts, loops, calls
of anything else, and no result larger than a column.
"""

from __future__ import annotations

import ast
import keyword
import operator
import re
import unicodedata
import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, UnknownNameError, counted

MAX_LENGTH = 2000
MAX_NODES = 400
MAX_DEPTH = 40
MAX_NUMBER = 1e300
MAX_TEXT = 200  # of a text that an expression states
Column = NDArray[Any]

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.FloorDiv: np.floor_divide,
    ast.Mod: np.mod, ast.Pow: np.power,
}  # fmt: skip
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip


def _rank(column: Column) -> Column:
    order = np.argsort(np.argsort(column, kind="stable"), kind="stable")
    return np.where(np.isnan(column), np.nan, order)


def _missing(value: Any) -> NDArray[np.bool_]:
    """True where a value is missing: an empty text, or NaN."""
    array = np.asarray(value)
    return array == "" if _is_text(array) else np.isnan(array.astype(np.float64))


FUNCTIONS: dict[str, tuple[int, int, Callable[..., Any]]] = {
    "abs": (1, 1, np.abs), "sqrt": (1, 1, np.sqrt), "exp": (1, 1, np.exp), "log": (1, 1, np.log),
    "log2": (1, 1, np.log2), "log10": (1, 1, np.log10), "sin": (1, 1, np.sin), "cos": (1, 1, np.cos),
    "tan": (1, 1, np.tan), "atan2": (2, 2, np.arctan2), "hypot": (2, 2, np.hypot), "floor": (1, 1, np.floor),
    "ceil": (1, 1, np.ceil), "round": (1, 1, np.round), "sign": (1, 1, np.sign),
    "min": (2, 8, lambda *a: np.minimum.reduce(np.broadcast_arrays(*a))),
    "max": (2, 8, lambda *a: np.maximum.reduce(np.broadcast_arrays(*a))),
    "clip": (3, 3, np.clip), "where": (3, 3, np.where), "isnan": (1, 1, _missing), "rank": (1, 1, _rank),
    "mean": (1, 1, np.nanmean), "median": (1, 1, np.nanmedian), "std": (1, 1, np.nanstd),
    "column_min": (1, 1, np.nanmin), "column_max": (1, 1, np.nanmax),
}  # fmt: skip
"""Fewest and most arguments, and the function. The last five give one number for the whole column."""
_WORDS = ("and", "or", "not", "if", "else")
CONSTANTS = {"pi": np.pi, "e": np.e, "nan": np.nan, "inf": np.inf}


def evaluate(text: str, columns: Mapping[str, Sequence[Any]]) -> list[float | str | None]:
    """Value of an expression at each row; None if it is no finite number.

    Raises InvalidInputError for anything but arithmetic over the columns, UnknownNameError for an absent column.
    """
    require_readable(text, columns)
    tree = parse(text)
    spelled = as_read(columns)
    length = len(next(iter(columns.values()), ()))
    cache: dict[str, Column] = {}

    def column(name: str) -> Column:
        name = spelled.get(name, name)
        if name in CONSTANTS and name not in columns:
            return np.asarray(CONSTANTS[name])
        if name not in columns:
            raise UnknownNameError.among("column", name, columns)
        if name not in cache:
            cache[name] = as_column(columns[name])
        return cache[name]

    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the mean of no number is an empty cell
        try:
            result = np.broadcast_to(np.asarray(_value(tree, column)), (length,))
        except InvalidInputError:
            raise
        except (TypeError, ValueError, OverflowError, MemoryError) as error:
            raise InvalidInputError(f"the expression {text[:80]!r} cannot be computed: {error}") from error
    if _is_text(result):
        return [str(item) for item in result]
    numbers = result.astype(np.float64)
    return [float(number) if np.isfinite(number) else None for number in numbers]


def as_column(values: Sequence[Any]) -> Column:
    """A column with a text as texts, any other as float64; a missing value is empty, or NaN."""
    if any(isinstance(value, str) for value in values):
        texts = ["" if value is None else str(value) for value in values]
        is_long = max(map(len, texts)) > MAX_TEXT  # an array of texts has the memory of the longest in each row
        return np.array(texts, object if is_long else str)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def as_read(names: Iterable[str]) -> dict[str, str]:
    """Names by what Python's parser makes of them: it reads the micro sign, for one, as a Greek letter."""
    return {unicodedata.normalize("NFKC", name): name for name in names}


def require_readable(text: str, names: Collection[str]) -> None:
    """Raise InvalidInputError for a name in a text that Python's parser reads as another word, such as lambda."""
    for word in re.findall(r"\w+", text) if isinstance(text, str) else ():
        if word in names and word not in _WORDS and (keyword.iskeyword(word) or not word.isidentifier()):
            raise InvalidInputError(
                f"the column {word!r} cannot be used in {text[:80]!r}, where this word means something else or cannot "
                "be read; give the column another name"
            )


def parse(text: str) -> ast.expr:
    """The syntax tree of an expression, checked: nothing in it can do more than arithmetic."""
    if not isinstance(text, str) or not text.strip():
        raise InvalidInputError("the expression is empty; expected for example 10 * log10(mse)")
    if len(text) > MAX_LENGTH:
        raise InvalidInputError(f"the expression has {len(text)} characters; at most {MAX_LENGTH} are read")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InvalidInputError(
            f"the expression {text[:80]!r} cannot be read: {getattr(error, 'msg', error)}"
        ) from error
    if sum(1 for _ in ast.walk(tree)) > MAX_NODES:
        raise InvalidInputError(f"the expression is too long; at most {MAX_NODES} names, numbers and signs are read")
    _check(tree, text, 0)
    return tree


def _check(node: ast.expr, text: str, depth: int) -> None:
    if depth > MAX_DEPTH:
        raise InvalidInputError(f"the expression {text[:80]!r} is nested more than {MAX_DEPTH} deep")
    match node:
        case ast.Constant(value=bool() | int() | float()):
            if not abs(node.value) <= MAX_NUMBER:  # type: ignore[arg-type]
                raise InvalidInputError(f"a number of the expression is larger than {MAX_NUMBER:g}")
            parts: list[ast.expr] = []
        case ast.Constant(value=str()):
            if len(node.value) > MAX_TEXT:  # type: ignore[arg-type]
                raise InvalidInputError(f"a text of the expression is longer than {MAX_TEXT} characters")
            parts = []
        case ast.Name():
            parts = []
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Not(), operand=operand):
            parts = [operand]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            parts = [left, right]
        case ast.BoolOp(values=values):
            parts = values
        case ast.Compare(left=left, ops=ops, comparators=comparators) if all(type(op) in _COMPARE for op in ops):
            parts = [left, *comparators]
        case ast.IfExp(test=test, body=body, orelse=otherwise):
            parts = [test, body, otherwise]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            if name not in FUNCTIONS:
                raise UnknownNameError.among("function", name, FUNCTIONS)
            fewest, most, _ = FUNCTIONS[name]
            if not fewest <= len(args) <= most:
                raise InvalidInputError(
                    f"{name} takes {counted(fewest, 'value') if fewest == most else f'{fewest} to {most} values'}; "
                    f"got {len(args)}"
                )
            parts = args
        case _:
            raise InvalidInputError(
                f"the expression {text[:80]!r} contains {_what(node)}; only columns, numbers, + - * / // % **, "
                f"comparisons, and, or, not, if and these functions are read: {', '.join(FUNCTIONS)}"
            )
    for part in parts:
        _check(part, text, depth + 1)


def _what(node: ast.expr) -> str:
    names = {"Attribute": "an attribute (a dot)", "Subscript": "a subscript", "Lambda": "a lambda", "Call": "a call",
             "ListComp": "a loop", "GeneratorExp": "a loop", "NamedExpr": "an assignment"}  # fmt: skip
    return names.get(type(node).__name__, f"a {type(node).__name__}")


def _value(node: ast.expr, column: Callable[[str], Column]) -> Any:
    match node:
        case ast.Constant(value=str() as text):
            return np.asarray(text)
        case ast.Constant(value=number):
            return np.float64(number)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return column(name)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return 1.0 - _truth(_value(operand, column))
        case ast.UnaryOp(op=op, operand=operand):
            value = _numeric(_value(operand, column))
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=op, right=right):
            return _BINARY[type(op)](_numeric(_value(left, column)), _numeric(_value(right, column)))
        case ast.BoolOp(op=op, values=values):
            return _joined([_truth(_value(each, column)) for each in values], is_and=isinstance(op, ast.And))
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            sides = [_value(each, column) for each in (left, *comparators)]
            pairs = zip(sides, ops, sides[1:], strict=False)
            return _joined([_compared(_COMPARE[type(op)], a, b) for a, op, b in pairs], is_and=True)
        case ast.IfExp(test=test, body=body, orelse=otherwise):
            return _chosen(*(_value(each, column) for each in (test, body, otherwise)))
        case ast.Call(func=ast.Name(id=name), args=args):
            given: list[Any] = [_value(each, column) for each in args]
            if name == "where":
                return _chosen(*given)
            if name == "isnan":
                return _missing(*given)
            return FUNCTIONS[name][2](*(_numeric(value) for value in given))
    raise InvalidInputError(f"{_what(node)} cannot be computed")


def _numeric(value: Any) -> Any:
    array = np.asarray(value)
    if _is_text(array):
        raise InvalidInputError("the expression computes with texts; texts can only be compared and chosen by where")
    return array.astype(np.float64)


def _truth(value: Any) -> NDArray[np.float64]:
    """1 where a value is true, 0 where it is not, NaN where it is missing."""
    number = _numeric(value)
    return np.where(np.isnan(number), np.nan, number != 0)


def _compared(compare: Callable[[Any, Any], Any], first: Any, second: Any) -> NDArray[np.float64]:
    """A comparison as ``_truth`` gives it: that with a missing number or text is missing.

    A comparison with the text ``""`` that the expression states asks for missing texts, so that it is known.
    """
    sides = np.asarray(first), np.asarray(second)
    if len({_is_text(side) for side in sides}) == 2:
        sides = _alike(*sides, is_order=compare not in (operator.eq, operator.ne))
    found = np.asarray(compare(*sides), np.float64)
    if any(side.ndim == 0 and _is_text(side) and not side.item() for side in sides):
        return found
    return np.where(np.logical_or(*map(_missing, sides)), np.nan, found)


def _alike(first: Column, second: Column, *, is_order: bool) -> tuple[Column, Column]:
    """A text and a number as texts that are equal if the text states the number.

    A column that holds numbers and texts is one of texts, and one that holds no value yet is one of numbers.
    """
    if is_order and not all(_is_text(side) or _missing(side).all() for side in (first, second)):
        raise InvalidInputError("the expression asks which of a text and a number is larger; compare numbers alone")
    return _written(first), _written(second)


def _joined(truths: Sequence[NDArray[np.float64]], *, is_and: bool) -> NDArray[np.float64]:
    """Truths joined by "and" or "or": missing where a missing one decides (Kleene's logic)."""
    table = np.stack(np.broadcast_arrays(*truths))
    deciding = 0.0 if is_and else 1.0
    unknown = np.where(np.isnan(table).any(axis=0), np.nan, 1.0 - deciding)
    return np.where((table == deciding).any(axis=0), deciding, unknown)


def _chosen(test: Any, body: Any, otherwise: Any) -> NDArray[Any]:
    """``body`` where the test is true, ``otherwise`` where it is not; empty or NaN where the test or it is missing."""
    truth = _truth(test)
    if _is_text(body) != _is_text(otherwise):
        body, otherwise = (side if _is_text(side) else _written(side) for side in (body, otherwise))
    found = np.where(truth == 1.0, body, otherwise)
    missing = np.isnan(truth) | np.where(truth == 1.0, _missing(body), _missing(otherwise))
    return np.where(missing, "" if _is_text(found) else np.nan, found)


def _is_text(value: Any) -> bool:
    return np.asarray(value).dtype.kind in "USO"


def _written(value: Any) -> Column:
    """Numbers, and texts that state one, as the text of each: 3 for 3.0, empty where it is missing; others as is."""
    array = np.asarray(value)
    texts = [_text_of(each) for each in array.ravel().tolist()]
    return np.array(texts, object if array.dtype.kind == "O" else str).reshape(array.shape)


def _text_of(value: Any) -> str:
    try:
        number = float(value)
    except ValueError:
        return str(value)
    return repr(number).removesuffix(".0") if np.isfinite(number) or isinstance(value, str) else ""
