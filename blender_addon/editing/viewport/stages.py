# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a scene's translation that stay from edit to edit, until Blender reports or exchanges their data."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import bpy

from spectral_core.scene import Scene

from ...compat import working_space
from ...translate.shading import images
from ...translate.viewport.kept import Kept
from ..pauses import round_number

NOTHING: Mapping[int, Any] = MappingProxyType({})
UNDOS, LOADS = ("undo_pre", "undo_post", "redo_pre", "redo_post"), ("load_pre", "load_post")
EVALUATIONS = ("depsgraph_update_post", "frame_change_post")
SAME_S = 0.2
"""Time after an evaluation in which Blender tells the views of it."""
_epochs = [0, 0]
"""Numbers of complete exchanges of data: by an undo, and by loading a file."""
_latest: list[Any] = [None, 0.0]
"""Scene and view layer that were evaluated last, and when."""


@dataclass
class Stage:
    """Data that all translations of one scene share.

    ``users``: names of the views. ``epoch``, ``frame``, ``designed``: exchanges of data, frame and palette of ``kept``.
    ``evaluation``: round and edits of the last evaluation, ``told``: the views that have told of it.
    ``part``: the objects that the views show, as ``part_shown_by``. ``scene``: the complete translation of the last
    evaluation, None until it is made. ``changes``: number of changes of the scenes of left and right sides so far.
    """

    kept: Kept = field(default_factory=Kept)
    users: set[str] = field(default_factory=set)
    epoch: Any = None
    frame: Any = None
    designed: Mapping[int, Any] = field(default_factory=dict)
    evaluation: Any = None
    told: set[str] = field(default_factory=set)
    part: Any = None
    scene: Scene | None = None
    changes: list[int] = field(default_factory=lambda: [0, 0])
    sent_in: int | None = None
    """Round of Blender's events in which a translation was made or continued last."""

    @property
    def may_continue(self) -> bool:
        """True if a redraw may continue a translation: one part of it in a round takes all the time there is."""
        return round_number() is None or self.sent_in != round_number()

    def keep_up(self, depsgraph: Any, designed: Mapping[int, Any] = NOTHING, view: str = "") -> None:
        """Drop the parts that edits have changed, and all parts if Blender does not report the changes.

        ``designed``: spectra of the palette that are shown before they are applied, by session number. Each ``view``
        calls it for each evaluation of the depsgraph; what the first has translated is not dropped for the others.
        """
        source = depsgraph.scene
        is_undone = False
        is_known = self._is_told_again(depsgraph.updates, view)
        epoch, frame = (*_epochs, working_space(bpy.data)), (source.frame_current, source.frame_subframe)
        if self.epoch is None or epoch[1:] != self.epoch[1:]:
            self.kept.clear()
        elif epoch != self.epoch:
            is_undone = True
            self.kept.undone(images.exchanged(self.kept.images, bpy.data.images))
        elif frame != self.frame:
            self.kept.other_frame(images.moving(bpy.data.images))
        freed = images.outdated(self.kept.images, bpy.data.images)
        before, self.designed = self.designed, designed
        redesigned = {key for key in before.keys() | designed.keys() if before.get(key) is not designed.get(key)}
        if not is_known or freed or redesigned or (epoch, frame) != (self.epoch, self.frame):
            self.scene = None
        self.epoch, self.frame = epoch, frame
        self.kept.forget_images(freed)
        # after an undo Blender may report all data, images too, of which only the exchanged ones must be read again
        if not is_known and not is_undone:
            self.kept.forget(depsgraph.updates)
        self.kept.redesign(redesigned)

    def show_part(self, part: Any) -> None:
        """Set the objects that the next translation shows; if they are others, it needs another walk over them."""
        if part != self.part:
            self.part, self.scene, self.kept.walk, self.kept.begun = part, None, None, None

    def _is_told_again(self, updates: Any, view: str) -> bool:
        """True if another view has told of the same evaluation in this round, and this one has not."""
        if len(self.users) < 2:
            return False
        edits = [(each.id.original.session_uid, each.is_updated_geometry, each.is_updated_transform,
                  each.is_updated_shading) for each in updates]  # fmt: skip
        evaluation = round_number(), edits
        is_known = evaluation[0] is not None and evaluation == self.evaluation and view not in self.told
        self.told = self.told | {view} if is_known else {view}
        self.evaluation = evaluation
        return is_known


def is_of_another(depsgraph: Any) -> bool:
    """True if Blender has just evaluated another scene or view layer: it tells all views of each evaluation."""
    return len(depsgraph.updates) == 0 and _latest[0] != _key(depsgraph) and time.monotonic() - _latest[1] < SAME_S


def _key(depsgraph: Any) -> tuple[int, str]:
    return depsgraph.scene.session_uid, depsgraph.view_layer.name


@bpy.app.handlers.persistent
def _evaluated(_scene: Any, depsgraph: Any) -> None:
    """Blender calls it before it tells the views."""
    if depsgraph.mode == "VIEWPORT":
        _latest[:] = _key(depsgraph), time.monotonic()


@bpy.app.handlers.persistent
def _undone(*_: object) -> None:
    """An undo gives other data the same session numbers, without reporting an edit."""
    _epochs[0] += 1


@bpy.app.handlers.persistent
def _loaded(*_: object) -> None:
    """So does a file."""
    _epochs[1] += 1


HANDLERS = (
    *((name, _undone) for name in UNDOS), *((name, _loaded) for name in LOADS),
    *((name, _evaluated) for name in EVALUATIONS),
)  # fmt: skip


def register() -> None:
    """Start listening to undo, files and evaluations."""
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening."""
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
