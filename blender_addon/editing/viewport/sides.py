# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a 3D view: one, or two where it is split; what each has requested, and for which scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from spectral_core.render.live.view import Viewpoint
from spectral_core.scene.look import Look

from .patience import Patience


@dataclass
class Side:
    """One picture of a view: the whole of it, or the side of a split one."""

    name: str
    number: int
    """0 of a whole view or a left side, 1 of a right side."""
    look: Look = field(default_factory=Look)
    shown_look: Look = field(default_factory=Look)
    """That of the latest picture, which may still be one under another light."""
    since: int = 0
    """Generation of the first request with the present scene."""
    key: tuple[Any, ...] = ()
    viewpoint: Viewpoint | None = None
    generation: int = 0
    changed: frozenset[str] = frozenset()
    """Fields of the scene that this view has changed since the latest request; others may have changed it, too."""
    changes: int = -1
    """Number of changes of the scene, by any view, before the latest request."""
    patience: Patience = field(default_factory=Patience)

    def is_behind(self, changes: list[int]) -> bool:
        """True if the scene has changed since the latest request. ``changes``: as in the view's ``Stage``."""
        return self.changes != changes[self.number]
