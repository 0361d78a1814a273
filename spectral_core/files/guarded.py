# SPDX-License-Identifier: GPL-3.0-or-later
"""The reader of all untrusted files: regular files only, limited time and memory, one type of error.

A file may be malicious. It may be a pipe that never ends, state a size that does not fit into memory, or nest its lists
ten thousand deep. ``reading`` converts every failure of a reader to FileFormatError; the limits below keep a reader
from running for minutes or filling the memory before it fails.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from spectral_core.errors import FileFormatError, SpectralError

MOST_TEXT_BYTES = 64 << 20
"""Largest table of spectra, palette in JSON or file of swatches; a million samples fit several times."""
MOST_TOML_BYTES = 4 << 20
"""Largest TOML file; pure Python reads about 2 MB in a second."""
MOST_HEADER_BYTES = 1 << 20
"""Largest text header of a volume."""
MOST_NAMES = 100_000
"""Most data files of one header."""
MOST_NESTING = 60
"""Largest nesting of lists and tables; the documents here need seven."""
MOST_EXPANSION, FREE_BYTES = 2000, 256 << 20
"""Above FREE_BYTES, numbers may take at most so many times the size of their file. No compression of real data reaches
it.
"""

_CHUNK = 1 << 20
_MARKS = re.compile(r'"(?:[^"\\\n]++|\\.)*+"|[^"\[{\]}]{1,4096}|(?s:.)')
"""A string, a bracket, or text without either, in pieces: no other thread runs while one piece is searched."""


@contextmanager
def reading(path: str | Path, what: str = "") -> Iterator[None]:
    """Convert any failure inside the block into an error of this project that names ``path``.

    Errors of this project's tree pass unchanged; all others become FileFormatError. A reader may therefore trust a file
    and fail if the file was wrong.

    Parameters
    ----------
    path : the file that is read.
    what : what the file should be, for the message, such as ``"a palette in TOML"``.
    """
    expected = f"; expected {what}" if what else ""
    try:
        yield
    except SpectralError:
        raise
    except RecursionError as error:
        raise FileFormatError(f"{path}: its lists or tables are nested too deeply{expected}") from error
    except MemoryError as error:
        raise FileFormatError(f"{path}: it needs more memory than is available{expected}") from error
    except OSError as error:
        raise FileFormatError(f"{path} cannot be read: {error.strerror or error}{expected}") from error
    except Exception as error:
        reason = str(error) or type(error).__name__
        raise FileFormatError(f"{path} is truncated, damaged or of another type: {_short(reason)}{expected}") from error


def no_file(path: str | Path, remedy: str = "check its name and its folder") -> str:
    """Say why a path names no file: nothing is there, or what is there is no file."""
    try:
        Path(path).stat()
    except (FileNotFoundError, NotADirectoryError, ValueError):  # ValueError: an invalid file name
        return f"there is no file {path}; {remedy}"
    except OSError as error:
        return f"{path} cannot be read: {error.strerror or error}; {remedy}"
    return f"{path} is a folder, pipe or device; expected a file"


def is_file(path: str | Path) -> bool:
    """True if a regular file is at the path.

    ``Path.is_file`` raises an error for a name that no file can have (a part of more than 255 bytes, as of a text that
    was pasted into the field of a path) and for a folder that may not be searched.
    """
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def is_there(path: str | Path) -> bool:
    """True if anything is at the path; no name is an error, as in ``is_file``."""
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def open_regular(path: str | Path) -> BinaryIO:
    """Open a regular file for reading; a pipe, device or folder is refused without waiting for it.

    Raises FileFormatError with the reason.
    """
    try:
        # Without O_NONBLOCK, opening a pipe waits for a writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError as error:
        raise FileFormatError(no_file(path)) from error
    except (OSError, ValueError) as error:  # ValueError: an invalid file name
        raise FileFormatError(
            f"{path}: {getattr(error, 'strerror', None) or error}; expected a file that can be read"
        ) from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise FileFormatError(f"{path} is a folder, pipe or device; expected a file")
    return os.fdopen(descriptor, "rb")


def require_regular(path: str | Path) -> None:
    """Raise FileFormatError if ``path`` cannot be opened as a regular file; for libraries that open it again."""
    open_regular(path).close()


def read_bytes(path: str | Path, most: int = MOST_TEXT_BYTES) -> bytes:
    """The bytes of a regular file of at most ``most`` bytes. Raises FileFormatError."""
    with open_regular(path) as stream:
        # Python allocates the requested size; the size that the system states is 0 for files of /proc.
        data = stream.read(min(os.fstat(stream.fileno()).st_size, most) + 1)
        while len(data) <= most and (more := stream.read(_CHUNK)):
            data += more
    if len(data) > most:
        raise FileFormatError(f"{path} is larger than {most / 2**20:g} MiB, the limit for such a file")
    return data


def read_text(path: str | Path, most: int = MOST_TEXT_BYTES) -> str:
    """The file as text, UTF-8 or UTF-16 with its mark, which is not empty. Raises FileFormatError (file, line)."""
    data = read_bytes(path, most)
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        named = encoding.removesuffix("-sig").upper()
        raise FileFormatError(f"{path}, line {line}: not {named} text; save the file as UTF-8") from error
    if "\0" in text:
        raise FileFormatError(f"{path}, line {text[: text.index(chr(0))].count(chr(10)) + 1}: a binary file, not text")
    if not text or text.isspace():
        raise FileFormatError(f"{path}, line 1: the file is empty")
    return text


def header_lines(stream: BinaryIO, path: str | Path) -> Iterator[bytes]:
    """Lines from the position of ``stream``, together at most MOST_HEADER_BYTES. Raises FileFormatError beyond that."""
    left = MOST_HEADER_BYTES
    while line := stream.readline(left + 1):
        left -= len(line)
        if left < 0:
            raise FileFormatError(f"{path}: its header is longer than {MOST_HEADER_BYTES >> 20} MiB; it is no header")
        yield line


def require_shallow(text: str, path: str | Path) -> None:
    """Raise FileFormatError if brackets outside of strings nest deeper than MOST_NESTING."""
    depth = 0
    for found in _MARKS.finditer(text):
        mark = found[0]
        if mark in "[{":
            depth += 1
            if depth > MOST_NESTING:
                line = text.count("\n", 0, found.start()) + 1
                raise FileFormatError(f"{path}, line {line}: lists or tables are nested deeper than {MOST_NESTING}")
        elif mark in "]}":
            depth = max(depth - 1, 0)


def require_room(needed: int, path: str | Path, *, held: int | None = None) -> None:
    """Raise FileFormatError if ``needed`` bytes exceed the memory of this machine or the length of this file.

    Parameters
    ----------
    needed : bytes that the file's stated numbers need in memory.
    path : the file, for the message.
    held : bytes of the file, if they limit its contents; None if they do not (a compressed file).
    """
    if needed > half_of_memory():
        raise FileFormatError(
            f"{path} states {needed / 2**30:,.1f} GiB of numbers, more than half of this machine's memory; crop or "
            "resample it, or its header is damaged"
        )
    if held is not None and needed > FREE_BYTES and needed > MOST_EXPANSION * held:
        raise FileFormatError(
            f"{path} states {needed / 2**30:,.1f} GiB of numbers in {held / 2**20:,.1f} MiB: it is nearly empty, or "
            "damaged; crop or resample it"
        )


def half_of_memory() -> int:
    """Half of this machine's memory in bytes: the limit of one file."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):  # Windows does not report it
        return 8 << 30


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 300 else text[:297] + "..."
