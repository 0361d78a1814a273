# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of text that fill the width of a panel, and names that fit, measured in the font of Blender's labels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import blf
from bpy.types import Context

MEAN_LETTER = 6.4
"""Width of a letter in unscaled pixels, where the font has no widths: Blender without a window may lack it."""
POINTS = 11.0
"""Blender's size of the text of labels, where no preferences state it."""


def text_width(text: str, context: Context) -> float:
    """Width of a label's text in unscaled pixels."""
    return _width(text, _points(context))


def widths_in(context: Context) -> Callable[[str], float]:
    """``text_width`` for many texts of one context."""
    points = _points(context)
    return lambda text: _width(text, points)


def lines_in(text: str, room: float, context: Context) -> list[str]:
    """The text in lines of at most ``room`` unscaled pixels; a word that is longer than a line is divided."""
    points = _points(context)
    lines = [""]
    used, blank = 0.0, _width("i i", points) - _width("ii", points)
    for word in text.split(" "):
        for part in _parts(word, room, points):
            width = _width(part, points)
            if lines[-1] and used + blank + width > room:
                lines.append("")
            used = used + blank + width if lines[-1] else width
            lines[-1] = f"{lines[-1]} {part}" if lines[-1] else part
    return [line for line in lines if line]


def _points(context: Context) -> float:
    styles = list(context.preferences.ui_styles) if context.preferences else []
    return float(styles[0].widget.points) if styles else POINTS


def _parts(word: str, room: float, points: float) -> list[str]:
    """The word, or the pieces of one that is too long."""
    parts = [""]
    for letter in word if _width(word, points) > room else ():
        if parts[-1] and _width(parts[-1] + letter, points) > room:
            parts.append("")
        parts[-1] += letter
    return parts if parts[-1] else [word]


@lru_cache(maxsize=10_000)
def _width(text: str, points: float) -> float:
    """Width of a text in unscaled pixels. Words recur at each redraw, so their widths are kept."""
    blf.size(0, points)
    return float(blf.dimensions(0, text)[0]) or MEAN_LETTER * len(text)


def told_apart(names: Sequence[str], room: float, width: Callable[[str], float]) -> list[str]:
    """Distinct names of at most this width each: a common prefix is shortened first."""
    if all(width(name) <= room for name in names):
        return list(names)
    alike = [len(set(letters_here)) == 1 for letters_here in zip(*names, strict=False)]
    common = (alike.index(False) if False in alike else len(alike)) if len(names) > 1 else 0
    return [name if width(name) <= room else _shortened(name, common, room, width) for name in names]


def _shortened(name: str, common: int, room: float, width: Callable[[str], float]) -> str:
    differing = name[common:].strip()
    if common and differing and width(f"…{differing}") <= room:
        most = len(name) - len(differing) - 1
        return _longest(lambda kept: f"{name[:kept].rstrip()}…{differing}", most, room, width)
    return _longest(
        lambda kept: f"{name[: kept // 2]}…{name[len(name) - (kept + 1) // 2 :]}", len(name) - 1, room, width
    )


def _longest(made: Callable[[int], str], most: int, room: float, width: Callable[[str], float]) -> str:
    """The text with as many letters, at most ``most``, as there is room for."""
    fits, over = 0, most + 1
    while over - fits > 1:
        kept = (fits + over) // 2
        fits, over = (kept, over) if width(made(kept)) <= room else (fits, kept)
    return made(fits)
