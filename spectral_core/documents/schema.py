# SPDX-License-Identifier: GPL-3.0-or-later
"""Documents checked against their JSON Schema files, with the position of each error.

Editors use the same schema files to check and complete documents. This module needs no validator as a dependency: it
implements the few keywords of JSON Schema that the files use, and a test checks that they use no others. Each file is
self-contained, as editors require; a test checks that the shared parts (grid, spectrum, color) are equal in all of
them.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from spectral_core.errors import FileFormatError, counted

Table = dict[str, Any]

KNOWN_WORDS = {
    "$schema", "$id", "$ref", "$defs", "title", "description", "type", "required", "additionalProperties", "properties",
    "const", "enum", "anyOf", "items", "minItems", "maxItems", "pattern", "minimum",
}  # fmt: skip
_TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,), "array": (list,), "string": (str,), "boolean": (bool,), "number": (int, float),
    "integer": (int,),
}  # fmt: skip
_WORDS = {
    "object": "a table", "array": "a list", "string": "a text", "boolean": "true or false", "number": "a number",
    "integer": "a whole number",
}  # fmt: skip


@cache
def _loaded(package: str, name: str) -> Table:
    schema: Table = json.loads(resources.files(package).joinpath(name).read_text("utf-8"))
    return schema


@dataclass(frozen=True)
class Schema:
    """A schema file of a package: ``Schema("spectral_core.palette.files", "palette.schema.json")``."""

    package: str
    name: str

    @property
    def content(self) -> Table:
        """The schema itself, in the form that editors and validators of JSON Schema accept."""
        return _loaded(self.package, self.name)

    def require_valid(self, document: Any) -> None:
        """Raise FileFormatError that names the first position where ``document`` violates the schema."""
        if isinstance(document, dict) and "format" in document:  # a file of another type: report that first
            self._check(document["format"], self.content["properties"]["format"], "format")
        self._check(document, self.content, "")

    def _resolved(self, schema: Table) -> Table:
        if "$ref" not in schema:
            return schema
        found: Table = self.content["$defs"][schema["$ref"].rpartition("/")[2]]
        return found

    def _check(self, value: Any, schema: Table, place: str) -> None:
        schema = self._resolved(schema)
        if "anyOf" in schema:
            self._check_any(value, schema, place)
        if "const" in schema and (value != schema["const"] or isinstance(value, bool)):
            raise _error(place, value, repr(schema["const"]))
        if "enum" in schema and value not in schema["enum"]:
            raise _error(place, value, f"one of {', '.join(map(repr, schema['enum']))}")
        if "type" in schema and not _has_type(value, schema["type"]):
            raise _error(place, value, _WORDS[schema["type"]])
        if "pattern" in schema and isinstance(value, str) and not re.search(schema["pattern"], value):
            raise _error(
                place, value, "#rrggbb, a color such as '#c8a078'" if "#" in schema["pattern"] else schema["pattern"]
            )
        if "minimum" in schema and _has_type(value, "number") and not value >= schema["minimum"]:
            raise _error(place, value, f"at least {schema['minimum']}")
        if isinstance(value, dict) and "properties" in schema:
            self._check_table(value, schema, place)
        if isinstance(value, list):
            self._check_list(value, schema, place)

    def _check_any(self, value: Any, schema: Table, place: str) -> None:
        """One of several schemas fits; else the error of the schema for the value's own type, which is the most
        specific.
        """
        choices = [self._resolved(choice) for choice in schema["anyOf"]]
        failures = []
        for choice in choices:
            try:
                self._check(value, choice, place)
            except FileFormatError as error:
                failures.append((not _has_type(value, choice.get("type", "none")), error))
            else:
                return
        misfit, nearest = min(failures, key=lambda failure: failure[0])
        if misfit and all("type" in choice for choice in choices):
            raise _error(place, value, " or ".join(_WORDS[choice["type"]] for choice in choices))
        raise nearest

    def _check_table(self, value: Table, schema: Table, place: str) -> None:
        known, where = schema["properties"], place or "the document"
        for name in schema.get("required", ()):
            if name not in value:
                beside = f"expected it beside {', '.join(sorted(value)[:20])}" if value else "it is empty"
                raise FileFormatError(f"{where} has no {name!r}; {beside}")
        for name, item in value.items():
            if name not in known and not schema.get("additionalProperties", True):
                raise FileFormatError(f"{where} has the unknown entry {name[:60]!r}; known: {', '.join(sorted(known))}")
            self._check(item, known.get(name, {}), f"{place}.{name}" if place else name)

    def _check_list(self, value: list[Any], schema: Table, place: str) -> None:
        low, high = schema.get("minItems", 0), schema.get("maxItems", len(value))
        if not low <= len(value) <= high:
            count = f"{low}" if low == high else f"{low} to {high}" if "maxItems" in schema else f"at least {low}"
            raise FileFormatError(f"{place} has {counted(len(value), 'entry', 'entries')}; expected {count}")
        items = schema.get("items", {})
        if self._resolved(items) == {"type": "number"}:  # long lists of samples: without a call for each
            wrong = next((index for index, item in enumerate(value) if type(item) not in (int, float)), None)
            if wrong is not None:
                raise _error(f"{place}[{wrong}]", value[wrong], "a number")
            return
        for index, item in enumerate(value):
            self._check(item, items, f"{place}[{index}]")


def _has_type(value: Any, name: str) -> bool:
    if isinstance(value, bool):
        return name == "boolean"
    return isinstance(value, _TYPES.get(name, ()))


def _error(place: str, value: Any, expected: str) -> FileFormatError:
    shown = json.dumps(value, default=str)
    shown = shown if len(shown) < 60 else shown[:57] + "..."
    return FileFormatError(f"{place or 'the document'} is {shown}; expected {expected}")
