# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages between a session and its render process: pickles whose arrays are sent separately, without a copy.

A message is a head (number of parts, size of each) followed by the parts: the pickle (protocol 5), then the memory of
its arrays. Both ends are this library, started by the same user; nothing else is ever read this way.
"""

from __future__ import annotations

import pickle
import struct
from typing import Any, BinaryIO

_COUNT = struct.Struct("<I")
_SIZE = struct.Struct("<Q")


def send(stream: BinaryIO, message: Any) -> None:
    """Write one message and flush. Raises BrokenPipeError or OSError if the other end is closed."""
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(message, protocol=5, buffer_callback=buffers.append)
    parts: list[Any] = [head, *(buffer.raw() for buffer in buffers)]
    stream.write(_COUNT.pack(len(parts)) + b"".join(_SIZE.pack(len(part)) for part in parts))
    for part in parts:
        stream.write(part)
    stream.flush()


def receive(stream: BinaryIO) -> Any:
    """Read one message. Raises EOFError if the other end is closed, also in the middle of a message."""
    count = _COUNT.unpack(_exactly(stream, _COUNT.size))[0]
    sizes = [_SIZE.unpack(_exactly(stream, _SIZE.size))[0] for _ in range(count)]
    head, *buffers = (_exactly(stream, size) for size in sizes)
    return pickle.loads(head, buffers=buffers)


def _exactly(stream: BinaryIO, size: int) -> bytearray:
    data = bytearray(size)
    view, filled = memoryview(data), 0
    while filled < size:
        got = stream.readinto(view[filled:])  # type: ignore[attr-defined]
        if not got:
            raise EOFError("the stream ended")
        filled += got
    return data
