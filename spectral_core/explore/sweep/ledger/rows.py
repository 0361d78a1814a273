# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of a ledger, checked as they are read: its file may have been edited by hand or damaged."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

State = Literal["pending", "done", "failed"]
COLUMNS = "key, ordinal, parameters, state, outcome, files, seconds, reason"
_KEY = re.compile(r"\w[\w-]*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Row:
    """One point of the ledger. ``outcome`` and ``files`` are empty until it is done."""

    key: str
    ordinal: int
    parameters: dict[str, Any]
    state: State
    outcome: dict[str, Any]
    files: dict[str, str]
    seconds: float | None
    reason: str | None


def row_of(stored: Sequence[Any]) -> Row:
    """The row of the stored ``COLUMNS``; ValueError that names the point and the misfit."""
    key, ordinal, parameters, state, outcome, files, seconds, reason = stored
    if not isinstance(key, str) or not _KEY.fullmatch(key):  # it names files of the folder
        raise ValueError(f"a point has the key {str(key)[:64]!r}; expected letters and digits")
    if not isinstance(ordinal, int):
        raise ValueError(f"point {key} has the ordinal {ordinal!r}; expected a whole number")
    if not isinstance(seconds, float | int | None):
        raise ValueError(f"point {key} took {seconds!r} seconds; expected a number")
    if not isinstance(reason, str | None):
        raise ValueError(f"point {key} has the reason {reason!r}; expected a text")
    return Row(
        key, ordinal, _table(key, "parameters", parameters, float | int | str), state,
        _table(key, "outcome", outcome, float | int | str | None), _table(key, "files", files, str), seconds, reason,
    )  # fmt: skip


def manual_value(key: str, name: str, stored: Any) -> float | int | str:
    """The value of a manual column at a point; ValueError that names both and the misfit."""
    value = _json(key, name, stored)
    if isinstance(value, bool) or not isinstance(value, float | int | str):
        raise ValueError(f"point {key} has {name} = {value!r}; expected a number or a text")
    return value


def _table(key: str, what: str, stored: Any, types: Any) -> dict[str, Any]:
    """A stored JSON object whose values have the types; an absent one is empty."""
    found = {} if stored is None or stored == "" else _json(key, what, stored)
    if not isinstance(found, dict):
        raise ValueError(f"the {what} of point {key} is a {type(found).__name__}; expected an object of values by name")
    for name, value in found.items():
        if not isinstance(value, types):
            raise ValueError(f"the {what} of point {key} has {name} = {value!r}; expected a single value")
    return found


def _json(key: str, what: str, stored: Any) -> Any:
    try:
        return json.loads(stored)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} of point {key} is not JSON: {error}") from error
