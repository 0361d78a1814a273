# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a store: atomic writes, locks between processes, names restricted to a folder."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.files.whole import UNFINISHED, whole_file

STORE_FOLDERS, DRIVER_LOCK = ("image", "outcome", "lease"), "driver.lock"
MAX_JSON_BYTES = 256_000_000
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,120}")


def write_whole(path: Path, content: bytes | str, *, durable: bool = True) -> None:
    """Write a file so that a reader sees the old content or the new one, never a part.

    ``durable``: also survive a power cut, which costs a wait for the disk.
    """
    with whole_file(path, durable=durable) as unfinished:
        unfinished.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


def read_json(path: Path) -> Any:
    """The content of a JSON file; FileFormatError says which file and why not."""
    try:
        if not path.is_file():
            raise FileFormatError(f"{path} is no file")
        if path.stat().st_size > MAX_JSON_BYTES:
            raise FileFormatError(f"{path} has {path.stat().st_size:,} bytes; at most {MAX_JSON_BYTES:,} are read")
        return json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{path} is not JSON: {error}") from error


def json_text(value: Any) -> str:
    """Canonical JSON: sorted names, no space, numbers to the last bit, no NaN."""
    try:
        return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"this cannot be stored as JSON: {error}") from error


def inside(folder: Path, name: str) -> Path:
    """The file of a folder that a table or a request names; raises InvalidInputError if it lies elsewhere."""
    if not isinstance(name, str) or not name or "\0" in name or "\\" in name or Path(name).is_absolute():
        raise InvalidInputError(f"the file name {str(name)[:120]!r} is not a plain path inside {folder.name}")
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise InvalidInputError(f"the file name {name[:120]!r} leads out of {folder.name}")
    return path


def require_file_name(name: str) -> str:
    """A bare file name of letters, digits, dot, dash and underscore."""
    if not _FILE_NAME.fullmatch(name) or ".." in name:
        raise InvalidInputError(f"{name[:120]!r} is no plain file name; expected letters, digits, dots and dashes")
    return name


def require_free(folder: Path) -> None:
    """Raise InvalidInputError if the folder of a new store is not free: neither empty, nor left by a process that was
    ended while it began a sweep there.
    """
    if folder.exists() and (not folder.is_dir() or not all(map(_is_begun, folder.iterdir()))):
        raise InvalidInputError(f"{folder} exists and is no empty folder; name another one")


def _is_begun(path: Path) -> bool:
    """True for what a store has before its project. The ledger is empty then, which ``Store.create`` checks."""
    if path.name in STORE_FOLDERS:
        return path.is_dir() and not any(path.iterdir())
    return path.is_file() and (path.name == DRIVER_LOCK or path.name.startswith(("ledger.sqlite", UNFINISHED)))


def remove_begun(folder: Path, *, with_folder: bool) -> None:
    """Remove what was made of a new store without points. ``with_folder``: the folder itself is new, too."""
    for path in (*folder.glob("ledger.sqlite*"), folder / DRIVER_LOCK):
        with suppress(OSError):
            path.unlink()
    for each in (*(folder / name for name in STORE_FOLDERS), *([folder] if with_folder else [])):
        with suppress(OSError):  # of a folder that is not empty
            each.rmdir()


@contextmanager
def file_lock(path: Path) -> Iterator[None]:
    """Hold the lock of a file; other processes wait. The system releases it at any end of this process."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        _lock(handle)
        yield
    finally:
        os.close(handle)


@contextmanager
def only_holder(path: Path, what: str) -> Iterator[None]:
    """Hold an exclusive lock; raises InvalidInputError if another process holds it."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            _lock(handle, wait=False)
        except OSError as error:
            raise InvalidInputError(f"{what} is in use by another process; wait for it or end it") from error
        yield
    finally:
        os.close(handle)


def _lock(handle: int, *, wait: bool = True) -> None:
    if os.name == "posix":
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    else:
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
