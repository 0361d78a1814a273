# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain documents as TOML 1.0, formatted for reading and editing: the standard library can only read TOML."""

from __future__ import annotations

import json
import math
from typing import Any

WIDTH = 110


def toml_text(document: dict[str, Any]) -> str:
    """A document of strings, numbers, booleans, lists and tables as TOML; None entries of tables are left out.

    Lists of tables become ``[[name]]``, tables ``[name]``; nested tables are written in one line.
    """
    lines: list[str] = []
    tables = {name: value for name, value in document.items() if _is_table_like(value)}
    lines += [f"{_key(name)} = {_value(value)}" for name, value in document.items() if _is_plain(value, tables, name)]
    for name, value in tables.items():
        if not value:
            continue
        for item in value if isinstance(value, list) else [value]:
            bracket = f"[[{_key(name)}]]" if isinstance(value, list) else f"[{_key(name)}]"
            entries = [f"{_key(key)} = {_value(entry)}" for key, entry in item.items() if entry is not None]
            lines += ["", bracket, *entries]
    return "\n".join(lines).lstrip("\n") + "\n"


def _is_table_like(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _is_plain(value: Any, tables: dict[str, Any], name: str) -> bool:
    return name not in tables and value is not None


def _key(name: str) -> str:
    bare = name.replace("_", "").replace("-", "")
    return name if bare.isascii() and bare.isalnum() else _string(name)


def _string(text: str) -> str:
    # JSON's escapes are TOML's, except that TOML also requires an escape for DEL.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None) + "}"
    if isinstance(value, (list, tuple)):
        return _list([_value(item) for item in value])
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return repr(value)


def _list(items: list[str]) -> str:
    """On one line if it fits, else filled lines; line breaks are allowed inside brackets."""
    short = "[" + ", ".join(items) + "]"
    if len(short) <= WIDTH or "\n" in short:
        return short
    lines, line = ["["], "    "
    for item in items:
        if len(line) + len(item) + 2 > WIDTH:
            lines.append(line.rstrip())
            line = "    "
        line += item + ", "
    return "\n".join([*lines, line.rstrip(), "]"])
