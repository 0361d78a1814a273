# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects of a scene: instances of shared meshes, lamps, and notes on unsupported objects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from math import isfinite
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Instance, Light, Material, Mesh, Rays, VolumeObject

from .. import compat
from .approximations import note_missing
from .context import Translation, overridden
from .displacement.moved import displaced
from .ledger import note_changed, note_nodes
from .lighting.placed import place_light, relit
from .meshes import READS_UV, object_mesh
from .placed_media import grids_read, in_mesh, in_volume
from .shading.attributes import color_of, object_attributes, random_of, root_of
from .shading.materials import TranslatedMaterial, default_volume, translate_material
from .strands.placed import place_hair, place_strands
from .viewport.kept import Kept, Unfinished, kept_or_made
from .viewport.walk import RepeatWalk, Trace, walk_of
from .visibility import Linking, hidden_from, terminator_cosine
from .volumes import GridFile, has_transfer, translate_volume

AS_MESH = ("CURVE", "SURFACE", "FONT", "META")
"""Objects whose faces Blender lists as a separate mesh instance."""
LEFT_OUT = dict.fromkeys(("GPENCIL", "GREASEPENCIL"), "grease pencil is not rendered")
UNSEEN = ("EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE")


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
    points: dict[int, Any] = field(default_factory=dict)
    """The instances of each instancer as points, by its address."""
    originals: list[Any] = field(default_factory=list)
    """The original object of each instance."""
    kept: Kept | None = None
    is_render: bool = True
    """True in renders, False in the viewport."""
    settled: tuple[Instance, ...] = ()
    """All instances, after the walk."""
    trace: Trace = field(default_factory=Trace)
    _names: dict[str, int] = field(default_factory=dict)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Each assigned material, once; one whose volume varies only as the objects that have it."""
        used = {name for item in self.settled for name in item.materials}
        made = {item.material.name: item for item in self.translated.values()}
        return tuple(item.material for name, item in made.items() if item.filling is None or name in used)

    def unique(self, kind: str, name: str) -> str:
        """``name`` for its first use, with a number after that."""
        key = f"{kind} {name}"
        self._names[key] = count = self._names.get(key, 0) + 1
        return name if count == 1 else self.unique(kind, f"{name} #{count}")


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
    with translation.listening() as heard:
        found = _walked(Collected(translation, kept=kept, is_render=shows is everything), shows)
    kept.walk = walk_of(found, heard.notes, kept)
    return found


def _walked(found: Collected, shows: Callable[[Any], bool]) -> Collected:
    """A walk over every instance."""
    translation = found.translation
    for instance in translation.depsgraph.object_instances:
        obj = instance.object
        if not shows(instance):
            continue
        if not instance.show_self and not (instance.is_instance and instance.show_particles):
            continue
        if found.kept is not None:
            found.trace.see(instance)
        try:
            _collect_one(found, obj, instance)
        except InvalidInputError as error:
            translation.note(obj.name, f"{error}; the object was left out")
    found.instances = [_linked(found, item, obj) for item, obj in zip(found.instances, found.originals, strict=True)]
    for obj in translation.depsgraph.objects:
        place_hair(found, obj, lambda item: [_translated(found, m) for m in _materials(item)], shows is everything)
    found.settled = tuple(found.instances)
    return found


def _remade(found: Collected, material: Any) -> TranslatedMaterial:
    """A material that was edited."""
    number, make = material.original.session_uid, partial(_material, found.translation, material)
    return kept_or_made(
        found.kept, found.translation, ("material", number), frozenset((number,)), material.name_full, make
    )


def _linked(found: Collected, item: Instance, obj: Any) -> Instance:
    """The instance with its light linking; the same object if a kept one has that already."""
    if not found.linking.is_used:
        return item
    rules = found.linking.unlit_by(obj), found.linking.clear_for(obj)
    if rules == ((), ()):
        return item
    return kept_or_made(
        found.kept, found.translation, ("linked", item.name), frozenset((obj.session_uid,)), (item, rules),
        lambda: replace(item, unlit_by=rules[0], clear_for=rules[1]),
    )  # fmt: skip


def _collect_one(found: Collected, obj: Any, instance: Any) -> None:
    translation = found.translation
    if obj.type == "LIGHT":
        place_light(found, obj, instance)
    elif obj.type == "MESH":
        if translation.depsgraph.view_layer_eval.use_solid:
            _collect_mesh(found, obj, instance)
    elif obj.type in ("CURVES", "POINTCLOUD"):
        if translation.depsgraph.view_layer_eval.use_strand or obj.type == "POINTCLOUD":
            materials = [_translated(found, material) for material in _materials(obj)]
            place_strands(found, obj, instance, materials, random_of(obj, instance))
    elif obj.type == "VOLUME":
        if translation.depsgraph.view_layer_eval.use_volumes:
            _collect_volume(found, obj, instance)
    elif obj.type not in AS_MESH + UNSEEN:
        translation.note(obj.name, LEFT_OUT.get(obj.type, f"objects of type {obj.type.lower()} are not rendered"))


def _collect_volume(found: Collected, obj: Any, instance: Any) -> None:
    """A Volume object: through its transfer function if that is on, else by its material."""
    if has_transfer(obj.data):
        volume = translate_volume(found.translation, found.unique("volume", obj.name_full), obj, instance)
        found.volumes.append(volume)
        return
    override = overridden(found.translation.depsgraph, "material_override")
    item = _translated(found, override or _materials(obj)[0], of_volume=True)
    if item.filling is None:
        found.translation.note(obj.name, "its material has no volume shader; nothing of it is visible")
        return
    placed = in_volume(found, obj, instance, item, GridFile.of(obj.data, grids_read(item.filling.inputs)))
    if placed is not None:
        hidden = hidden_from(obj)
        found.originals.append(obj.original)
        found.instances.append(replace(placed, hidden_from=hidden) if hidden else placed)


def _collect_mesh(found: Collected, obj: Any, instance: Any) -> None:
    rows = tuple(map(tuple, instance.matrix_world))
    if not all(map(isfinite, chain(*rows))):
        found.translation.note(obj.name, "its transform is not finite; the object was left out")
        return
    override = overridden(found.translation.depsgraph, "material_override")
    materials = [_translated(found, override or material) for material in _materials(obj)]
    reads = frozenset().union(*(item.reads for item in materials))
    shows_uv = frozenset({"uv"}) if found.translation.depsgraph.view_layer_eval.use_pass_uv else frozenset()
    mesh = _mesh(found, obj, reads | shows_uv, instance)
    if mesh is None:
        return
    mesh = displaced(found, obj, instance, mesh, materials)
    materials = [in_mesh(found, obj, instance, mesh, item, (rows,)) for item in materials]
    name, original = found.unique("instance", obj.name_full), obj.original
    layer = found.translation.depsgraph.view_layer
    is_holdout = bool(obj.is_holdout or original.holdout_get(view_layer=layer))
    hidden = hidden_from(obj)
    if original.indirect_only_get(view_layer=layer):
        hidden |= Rays.CAMERA
    fields = {
        "name": name,
        "mesh": mesh.name,
        "group": original.lightgroup,  # Blender does not notify the evaluated copy of a change
        "hidden_from": hidden,
        "is_holdout": is_holdout,
        "color": tuple(color_of(obj, instance)),
        "index": int(obj.pass_index),
        "attributes": object_attributes(
            obj, instance, reads, found.translation.scene.frame_current_final, found.points
        ),
        "shown_as": obj.name,
        "asset": root_of(original).name,
        "is_shadow_catcher": obj.is_shadow_catcher,
        "terminator_cosine": terminator_cosine(obj),
    }
    make = partial(_instance, found, obj, instance, mesh, materials, reads, fields)
    found.trace.places[original.session_uid] = len(found.instances)
    found.originals.append(original)
    found.linking.add(name, original)
    if instance.is_instance:
        found.instances.append(make())
        return
    names = tuple(item.material.name for item in materials)
    state = (rows, names, reads, tuple(fields.values()), mesh)
    makers = frozenset((original.session_uid, original.data.session_uid))
    key = ("instance", original.session_uid)
    found.instances.append(kept_or_made(found.kept, found.translation, key, makers, state, make))


def _instance(
    found: Collected, obj: Any, instance: Any, mesh: Mesh, materials: list[TranslatedMaterial], reads: frozenset[str],
    fields: dict[str, Any],
) -> Instance:  # fmt: skip
    """The instance of a mesh, and its notes."""
    highest = 0 if mesh.material_indices is None else int(mesh.material_indices.max())
    # a face beyond the last slot has the last material, as in Blender
    materials = materials + [materials[-1]] * (highest + 1 - len(materials))
    note_missing(found.translation, obj, reads)
    note_changed(found.translation, obj.name, getattr(obj, "cycles", None))
    if obj.mode == "SCULPT" and any(each.type == "MULTIRES" for each in obj.modifiers):
        found.translation.note(
            obj.name, "its multiresolution levels are shown after Sculpt Mode; here the base mesh is"
        )
    if obj.is_shadow_catcher and not found.is_render:
        message = "it is a shadow catcher in renders of F12 and spectral-scene, a plain object in the viewport"
        found.translation.note(obj.name, message)
    matrix, names = np.array(instance.matrix_world, dtype=np.float64), tuple(item.material.name for item in materials)
    return Instance(world_from_object=matrix, materials=names, random=random_of(obj, instance), **fields)


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


def _mesh(found: Collected, obj: Any, reads: frozenset[str], instance: Any) -> Mesh | None:
    """Mesh of an evaluated object, shared by all objects with the same evaluated data."""
    reads = frozenset(name for name in reads if name in READS_UV or name.startswith(("generated", "attribute")))
    key = (obj.data.as_pointer(), reads)
    if key not in found.meshes:
        data = obj.original.data if obj.data.is_editmode else obj.data  # without a name of its own in Edit Mode
        name = found.unique("mesh", data.name_full)
        make = partial(object_mesh, name, obj, reads)
        if found.kept is None:
            found.meshes[key] = make()
        else:
            makers = _makers(obj, instance)  # another mesh may use the same memory later
            found.meshes[key] = found.kept.mesh((*key, name, makers), makers, make)
    return found.meshes[key]


def _makers(obj: Any, instance: Any) -> frozenset[int]:
    """Session numbers of the data that a mesh is made from; none if geometry nodes or the like create it anew."""
    source = obj.original
    data = getattr(source, "data", None)
    blocks = [source, data, instance.parent.original if instance.parent else None]
    return frozenset(block.session_uid for block in blocks if block is not None)
