# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures whose names and texts have characters that Matplotlib's own font lacks, and files in folders to be made."""

from __future__ import annotations

from pathlib import Path

import pytest

from spectral_core.cli import main
from spectral_core.explore.page import fonts
from spectral_core.explore.page.static import draw_matrix

pytest.importorskip("matplotlib")


def test_texts_have_fonts_with_their_characters_or_are_named() -> None:
    assert fonts._families(["width", "mittlere Größe", "Δ"]) == ([fonts.FIRST], "")
    families, missing = fonts._families(["明るさ"])
    # a font for them is found if one is installed; Matplotlib's font of boxes is none
    assert (len(families) > 1) != bool(missing) and not any(name.startswith(fonts.BOXES) for name in families)


@pytest.mark.filterwarnings("error")
def test_a_figure_of_any_script_is_drawn_without_warnings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The figure had boxes for Chinese, Japanese and Korean, and Matplotlib's warnings were printed."""
    asked: list[str] = []
    inner = fonts._families
    monkeypatch.setattr(fonts, "_families", lambda texts: inner(asked.extend(texts) or asked))  # type: ignore[func-returns-value]
    draw_matrix(tmp_path / "figure.svg", {"明るさ": [1.0, 2.0], "재질": ["金属", "अ"]}, ["明るさ", "재질"])
    assert {"明るさ", "재질", "金属", "अ"} <= set(asked)


def test_explore_makes_the_folders_of_its_files_and_names_missing_fonts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A missing folder was refused, where other commands make it."""
    (tmp_path / "data.csv").write_text("a,b,明\n1.0,2.0,x\n2.0,3.0,y\n", "utf-8")
    monkeypatch.setattr(fonts, "without_font", lambda texts: "明" if "明" in texts else "")
    page, figure = tmp_path / "new" / "page.html", tmp_path / "other" / "figure.svg"
    assert main(["explore", str(tmp_path), "--out", str(page), "--figure", str(figure)]) == 0
    assert page.is_file() and figure.is_file() and "no installed font has 明" in capsys.readouterr().err
