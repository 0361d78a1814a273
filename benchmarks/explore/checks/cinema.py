# SPDX-License-Identifier: GPL-3.0-or-later
"""Check of Cinema Specification D (version 1.2), with its own reading of RFC 4180, of types and of files.

It shares no code with the writer; ``explore-page`` and the tests check data.csv with it. pycinema, which needs Qt, runs
in a separate process: the variable PYCINEMA_PYTHON names a Python with it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

_PYCINEMA = """import contextlib, io, json, sys
with contextlib.redirect_stdout(io.StringIO()):
    import pycinema, pycinema.filters
    reader = pycinema.filters.CinemaDatabaseReader()
    reader.inputs.path.set(sys.argv[1])
    table = reader.outputs.table.get()
    pictures = pycinema.filters.ImageReader()
    pictures.inputs.table.set(table)
    shapes = [list(image.channels['rgba'].shape) for image in pictures.outputs.images.get()]
print(json.dumps({'header': table[0], 'rows': table[1:], 'shapes': shapes}))
"""


def parse(text: str) -> list[list[str | None]]:
    """Records of RFC 4180 text, None if a field is empty. Raises ValueError if the text is none."""
    records: list[list[str | None]] = []
    record: list[str | None] = []
    at, open_ = 0, False  # after a comma, a field follows even at the end
    while at < len(text) or open_:
        if text[at : at + 1] == '"':
            field, at = "", at + 1
            while True:
                end = text.find('"', at)
                if end < 0:
                    raise ValueError("a quoted field has no end")
                field, at = field + text[at:end], end + 1
                if text[at : at + 1] != '"':
                    break
                field, at = field + '"', at + 1
            record.append(field)
        else:
            end = at
            while end < len(text) and text[end] not in ',\n\r"':
                end += 1
            record.append(text[at:end] or None)
            at = end
        if text[at : at + 1] == ",":
            at, open_ = at + 1, True
        elif at >= len(text) or text[at] in "\r\n":
            at += 2 if text[at : at + 2] == "\r\n" else 1
            records.append(record)
            record, open_ = [], False
        else:
            raise ValueError(f"{text[at : at + 20]!r} stands after a field")
    return records


def kind_of(field: str) -> str:
    """integer, float or string, in the precedence of the specification."""
    for kind, convert in (("integer", int), ("float", float)):
        try:
            convert(field)
        except ValueError:
            continue
        return kind
    return "string"


def problems(folder: Path) -> list[str]:
    """Violations of the specification in a folder, as text."""
    if folder.suffix != ".cdb":
        return [f"the folder is named {folder.name}; the specification wants .cdb"]
    try:
        records = parse((folder / "data.csv").read_bytes().decode("utf-8"))
    except (OSError, ValueError) as error:
        return [str(error)]
    if len(records) < 2:
        return ["there is no data row"]
    header, *rows = records
    found = [f"header {name!r} is no string" for name in header if not name or kind_of(name) != "string"]
    if len(set(header)) < len(header):
        found.append("two columns have one name")
    files = [str(name).startswith("FILE") for name in header]
    if sorted(files) != files:
        found.append("a column follows a FILE column")
    found += [
        f"row {k} has {len(row)} fields of {len(header)}" for k, row in enumerate(rows) if len(row) != len(header)
    ]
    if found:
        return found
    for column, name in enumerate(header):
        fields = [row[column] for row in rows]
        known = [field for field in fields if field is not None]
        kinds = {kind_of(field) for field in known}
        if len(kinds) > 1:
            found.append(f"{name} mixes {', '.join(sorted(kinds))}")
        if files[column]:
            found += [f"{field} is missing" for field in known if not (folder / field).is_file()]
    return found


def by_pycinema(folder: Path) -> dict[str, object] | None:
    """Header, rows and shapes of pictures as pycinema reads them; None if no Python has it."""
    python = os.environ.get("PYCINEMA_PYTHON", sys.executable)
    said = subprocess.run(
        [python, "-c", _PYCINEMA, str(folder)], capture_output=True, text=True, check=False, timeout=120,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "PYTHONPATH": ""},
    )  # fmt: skip
    if "No module named 'pycinema'" in said.stderr:
        return None
    if said.returncode:
        raise RuntimeError(f"pycinema failed: {said.stderr[-2000:]}")
    read: dict[str, object] = json.loads(said.stdout.splitlines()[-1])
    return read
