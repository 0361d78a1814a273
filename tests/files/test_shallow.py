# SPDX-License-Identifier: GPL-3.0-or-later
"""The nesting of untrusted text, against a reader of single characters."""

from __future__ import annotations

import random

import pytest

from spectral_core.errors import FileFormatError
from spectral_core.files import guarded


def depth_of(text):
    """Largest depth of brackets outside of strings; a string ends on its line, or its quote is no string."""
    depth = deepest = place = 0
    while place < len(text):
        mark = text[place]
        if mark == '"':
            end = place + 1
            while end < len(text) and text[end] not in '"\n':
                end += 1
            if end < len(text) and text[end] == '"':
                place = end
        depth = depth + 1 if mark in "[{" else max(depth - 1, 0) if mark in "]}" else depth
        deepest = max(deepest, depth)
        place += 1
    return deepest


def test_the_depth_of_random_text_is_that_of_a_plain_reader(monkeypatch):
    monkeypatch.setattr(guarded, "MOST_NESTING", 3)
    rng, deep = random.Random(90210), 0
    for _ in range(4000):
        text = "".join(rng.choice('"[{]} a,\n') for _ in range(rng.randint(0, 24)))
        if depth_of(text) > 3:
            deep += 1
            with pytest.raises(FileFormatError, match="deeper than 3"):
                guarded.require_shallow(text, "drawn")
        else:
            guarded.require_shallow(text, "drawn")
    assert 200 < deep < 3800


@pytest.mark.parametrize("text", ['"\\"[[[["', '"a[[[[', "1.5, " * 200_000, '"' + "QUJD" * 200_000 + '"'])
def test_escapes_open_strings_and_long_text(text, monkeypatch):
    monkeypatch.setattr(guarded, "MOST_NESTING", 4)
    guarded.require_shallow(text, "given")
    with pytest.raises(FileFormatError, match=r"given, line 1: .* deeper than 4"):
        guarded.require_shallow("[[[[[" + text, "given")
