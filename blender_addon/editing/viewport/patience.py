# SPDX-License-Identifier: GPL-3.0-or-later
"""The wait of a redraw for the first picture of a change: none where such pictures came too late before."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from spectral_core.render.live.link import Shown

FADING = 0.9
"""Factor on the expected time for each change that is not waited for, so that a wait is tried again."""
LOADED = "loaded"
"""The word of a picture whose scene was loaded anew; this tells nothing about the next change of the same kind."""


@dataclass
class _Request:
    """``changed``: kind of the change; ``began``: when its update began; ``is_waited``: True if a redraw waits."""

    generation: int
    changed: frozenset[str]
    began: float
    is_waited: bool


@dataclass
class Patience:
    """Expected times in s from a change to its first picture, by the fields of the scene that it changes."""

    expected: dict[frozenset[str], float] = field(default_factory=dict)
    _open: _Request | None = None

    def wait_s(self, generation: int, changed: frozenset[str], began: float, longest: float) -> float:
        """Wait of the redraw of a request: ``longest`` from ``began``, or nothing. ``changed``: none for the view."""
        if self._open is not None:  # its picture has not come
            self._learn(self._open, time.monotonic())
        expected = self.expected.get(changed, 0.0)
        is_waited = expected <= longest
        if not is_waited:
            self.expected[changed] = FADING * expected
        self._open = _Request(generation, changed, began, is_waited)
        return longest if is_waited else 0.0

    def notice(self, shown: Shown | None) -> None:
        """Learn from the first picture of the latest request, if it has come."""
        request = self._open
        if request is None or shown is None or shown.frame.generation < request.generation:
            return
        self._open = None
        if not (request.changed and shown.frame.how == LOADED):
            self._learn(request, shown.first)

    def _learn(self, request: _Request, came: float) -> None:
        if request.is_waited:  # a redraw that does not wait draws, and this delays the picture
            seconds = came - request.began
            self.expected[request.changed] = (self.expected.get(request.changed, seconds) + seconds) / 2
