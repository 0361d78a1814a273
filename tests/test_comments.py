# SPDX-License-Identifier: GPL-3.0-or-later
"""Comments of the numerics: each of their folders has at least one line of comment per fifteen lines of code."""

from __future__ import annotations

import io
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
NUMERICS = (
    "spectral_core/palette/qp",
    "spectral_core/volume/march",
    "spectral_core/render/trace",
    "spectral_core/lattice/fill",
)
CODE_PER_COMMENT = 15
BETWEEN = (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.NL)


def counted(text: str) -> tuple[int, int]:
    """(lines of code, lines of comment); docstrings and the license line count as neither."""
    code: set[int] = set()
    comments: set[int] = set()
    before = tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        lines = range(token.start[0], token.end[0] + 1)
        if token.type == tokenize.COMMENT:
            comments.update(lines)
            continue
        is_docstring = token.type == tokenize.STRING and before in BETWEEN
        if not is_docstring and token.type not in (*BETWEEN, tokenize.ENDMARKER):
            code.update(lines)
        before = token.type
    return len(code), len(comments - {1})


def test_the_count_distinguishes_code_comments_and_docstrings() -> None:
    lines = [
        "# license", '"""Docstring."""', "", "# why", "x = [1,", "     2]  # unit", '"""Of x."""', "", "",
        "def f():", '    """Doc."""', '    return "a"', "",
    ]  # fmt: skip
    assert counted("\n".join(lines)) == (4, 2)


@pytest.mark.parametrize("folder", NUMERICS)
def test_numerics_have_comments(folder: str) -> None:
    found = {path: counted(path.read_text("utf-8")) for path in sorted((ROOT / folder).rglob("*.py"))}
    code, comments = (sum(counts) for counts in zip(*found.values(), strict=True))
    barest = sorted(found, key=lambda path: found[path][0] / (found[path][1] + 1), reverse=True)[:4]
    places = ", ".join(f"{path.name} ({found[path][1]} in {found[path][0]})" for path in barest)
    assert comments * CODE_PER_COMMENT >= code, f"{folder}: {comments} lines of comment in {code}; barest: {places}"
