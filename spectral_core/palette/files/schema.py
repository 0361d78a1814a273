# SPDX-License-Identifier: GPL-3.0-or-later
"""Documents checked against ``palette.schema.json``: the part of JSON Schema that it uses, with errors that say where.

The schema file is also what an editor checks and completes palettes with. No validator is a dependency for it: these
are the few words of JSON Schema that the file needs, and a test sees that it uses no others.
"""

from __future__ import annotations

import json
import re
from functools import cache
from importlib import resources
from typing import Any

from spectral_core.errors import InvalidInputError


@cache
def palette_schema() -> dict[str, Any]:
    """The schema of palette documents."""
    text = resources.files("spectral_core.palette.files").joinpath("palette.schema.json").read_text("utf-8")
    return json.loads(text)


def require_valid(document: Any) -> None:
    """Raise InvalidInputError that names the first place where a document breaks the schema."""
    if isinstance(document, dict) and "format" in document:  # a file of another kind: say that before what it lacks
        _check(document["format"], palette_schema()["properties"]["format"], "format")
    _check(document, palette_schema(), "")


def _check(value: Any, schema: dict[str, Any], place: str) -> None:
    if "$ref" in schema:
        schema = palette_schema()["$defs"][schema["$ref"].rpartition("/")[2]]
    if "anyOf" in schema:
        _check_any(value, schema, place)
    if "const" in schema and value != schema["const"]:
        raise _error(place, value, repr(schema["const"]))
    if "enum" in schema and value not in schema["enum"]:
        raise _error(place, value, f"one of {', '.join(map(repr, schema['enum']))}")
    if "type" in schema and not _has_type(value, schema["type"]):
        raise _error(place, value, {"object": "a table", "array": "a list"}.get(schema["type"], f"a {schema['type']}"))
    if "pattern" in schema and isinstance(value, str) and not re.search(schema["pattern"], value):
        raise _error(place, value, "#rrggbb" if "#" in schema["pattern"] else f"text like {schema['pattern']}")
    if "minimum" in schema and _has_type(value, "number") and not value >= schema["minimum"]:
        raise _error(place, value, f"at least {schema['minimum']}")
    if isinstance(value, dict) and "properties" in schema:
        _check_table(value, schema, place)
    if isinstance(value, list) and schema.get("type") == "array":
        _check_list(value, schema, place)


def _check_any(value: Any, schema: dict[str, Any], place: str) -> None:
    """One of several schemas fits; else the error of the one that comes nearest: the one of the value's own type."""
    failures = []
    for choice in schema["anyOf"]:
        try:
            _check(value, choice, place)
        except InvalidInputError as error:
            resolved = palette_schema()["$defs"][choice["$ref"].rpartition("/")[2]] if "$ref" in choice else choice
            failures.append((not _has_type(value, resolved.get("type", "none")), error))
        else:
            return
    raise min(failures, key=lambda failure: failure[0])[1]


def _check_table(value: dict[str, Any], schema: dict[str, Any], place: str) -> None:
    known = schema["properties"]
    for name in schema.get("required", ()):
        if name not in value:
            raise InvalidInputError(f"{place or 'the document'} has no {name!r}; expected it beside {sorted(value)}")
    for name, item in value.items():
        if name not in known and not schema.get("additionalProperties", True):
            raise InvalidInputError(
                f"{place or 'the document'} holds the unknown word {name!r}; known: {', '.join(sorted(known))}"
            )
        _check(item, known.get(name, {}), f"{place}.{name}" if place else name)


def _check_list(value: list[Any], schema: dict[str, Any], place: str) -> None:
    low, high = schema.get("minItems", 0), schema.get("maxItems", len(value))
    if not low <= len(value) <= high:
        count = f"{low}" if low == high else f"{low} to {high}" if "maxItems" in schema else f"at least {low}"
        raise InvalidInputError(f"{place} has {len(value)} entries; expected {count}")
    for index, item in enumerate(value):
        _check(item, schema.get("items", {}), f"{place}[{index}]")


def _has_type(value: Any, name: str) -> bool:
    if name in ("number", "integer"):
        kinds = (int, float) if name == "number" else (int,)
        return isinstance(value, kinds) and not isinstance(value, bool)
    return isinstance(value, {"object": dict, "array": list, "string": str, "boolean": bool}.get(name, ()))


def _error(place: str, value: Any, expected: str) -> InvalidInputError:
    shown = json.dumps(value, default=str)
    return InvalidInputError(
        f"{place or 'the document'} is {shown if len(shown) < 60 else shown[:57] + '...'}; expected {expected}"
    )
