# SPDX-License-Identifier: GPL-3.0-or-later
"""Fonts of a figure: Matplotlib's own one, then installed ones that have characters it lacks, such as Chinese ones."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from spectral_core.files.whole import whole_file

FIRST = "DejaVu Sans"
"""Comes with Matplotlib."""
BOXES = "Last Resort"
"""Comes with Matplotlib, too; it has a box for every character."""
LIKELY = ("CJK", "Noto Sans", "Gothic", "YaHei", "PingFang", "Hiragino", "WenQuanYi", "Nirmala", "Unicode", "Sans")
"""Parts of the names of fonts that are opened first, because many fonts may be installed."""


def save_figure(figure: Any, path: str | Path) -> None:
    """Write a figure in fonts that have the characters of its texts, as far as such fonts are installed."""
    from matplotlib.text import Text

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # ``without_font`` names them
        figure.draw_without_rendering()  # ticks get their texts
        texts = figure.findobj(Text)
        families, _ = _families(text.get_text() for text in texts)
        for text in texts if len(families) > 1 else ():
            text.set_fontfamily(families)
        with whole_file(path) as unfinished:
            figure.savefig(unfinished)


def without_font(texts: Iterable[str]) -> str:
    """The characters of texts that no installed font has; a figure shows boxes for them."""
    return _families(texts)[1]


def _families(texts: Iterable[str]) -> tuple[list[str], str]:
    """Names of the fonts that texts need, and the characters that are in none of those installed."""
    from matplotlib.font_manager import fontManager

    wanted = {letter for text in texts for letter in text if letter.isprintable()}
    fonts = sorted(fontManager.ttflist, key=lambda font: (font.name != FIRST, _rank(font.name), font.name))
    families: list[str] = [FIRST]
    for font in fonts:
        if not wanted:
            break
        if (
            font.name.startswith(BOXES)
            or font.style != "normal"
            or str(font.weight) not in ("400", "normal", "regular", "book")
        ):
            continue
        covered = {letter for letter in wanted if ord(letter) in _characters(font.fname)}
        if covered and font.name not in families:
            families.append(font.name)
        wanted -= covered
    return families, "".join(sorted(wanted))


def _rank(name: str) -> int:
    return next((place for place, part in enumerate(LIKELY) if part in name), len(LIKELY))


@cache
def _characters(path: str) -> frozenset[int]:
    from matplotlib.font_manager import get_font

    try:
        return frozenset(get_font(path).get_charmap())
    except (OSError, RuntimeError):  # a font that was removed since Matplotlib listed it, or a damaged one
        return frozenset()
