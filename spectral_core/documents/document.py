# SPDX-License-Identifier: GPL-3.0-or-later
"""A document from a file and into one: TOML by the ending ``.toml``, JSON by ``.json``."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from spectral_core.checks import path_of, require_kind
from spectral_core.documents.toml import toml_text
from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.guarded import MOST_TOML_BYTES, read_text, reading, require_shallow
from spectral_core.files.whole import write_text

Document = dict[str, Any]
Decoded = TypeVar("Decoded")

MOST_KEY_PARTS = 16
"""Most parts of a dotted TOML key; the time of the reader is quadratic in their number."""

# Python before 3.11.5 matches a group of alternatives with a possessive quantifier (*+) wrongly, so only sets of
# characters have one. The first character tells which alternative it is, so that the search stays linear without it.
_STRING_OR_COMMENT = re.compile(
    r'"""(?:[^"\\]++|\\.|"(?!""))*(?:"""|\\?\Z)'
    r"|'''(?:[^']++|'(?!''))*(?:'''|\Z)"
    r'|"(?:[^"\\\n]++|\\.)*"?'
    r"|'[^'\n]*'?"
    r"|#[^\n]*",
    re.DOTALL,
)
_LISTED_FRACTION = re.compile(r"\.\d+(?:[eE][-+]?\d+)?(?=\s*[,\]}])")
"""The decimals of a number in a list or table; the dots that remain outside of strings belong to keys."""


def read_document(path: str | Path, decode: Callable[[Any, Path], Decoded], what: str) -> Decoded:
    """Read a document and decode it by ``decode``.

    Parameters
    ----------
    path : a ``.toml`` or ``.json`` file; of another ending, JSON where the text starts with ``{``.
    decode : takes the document and the folder in which its spectrum files are sought.
    what : the expected type of document, for messages, such as ``"a palette"``.

    Raises
    ------
    FileFormatError
        Whatever is wrong, with the file, and the line or the place in the document.
    """
    file = path_of(path)
    with reading(file, what):
        return decode_document(file, decode, _parsed(file, what))


def decode_document(file: Path, decode: Callable[[Any, Path], Decoded], document: Any) -> Decoded:
    """The result of ``decode`` for a document; its errors name the file."""
    try:
        return decode(document, file.parent)
    except FileFormatError as error:
        if str(error).startswith(str(file.parent)):  # of a spectrum file that the document names
            raise
        raise FileFormatError(f"{file}: {error}") from error
    except InvalidInputError as error:
        raise FileFormatError(f"{file}: {error}") from error


def _parsed(file: Path, what: str) -> Any:
    text = read_text(file)
    suffix = file.suffix.lower()
    as_json = suffix == ".json" or (suffix != ".toml" and text.lstrip().startswith("{"))
    require_shallow(text, file)
    if not as_json:
        _require_readable_toml(text, file)
    try:
        return json.loads(text, object_pairs_hook=_table_of) if as_json else tomllib.loads(text)
    except ValueError as error:  # also of an integer with over 4300 digits
        raise FileFormatError(f"{file}: {error}; expected {what} in {'JSON' if as_json else 'TOML'}") from error


def _table_of(entries: list[tuple[str, Any]]) -> Document:
    """A table of JSON. Raises ValueError for an entry that is stated twice: Python's reader keeps only the last."""
    table = dict(entries)
    if len(table) < len(entries):
        names = [name for name, _ in entries]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"one table states the entry {twice[:60]!r} more than once; state it once")
    return table


def _require_readable_toml(text: str, file: Path) -> None:
    if len(text) > MOST_TOML_BYTES:
        raise FileFormatError(
            f"{file} is larger than {MOST_TOML_BYTES >> 20} MiB, the limit for TOML; write it as JSON"
        )
    if not any(line.count(".") > MOST_KEY_PARTS for line in text.split("\n")):
        return
    bare = _STRING_OR_COMMENT.sub(lambda found: "\n" * found[0].count("\n"), text)
    for number, line in enumerate(bare.split("\n"), 1):
        if line.count(".") <= MOST_KEY_PARTS:
            continue
        # Every "=" of the line ends a key, which may follow the end of a list, or be inside a table.
        if any(part.count(".") > MOST_KEY_PARTS for part in _LISTED_FRACTION.sub("", line).split("=")):
            raise FileFormatError(f"{file}, line {number}: a key has over {MOST_KEY_PARTS} dots; expected a plain name")


def write_document(
    path: str | Path, document: Document, *, comment: str = "", what: str = "documents", indent: int | None = 1
) -> None:
    """Write a document as TOML or JSON, by the ending; whole or not at all.

    Parameters
    ----------
    path : ends in ``.toml`` or ``.json``.
    document : strings, finite numbers, lists and tables.
    comment : lines for people on top of a TOML file.
    what : type of the document, for messages.
    indent : blanks per level of JSON; None for one line.

    Raises
    ------
    InvalidInputError
        Another ending, or more TOML than is read again.
    FileWriteError
        The disk is full, or the folder is absent or closed to this user.
    """
    write_text(path, document_text(document, path_of(path), comment=comment, what=what, indent=indent))


def document_text(
    document: Document, path: Path, *, comment: str = "", what: str = "documents", indent: int | None = 1
) -> str:
    """The text of a document in the format that the ending of ``path`` names.

    Raises InvalidInputError for another ending, and for a text that is too long to be read again.
    """
    require_kind("the comment", comment, str)
    suffix = path.suffix.lower()
    if suffix == ".json":
        return json.dumps(document, indent=indent, allow_nan=False) + "\n"
    if suffix == ".toml":
        odd = next((each for each in comment if each == "\x7f" or (each < " " and each not in "\t\n\r")), "")
        if odd:
            raise InvalidInputError(f"the comment contains the control character {odd!r}; remove it")
        remark = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
        text = (remark + "\n" if remark else "") + toml_text(document)
        if len(text) > MOST_TOML_BYTES:
            raise InvalidInputError(
                f"{path.name} would have {len(text) / (1 << 20):.1f} MiB, and TOML is read up to "
                f"{MOST_TOML_BYTES >> 20} MiB; name it .json"
            )
        return text
    raise InvalidInputError(f"cannot tell the format of {path.name!r}; name {what} .toml or .json")
