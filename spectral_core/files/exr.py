# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a scan line EXR file is whole: every chunk that its offset tables name lies within the file.

OpenEXR notices a full disk only where a write fails, not where its last buffer is flushed after everything was said.
Layout: "OpenEXR File Layout", openexr.com.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

from spectral_core.errors import FileFormatError
from spectral_core.files.guarded import open_regular

_MAGIC, _MULTIPART = 20000630, 0x1000
_LINES_PER_CHUNK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}


def require_whole_exr(path: Path) -> None:
    """Raise FileFormatError where a scan line EXR file ends before its last chunk."""
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
            raise FileFormatError(f"{path} is cut: {error}") from error


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
