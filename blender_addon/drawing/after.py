# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing after Blender has drawn the main regions of editors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy


class AfterEditors:
    """A function ``draw`` that Blender calls after it has drawn the main regions of editors (``spaces``: their types).

    Without a window nothing is drawn.
    """

    def __init__(self, draw: Callable[[], None], *spaces: Any) -> None:
        self._draw, self._spaces = draw, spaces
        self._handlers: list[tuple[Any, Any]] = []

    def begin(self) -> None:
        """From now on, draw."""
        if not bpy.app.background:
            for space in self._spaces:
                self._handlers.append((space, space.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")))

    def end(self) -> None:
        """From now on, do not draw."""
        for space, handler in self._handlers:
            space.draw_handler_remove(handler, "WINDOW")
        self._handlers.clear()
