# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing to Blender's data at a time when Blender permits it: not while a view or a panel is drawn."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from ...viewport.kept import Forbidden

Value = TypeVar("Value")
TRY_AGAIN_S = 0.005
FORBIDS = "not allowed"
"""Words of Blender's error: "Writing to ID classes in this context is not allowed"."""
_drawing: list[int] = []
"""An entry for each view that is drawn now, on the main thread."""


@contextmanager
def drawing() -> Iterator[None]:
    """A block in which Blender draws a view."""
    _drawing.append(1)
    try:
        yield
    finally:
        _drawing.pop()


def permitted(write: Callable[[], Value]) -> Value:
    """The result of ``write``, which is called again until Blender permits it.

    Blender forbids it on all threads while it draws. A render waits for the end of the drawing. Raises Forbidden on the
    main thread, which draws itself; ``write`` is not called then, since an image that it makes and removes again is an
    edit of the file.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and _drawing:
        raise Forbidden
    while True:
        try:
            return write()
        except AttributeError as error:
            if FORBIDS not in str(error):
                raise
            if is_main:
                raise Forbidden from error
        time.sleep(TRY_AGAIN_S)
