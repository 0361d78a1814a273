# SPDX-License-Identifier: GPL-3.0-or-later
"""The writer of all files: complete, or not at all.

::

    with whole_file(path) as unfinished:        # a new file with a random name beside ``path``
        library.write(str(unfinished))          # any writer that takes a path

When the block ends, the new file is flushed to the disk, checked, and moved over ``path`` in one step. Every reader of
``path``, also after a power failure, finds the earlier file or the new one. A block that fails leaves ``path``
unchanged. The next write into the same folder removes the leftovers of a killed process: an unfinished file is locked
while its writer lives, and one that can be locked has no writer any more.
"""

from __future__ import annotations

import contextlib
import math
import os
import secrets
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from spectral_core.checks import path_of
from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.guarded import is_there

try:
    import fcntl
except ImportError:  # Windows: an open file cannot be removed there, which serves as the lock
    fcntl = None  # type: ignore[assignment]

_looked_through: dict[str, tuple[float, float]] = {}
"""Time of the last search of each folder for leftovers, and its duration in seconds."""
UNFINISHED = ".spectral-unfinished-"


@contextmanager
def whole_file(
    path: str | Path, *, check: Callable[[Path], object] | None = None, durable: bool = True
) -> Iterator[Path]:
    """Yield a new file beside ``path`` to write to, and move it to ``path`` when the block ends without an error.

    Parameters
    ----------
    path : the file to make or to replace. If it is a link, the link is replaced, not its target.
    check : reads the finished file and raises if it differs from the written data. For writers of libraries that do not
        report a full disk.
    durable : also survive a power cut, which costs a wait for the disk.

    Yields
    ------
    Path
        An empty file in the folder of ``path`` with a random name and the same ending.

    Raises
    ------
    FileWriteError
        The disk is full, the folder is absent or closed to this user, or ``check`` failed; ``path`` is as it was.
    InvalidInputError
        ``path`` is a folder, a device or another entry that no file can replace.
    """
    target = path_of(path)
    require_replaceable(target)
    _remove_leftovers(target.parent)
    unfinished, lock = _create(target)
    try:
        with _told(target):
            yield unfinished
            _finish(unfinished, lock, target, check, durable)
    finally:
        _remove(unfinished, lock)


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write ``data`` to ``path``, whole or not at all. Raises the same errors as ``whole_file``."""
    with whole_file(path) as unfinished, unfinished.open("wb") as stream:
        stream.write(data)


def write_text(path: str | Path, text: str) -> None:
    """Write ``text`` as UTF-8 to ``path``, whole or not at all. Raises the same errors as ``whole_file``."""
    write_bytes(path, text.encode("utf-8"))


def make_folder(path: str | Path) -> Path:
    """Make a folder with those above it, unless it is there. Raises FileWriteError."""
    folder = path_of(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        in_the_way = next((each for each in (folder, *folder.parents) if is_there(each) and not each.is_dir()), None)
        reason = error.strerror or str(error) if in_the_way is None else f"{in_the_way} is a file"
        raise FileWriteError(f"the folder {folder} cannot be made: {reason}; choose another folder") from error
    return folder


def require_writable(path: str | Path) -> None:
    """Make the folder of a file that is written after hours of work, and try to make the file.

    What is at the path stays unchanged. Raises FileWriteError and InvalidInputError as ``whole_file``.
    """
    target = path_of(path)
    require_replaceable(target)
    make_folder(target.parent)
    unfinished, lock = _create(target)
    _remove(unfinished, lock)


def require_own_kind(path: str | Path, is_own: Callable[[Path], bool], kind: str) -> None:
    """Raise an error if a file of another type than ``kind`` is at the path.

    For paths in a document or a .blend file, whose author may have named any file.

    Parameters
    ----------
    path : where a file is to be written.
    is_own : whether a file that is there may be replaced; it sees regular files only.
    kind : name of the contents, for the message.

    Raises
    ------
    InvalidInputError
        Something is there, and it is no such file.
    """
    target = path_of(path)
    if os.path.lexists(target) and not (target.is_file() and is_own(target)):
        raise InvalidInputError(
            f"{target} exists already and is no {kind}, so it is not replaced; choose another path, or remove it"
        )


def require_replaceable(target: Path) -> None:
    """Raise InvalidInputError for a folder, a device or another entry that no file can replace."""
    with _told(target):  # names that no file can have
        is_folder = target.is_dir()
    if is_folder:
        raise InvalidInputError(f"{target} is a folder; name a file in it")
    # A device or pipe, also behind a link such as /dev/stdout, would be replaced by a file for every program.
    if target.exists() and not target.is_file():
        raise InvalidInputError(f"{target} is a device or a pipe; name a file")


class _Lock:
    """An open, locked descriptor of an unfinished file, released once."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        if fcntl is not None:
            with contextlib.suppress(OSError):  # some network file systems have no locks
                fcntl.flock(descriptor, fcntl.LOCK_EX)

    def release(self) -> None:
        """Close the descriptor, which ends the lock."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            with contextlib.suppress(OSError):
                os.close(descriptor)


def _create(target: Path) -> tuple[Path, _Lock]:
    """Create a file that no other process could have prepared, locked, with the permissions of the one that it
    replaces.
    """
    for _ in range(100):
        unfinished = target.with_name(f"{UNFINISHED}{secrets.token_hex(8)}{target.suffix[:16]}")
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with _told(target):
            descriptor = os.open(unfinished, flags, 0o666)
        lock = _Lock(descriptor)
        # Between making and locking, another writer may have taken the file for a leftover.
        if fcntl is None or unfinished.exists():
            break
        lock.release()
    if fcntl is not None and target.is_file() and not target.is_symlink():
        with contextlib.suppress(OSError):
            os.fchmod(descriptor, stat.S_IMODE(target.stat().st_mode))
    return unfinished, lock


def _remove(unfinished: Path, lock: _Lock) -> None:
    if fcntl is None:  # Windows removes no open file; elsewhere the lock must outlive the removal
        lock.release()
    with contextlib.suppress(OSError):
        unfinished.unlink(missing_ok=True)
    lock.release()


def _finish(unfinished: Path, lock: _Lock, target: Path, check: Callable[[Path], object] | None, durable: bool) -> None:
    """Flush to the disk, check, replace."""
    if durable:
        with unfinished.open("rb+") as stream:  # a library may have created another file there
            os.fsync(stream.fileno())
    if unfinished.stat().st_size == 0 and check is not None:
        raise FileWriteError(f"{target} could not be written: nothing was written to the disk; is it full?")
    if check is not None:
        try:
            check(unfinished)
        except Exception as error:  # a reader may raise any error for an incomplete file
            raise FileWriteError(
                f"{target} could not be written: the file on the disk is incomplete; is the disk full? ({error})"
            ) from error
    if fcntl is None:
        lock.release()
    unfinished.replace(target)
    if durable:
        _flush_folder(target.parent)


def _flush_folder(folder: Path) -> None:
    """Make the new name persistent through a power failure, if the system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextmanager
def _told(target: Path) -> Iterator[None]:
    """Convert a failure of the disk or of a writing library into an error that states the fate of the file."""
    try:
        yield
    except (OSError, RuntimeError) as error:  # OpenEXR and OpenVDB raise RuntimeError
        kept = "; the earlier file is unchanged" if is_there(target) else ""
        reason = getattr(error, "strerror", None) or str(error).rstrip(".") or type(error).__name__
        if isinstance(error, FileNotFoundError) and not target.parent.is_dir():
            reason = f"the folder {target.parent} does not exist; create it first"
        raise FileWriteError(f"{target} could not be written: {reason}{kept}") from error


def _remove_leftovers(folder: Path) -> None:
    """Remove the unfinished files of processes that have ended.

    Searching a folder of a hundred thousand pictures before each write would take longer than writing: at most a
    twentieth of the time is spent on it.
    """
    start, (last, duration) = time.monotonic(), _looked_through.get(str(folder), (-math.inf, 0.0))
    if start - last < 20 * duration:
        return
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            if entry.name.startswith(UNFINISHED) and entry.is_file(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(entry.path)
    _looked_through[str(folder)] = (start, time.monotonic() - start)


def _remove_if_abandoned(path: str) -> None:
    if fcntl is None:
        os.unlink(path)  # noqa: PTH108 - refused by Windows while its writer has it open
        return
    descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.unlink(path)  # noqa: PTH108
    finally:
        os.close(descriptor)
