# SPDX-License-Identifier: GPL-3.0-or-later
"""One point on a worker: compute it, commit its files if the store is reachable, answer with a receipt.

The worker itself commits, so that an outcome is never lost with the driver. A lock file per point, which the system
releases at the end of its holder, keeps two workers off the same point; the second finds the first one's outcome.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, FileWriteError, InvalidInputError
from spectral_core.explore.sweep.files import file_lock, json_text, read_json, require_file_name, write_whole
from spectral_core.explore.sweep.outcome import ComputeNode, Outcome, plain_values
from spectral_core.explore.sweep.parameters import Value
from spectral_core.spectra.pictures import display_png, exr_bytes, has_exr

MAX_WARM = 8
"""Nodes that a thread keeps with their loaded data; the oldest is dropped."""


class OutcomeNotStored(FileWriteError):
    """The files of a point could not be written, for example because the disk is full."""


@dataclass(frozen=True, slots=True)
class StoreAddress:
    """Folder of a store, and its id: another machine may have another folder of the same name."""

    folder: str
    store_id: str
    linear: bool = True
    """Also store linear pictures as EXR."""

    def reachable(self) -> bool:
        """True if this store is at that folder, seen from this process."""
        try:
            return json.loads((Path(self.folder) / "project.json").read_text("utf-8")).get("id") == self.store_id
        except (OSError, ValueError):
            return False


@dataclass(frozen=True, slots=True)
class Receipt:
    """Answer of a worker. ``record`` goes into the ledger; ``contents`` are files that the worker could not write."""

    key: str
    record: dict[str, Any]
    contents: dict[str, bytes] = field(default_factory=dict)
    computed: bool = True
    """False where another worker had committed the point already."""


class _Warm(threading.local):
    """Nodes of one thread by type and fingerprint; they end with it."""

    def __init__(self) -> None:
        self.nodes: dict[tuple[type, str], Any] = {}


_warm = _Warm()


def _equivalent(node: ComputeNode) -> Any:
    """The equivalent node of this thread: each task brings a copy without cached data."""
    nodes, address = _warm.nodes, (type(node), node.fingerprint)
    if address not in nodes:
        if len(nodes) >= MAX_WARM:
            nodes.pop(next(iter(nodes)))
        nodes[address] = node
    return nodes[address]


def compute_point(
    node: ComputeNode, parameters: Mapping[str, Value], seed: int, key: str, address: StoreAddress | None
) -> Receipt:
    """Compute a point and commit it.

    Parameters
    ----------
    node : the compute node.
    parameters : value by name.
    seed : start of its random numbers.
    key : the row's key, which names its files.
    address : the store to commit to; None, or one that is out of reach: everything is in the receipt.
    """
    if address is None or not address.reachable():
        record, contents = _computed(node, parameters, seed, key, address)
        return Receipt(key, record, contents)
    folder = Path(address.folder)
    with file_lock(folder / "lease" / key):
        spooled = spooled_record(folder / "outcome" / f"{key}.json")
        if spooled is not None:
            return Receipt(key, spooled, computed=False)
        record, contents = _computed(node, parameters, seed, key, address)
        commit_files(folder, key, record, contents)
    return Receipt(key, record)


def spooled_record(path: Path) -> dict[str, Any] | None:
    """The record of a point that was computed, None if there is none.

    A power failure may leave an empty one: it is removed, so that the point is computed again.
    """
    if not path.exists():
        return None
    try:
        record = read_json(path)
        if isinstance(record, dict) and {"values", "files", "seconds"} <= set(record):
            return record
    except FileFormatError:
        pass
    path.unlink(missing_ok=True)
    return None


def commit_files(folder: Path, key: str, record: Mapping[str, Any], contents: Mapping[str, bytes]) -> None:
    """Write the files of an outcome, then the record that says it is complete."""
    text = json_text(record)
    try:
        for name, content in contents.items():
            write_whole(folder / "image" / require_file_name(name), content, durable=False)
        write_whole(folder / "outcome" / f"{key}.json", text, durable=False)
    except (FileWriteError, OSError) as error:
        raise OutcomeNotStored(f"{error}; make room and run the sweep again, which continues here") from error


def _computed(
    node: ComputeNode, parameters: Mapping[str, Value], seed: int, key: str, address: StoreAddress | None
) -> tuple[dict[str, Any], dict[str, bytes]]:
    node = _equivalent(node)
    start = time.perf_counter()
    outcome: Outcome = node(parameters, seed)
    seconds = time.perf_counter() - start
    contents: dict[str, bytes] = {}
    columns: dict[str, str] = {}
    linear = (address is None or address.linear) and has_exr()
    for name, picture in outcome.pictures.items():
        stem = f"{key}_{name}" if name else key
        _enter(columns, f"FILE_{name}" if name else "FILE", f"image/{stem}.png")
        contents[f"{stem}.png"] = outcome.shown.get(name) or display_png(picture)
        if linear and picture.ndim == 3:
            _enter(columns, f"FILE_{name}_linear" if name else "FILE_linear", f"image/{stem}.exr")
            contents[f"{stem}.exr"] = exr_bytes(picture)
    for number, (ending, content) in enumerate(sorted(outcome.files.items())):
        name = require_file_name(f"{key}{ending}")
        first = "FILE" if number == 0 and "FILE" not in columns else f"FILE_{number}"
        _enter(columns, first, f"image/{name}")
        contents[name] = content
    record = {"values": plain_values(outcome.values), "files": columns, "seconds": round(seconds, 6)}
    return record, contents


def _enter(columns: dict[str, str], column: str, file: str) -> None:
    """Enter the file of a picture, where no other picture has this column."""
    if column in columns:
        raise InvalidInputError(
            f"two pictures of the outcome take the column {column!r}; rename one of them. FILE_linear and "
            "FILE_NAME_linear hold the linear values of the main picture and of the picture NAME"
        )
    columns[column] = file
