# SPDX-License-Identifier: GPL-3.0-or-later
"""``--only`` chooses cases of a benchmark by their names."""

from __future__ import annotations

import pytest

from benchmarks import Options
from spectral_core.errors import UnknownNameError

NAMES = ("room", "mirror", "mirror caustic", "glass caustic", "sky", "sky image")


def test_words_choose_equal_names_or_else_all_that_contain_them() -> None:
    def only(*words: str) -> list[str]:
        return Options(extra=list(words)).only(NAMES)

    assert only() == list(NAMES)
    assert only("--only", "mirror") == ["mirror"]
    assert only("--only", "caustic") == ["mirror caustic", "glass caustic"]
    assert only("--only", "sky, room") == ["room", "sky"]
    with pytest.raises(UnknownNameError, match="mirror"):
        only("--only", "miror")
