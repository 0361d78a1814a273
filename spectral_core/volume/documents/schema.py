# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer function documents checked against ``transfer.schema.json``, with errors that say where.

The schema is also what an editor checks and completes such files with. These are the few words of JSON Schema that it
uses; a test sees that it uses no others.
"""

from __future__ import annotations

import json
import re
from functools import cache
from importlib import resources
from typing import Any

from spectral_core.errors import FileFormatError

KNOWN_WORDS = {
    "$schema", "$id", "$ref", "$defs", "title", "description", "type", "required", "additionalProperties", "properties",
    "const", "enum", "anyOf", "items", "minItems", "maxItems", "pattern",
}  # fmt: skip
_TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "number": (int, float),
    "boolean": (bool,),
}
_WORDS = {"object": "a table", "array": "a list", "string": "a text", "number": "a number", "boolean": "true or false"}


@cache
def transfer_schema() -> dict[str, Any]:
    """The JSON Schema of transfer function documents."""
    text = resources.files("spectral_core.volume.documents").joinpath("transfer.schema.json").read_text("utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def require_valid(document: Any) -> None:
    """Raise FileFormatError that names the first place where ``document`` breaks the schema."""
    if isinstance(document, dict) and "format" in document:  # a file of another kind: say that before what it lacks
        _check(document["format"], transfer_schema()["properties"]["format"], "format")
    _check(document, transfer_schema(), "")


def _check(value: Any, schema: dict[str, Any], place: str) -> None:
    schema = _resolved(schema)
    if "anyOf" in schema:
        # The error of the choice of the value's own type says most; without one, all types that would do.
        fitting = [choice for choice in schema["anyOf"] if _has_type(value, _resolved(choice)["type"])]
        if not fitting:
            raise _error(place, value, " or ".join(_WORDS[_resolved(c)["type"]] for c in schema["anyOf"]))
        _check(value, fitting[0], place)
    if "const" in schema and value != schema["const"]:
        raise _error(place, value, repr(schema["const"]))
    if "enum" in schema and value not in schema["enum"]:
        raise _error(place, value, " or ".join(map(repr, schema["enum"])))
    if "type" in schema and not _has_type(value, schema["type"]):
        raise _error(place, value, _WORDS[schema["type"]])
    if "pattern" in schema and not re.search(schema["pattern"], value):
        raise _error(place, value, "a colour such as '#c8a078'")
    if isinstance(value, dict) and "properties" in schema:
        _check_table(value, schema, place)
    if isinstance(value, list):
        low, high = schema.get("minItems", 0), schema.get("maxItems", len(value))
        if not low <= len(value) <= high:
            expected = f"{low}" if low == high else f"at least {low}"
            raise FileFormatError(f"{place} has {len(value)} entries; expected {expected}")
        for index, item in enumerate(value):
            _check(item, schema.get("items", {}), f"{place}[{index}]")


def _check_table(value: dict[str, Any], schema: dict[str, Any], place: str) -> None:
    known, where = schema["properties"], place or "the document"
    for name in schema.get("required", ()):
        if name not in value:
            raise FileFormatError(
                f"{where} has no {name!r}; expected it beside {', '.join(sorted(value)) or 'nothing'}"
            )
    for name, item in value.items():
        if name not in known:
            raise FileFormatError(f"{where} holds the unknown word {name!r}; known: {', '.join(sorted(known))}")
        _check(item, known[name], f"{place}.{name}" if place else name)


def _resolved(schema: dict[str, Any]) -> dict[str, Any]:
    if "$ref" not in schema:
        return schema
    found: dict[str, Any] = transfer_schema()["$defs"][schema["$ref"].rpartition("/")[2]]
    return found


def _has_type(value: Any, name: str) -> bool:
    return isinstance(value, _TYPES[name]) and (name == "boolean" or not isinstance(value, bool))


def _error(place: str, value: Any, expected: str) -> FileFormatError:
    shown = json.dumps(value, default=str)
    shown = shown if len(shown) < 60 else shown[:57] + "..."
    return FileFormatError(f"{place or 'the document'} is {shown}; expected {expected}")
