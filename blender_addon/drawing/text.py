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
    return widths_in(context)(text)


def widths_in(context: Context) -> Callable[[str], float]:
    """``text_width`` for many texts of one context.

    Texts are measured at the scale of the interface: letters end at whole pixels, so that the same text is up to four
    per cent wider or narrower than at another scale.
    """
    points, scale = _points(context), _scale(context)
    return lambda text: _width(text, points * scale) / scale


def lines_in(text: str, room: float, context: Context) -> list[str]:
    """The text in lines of at most ``room`` unscaled pixels; a word that is longer than a line is divided."""
    width_of = widths_in(context)
    lines = [""]
    used, blank = 0.0, width_of("i i") - width_of("ii")
    for word in text.split(" "):
        for part in _parts(word, room, width_of):
            width = width_of(part)
            if lines[-1] and used + blank + width > room:
                lines.append("")
            used = used + blank + width if lines[-1] else width
            lines[-1] = f"{lines[-1]} {part}" if lines[-1] else part
    return [line for line in lines if line]


def _points(context: Context) -> float:
    styles = list(context.preferences.ui_styles) if context.preferences else []
    return float(styles[0].widget.points) if styles else POINTS


def _scale(context: Context) -> float:
    """Scale of the interface; Blender without a window has none."""
    return (float(context.preferences.system.ui_scale) if context.preferences else 0.0) or 1.0


def _parts(word: str, room: float, width_of: Callable[[str], float]) -> list[str]:
    """The word, or the pieces of one that is too long."""
    parts = [""]
    for letter in word if width_of(word) > room else ():
        if parts[-1] and width_of(parts[-1] + letter) > room:
            parts.append("")
        parts[-1] += letter
    return parts if parts[-1] else [word]


@lru_cache(maxsize=10_000)
def _width(text: str, points: float) -> float:
    """Width of a text in pixels. Words recur at each redraw, so their widths are kept."""
    blf.size(0, points)
    return float(blf.dimensions(0, text)[0]) or MEAN_LETTER * points / POINTS * len(text)


def told_apart(names: Sequence[str], room: float, width: Callable[[str], float]) -> list[str]:
    """Names of at most this width each, distinct where there is room for what differs: first what they begin with
    alike is shortened, then the words that they end with alike. No number is cut in two.
    """
    if all(width(name) <= room for name in names):
        return list(names)
    first = _common(names, str.isdigit)
    last = _common([name[first:][::-1] for name in names], str.isalnum)
    shown = [name if width(name) <= room else _shortened(name, first, last, room, width) for name in names]
    alike: dict[str, list[int]] = {}
    for number, text in enumerate(shown):
        alike.setdefault(text, []).append(number)
    for numbers in alike.values():
        if 1 < len(numbers) < len(names):  # they have more in common with each other than with all
            some = told_apart([names[number] for number in numbers], room, width)
            for number, text in zip(numbers, some, strict=True):
                shown[number] = text
    return shown


def _common(names: Sequence[str], belongs: Callable[[str], bool]) -> int:
    """Letters that several names begin with alike, without the last ones that belong together with the next ones."""
    if len(names) < 2:
        return 0
    alike = [len(set(letters_here)) == 1 for letters_here in zip(*names, strict=False)]
    common = alike.index(False) if False in alike else len(alike)
    while common and belongs(names[0][common - 1]):
        common -= 1
    return common


def _shortened(name: str, first: int, last: int, room: float, width: Callable[[str], float]) -> str:
    """A name whose first and last letters, so many, are those of other names too."""
    for end in dict.fromkeys([len(name), len(name) - last]):
        differing, rest = name[first:end].strip(), "" if end == len(name) else "…"
        if first and differing and width(f"…{differing}{rest}") <= room:
            most = len(name) - len(differing) - 1
            return _longest(lambda kept: f"{name[:kept].rstrip()}…{differing}{rest}", most, room, width)  # noqa: B023
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
