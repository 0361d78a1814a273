# SPDX-License-Identifier: GPL-3.0-or-later
"""One self-contained HTML page of a table: data, thumbnails, style and script inside, nothing from the network."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core import __version__
from spectral_core.errors import InvalidInputError, MissingDependencyError
from spectral_core.explore.features.expression import as_column
from spectral_core.explore.page.bundle import asset, script
from spectral_core.explore.sweep.cinema import is_file_column, read_csv
from spectral_core.explore.sweep.files import inside, write_whole
from spectral_core.explore.sweep.store import TIMING_COLUMN, Store

THUMBNAIL = 56
PER_ROW, PER_SHEET = 20, 400
MOST_THUMBNAILS = 4000
MOST_ROWS = 200_000
MOST_SHOWN = 8
"""Variables that a figure shows if none are named; the page has the same number and rule in ``script/state.js``."""


@dataclass(frozen=True, slots=True)
class PageTable:
    """Contents of a page. ``columns``: values by name; ``about``: role, unit, group, log by name. ``limits``: the
    constraints and the ball of the sweep's region, as in its file; a part of it has them, too.
    """

    title: str
    table_id: str
    columns: Mapping[str, Sequence[Any]]
    keys: Sequence[str]
    about: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    folder: Path | None = None
    limits: Mapping[str, Any] = field(default_factory=dict)


def table_of_store(store: Store) -> PageTable:
    """The table of a sweep, with the units, groups and scales of its parameters."""
    columns = store.columns()
    about: dict[str, dict[str, Any]] = {}
    for parameter in store.project.space.parameters:
        about[parameter.name] = {"role": "parameter", "unit": parameter.unit, "group": parameter.group,
                                 "log": parameter.scale == "log", "of": parameter.kind}  # fmt: skip
        if parameter.kind != "choice":
            about[parameter.name]["range"] = [parameter.low, parameter.high]
    for name in store.ledger.manual():
        about[name] = {"role": "manual", "group": "measured"}
    for name in store.project.expressions:
        about[name] = {"role": "value", "group": "derived"}
    about[TIMING_COLUMN] = {"role": "time", "unit": "s", "group": "time"}
    keys = columns.pop("key", [])
    region = store.project.region.to_dict()
    limits: dict[str, Any] = {part: region[part] for part in ("constraints", "ball") if part in region}
    return PageTable(store.folder.stem, store.project.store_id, columns, keys, about, store.folder, limits)


def table_of_folder(folder: str | Path) -> PageTable:
    """The table of any Cinema folder; no column is assumed to be a parameter."""
    folder = Path(folder)
    names, rows = read_csv(folder / "data.csv")
    columns = {name: [row[name] for row in rows] for name in names if name != "key"}
    keys = [str(row.get("key") or number) for number, row in enumerate(rows)]
    if len(set(keys)) < len(keys):
        keys = [str(number) for number in range(len(rows))]
    return PageTable(folder.stem, folder.stem, columns, keys, {}, folder)


def shown_at_first(table: PageTable) -> list[str]:
    """The variables of a figure that names none: parameters, then outcomes that vary.

    Parameters leave room for outcomes, up to half of it: without outcomes the plots show only the sampling design.
    A single variable has another column beside it, because a plot needs two.
    """
    roles = {name: table.about.get(name, {}).get("role", "value") for name in table.columns if not is_file_column(name)}
    parameters = [name for name, role in roles.items() if role == "parameter"]
    outcomes = [name for name, role in roles.items() if role not in ("parameter", "time")]
    rest = [name for name in outcomes if _varies(table.columns[name])] or outcomes
    shown = [*parameters[: MOST_SHOWN - min(len(rest), MOST_SHOWN // 2)], *rest][:MOST_SHOWN]
    return shown if len(shown) > 1 else [*shown, *(name for name in roles if name not in shown)][:2]


def _varies(values: Sequence[Any]) -> bool:
    """True if a column has more than one value, beyond rounding."""
    column = as_column(values)
    if column.dtype.kind != "f":
        return len(set(column)) > 1
    known = column[~np.isnan(column)]
    finite = known[np.isfinite(known)]
    if finite.size < known.size:  # no distance is beyond the rounding of an infinite value
        return len(set(known.tolist())) > 1
    with np.errstate(over="ignore"):
        return bool(finite.size and (np.abs(finite - finite[0]) > 1e-12 * max(1.0, abs(finite[0]))).any())


def page_html(table: PageTable, *, thumbnails: bool = True, live: bool = False) -> str:
    """The page as text.

    Parameters
    ----------
    table : the contents.
    thumbnails : put small pictures into the page, up to ``MOST_THUMBNAILS``; needs Pillow.
    live : for ``explore --serve``: the page may ask the server that sent it.
    """
    if not 1 <= len(table.keys) <= MOST_ROWS:
        remedy = "leave rows out, for example with a smaller [region]" if table.keys else "run the sweep first"
        raise InvalidInputError(f"the table has {len(table.keys):,} rows; a page shows 1 to {MOST_ROWS:,}; {remedy}")
    files = {name: [str(v or "") for v in values] for name, values in table.columns.items() if is_file_column(name)}
    payload = {
        "title": table.title,
        "id": table.table_id,
        "version": __version__,
        "keys": list(table.keys),
        "columns": [
            _packed(name, values, table.about.get(name, {}))
            for name, values in table.columns.items()
            if not is_file_column(name)
        ],
        "files": {name: values for name, values in files.items() if not name.endswith("_linear")},
        "thumbnails": _thumbnails(table, files.get("FILE", [])) if thumbnails else None,
        "live": live,
        "limits": dict(table.limits),
    }
    # inside of a script element only "<" can end it; U+2028 and U+2029 are line ends to old parsers
    text = json.dumps(payload, separators=(",", ":"), ensure_ascii=True).replace("<", "\\u003c")
    page = asset("template.html").replace("@CONNECT@", "'self'" if live else "'none'")
    return page.replace("@STYLE@", asset("style.css")).replace("@SCRIPT@", script()).replace("@PAYLOAD@", text)


def write_page(target: Path, table: PageTable, **options: Any) -> Path:
    """Write the page; full pictures are found where it lies in the table's folder."""
    write_whole(target, page_html(table, **options))
    return target


def _packed(name: str, values: Sequence[Any], about: Mapping[str, Any]) -> dict[str, Any]:
    column = as_column(values)
    entry: dict[str, Any] = {"name": name, "role": "value", "unit": "", "group": "outcomes", "log": False, **about}
    if column.dtype.kind != "f":
        return entry | {"kind": "text", "texts": column.tolist()}
    return entry | {"kind": "number", "packed": _encoded(column, exact=entry["role"] == "parameter")}


def _encoded(column: NDArray[Any], *, exact: bool) -> dict[str, Any]:
    """32-bit floats if seven digits represent all values and whole numbers stay what they are, else 64-bit.

    ``exact``: always 64-bit, so that a region drawn around points holds them.
    """
    with np.errstate(over="ignore"):
        short = column.astype("<f4")
    known = np.isfinite(column)
    kept, given = short[known].astype(float), column[known]
    same = np.allclose(kept, given, rtol=1e-6, atol=0.0) and (kept == given)[given == np.floor(given)].all()
    low, high = (float(column[known].min()), float(column[known].max())) if known.any() else (0.0, 0.0)
    narrow = high - low < 1e-4 * max(abs(low), abs(high))
    data = short if same and not narrow and not exact else column.astype("<f8")
    return {"width": data.itemsize, "data": base64.b64encode(data.tobytes()).decode()}


def _thumbnails(table: PageTable, files: Sequence[str]) -> dict[str, Any] | None:
    """Sprite sheets of small pictures, WebP in data addresses; None if there is nothing to show them from."""
    if table.folder is None or not any(files) or len(files) > MOST_THUMBNAILS:
        return None
    from spectral_core.explore.features.picture_files import encode

    sheets, missing = [], []
    for start in range(0, len(files), PER_SHEET):
        part = files[start : start + PER_SHEET]
        rows = -(-len(part) // PER_ROW)
        sheet = np.full((rows * THUMBNAIL, PER_ROW * THUMBNAIL, 3), 128, np.uint8)
        for number, name in enumerate(part):
            try:
                small = _small(table.folder, name)
            except MissingDependencyError:
                return None
            if small is None:
                missing.append(start + number)
                continue
            top, left = (number // PER_ROW) * THUMBNAIL, (number % PER_ROW) * THUMBNAIL
            down, across = (THUMBNAIL - small.shape[0]) // 2, (THUMBNAIL - small.shape[1]) // 2
            sheet[top + down : top + down + small.shape[0], left + across : left + across + small.shape[1]] = small
        sheets.append("data:image/webp;base64," + base64.b64encode(encode(sheet)).decode())
    shape = {"size": THUMBNAIL, "perRow": PER_ROW, "perSheet": PER_SHEET}
    return {"sheets": sheets, **shape, "missing": missing} if len(missing) < len(files) else None


def _small(folder: Path, name: str) -> NDArray[np.uint8] | None:
    """A small picture of a file of a table, None if there is none that can be read."""
    from spectral_core.explore.features.picture_files import read_display

    if not name.lower().endswith((".png", ".jpg", ".jpeg", ".webp")):
        return None
    try:
        return read_display(inside(folder, name), THUMBNAIL)
    except (OSError, InvalidInputError):
        return None
