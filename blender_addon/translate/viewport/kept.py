# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a translation that no edit has changed, for the next one."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from spectral_core.render.same import equal
from spectral_core.scene import Instance, Mesh, Note

from ..context import Translation
from .owners import with_owners
from .walk import Walk

if TYPE_CHECKING:
    from ..objects import Collected

Value = TypeVar("Value")

KNOWN = frozenset(
    (
        "Object",
        "Mesh",
        "Material",
        "World",
        "Scene",
        "Camera",
        "PointLight",
        "SunLight",
        "SpotLight",
        "AreaLight",
        "Volume",
    )
)
"""Blender's names of data whose edits affect only the parts made from them. Any other edit drops all parts except
meshes.
"""

OF_OBJECTS = ("instance", "light", "displaced", "medium")
"""First words of the types of parts that are made from an object, which are of no use without it."""
NEW_SHARE = 1.0
"""Least time for new parts, relative to the time that a translation has taken to reach the first of them. Blender lists
all copies of an object before it returns the first one: for 200,000 copies that alone takes longer than the limit.
"""


class Unfinished(Exception):
    """A translation has reached its time limit. The parts made so far are kept: the next one continues."""


class Forbidden(Unfinished):
    """A translation has to write to Blender's data while Blender draws, which forbids it: an update continues it."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One kept part. ``makers``: session numbers of its sources. ``state``: other data that it depends on."""

    value: Any
    makers: frozenset[int]
    state: Any
    notes: tuple[Note, ...]


@dataclass
class Begun:
    """A walk over the objects that may reach its time limit: its result so far, notes, and the next object's place."""

    found: Collected
    notes: tuple[Note, ...] = ()
    place: int = 0


@dataclass
class Kept:
    """Parts of the translations of one viewport.

    ``meshes``: by evaluated data and the inputs read, each with the session numbers of its sources. ``parts``:
    materials, objects, lamps and worlds, by type and session number. ``images``: as in ``Translation``.
    """

    meshes: dict[Any, tuple[Mesh | None, frozenset[int]]] = field(default_factory=dict)
    parts: dict[Any, Part] = field(default_factory=dict)
    images: dict[Any, Any] = field(default_factory=dict)
    hair: dict[Any, tuple[bytes, Mesh | None]] = field(default_factory=dict)
    """Meshes of hair and points by the session number of their object, their name and the inputs read, each with a
    digest of what it was made of.
    """
    walk: Walk | None = None
    """The last complete walk over the objects, until an edit that needs another."""
    placed: dict[str, Instance] = field(default_factory=dict)
    """Instances of the last complete walk, by name: equal ones stay the same objects, which later comparisons pass."""
    begun: Begun | None = None
    """A walk that has reached the time limit, until the next edit."""
    answers: dict[Any, Any] = field(default_factory=dict)
    """By the key of a part the questions that it has asked, with their answers; see ``answers``."""
    _settled_parts: int = 0
    """Number of parts after they were last freed."""
    _begin: float = float("-inf")
    _end: float = float("inf")
    _has_progress: bool = False

    def limit(self, seconds: float) -> None:
        """Limit the next translation: it raises ``Unfinished`` before a part that would begin later than this.

        At least one new part is made and kept before that, so that repeated translations come to an end, and new parts
        have as much time as was needed to reach the first of them.
        """
        self._begin, self._has_progress = time.monotonic(), False
        self._end = self._begin + seconds

    def spend(self) -> None:
        """Called before each new part. Raises Unfinished after the time limit."""
        now = time.monotonic()
        if not self._has_progress:
            self._end = max(self._end, now + NEW_SHARE * (now - self._begin))
        elif now > self._end:
            raise Unfinished

    def passed(self) -> None:
        """Called after each object of a walk, which continues where it ended."""
        self._has_progress = True

    def same(self, item: Instance) -> Instance:
        """The equal instance of the last complete walk, or ``item``."""
        before = self.placed.get(item.name)
        return before if before is not None and equal(before, item) else item

    def clear(self) -> None:
        """Drop everything, as for another file."""
        self.undone(set())
        self.images.clear()

    def undone(self, images: set[int]) -> None:
        """Drop what an undo may have changed. ``images``: session numbers of those whose pixels it may have changed."""
        self.meshes.clear()
        self.other_frame(images)

    def other_frame(self, images: set[int]) -> None:
        """Drop what may depend on the frame without a report; Blender reports the meshes that it evaluated anew.

        ``images``: session numbers of those that the frame may change.
        """
        self.forget_images(images)
        self.parts.clear()
        self.placed.clear()
        self.walk = self.begun = None

    def forget(self, updates: Iterable[Any]) -> None:
        """Drop the parts that the edits of a depsgraph affect (``depsgraph.updates``)."""
        edits = with_owners(updates)
        self.begun = None
        if self.walk is not None and not self.walk.follows(edits):
            self.walk = None
        touched: set[int] = set()
        reshaped: set[int] = set()
        for edit in edits:
            if edit.is_geometry:
                reshaped.add(edit.uid)
            if edit.kind in ("Object", "Mesh"):  # each material's edit lists all of its objects and meshes
                if not edit.is_only_shading:
                    touched.add(edit.uid)
                continue
            touched.add(edit.uid)
            if edit.kind == "Image":
                self.forget_images({edit.uid})
            if edit.kind not in KNOWN and not (edit.kind == "ShaderNodeTree" and edit.block.is_embedded_data):
                self.parts.clear()
        self.drop(touched)
        if reshaped:
            self.meshes = {key: kept for key, kept in self.meshes.items() if not kept[1] & reshaped and kept[1]}

    def forget_images(self, numbers: set[int]) -> None:
        """Drop the pixels of images, given by session numbers, and the parts that may use them."""
        for key in [key for key in self.images if key[1] in numbers]:
            del self.images[key]
        if numbers:
            self.parts.clear()
            self.walk = None

    def settle(self, used: set[Any], there: Callable[[], set[int]]) -> None:
        """Free what a complete walk has not used (``used``: keys of meshes and hair) and no other can: meshes and parts
        of what was deleted, and earlier forms of meshes. ``there``: the session numbers of all objects.
        """
        unused, shaved = ([key for key in kept if key not in used] for kept in (self.meshes, self.hair))
        if not (unused or shaved) and len(self.parts) <= self._settled_parts:
            return
        alive, current = there(), {self.meshes[key][1] for key in used if key in self.meshes}
        grown = {key[0] for key in self.hair if key in used}
        for key in shaved:
            if key[0] in grown or key[0] not in alive:
                del self.hair[key]
        for key in unused:
            makers = self.meshes[key][1]
            if makers in current or makers.isdisjoint(alive):
                del self.meshes[key]
        of_objects = [key for key in self.parts if key[0].partition(" ")[0] in OF_OBJECTS]
        for key in of_objects:
            if self.parts[key].makers.isdisjoint(alive):
                del self.parts[key]
        self._settled_parts = len(self.parts)

    def drop(self, makers: set[int]) -> None:
        """Drop the parts made from any of these (session numbers)."""
        if makers:
            self.parts = {key: part for key, part in self.parts.items() if part.makers.isdisjoint(makers)}

    def redesign(self, makers: set[int]) -> None:
        """Drop the parts made from any of these (session numbers), whose designed spectra have changed."""
        self.drop(makers)
        if makers:
            self.begun = None
        if self.walk is not None and not self.walk.redesigned(makers):
            self.walk = None

    def keep(self, key: Any, part: Part) -> None:
        """Keep a new part. One in the place of another is no progress: two instances may exchange theirs forever."""
        self._has_progress |= key not in self.parts
        self.parts[key] = part

    def strands(self, key: Any, content: bytes, make: Callable[[], Mesh | None]) -> Mesh | None:
        """The mesh of hair or points (``key``: as in ``hair``), created if their ``content`` is another one."""
        if key not in self.hair or self.hair[key][0] != content:
            self.spend()
            self.hair[key] = content, make()
            self._has_progress = True
        return self.hair[key][1]

    def mesh(self, key: Any, makers: frozenset[int], make: Callable[[], Mesh | None]) -> Mesh | None:
        """The mesh of a key, created if none is kept."""
        if key not in self.meshes:
            self.spend()
            self.meshes[key] = make(), makers
            self._has_progress = True
        return self.meshes[key][0]


def kept_or_made(
    kept: Kept | None,
    translation: Translation,
    key: tuple[str, Any],
    makers: frozenset[int],
    state: Any,
    make: Callable[[], Value],
) -> Value:
    """The result of ``make`` with its notes; the kept one if nothing has changed since then.

    ``key``: type and session number. ``state``: compared with its earlier value; for data whose changes Blender does
    not report.
    """
    if kept is None:
        return make()
    found = kept.parts.get(key)
    if found is not None and found.state == state:
        for note in found.notes:
            translation.note(note.subject, note.message)
        return found.value
    kept.spend()
    with translation.listening() as heard:
        value = make()
    if heard.reads_elsewhere:
        kept.parts.pop(key, None)
    else:
        kept.keep(key, Part(value, makers, state, heard.notes))
    return value
