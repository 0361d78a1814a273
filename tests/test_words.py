# SPDX-License-Identifier: GPL-3.0-or-later
"""Words of comments, docstrings, texts and pages: American spelling, and no word that the glossary replaces."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("spectral_core", "blender_addon", "benchmarks", "examples", "scripts", "tests")
BRITISH = (
    r"colouring|colours?|coloured|grey|greyish|cent(?:re|res|red)|behaviours?|favou(?:r|rs|red|rite)|neighbours?|licences?"
    r"|(?:nano|micro|milli|centi|kilo)?metres?|towards|afterwards|learnt|whilst|amongst|fibres?|aluminium|analys(?:ed?|ing)"
    r"|(?:optim|normal|recogn|organ|initial|minim|maxim|summar)is(?:e|ed|es|ing|ation)"
)
REPLACED = r"glow(?:s|ing)?|surroundings|worn|wears|wearing|dressed|leap(?:s|ing)?|wish(?:es)?"
"""Of docs/glossary.md, the words that have no other meaning here."""
WORD = re.compile(rf"(?<![\w-])(?:{BRITISH}|{REPLACED})(?![\w-])")
"""Of texts in small letters. Only a file in which one is found is parsed, which takes a hundred times as long."""
QUOTED = {
    ("spectral_core/palette/texture/project.py", "wishes"),
    ("tests/palette/texture/test_texture_document.py", "wishes"),
    ("tests/palette_models/test_palette_files.py", "colour"), ("tests/volume_files/test_transfer_file.py", "colour"),
    ("docs/glossary.md", "surroundings"), ("docs/glossary.md", "glow"), ("docs/glossary.md", "worn"),
    ("docs/glossary.md", "dressed"), ("docs/glossary.md", "leap"), ("docs/glossary.md", "wish"),
}  # fmt: skip
"""Words that a file quotes: keys of documents, and the glossary itself."""


def prose_of(path: Path) -> str:
    """Comments, docstrings and texts of a Python file; the text of a page without code."""
    text = path.read_text("utf-8")
    if path.suffix == ".md":
        return re.sub(r"```.*?```|`[^`\n]*`", " ", text, flags=re.DOTALL)
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = [token.string for token in tokens if token.type == tokenize.COMMENT]
    strings = [
        node.value
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value.split()) > 2
    ]
    return re.sub(r"``[^`]*``", " ", "\n".join([*comments, *strings]))


def pages() -> list[Path]:
    """All files whose words are checked."""
    found = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    return [*found, ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_words_are_found() -> None:
    assert [found.group() for found in WORD.finditer("the centre of a colour, a glow; colour-science, glow_rows")] == [
        "centre", "colour", "glow",
    ]  # fmt: skip


def test_prose_has_american_spelling_and_the_words_of_the_glossary() -> None:
    wrong = []
    for path in pages():
        name = path.relative_to(ROOT).as_posix()
        if not WORD.search(path.read_text("utf-8").lower()):
            continue
        for found in WORD.finditer(prose_of(path).lower()):
            if (name, found.group()) not in QUOTED and path.name != "test_words.py":
                wrong.append(f"{name}: {found.group()}")
    if wrong:
        pytest.fail("\n".join(wrong))


def test_names_have_the_words_of_the_glossary_too() -> None:
    """Parts of the names of modules, classes, functions, arguments and attributes of the product."""
    replaced = re.compile(REPLACED)
    wrong = set()
    for path in [path for folder in ("spectral_core", "blender_addon") for path in (ROOT / folder).rglob("*.py")]:
        source = path.read_text("utf-8")
        tokens = tokenize.generate_tokens(io.StringIO(source if replaced.search(source.lower()) else "").readline)
        names = {path.stem, *(token.string for token in tokens if token.type == tokenize.NAME)}
        for name in names:
            parts = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower().split("_")
            wrong |= {f"{path.relative_to(ROOT)}: {name}" for part in parts if replaced.fullmatch(part)}
    assert wrong == set()


def test_the_glossary_names_each_noun_once() -> None:
    rows = re.findall(r"^\| ([^|]+) \|", (ROOT / "docs" / "glossary.md").read_text("utf-8"), re.MULTILINE)
    nouns = [noun.strip() for row in rows[rows.index("noun") + 1 :] for noun in row.split(",")]
    assert len(nouns) > 40
    assert sorted({noun for noun in nouns if nouns.count(noun) > 1}) == []
