# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects of the last complete translation, for edits after which a walk over every object would find the same.

A walk takes time for each object, too long for each edited number in a scene of ten thousand instances.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from spectral_core.scene import Instance, Light, Note

from ..context import Translation, whole
from ..visibility import hidden_from, terminator_of
from .owners import Edit, muted_links_of

if TYPE_CHECKING:
    from ..objects import Collected
    from .kept import Kept

SETTLED = frozenset(("World", "Camera"))
"""Blender's names of data that objects do not depend on; a complete translation reads them anyway."""
UNSEEN = ("CAMERA", "SPEAKER", "LIGHT_PROBE")
"""Types of objects that a walk passes over."""
Remake = Callable[["Collected", Any], Any]


class RepeatWalk(Exception):
    """The walk must be repeated."""


def facts_of(obj: Any, owner: Any) -> tuple[Any, ...]:
    """Properties of an evaluated object whose change Blender reports in the words of an edited material.

    ``owner``: ``whole`` of the object.
    """
    return (
        obj.name_full, obj.pass_index, tuple(obj.color), hidden_from(obj), obj.is_holdout, obj.is_shadow_catcher,
        obj.original.lightgroup, *terminator_of(obj, owner).values(),
    )  # fmt: skip


@dataclass
class Trace:
    """Where a walk has found what; all by session numbers.

    ``sources``: those of materials, by their key in ``Collected.translated``. ``lights``, ``places``: index of an
    object in ``Collected.lights`` and ``Collected.instances``. ``lamps``: lamp objects by their data. ``repeated``:
    objects with instances. ``facts``, ``names``: of all objects that the view shows. ``passed``: objects with an
    instance that the view does not show.
    """

    sources: dict[Any, int] = field(default_factory=dict)
    lights: dict[int, int] = field(default_factory=dict)
    places: dict[int, int] = field(default_factory=dict)
    lamps: dict[int, int] = field(default_factory=dict)
    repeated: set[int] = field(default_factory=set)
    facts: dict[int, tuple[Any, ...]] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    passed: set[int] = field(default_factory=set)

    def pass_over(self, instance: Any) -> None:
        """Take note of an instance that the view does not show, as an object outside of its local view."""
        self.passed.add(instance.object.original.session_uid)

    def see(self, instance: Any, depsgraph: Any) -> None:
        """Take note of an instance of the depsgraph."""
        uid = instance.object.original.session_uid
        if instance.is_instance:
            self.repeated.add(uid)
        if uid not in self.facts:
            self.facts[uid] = facts_of(instance.object, whole(instance.object, depsgraph))
            self.names[uid] = instance.object.original.name_full


@dataclass
class Walk:
    """What a walk has found, and the edits since then that it can follow.

    ``materials``, ``lights``, ``places``, ``lamps``: of the trace, without objects that have instances; ``materials``
    by session number.
    """

    found: Collected
    notes: tuple[Note, ...]
    materials: dict[int, Any]
    lights: dict[int, int]
    places: dict[int, int]
    lamps: dict[int, int]
    part_notes: dict[tuple[str, int], tuple[Note, ...]]
    unreported: Any
    """See ``unreported_of``."""
    edited: set[int] = field(default_factory=set)
    """Session numbers of the materials and lamp objects to translate again."""
    moved: set[int] = field(default_factory=set)

    def follows(self, edits: Collection[Edit]) -> bool:
        """Take note of a list of edits; False if it needs a walk, as the changes that Blender does not name."""
        return bool(edits) and all(map(self._follows, edits))

    def _follows(self, edit: Edit) -> bool:
        kind, uid = edit.kind, edit.uid
        if kind == "Object":
            return self._follows_object(edit)
        if kind == "Mesh":
            return edit.is_only_shading
        if kind == "Material":
            self.edited.add(uid)
            return uid in self.materials
        if uid in self.lamps:
            self.edited.add(self.lamps[uid])
            return True
        return kind in SETTLED or (kind == "ShaderNodeTree" and bool(edit.block.is_embedded_data))

    def _follows_object(self, edit: Edit) -> bool:
        block, uid, trace = edit.block, edit.uid, self.found.trace
        if block.type in UNSEEN:
            return not block.is_instancer
        if uid in trace.passed and uid not in trace.facts:  # another part of the view takes another walk anyway
            return edit.is_only_shading
        # an edit names the whole object; the depsgraph of the last walk may be gone
        if facts_of(block, block) != trace.facts.get(uid):
            return False
        if uid in self.lights:
            self.edited.add(uid)
            return True
        if edit.is_only_shading:
            return True
        if edit.is_geometry or uid not in self.places or block.is_instancer:
            return False
        self.moved.add(uid)
        return edit.is_transform

    def redesigned(self, uids: Iterable[int]) -> bool:
        """Take note of materials, lamps and worlds whose designed spectra have changed; False if it needs a walk."""
        for uid in uids:
            if uid in self.materials or uid in self.lights:
                self.edited.add(uid)
            elif uid in self.lamps:
                self.edited.add(self.lamps[uid])
            elif all(world.session_uid != uid for world in bpy.data.worlds):
                return False
        return True

    def again(self, translation: Translation, remade: Remake, relit: Remake) -> Collected:
        """The result of a walk after the edits. ``remade``, ``relit``: translate a material, a lamp's object.

        Raises RepeatWalk if an edit changes more than numbers.
        """
        if self.unreported != unreported_of():
            raise RepeatWalk
        touched = [("material" if uid in self.materials else "light", uid) for uid in sorted(self.edited)]
        found = replace(self.found, translation=translation, translated=dict(self.found.translated))
        found.lights = list(found.lights)
        with translation.listening() as heard:
            for kind, uid in touched:
                if kind == "material":
                    self._remake(found, uid, remade)
                else:
                    found.lights[self.lights[uid]] = self._light(found, uid, relit)
        found.settled = self._moved(found)
        assert found.kept is not None
        parts = {key: found.kept.parts.get(key) for key in touched}
        if None in parts.values():
            raise RepeatWalk
        stale = {note for key in touched for note in self.part_notes.get(key, ())}
        self.notes = tuple(note for note in self.notes if note not in stale) + heard.notes
        for note in self.notes:
            translation.note(note.subject, note.message)
        self.part_notes |= {key: part.notes for key, part in parts.items() if part is not None}
        self.found, self.edited, self.moved = found, set(), set()
        return found

    def _remake(self, found: Collected, uid: int, remade: Remake) -> None:
        source = next((each for each in bpy.data.materials if each.session_uid == uid), None)
        if source is None:
            raise RepeatWalk
        key = self.materials[uid]
        old = found.translated[key]
        new = remade(found, source.evaluated_get(found.translation.depsgraph))
        if (new.material.name, new.reads) != (old.material.name, old.reads) or _depends_on_objects(new):
            raise RepeatWalk
        found.translated[key] = new

    def _light(self, found: Collected, uid: int, relit: Remake) -> Light:
        obj, old = self._object(found, uid), found.lights[self.lights[uid]]
        if obj.name_full != old.name:
            raise RepeatWalk
        light: Light | None = relit(found, obj)
        if light is None:
            raise RepeatWalk
        return light

    def _moved(self, found: Collected) -> tuple[Instance, ...]:
        if not self.moved:
            return found.settled
        items = list(found.settled)
        for uid in self.moved:
            matrix = np.array(self._object(found, uid).matrix_world, dtype=np.float64)
            place = self.places[uid]
            if not np.isfinite(matrix).all():
                raise RepeatWalk
            items[place] = replace(items[place], world_from_object=matrix)
        return tuple(items)

    def _object(self, found: Collected, uid: int) -> Any:
        name = found.trace.names[uid]
        obj = bpy.data.objects.get(name)
        if obj is None or obj.session_uid != uid:
            raise RepeatWalk
        return obj.evaluated_get(found.translation.depsgraph)


def walk_of(found: Collected, notes: tuple[Note, ...], kept: Kept) -> Walk | None:
    """A record of a complete walk; None if its results depend on more than Blender reports."""
    if found.linking.is_used or found.volumes or any(map(_depends_on_objects, found.translated.values())):
        return None
    if any(item.attributes for item in found.settled):  # Blender reports no change of a custom property
        return None
    trace = found.trace
    materials = {uid: key for key, uid in trace.sources.items()}
    made = {("material", uid) for uid in materials} | {("light", uid) for uid in trace.lights}
    # a part that is not kept reads other objects; a material with two keys has two evaluated forms
    if not made <= kept.parts.keys() or len(materials) < len(trace.sources) or len(trace.lights) < len(found.lights):
        return None
    lights = {uid: place for uid, place in trace.lights.items() if uid not in trace.repeated}
    places = {uid: place for uid, place in trace.places.items() if uid not in trace.repeated}
    lamps = {data: uid for data, uid in trace.lamps.items() if uid in lights}
    parts = {key: kept.parts[key].notes for key in made}
    return Walk(found, notes, materials, lights, places, lamps, parts, unreported_of())


def _depends_on_objects(item: Any) -> bool:
    return item.filling is not None or item.displacement is not None


def unreported_of() -> Any:
    """Properties whose changes Blender does not report: the light groups of objects and muted links of lamps."""
    groups = [obj.lightgroup for obj in bpy.data.objects]  # those of instanced collections are in no list of the scene
    return groups, {lamp.session_uid: muted_links_of(lamp) for lamp in bpy.data.lights}


def single(obj: Any) -> Any:
    """The instance of the depsgraph of an object that exists once."""
    return SimpleNamespace(object=obj, matrix_world=obj.matrix_world, is_instance=False, parent=None)
