# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's script modules as one script: in the order of their imports, without import and export lines.

Names at the top of a module are unique among all modules, which a test checks; so no renaming is needed.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import resources

from spectral_core.errors import FileFormatError

_IMPORT = re.compile(r'^import\s+\{[^}]*\}\s+from\s+"\./([\w-]+\.js)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=function|class|const|async)", re.MULTILINE)
_TOP_LEVEL = re.compile(r"^(?:export )?(?:async )?(?:function|class|const|let)\s+([A-Za-z_]\w*)", re.MULTILINE)


def modules() -> dict[str, str]:
    """Text of every module by file name."""
    folder = resources.files("spectral_core.explore.page") / "script"
    return {entry.name: entry.read_text("utf-8") for entry in folder.iterdir() if entry.name.endswith(".js")}


@cache
def script() -> str:
    """All modules from main.js on, one after the other, in one function."""
    texts = modules()
    ordered: list[str] = []

    def visit(name: str, above: tuple[str, ...]) -> None:
        if name in above:
            raise FileFormatError(f"the script modules import each other in a circle: {' -> '.join((*above, name))}")
        if name in ordered:
            return
        for wanted in _IMPORT.findall(texts[name]):
            visit(wanted, (*above, name))
        ordered.append(name)

    visit("main.js", ())
    names = [found for name in ordered for found in _TOP_LEVEL.findall(texts[name])]
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise FileFormatError(f"two script modules define {doubled[0]!r}")
    parts = [_EXPORT.sub("", _IMPORT.sub("", texts[name])) for name in ordered]
    return '"use strict";\n(() => {\n' + _without_comments("\n".join(parts)) + "})();"


def _without_comments(text: str) -> str:
    """The text without comment lines: browsers read the page, people read the modules."""
    text = re.sub(r"^\s*/\*\*.*?\*/\s*\n", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^\s*//.*\n", "", text, flags=re.MULTILINE)


def asset(name: str) -> str:
    """Text of the template or the style sheet."""
    return (resources.files("spectral_core.explore.page") / name).read_text("utf-8")
