# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of operators that store their answers in the same place while the artist goes on."""

from __future__ import annotations

from bpy.types import Scene

_latest: dict[tuple[int, str], int] = {}
"""Number of the last turn, by session number of the scene and name of the result."""


class Turn:
    """The turn of one operator at a result of a scene; ``result`` "": a result of its own, which nobody overtakes."""

    def __init__(self, scene: Scene, result: str) -> None:
        self._key, self._is_shared = (scene.session_uid, result), bool(result)
        self._number = _latest[self._key] = _latest.get(self._key, 0) + 1

    @property
    def is_overtaken(self) -> bool:
        """True if another operator has begun since for the same result, as a second preset during the first solve."""
        return self._is_shared and self._number != _latest[self._key]
