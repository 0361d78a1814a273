# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged palette documents are read or refused with their file; all keywords of the schema are implemented."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_core.errors import FileFormatError
from spectral_core.palette.files import read_palette, write_palette
from spectral_core.palette.presets import PRESETS

ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3),
    st.floats(),
    st.text(max_size=4),
    st.just([]),
    st.just({}),
    st.just([[1]]),
)


def places(document: Any, here: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Keys and indices that lead to every part of a document."""
    keys = list(document) if isinstance(document, dict) else range(len(document)) if isinstance(document, list) else []
    return [here, *(place for key in keys for place in places(document[key], (*here, key)))]


@settings(max_examples=200)
@given(st.data())
def test_any_document_is_read_or_refused_with_its_file(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "any.json"
    write_palette(path, PRESETS["Metamer pair"]())
    document = json.loads(path.read_text())
    *way, last = data.draw(st.sampled_from([place for place in places(document) if place]))
    part = document
    for key in way:
        part = part[key]
    part[last] = data.draw(ANYTHING)
    path.write_text(json.dumps(document))
    try:
        read_palette(path)
    except FileFormatError as error:
        assert str(path) in str(error)


def test_the_schema_uses_only_keywords_that_are_implemented() -> None:
    from spectral_core.documents.schema import KNOWN_WORDS
    from spectral_core.palette.files import palette_schema

    def words(schema: Any, named: bool = False) -> set[str]:
        if isinstance(schema, list):
            return set().union(*(words(each) for each in schema)) if schema else set()
        if not isinstance(schema, dict):
            return set()
        found = set() if named else set(schema)
        for word, value in schema.items():
            found |= words(value, named=not named and word in ("properties", "$defs"))
        return found

    assert words(palette_schema()) <= KNOWN_WORDS
