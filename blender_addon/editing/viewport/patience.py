# SPDX-License-Identifier: GPL-3.0-or-later
"""The wait of a redraw for the first picture of a change: none where such pictures came too late before."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

from spectral_core.render.live.messages import LOADED, Shown

REMEMBERED, FEWEST = 5, 2
"""Pictures of a kind of change that are remembered, and those among them that must have come in time for a wait: where
redraws are slow, a picture in time gains more than a late one loses, because it needs no second redraw.
"""
TRIED_AGAIN = 4
"""One in so many changes without a wait gets a wait."""


@dataclass
class _Request:
    """``changed``: kind of the change; ``began``: when its update began; ``is_waited``: True if a redraw waits."""

    generation: int
    changed: frozenset[str]
    began: float
    is_waited: bool


@dataclass
class _Kind:
    """The latest times in s from a change to its first picture, and the number of changes without a wait since."""

    times: deque[float] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    skipped: int = 0

    def is_worth(self, longest: float) -> bool:
        late = len(self.times) - sum(seconds <= longest for seconds in self.times)
        return late <= REMEMBERED - FEWEST or self.skipped == TRIED_AGAIN - 1


@dataclass
class Patience:
    """Experience with changes of each kind: the fields of the scene that they change."""

    kinds: dict[frozenset[str], _Kind] = field(default_factory=dict)
    _open: _Request | None = None

    def wait_s(self, generation: int, changed: frozenset[str], began: float, longest: float) -> float:
        """Wait of the redraw of a request: ``longest`` from ``began``, or nothing. ``changed``: none for the view."""
        if self._open is not None:  # its picture has not come
            self._learn(self._open, time.monotonic())
        kind = self.kinds.setdefault(changed, _Kind())
        is_waited = kind.is_worth(longest)
        kind.skipped = 0 if is_waited else kind.skipped + 1
        self._open = _Request(generation, changed, began, is_waited)
        return longest if is_waited else 0.0

    def notice(self, shown: Shown | None) -> None:
        """Learn from the first picture of the latest request, if it has come."""
        request = self._open
        if request is None or shown is None or shown.frame.generation < request.generation:
            return
        self._open = None
        # the time of loading a scene tells nothing about the next change of the same kind
        if not (request.changed and shown.frame.how == LOADED):
            self._learn(request, shown.first)

    def _learn(self, request: _Request, came: float) -> None:
        if request.is_waited:  # a redraw that does not wait draws, and this delays the picture
            self.kinds[request.changed].times.append(came - request.began)
