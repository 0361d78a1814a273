# SPDX-License-Identifier: GPL-3.0-or-later
"""Test if a shared library of Linux calls its own functions, or those of another library with the same names.

By default a symbol is bound to the first library of the process that defines it. A distribution's Blender shares its
OpenEXR with the process, so a Python module with a second OpenEXR calls functions of the first: another version, whose
structures have another layout. DT_SYMBOLIC makes a library search itself first ("System V ABI", gabi chapter 5).
"""

from __future__ import annotations

import struct
from pathlib import Path

_PT_DYNAMIC, _DT_NULL, _DT_SYMBOLIC, _DT_FLAGS, _DF_SYMBOLIC = 2, 0, 16, 30, 2


def calls_itself(library: Path) -> bool:
    """True if the library searches itself first; False for a file that is no 64-bit ELF file."""
    entries = [(tag, value) for _, tag, value in _dynamic(library.read_bytes())]
    return any(tag == _DT_SYMBOLIC or (tag == _DT_FLAGS and value & _DF_SYMBOLIC) for tag, value in entries)


def made_to_call_itself(library: bytes) -> bytes:
    """The library with DT_SYMBOLIC in a free entry of its dynamic section. Raises ValueError without a free entry."""
    entries = _dynamic(library)
    if any(tag == _DT_SYMBOLIC for _, tag, _ in entries):
        return library
    free = [place for place, tag, _ in entries if tag == _DT_NULL]
    if len(free) < 2:  # one must stay as the terminator
        raise ValueError("no 64-bit ELF library with a free entry in its dynamic section")
    changed = bytearray(library)
    struct.pack_into("<QQ", changed, free[0], _DT_SYMBOLIC, 0)
    return bytes(changed)


def _dynamic(library: bytes) -> list[tuple[int, int, int]]:
    """Position, tag and value of each entry of the dynamic section, with the free ones at its end."""
    if library[:6] != b"\x7fELF\x02\x01":  # 64 bits, little-endian
        return []
    (first,) = struct.unpack_from("<Q", library, 32)
    size, count = struct.unpack_from("<HH", library, 54)
    for header in range(first, first + size * count, size):
        kind, _, start, _, _, length = struct.unpack_from("<IIQQQQ", library, header)
        if kind == _PT_DYNAMIC:
            return [(place, *struct.unpack_from("<QQ", library, place)) for place in range(start, start + length, 16)]
    return []
