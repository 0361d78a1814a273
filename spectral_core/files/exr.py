# SPDX-License-Identifier: GPL-3.0-or-later
"""EXR files written whole and read within limits, through the OpenEXR module.

OpenEXR detects a full disk at a failing write, but not at the flush of its last buffer. A written file is therefore
checked: every chunk in its offset tables must lie within it ("OpenEXR File Layout", openexr.com).
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import importlib.util
import struct
import sys
from pathlib import Path
from typing import Any, BinaryIO

from spectral_core.errors import FileFormatError, MissingDependencyError
from spectral_core.files.elf import calls_itself
from spectral_core.files.guarded import open_regular, reading, require_room
from spectral_core.files.whole import whole_file

_MAGIC, _MULTIPART = 20000630, 0x1000
_LINES_PER_CHUNK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}


def openexr() -> Any:
    """The OpenEXR module. Raises MissingDependencyError if it is not installed, or would end the process."""
    if "OpenEXR" not in sys.modules:
        _require_own_functions()
    try:
        import OpenEXR
    except ImportError as error:
        raise MissingDependencyError.package("OpenEXR", "an EXR file", "render") from error
    return OpenEXR


def _require_own_functions() -> None:
    """Raise an error for a module that would call another version of OpenEXR in the process; see ``files.elf``."""
    found = importlib.util.find_spec("OpenEXR")
    if found is None or not sys.platform.startswith("linux"):
        return
    shared = getattr(ctypes.CDLL(None), "exr_get_library_version", None)
    if shared is None or calls_itself(Path(str(found.origin))):
        return
    numbers = [ctypes.c_int() for _ in range(3)]
    shared(*map(ctypes.byref, numbers), None)
    version = ".".join(str(number.value) for number in numbers)
    own = importlib.metadata.version("OpenEXR")
    if own.split(".")[:2] != version.split(".")[:2]:
        raise MissingDependencyError(
            f"the Python module OpenEXR {own} cannot be used beside OpenEXR {version}, which this program shares with "
            "all its modules: it would crash. Install the extension from its zip, whose OpenEXR calls itself, or "
            f"OpenEXR {version.rsplit('.', 1)[0]} for this Python."
        )


def write_exr(path: str | Path, file: Any) -> None:
    """Write an ``OpenEXR.File``, whole or not at all. Raises FileWriteError."""
    with whole_file(path, check=require_whole_exr) as unfinished:
        file.write(str(unfinished))


def read_exr(path: str | Path, what: str = "an EXR file") -> list[Any]:
    """Parts of an EXR file, with a channel for each name.

    Parameters
    ----------
    path : the file.
    what : name of the expected content, for messages.

    Raises
    ------
    FileFormatError
        It is absent, cut or damaged, a pipe or device, or states more pixels than it can hold.
    MissingDependencyError
        OpenEXR is not installed.
    """
    module, needed = openexr(), 0
    with open_regular(path) as stream:
        size = stream.seek(0, 2)
    with reading(path, what):
        headers = exr_headers(path, what)
        for header in headers:
            (left, bottom), (right, top) = (map(int, corner) for corner in header["dataWindow"])
            needed += 4 * (right - left + 1) * (top - bottom + 1) * max(len(header.get("channels", ())), 1)
        require_room(needed, path, held=size)
        parts: list[Any] = module.File(str(path), separate_channels=True).parts
        if len(parts) < max(len(headers), 1):  # the module leaves out a part of which it cannot read all pixels
            raise FileFormatError(
                f"{path} is truncated or damaged: the pixels of {len(headers) - len(parts)} of its {len(headers)} "
                f"parts cannot be read; expected {what}"
            )
    return parts


def exr_headers(path: str | Path, what: str = "an EXR file") -> list[dict[str, Any]]:
    """Header of each part, without reading pixels. Raises the same errors as ``read_exr``."""
    module = openexr()
    open_regular(path).close()
    with reading(path, what):
        return [part.header for part in module.File(str(path), header_only=True).parts]


def require_whole_exr(path: Path) -> None:
    """Raise FileFormatError if a scan line EXR file ends before its last chunk."""
    with open_regular(path) as stream:
        size = stream.seek(0, 2)
        stream.seek(0)
        try:
            magic, version = struct.unpack("<ii", stream.read(8))
            if magic != _MAGIC:
                raise FileFormatError(f"{path} is no EXR file")
            multipart = bool(version & _MULTIPART)
            counts = [_chunk_count(header) for header in _headers(stream, multipart)]
            for count in counts:
                for offset in struct.unpack(f"<{count}Q", stream.read(8 * count)):
                    _require_chunk(stream, offset + 4 * multipart, size)
        except (struct.error, KeyError) as error:
            raise FileFormatError(f"{path} is truncated: {error}") from error


def _headers(stream: BinaryIO, multipart: bool) -> list[dict[str, bytes]]:
    """Attributes of each part by name."""
    headers: list[dict[str, bytes]] = []
    while True:
        header: dict[str, bytes] = {}
        while name := _word(stream):
            _word(stream)  # its type
            (length,) = struct.unpack("<i", stream.read(4))
            header[name] = stream.read(length)
        if not header:  # the end of a list of parts
            return headers
        headers.append(header)
        if not multipart:
            return headers


def _word(stream: BinaryIO) -> str:
    letters = bytearray()
    while (letter := stream.read(1)) != b"\0":
        if not letter:
            raise struct.error("it ends within its header")
        letters += letter
    return letters.decode("utf-8", "replace")


def _chunk_count(header: dict[str, bytes]) -> int:
    if "chunkCount" in header:
        return int(struct.unpack("<i", header["chunkCount"])[0])
    _, low, _, high = struct.unpack("<4i", header["dataWindow"])
    lines = _LINES_PER_CHUNK[header["compression"][0]]
    return -(-(high - low + 1) // lines)


def _require_chunk(stream: BinaryIO, offset: int, size: int) -> None:
    """A chunk is its first line, the number of its bytes, and these."""
    here = stream.tell()
    if not 0 < offset <= size - 8:
        raise struct.error(f"a chunk begins at byte {offset} of {size}")
    stream.seek(offset)
    _, length = struct.unpack("<ii", stream.read(8))
    if offset + 8 + length > size:
        raise struct.error(f"a chunk ends at byte {offset + 8 + length} of {size}")
    stream.seek(here)
