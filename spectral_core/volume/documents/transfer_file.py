# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions in TOML and JSON files.

::

    format = "spectral-scene transfer function"
    version = 1
    values = "data"                     # knots are data values; "fraction": 0 the volume's least, 1 its greatest
    length = "voxel"                    # extinction per voxel; "world" (the default): per world unit

    [[materials]]
    name = "bone"
    values = [1100, 1300, 2500]         # ascending; two equal ones make a jump
    extinction = [0, 0.6, 0.8]          # what each takes, at these values
    color = "#e8dcc0"                   # or linear [r, g, b]; with [wavelengths] a spectrum
    gradient = {values = [10, 40], weights = [0, 1]}    # optional: only where the value changes quickly

    [[materials]]
    name = "x-ray"
    values = [200, 2500]
    emission = [0, 0.02]                # adds light; without extinction it takes none
    color = [0.5, 0.7, 1.0]
    lit = false                         # shines by itself instead of in the scene's light

A spectrum is ``{catalogue = "dark skin"}``, ``{file = "paint.csv", name = "ochre"}`` or ``{values = [...]}``.
``transfer.schema.json`` says it all for editors.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.documents.transfer_document import TransferDocument, document_of, transfer_of
from spectral_core.volume.transfer import TransferFunction


def read_transfer(path: str | Path) -> TransferDocument:
    """The transfer function of a .toml or .json file. Raises FileFormatError (file, and line or place)."""
    file = Path(path)
    try:
        text = file.read_text("utf-8")
    except OSError as error:
        raise InvalidInputError(f"{file} cannot be opened: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{file} is no text; expected a transfer function in TOML or JSON") from error
    as_json = file.suffix.lower() == ".json" or text.lstrip().startswith("{")
    try:
        document = json.loads(text) if as_json else tomllib.loads(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise FileFormatError(f"{file}: {error}; expected {'JSON' if as_json else 'TOML'}") from error
    try:
        return transfer_of(document, file.parent)
    except InvalidInputError as error:
        raise FileFormatError(f"{file}: {error}") from error


def write_transfer(path: str | Path, stated: TransferDocument | TransferFunction, *, comment: str = "") -> None:
    """Write ``.toml`` or ``.json``; read_transfer returns the same numbers. ``comment``: lines above the TOML."""
    file = Path(path)
    if isinstance(stated, TransferFunction):
        stated = TransferDocument(stated)
    document = document_of(stated)
    if file.suffix.lower() == ".json":
        file.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    elif file.suffix.lower() == ".toml":
        remark = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
        file.write_text(remark + ("\n" if remark else "") + transfer_text(document), encoding="utf-8")
    else:
        raise InvalidInputError(f"cannot tell the format of {file.name!r}; name transfer functions .toml or .json")


def transfer_text(document: dict[str, Any]) -> str:
    """A transfer function document as TOML."""
    lines = [f"{key} = {_value(item)}" for key, item in document.items() if not isinstance(item, (dict, list))]
    if "wavelengths" in document:
        lines += ["", "[wavelengths]", *(f"{key} = {_value(item)}" for key, item in document["wavelengths"].items())]
    for material in document["materials"]:
        lines += ["", "[[materials]]", *(f"{key} = {_value(item)}" for key, item in material.items())]
    return "\n".join(lines) + "\n"


def _value(item: Any) -> str:
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, str):
        return json.dumps(item, ensure_ascii=False).replace("\x7f", "\\u007f")  # JSON's escapes are TOML's but for DEL
    if isinstance(item, dict):
        return "{" + ", ".join(f"{key} = {_value(each)}" for key, each in item.items()) + "}"
    if isinstance(item, list):
        return "[" + ", ".join(map(_value, item)) + "]"
    return repr(item)
