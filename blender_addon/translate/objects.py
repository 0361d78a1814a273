# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects of a scene: instances of shared meshes, lamps, and notes on unsupported objects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Instance, Light, Material, Mesh, VolumeObject

from .. import compat
from .camera.identities import Identity, Owners, identities_of, owners_of
from .context import Translation, overridden
from .ledger import note_changed, note_nodes
from .lighting.placed import place_light, relit
from .meshes.placed import Shared, place_mesh
from .placed_media import grids_read, in_volume
from .shading.attributes import random_of
from .shading.carried.instances import InstancePoints
from .shading.materials import TranslatedMaterial, default_volume, translate_material
from .strands.placed import place_hair, place_strands
from .viewport.answers import kept_or_asked
from .viewport.kept import Begun, Kept, Unfinished, kept_or_made
from .viewport.walk import RepeatWalk, Trace, walk_of
from .visibility import Culling, Linking, note_volume, seen_as, shown_by
from .volumes import GridFile, has_transfer, note_velocity, saved_of, settings_data, translate_volume

AS_MESH = ("CURVE", "SURFACE", "FONT", "META")
"""Objects whose faces Blender lists as a separate mesh instance."""
DRAWN_BY_BLENDER = "Blender itself draws {} over the picture; mirrors, spectral bands, recordings and exports have none"
"""Note on what Blender draws over the finished picture of every engine, if it can draw at all (by OpenGL or Vulkan)."""
LEFT_OUT = dict.fromkeys(("GPENCIL", "GREASEPENCIL"), DRAWN_BY_BLENDER.format("grease pencil"))
UNSEEN = ("EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE")
"""Types of objects that no ray meets."""


@dataclass
class Collected:
    """Result of a walk over the depsgraph, each item once."""

    translation: Translation
    meshes: dict[Any, Mesh | None] = field(default_factory=dict)
    translated: dict[Any, TranslatedMaterial] = field(default_factory=dict)
    instances: list[Instance] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    volumes: list[VolumeObject] = field(default_factory=list)
    linking: Linking = field(default_factory=Linking)
    volume_owners: list[tuple[str, Any, Any]] = field(default_factory=list)
    """Of each volume with a transfer function the object's name, the original object, and what shows it."""
    volume_places: dict[str, tuple[Owners, NDArray[np.float64]]] = field(default_factory=dict)
    """By the name of a volume: its object and what shows it, and world_from_object."""
    points: InstancePoints = field(default_factory=InstancePoints)
    """The instances of each instancer as points."""
    originals: list[Any] = field(default_factory=list)
    """The original object of each instance."""
    shown_by: list[Any] = field(default_factory=list)
    """What shows each instance, None for objects that show themselves."""
    kept: Kept | None = None
    is_render: bool = True
    """True in renders, False in the viewport."""
    settled: tuple[Instance, ...] = ()
    """All instances, after the walk."""
    trace: Trace = field(default_factory=Trace)
    identities: list[Identity] = field(default_factory=list)
    """Identity of each instance, in renders with motion blur only."""
    shared: dict[tuple[int, int], Shared | None] = field(default_factory=dict)
    """What the instances of a mesh object share, by its session number and the address of its mesh."""
    kept_meshes: set[Any] = field(default_factory=set)
    """Keys of the meshes among the kept ones."""
    noted: set[tuple[int, int]] = field(default_factory=set)
    """Keys of ``shared`` whose notes have been given for all instances."""
    _names: dict[str, int] = field(default_factory=dict)
    _taken: list[str] = field(default_factory=list)
    """Names that the present object has taken."""

    @property
    def materials(self) -> tuple[Material, ...]:
        """Each assigned material, once; one whose volume varies only as the objects that have it."""
        used = {name for item in self.settled for name in item.materials}
        made = {item.material.name: item for item in self.translated.values()}
        return tuple(item.material for name, item in made.items() if item.filling is None or name in used)

    def enter(self, instance: Instance, original: Any, shown_by: Any = None) -> None:
        """Add an instance of an original object, ``shown_by`` another one if it does not show itself."""
        self.instances.append(instance if self.kept is None else self.kept.same(instance))
        self.originals.append(original)
        self.shown_by.append(shown_by)

    def unique(self, kind: str, name: str) -> str:
        """``name`` for its first use, with a number after that."""
        key = f"{kind} {name}"
        self._names[key] = count = self._names.get(key, 0) + 1
        self._taken.append(key)
        return name if count == 1 else self.unique(kind, f"{name} #{count}")

    def settle_names(self) -> None:
        """Keep the names that the present object has taken."""
        self._taken.clear()

    def free_names(self) -> None:
        """Release the names of the present object, which will be visited again."""
        for key in self._taken:
            self._names[key] -= 1
        self._taken.clear()


def everything(_instance: Any) -> bool:
    """True: every instance takes part by default."""
    return True


def collect(translation: Translation, shows: Callable[[Any], bool] = everything, kept: Kept | None = None) -> Collected:
    """All instances that the render shows and that pass ``shows``; ``kept``: parts and walk of earlier translations."""
    if kept is None:
        return _walked(Collected(translation, is_render=shows is everything), shows)
    walk, kept.walk = kept.walk, None
    if walk is not None:
        try:
            found = walk.again(translation, _remade, relit)
        except Unfinished:
            kept.walk = walk
            raise
        except RepeatWalk:
            pass
        else:
            kept.walk = walk
            return found
    begun, kept.begun = kept.begun or Begun(Collected(translation, kept=kept, is_render=shows is everything)), None
    begun.found.translation = translation
    with translation.listening() as heard:
        for note in begun.notes:
            translation.note(note.subject, note.message)
        try:
            found = _walked(begun.found, shows, begun)
        except Unfinished:
            begun.found.free_names()
            kept.begun = replace(begun, notes=translation.notes)
            raise
    kept.settle(found.kept_meshes, lambda: {obj.session_uid for obj in bpy.data.objects})
    kept.walk = walk_of(found, heard.notes, kept)
    kept.placed = {item.name: item for item in found.instances}
    return found


def _walked(found: Collected, shows: Callable[[Any], bool], begun: Begun | None = None) -> Collected:
    """A walk over every instance, or over those from the place of ``begun`` on."""
    translation, kept = found.translation, found.kept
    culling = Culling(translation, is_render=found.is_render)
    is_blurred = kept is None and translation.scene.render.use_motion_blur
    for instance in islice(translation.depsgraph.object_instances, 0 if begun is None else begun.place, None):
        if kept is not None:
            kept.spend()
        _visit(found, instance, shows, culling)
        if is_blurred and len(found.instances) > len(found.identities):
            found.identities += identities_of(instance, len(found.instances) - len(found.identities))
        if begun is not None and kept is not None:
            begun.place += 1
            kept.passed()
        found.settle_names()
    if found.linking.is_used:
        found.instances = [
            _linked(found, *each) for each in zip(found.instances, found.originals, found.shown_by, strict=True)
        ]
        _note_linked_volumes(found)
    found.settled = tuple(found.instances)
    return found


def _visit(found: Collected, instance: Any, shows: Callable[[Any], bool], culling: Culling) -> None:
    """One instance of the depsgraph."""
    obj = instance.object
    is_shown = instance.show_self
    has_hair = obj.type == "MESH" and instance.show_particles and len(obj.particle_systems) > 0
    if not shows(instance):
        found.trace.pass_over(instance)
        return
    if not (is_shown or has_hair) or culling.leaves_out(obj, instance.matrix_world):
        return
    if found.kept is not None:
        found.trace.see(instance, found.translation.depsgraph)
    try:
        if is_shown:
            _collect_one(found, obj, instance)
        if has_hair:
            place_hair(found, instance, partial(_all_translated, found))
    except InvalidInputError as error:
        found.translation.note(obj.name, f"{error}; the object was left out")


def _remade(found: Collected, material: Any) -> TranslatedMaterial:
    """A material that was edited."""
    number, make = material.original.session_uid, partial(_material, found.translation, material)
    return kept_or_asked(
        found.kept, found.translation, ("material", number), frozenset((number,)), material.name_full, make
    )


def _linked(found: Collected, item: Instance, obj: Any, shown_by: Any) -> Instance:
    """The instance with its light linking; the same object if a kept one has that already."""
    rules = found.linking.unlit_by(obj, shown_by), found.linking.clear_for(obj, shown_by)
    if rules == ((), ()):
        return item
    return kept_or_made(
        found.kept, found.translation, ("linked", item.name), frozenset((obj.session_uid,)), (item, rules),
        lambda: replace(item, unlit_by=rules[0], clear_for=rules[1]),
    )  # fmt: skip


def _note_linked_volumes(found: Collected) -> None:
    """Note volumes with transfer functions that the linking of a lamp leaves out."""
    for name, *owners in found.volume_owners:
        if found.linking.unlit_by(*owners) or found.linking.clear_for(*owners):
            found.translation.note(name, "Light Linking has no effect on a volume with a transfer function")


def _collect_one(found: Collected, obj: Any, instance: Any) -> None:
    translation = found.translation
    if obj.type == "LIGHT":
        place_light(found, obj, instance)
    elif obj.type == "MESH":
        if translation.depsgraph.view_layer_eval.use_solid:
            place_mesh(found, obj, instance, partial(_all_translated, found))
    elif obj.type in ("CURVES", "POINTCLOUD"):
        if translation.depsgraph.view_layer_eval.use_strand or obj.type == "POINTCLOUD":
            place_strands(found, obj, instance, _all_translated(found, obj), random_of(obj, instance))
    elif obj.type == "VOLUME":
        if translation.depsgraph.view_layer_eval.use_volumes:
            _collect_volume(found, obj, instance)
    elif obj.type not in AS_MESH + UNSEEN:
        translation.note(obj.name, LEFT_OUT.get(obj.type, f"objects of type {obj.type.lower()} are not rendered"))


def _collect_volume(found: Collected, obj: Any, instance: Any) -> None:
    """A Volume object: through its transfer function if that is on, else by its material."""
    seen = seen_as(instance, found.translation.depsgraph)
    settings = settings_data(obj, found.translation.depsgraph)
    samples = has_transfer(settings)
    note_volume(found.translation, obj.name, seen)
    note_velocity(found, obj)
    if samples:
        volume = translate_volume(found, found.unique("volume", obj.name_full), obj, instance)
        found.volumes.append(replace(volume, hidden_from=seen["hidden_from"]))
        place = np.array(instance.matrix_world, dtype=np.float64)
        found.volume_places[volume.name] = owners_of(instance), place
        found.volume_owners.append((obj.name, obj.original, shown_by(instance)))
        return
    override = overridden(found.translation.depsgraph, "material_override")
    item = _translated(found, override or _materials(obj)[0], of_volume=True)
    if item.filling is None:
        found.translation.note(obj.name, "its material has no volume shader; nothing of it is visible")
        return
    file = GridFile.of(obj.data, grids_read(item.filling.inputs), saved_of(found, obj, instance))
    placed = in_volume(found, obj, instance, item, file)
    if placed is not None:
        hidden = seen["hidden_from"]
        found.enter(replace(placed, hidden_from=hidden) if hidden else placed, obj.original, shown_by(instance))


def _all_translated(found: Collected, obj: Any) -> list[TranslatedMaterial]:
    """The materials of an object, or the one that the view layer gives to all."""
    override = overridden(found.translation.depsgraph, "material_override")
    return [_translated(found, override or material) for material in _materials(obj)]


def _materials(obj: Any) -> list[Any]:
    slots = [slot.material for slot in obj.material_slots]
    return slots or list(getattr(obj.data, "materials", ())) or [None]


def _translated(found: Collected, material: Any, *, of_volume: bool = False) -> TranslatedMaterial:
    key: Any = material.as_pointer() if material is not None else "volume" if of_volume else None
    if key not in found.translated:
        if material is None:
            found.translated[key] = default_volume() if of_volume else translate_material(found.translation, None)
        else:
            found.translated[key] = _remade(found, material)
            found.trace.sources[key] = material.original.session_uid
    return found.translated[key]


def _material(translation: Translation, material: Any) -> TranslatedMaterial:
    """A material, and its notes."""
    for item in (material, getattr(material, "cycles", None)):
        note_changed(translation, material.name, item)
    note_nodes(translation, material.name, compat.node_tree(material))
    return translate_material(translation, material)
